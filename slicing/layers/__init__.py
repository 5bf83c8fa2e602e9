"""Layers of a sub-volume: their surface, curves, thickness, and where they end.

Modules: ``layer``, ``thickness``, ``outside_body`` (what is inside the body is left out), ``body_ends`` (where a body
ends, and what lies over its ends), ``poles`` (layers that close over the end of a body).
"""
