"""The command line: one module a command. Nothing imports it.

``main`` turns arguments into an exit code, ``arguments`` holds the options, ``NAME_command`` what ``rbam NAME`` does.
The others are what commands share: ``given_case``, ``program_file``, ``jobs``, ``exit_codes``, ``console``, ``bar``
(progress), ``speech`` (how much is said).
"""
