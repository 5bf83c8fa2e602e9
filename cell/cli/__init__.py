"""The command line: one module a command. Nothing imports it.

``main`` turns arguments into an exit code, ``arguments`` holds the options. ``check_command``, ``export_command``,
``slice_command``, ``compare_command``, ``sweep_command``, ``replay_command`` and ``scene_command`` are what ``rbam
NAME`` does. The others are what commands share: ``case_options``, ``program_file``, ``process_count``, ``exit_codes``,
``console``, ``progress_bar`` (progress), ``verbosity`` (how much is printed).
"""
