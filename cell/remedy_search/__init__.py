"""What would help an infeasible case: the smallest changes that a whole check agrees to.

Modules: ``search``, ``change`` with ``angle_changes`` and ``cell_changes`` (one class a kind), ``changes`` (those a
case has), ``seam_changes``, ``screening`` (what has no chance), ``bead_trial`` (one bead on trial), ``target_groups``
(targets that fail alike), ``table_modes`` (other ways for the table to move), ``remedy`` (a change that helps, and how
it is put into words).
"""
