"""The search for a motion: along every bead, between the beads, from home and back.

Modules, from the single target to the whole part: ``context`` (what every search needs), ``configurations`` (rolls and
branches at targets), ``collision_free_rolls`` (rolls between the sampled ones that are free), ``blocked_rolls`` (turns
of the roll that free nothing), ``edge_tracking`` (the way between two targets, followed), ``next_target`` (which
configurations lead on to the next target), ``edge_check`` (edges followed and checked), ``station_search`` and
``bead_search`` (the way along a bead), ``bead_plan`` (one bead, as finely as it takes), ``beads_ahead`` (many beads
checked together), ``densify`` (more samples where they are needed), ``travels`` (ways through the air),
``infeasible_part`` (which targets are lost once a part cannot be built), ``blocking_layers`` (layers in the way of what
comes later), ``part_plan`` (all beads), ``assemble`` (one motion of them), ``blended_check`` (its corners).
`cell.verification` never imports from here.
"""
