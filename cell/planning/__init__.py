"""The search for a motion: along every bead, between the beads, from home and back.

Modules, from the single target to the whole part: ``context`` (what every search needs), ``configurations`` (rolls and
branches at targets), ``collision_free_rolls`` (rolls between the sampled ones that are free), ``blocked_rolls`` (turns
of the roll that free nothing), ``edges`` (motions from a target to the next), ``stations``, ``station_search`` and
``bead_search`` (the path along a bead), ``bead_outcome`` (what came of it), ``bead_plan`` (one bead, as finely as it
takes), ``cuts`` (where no way leads through one), ``neighbours`` (many beads checked together, or one like another),
``travels`` (motions between beads), ``unreachable`` (targets that are proved out of reach), ``infeasible_part``
(which targets are lost once a part cannot be built),
``blocking_layers`` (layers in the way of what comes later), ``loss_ahead`` (a bead at the end that is lost, seen before
travels are searched), ``bead_runs`` (beads planned one after the other, as data), ``part_plan`` (all beads),
``assemble`` (one motion of them).
`cell.verification` never imports from here.
"""
