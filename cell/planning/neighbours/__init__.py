"""Beads planned by what is known of others near them.

Modules: ``beads_ahead`` (beads that follow one another, searched and checked together), ``similar_bead`` (a bead on the
way of one like it that was hard to find).
"""
