"""One model by itself, before it is part of a cell: its names, joints, shapes and chain.

Modules: ``asset_files`` (files that a model reads), ``names`` (elements keep theirs, none clash), ``model_names``
(names that a case binds), ``held_settings`` (where a joint stands that is not planned, as the case has it),
``held_joints`` (joints that are not planned), ``couplings`` (joints that a model ties together), ``finite_numbers``
(numbers that are none), ``chain_from_model`` (the arm for `ik`), ``torch`` (a torch of changed dimensions),
``wire_end`` (a TCP that is not where the wire ends), ``convex_pieces`` (concave meshes), ``fixture_mesh`` (a
fixture's file), ``fitted_shapes`` (shapes fitted to meshes), ``detection`` (shapes with which MuJoCo misses no
collision).
"""
