"""Beads: the lines that the torch lays in a layer.

Modules: ``bead``, ``lay`` (all beads of a sub-volume), ``infill``, ``regions`` (areas of a layer), ``middle_lines``,
``order``, ``seams``, ``leads``, ``exact_points``, ``fine_thickness``, ``thickness_policy`` and ``thickness_merge``
(places too thin or too thick).
"""
