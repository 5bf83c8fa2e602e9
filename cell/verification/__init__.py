"""Checks a motion, whatever planned it. It never imports `cell.planning`.

Modules: ``motion_check`` (the verdict), ``bead_order`` (rows against beads), ``bead_samples`` (wire and bead between
rows), ``drive_use`` (speeds and accelerations of the axes), ``arm_clearances`` (the arm's clearances on all of a
motion), ``laid_deposits`` (what is laid by then), ``blended_motion`` (rounded corners), ``collisions`` (what a motion
collides with).
"""
