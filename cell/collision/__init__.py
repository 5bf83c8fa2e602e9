"""Clearances of the cell, and the proof that nothing is touched between samples.

Modules: ``checker`` (least clearances of configurations), ``clearances`` (what it returns), ``pair_groups`` and
``near_pairs`` (of which pairs), ``broad_phase`` (bodies that can be near), ``arm_poses`` (kinematics of the arm
alone), ``model_copies``, ``proofs`` (steps between configurations proved free), ``blended_corners`` (rounded corners)
with ``rounded_paths`` (what they are), ``rounding_proofs``, ``rounding_sheets`` and ``rounding_bisection`` (all that a
controller may make of them), ``wire`` and ``table`` (the wire against the part, the table against the cell). Where
MuJoCo's own collision detection misses something, `cell.mjcf.detection` mends it.
"""
