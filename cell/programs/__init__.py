"""Robot programs: written from a checked motion, read back, and run as the controller would.

Modules: ``program`` (a program as data, without any syntax).
"""
