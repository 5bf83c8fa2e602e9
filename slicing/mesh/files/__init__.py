"""Triangles of mesh files, as they stand there: STL, OBJ, PLY, OFF, GLB and 3MF.

Modules: ``stl``, ``obj``, ``ply`` (OFF as well), ``glb``, ``three_mf``, ``bounds`` (what a file unpacks to) and
``polygons`` (polygons divided into triangles). `slicing.mesh.load` makes solids of what they read.
"""
