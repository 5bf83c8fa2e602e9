"""Poses of the table: which cannot serve, which suit, and the table's way from one to the next.

Modules: ``hopeless_poses`` (poses excluded by few targets), ``suited_poses`` (those that lay upright, best first),
``layer_precedence`` and ``layer_order`` (which layers after which), ``table_turn`` (the way between two poses),
``waiting_pose`` (where the arm stands meanwhile), ``indexed_motion`` (motions and turns in one), ``parallel_poses``
(who checks poses).
"""
