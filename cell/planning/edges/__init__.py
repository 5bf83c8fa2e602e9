"""Edges of the searches: motions of the arm from one target of a bead to the next, followed densely and checked.

Modules: ``edge_tracking`` (the motion between two targets, followed), ``next_target`` (which configurations lead on to
the next target), ``edge_check`` (edges followed and checked), ``densify`` (more samples where they are needed),
``blended_check`` (corners as a controller rounds them).
"""
