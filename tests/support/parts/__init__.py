"""Solids with known truth, and what is held against it."""
