"""The command line: one module a command. Nothing imports it.

``main`` turns arguments into an exit code, ``arguments`` holds the options. ``check_command``, ``export_command``,
``slice_command``, ``compare_command``, ``sweep_command``, ``replay_command`` and ``scene_command`` are what ``rbam
NAME`` does. The others are what commands share: ``given_case``, ``program_file``, ``jobs``, ``exit_codes``,
``console``, ``bar`` (progress), ``speech`` (how much is said).
"""
