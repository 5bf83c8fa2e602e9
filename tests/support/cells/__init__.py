"""Arms, torches, tables and cells: shipped, odd and random ones."""
