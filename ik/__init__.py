"""Inverse kinematics on plain arrays: chains, solvers, singularity margins, paths (metres, radians)."""
