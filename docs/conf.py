"""The documents as a site: ``python -m sphinx -W --keep-going docs build/docs``."""

from __future__ import annotations

import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE / "_ext"), str(HERE.parent)]

project = "rbam-cell"
author = "The rbam-cell authors"
copyright = author
extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "live_pages",
    "public_names",
    "outside_links",
]
exclude_patterns = ["_ext"]
myst_enable_extensions = ["colon_fence", "deflist"]
myst_heading_anchors = 3

# API: Google style docstrings, in which `name` is code
default_role = "code"
napoleon_use_ivar = True
napoleon_custom_sections = [("Source", "returns_style")]
autodoc_typehints = "signature"
autodoc_typehints_format = "short"
autodoc_preserve_defaults = True
autodoc_type_aliases = {name: name for name in ("Floats", "Ints", "Bools")}
autodoc_member_order = "bysource"
python_use_unqualified_type_names = True
maximum_signature_line_length = 88

html_theme = "furo"
html_title = "rbam-cell"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_copy_source = False
