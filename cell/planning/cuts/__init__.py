"""Beads that are cut: no way leads through them though each of their targets can be welded.

Modules: ``cut_search`` (what is known of places on a bead), ``bead_cut`` (where a bead is cut, and as what it is lost).
"""
