"""Pages of one file: the check report, the comparison and the sweep map.

Modules: ``page`` (template and scripts), ``pack`` (arrays in a page), ``shapes`` and ``scene`` (the cell in 3D),
``drawn_path`` (the samples that a page shows), ``series`` (values along the motion), ``page_words``, ``check_page``,
``comparison_page``, ``sweep_page``. The folder ``web`` holds templates, styles and scripts.
"""
