"""Results as JSON documents and as text on a terminal.

Modules: ``check_document`` and ``check_report``, ``motion_report``, ``program_document``, ``remedy_lines``,
``slice_lines``, ``comparison_lines``, ``sweep_lines``, ``scene_contents`` (what is in a cell), ``facts`` (names and
values).
"""
