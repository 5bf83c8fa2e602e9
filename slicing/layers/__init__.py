"""Layers of a sub-volume: their surface, curves, thickness, and where they end.

Modules: ``layer``, ``thickness``, ``outside_body`` (what is inside the body is left out), ``poles`` (ends of a body).
"""
