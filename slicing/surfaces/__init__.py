"""What layers lie on: planes, cylinders, cones and surfaces of revolution, and maps of them into the plane.

Modules: ``surfaces`` (all kinds), with ``planes``, ``cylinders``, ``cones`` and ``revolved_profiles``, and ``offsets``
(what all of them answer); ``bodies`` (round bodies), ``profile`` (turned profiles), ``rays`` (from points back to
them), ``offset_families`` (offsets of one surface together), ``greatest_distance`` (how far a mesh reaches off one),
``charts`` and ``pole_chart`` (maps into the plane), ``meridians`` (profiles by arc length).
"""
