"""Closed triangle meshes: read, repaired where that is safe, measured.

Modules: ``load``, ``solid`` (`Mesh`), ``mesh_edges``, ``face_measures``, ``components``, ``hull``, ``closing``,
``folds``, ``shells`` and ``self_crossings`` (repairs), ``closest_point``; the readers of each kind of file are in
``files``.
"""
