"""The part as it grows: convex pieces of every layer, for collision detection.

Modules: ``part_shape``, ``round_sectors`` (rings).
"""
