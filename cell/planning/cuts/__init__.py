"""Beads that are cut: no motion leads through them, though each of their targets can be welded by itself.

Modules: ``cut_search`` (free rolls at places on a bead), ``bead_cut`` (where a bead is cut, and the failure that is
reported).
"""
