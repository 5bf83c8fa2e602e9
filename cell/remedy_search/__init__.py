"""What would help an infeasible case: the smallest changes that a whole check agrees to.

Modules: ``search``, ``changes`` and ``seam_changes`` (what can be changed), ``screening`` (what has no chance),
``bead_trial`` (one bead on trial), ``target_groups`` (targets that fail alike), ``words``.
"""
