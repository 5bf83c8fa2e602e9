"""The search for a motion: along every bead, between the beads, from home and back.

Modules, from the single target to the whole part: ``context`` (what every search needs), ``configurations`` (rolls and
branches at targets), ``collision_free_rolls`` (rolls between the sampled ones that are free), ``blocked_rolls`` (turns
of the roll that free nothing), ``edges`` (motions from a target to the next), ``stations``, ``station_search`` and
``bead_search`` (the path along a bead), ``bead_outcome`` (the result of a search), ``bead_plan`` (one bead, searched
more finely where needed), ``cuts`` (beads without any path through them), ``neighbours`` (many beads checked together,
or one planned like another), ``travels`` (motions between beads), ``unreachable`` (targets that are proved out of
reach), ``infeasible_part`` (which targets are still checked once a part cannot be built), ``blocking_layers`` (layers
in the way of later ones), ``loss_ahead`` (infeasible beads at the end of a part, found before travels are searched),
``bead_runs`` (beads planned one after the other, as data), ``part_plan`` (all beads), ``assemble`` (one motion of
them). `cell.verification` never imports from here.
"""
