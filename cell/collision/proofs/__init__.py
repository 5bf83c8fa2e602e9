"""Clearances proved between the configurations that were checked.

Modules: ``reach_radii`` and ``motion_bounds`` (how far a step can carry any point of the arm), ``open_steps`` (steps
not settled yet), ``between_samples`` (steps proved by the clearance at their ends and the travel between),
``convex_shapes``, ``link_poses`` (shapes in many configurations), ``step_clusters`` (steps near to one another),
``sheet_pieces`` (pieces of motions known at their corners), ``plane_proofs`` with ``shared_planes`` and
``carried_planes`` (planes that two shapes lie on either side of), ``few_corners`` (what holds many points),
``laid_covers`` and ``covered_pairs`` (what is laid taken as a whole), ``motion_clearance`` (the clearance that a whole
motion keeps).
"""
