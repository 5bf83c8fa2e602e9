"""Robot programs: written from a checked motion, read back, and run as the controller would.

Modules: ``program`` (a program as data, without any syntax), ``orientation`` (KUKA's A B C), ``controller`` and
``cell_controller`` (the case's section as numbers and arrays, and what they mean in its cell), ``cell_frames``
(the positioner, seen from the arm's base), ``hooks`` (lines where arcs and layers start and end). Written:
``from_motion`` (the program of a motion), ``krl_modules`` (which module holds what), ``krl_write``,
``robodk_script``, ``pose_rows``, ``export`` (with all checks), ``round_trip`` (what was written against what was
meant), ``exported`` (what comes of it, and its files). Read: ``krl_read`` with ``krl`` (the language), ``running``
(run as the controller would), ``bead_match`` (which bead a row welds), ``program_check`` (the verdict).
"""
