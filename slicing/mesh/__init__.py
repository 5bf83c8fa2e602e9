"""Closed triangle meshes: read, repaired where that is safe, measured.

Modules: ``load``, ``solid`` (`Mesh`), ``manifold`` (solids of manifold3d), ``mesh_edges``, ``face_measures``,
``components``, ``hull``, ``closing``, ``folds``, ``shells`` and ``self_crossings`` (repairs), ``closest_point``; the
readers of each kind of file are in ``files``.
"""
