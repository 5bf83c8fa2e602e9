"""Cases and motions that are quickly planned."""
