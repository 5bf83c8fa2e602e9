"""Poses of the table: which cannot serve, which suit, and the table's way from one to the next.

Modules: ``hopeless_poses`` (poses excluded by few targets), ``suited_poses`` (those that lay upright, best first),
``group_order`` (which group after which), ``table_turn`` (the way between two poses).
"""
