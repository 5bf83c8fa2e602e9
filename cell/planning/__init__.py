"""The search for a motion: along every bead, between the beads, from home and back.

Modules, from the single target to the whole part: ``context`` (what every search needs), ``configurations`` (rolls
and branches at targets), ``edge_tracking`` (the way between two targets, followed), ``edge_check`` (edges followed
and checked), ``station_search`` and ``bead_search`` (the way along a bead), ``beads_ahead`` (many beads checked
together), ``densify`` (more samples where they are needed), ``travels`` (ways through the air), ``lockouts`` (layers
that lock the torch out), ``part_plan`` (all beads), ``assemble`` (one motion of them), ``blended_check`` (its corners).
`cell.verification` never imports from here.
"""
