"""A program run as the controller would: its way, sample by sample, and its times.

Modules: ``interpolation`` (lines and circles), ``configuration_tracking`` (the arm along them),
``external_axes`` (the table's axes), ``corners`` (where
the rounding of a move may begin), ``program_path`` (the way), ``simulate`` (the times, and the motion that comes of
it).
"""
