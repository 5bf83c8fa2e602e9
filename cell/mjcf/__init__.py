"""One model by itself, before it is part of a cell: its names, joints, shapes and chain.

Modules: ``asset_files`` (files that a model reads), ``names`` (elements keep theirs, none clash), ``model_names``
(names that a case binds), ``held_joints`` (joints that are not planned), ``chain_from_model`` (the arm for `ik`),
``torch`` (a torch of changed dimensions), ``convex_pieces`` (concave meshes), ``detection`` (shapes with which no
collision is missed).
"""
