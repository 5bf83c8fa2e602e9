"""Travels: the motions from bead to bead, from home and back.

Modules: ``legs`` (retracting and approaching), ``free_moves`` (how far straight moves are free), ``rrt_connect``
(paths round obstacles), ``travel`` (from a bead's end to the next one's start), ``straight_travels`` (many that
go straight, together), ``home``, ``timed_travels`` (when their rows are passed).
"""
