"""Ways through the air: from bead to bead, from home and back.

Modules: ``legs`` (the ways off beads and onto them), ``free_moves`` (how far straight moves are free), ``rrt_connect``
(ways round what is in between), ``travel`` (from a bead's end to the next one's start), ``straight_travels`` (many that
go straight, together), ``home``, ``timed_travels`` (when their rows are passed).
"""
