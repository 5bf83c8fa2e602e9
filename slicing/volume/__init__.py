"""Layers held against the solid: areas and volumes by an independent sum over its faces.

Modules: ``layer_areas``, ``offset_families``, ``solid_flux``.
"""
