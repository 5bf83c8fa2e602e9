"""The command line: one module a command. Nothing imports it.

Modules: ``main`` (the commands), ``arguments`` (their options), ``replay_command``, ``speech`` (how much is said),
``bar`` (progress).
"""
