"""Slicing strategies side by side, with the paper's indices and scores.

Module: ``compare``.
"""
