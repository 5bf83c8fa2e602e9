"""One mesh of a whole part taken apart into its round body and what stands on it.

Modules: ``decompose``, ``axis``, ``outline`` (profile of the body), ``turned_faces``, ``cut``.
"""
