"""Layers compared with the solid: areas and volumes by an independent sum over its faces.

Modules: ``layer_areas``, ``borders`` (lengths and loops of layers against the solid's), ``solid_flux``, with
``flux_fields`` (one a kind of surface) and ``solid_faces``.
"""
