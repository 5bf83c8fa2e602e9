"""Exact curves in which a mesh meets a surface.

Modules: ``intersect``, ``revolved``, ``parallel_levels`` and ``cone_levels`` (many layers at once),
``crossing_net``, ``plane_levels`` and ``cylinder_levels`` (what these are made of), ``face_intervals`` (which faces a
layer meets), ``slabs``, ``conic_arcs`` and ``ellipse_arcs`` (arcs within a face), ``pairing`` and
``loops`` (arcs joined).
"""
