"""Beads: the lines that the torch lays in a layer.

Modules: ``bead``, ``lay`` (all beads of a sub-volume), ``infill``, ``zigzag``, ``regions`` (areas of a layer),
``middle_lines``, ``order``, ``seams``, ``lead_in_out``, ``exact_points``, ``over_ends`` (over the end of a body),
``fine_thickness``, ``thickness_policy`` and ``thickness_merge`` (places too thin or too thick), ``deposition`` (metal
laid against metal needed), ``overhang`` and ``overhang_regions`` (regions without anything below).
"""
