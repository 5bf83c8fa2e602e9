"""Closed triangle meshes: read, repaired where that is safe, measured.

Modules: ``load``, ``solid`` (`Mesh`), ``edge_table``, ``face_measures``, ``components``, ``hull``, ``closing``,
``folds``, ``shells`` and ``self_crossings`` (repairs), ``closest_point``; the readers of each kind of file are in
``files``.
"""
