"""Slicing of sub-volumes on a round body: meshes in, layers, beads and robot targets out (part frame, mm)."""
