"""The motion to look at: MuJoCo's window, a browser, pictures and films.

Modules: ``stage_scene`` (what is drawn), ``player`` (which moment is shown), ``camera``, ``window``, ``browser`` with
``browser_stage``, ``browser_panel`` and ``web_guard`` (access to it), ``picture``, ``film``, ``layer_picture``,
``sweep_map_picture``, ``print_raster``, ``colours``, ``shown_motion``.
"""
