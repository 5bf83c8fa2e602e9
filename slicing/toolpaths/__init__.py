"""Toolpaths: beads in the order of deposition as targets, laid here or read from another slicer's file.

Modules: ``toolpath`` (what ``cell`` plans from), ``csv_file`` (another slicer's table), ``bead_hulls`` (the metal of
beads as convex pieces), ``own_metal`` (beads over their own metal), ``shortcuts`` (a mesh to a toolpath in three
calls).
"""
