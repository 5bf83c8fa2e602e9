"""Clearances of the cell, and the proof that nothing is touched between samples.

Modules: ``checker`` (least clearances of configurations), ``clearances`` (what it returns), ``pair_groups`` and
``near_pairs`` (of which pairs), ``broad_phase`` (bodies that can be near), ``arm_poses`` (kinematics of the arm alone),
``model_copies``, ``proofs`` (steps between configurations proved free), ``blended_corners`` (rounded corners) with
``blended_paths`` (their geometry) and ``blend_proofs``, ``blend_sheets``, ``blend_chords`` and ``blend_bisection``
(proofs for every rounding that a controller may run), ``wire`` and ``table_clearances`` (the wire against the part, the
table against the cell), ``stick_out`` (how far the wire reaches beyond the torch). Shapes that MuJoCo's own collision
detection would miss are changed in `cell.mjcf.detection`.
"""
