"""A program run as the controller would: its way, sample by sample, and its times.

Modules: ``interpolation`` (lines and circles), ``configuration_tracking`` (the arm along them), ``program_path`` (the
way), ``simulate`` (the times, and the motion that comes of it).
"""
