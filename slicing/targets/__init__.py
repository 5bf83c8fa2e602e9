"""Robot targets along the beads.

Modules: ``targets``, ``break_points`` and ``greedy_walk`` (as few targets as the tolerance allows), ``chord_error``,
``speeds``, ``waypoints`` (travels between beads).
"""
