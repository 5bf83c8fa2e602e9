"""The case file: read, checked and explained.

Modules: ``read`` (YAML to a `Case`), ``yaml12`` (the YAML dialect), ``sections`` and ``seam_section`` (every key with
its limits), ``fields`` (kinds of values), ``roll_text`` and ``number_lists`` (short forms on the command line),
``problems`` (messages of bad input), ``fingerprint`` (what a case's results depend on).
"""
