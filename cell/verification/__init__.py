"""The judge of a motion, whoever planned it. It never imports `cell.planning`.

Modules: ``motion_check`` (the verdict), ``bead_order`` (rows against beads), ``bead_samples`` (wire and bead between
rows), ``blended_motion`` (rounded corners), ``collisions`` (clearances of rows and between them).
"""
