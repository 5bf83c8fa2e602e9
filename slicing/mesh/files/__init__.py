"""Triangles of mesh files, as they stand there: STL, OBJ, PLY, OFF, GLB and 3MF.

Modules: one a kind, ``bounds`` (what a file unpacks to) and ``polygons`` (polygons divided into triangles).
`slicing.mesh.load` makes solids of what they read.
"""
