"""Clearances of the cell, and the proof that nothing is touched between samples.

Modules: ``checker`` (least clearances of configurations), ``clearances`` (what it returns), ``pair_groups`` and
``near_pairs`` (of which pairs), ``broad_phase`` (bodies that can be near), ``arm_poses`` (kinematics of the arm alone),
``model_copies``, ``proofs`` (steps between configurations proved free), ``blended_corners`` (rounded corners) with
``blended_paths`` (what they are), ``blend_proofs``, ``blend_sheets``, ``blend_chords`` and ``blend_bisection`` (all
that a controller may make of them), ``wire`` and ``table_clearances`` (the wire against the part, the table against the
cell), ``stick_out`` (how far the wire reaches beyond the torch).
Where MuJoCo's own collision detection misses something, `cell.mjcf.detection` mends it.
"""
