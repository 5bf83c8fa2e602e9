"""Layers, beads and deposits, and what is asked of them."""
