"""Clearances of the cell, and the proof that nothing is touched between samples.

Modules: ``checker`` (least clearances of configurations), ``clearances`` (what it returns), ``broad_phase`` (bodies
that can be near), ``arm_poses`` (kinematics of the arm alone), ``reach_radii`` and ``motion_bounds`` (how far a step
can carry any point), ``between_samples`` (steps proved free), ``blended_corners`` (rounded corners), ``wire`` and
``table`` (the wire against the part, the table against the cell).
"""
