"""Measurements of speed, and of whether what is said is true; run from here: ``python -m bench.speed.ik``."""
