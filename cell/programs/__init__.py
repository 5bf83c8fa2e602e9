"""Robot programs: written from a checked motion, read back, and run as the controller would.

Modules: ``program`` (a program as data, without any syntax), ``orientation`` (KUKA's A B C), ``controller`` (the case's
section as numbers and arrays), ``hooks`` (lines where arcs and layers start and end), ``krl_write``, ``krl_read``, and
the room's own room ``krl`` (the language).
"""
