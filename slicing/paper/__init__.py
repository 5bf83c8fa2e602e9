"""The indices and scores of Lettori et al. 2024.

Modules: ``indices``, ``adhesion``, ``scores``.
"""
