"""The case file: read, checked and explained.

Modules: ``read`` (YAML to a `Case`), ``yaml12`` (the YAML dialect), ``files`` (files that a case reads), ``sections``
(every key with its limits) with ``part_sections``, ``cell_sections``, ``table_section`` and ``controller_section``,
``fields`` (kinds of values), ``roll_text`` and ``number_lists`` (short forms on the command line), ``problems``
(messages of bad input), ``fingerprint`` (what a case's results depend on).
"""
