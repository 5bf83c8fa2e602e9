"""Links of the documents to what stands beside them in the repository.

A page that is read in the repository links to `../slicing` or `../models/parts/README.md`. On the site the README of a
model is a page of its own; other files and folders are named without a link. A page that holds a comment
`<!-- text of models/parts/README.md -->` is that file.
"""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Any

from sphinx.application import Sphinx

LINK = re.compile(r"(?<!!)\[([^\]\[]*)\]\((?!https?:|#|<)([^)#\s]+)(#[^)\s]*)?\)")
TEXT_OF = re.compile(r"^<!-- text of (\S+) -->$", re.MULTILINE)
PAGES = {
    "models/parts/README.md": "models/parts.md",
    "models/cases/README.md": "models/cases.md",
    "models/kr70_r2100/README.md": "models/kr70_r2100.md",
    "models/kp2_hv500/README.md": "models/kp2_hv500.md",
    "models/cmt_torch/README.md": "models/cmt_torch.md",
}


def rewritten(text: str, of: Path, page: Path, source: Path) -> str:
    """A text with the links that lead out of the documents put right.

    Args:
        text: what is shown.
        of: the file it is of; its links are relative to that.
        page: the page that shows it.
        source: folder of the documents.

    Returns:
        The text, with links relative to the page.
    """

    def put_right(found: re.Match[str]) -> str:
        words, link, anchor = found[1], found[2], found[3] or ""
        there = (of.parent / link).resolve()
        name = Path(os.path.relpath(there, source.parent)).as_posix()
        there = source / PAGES[name] if name in PAGES else there
        if there.is_relative_to(source):
            return f"[{words}]({Path(os.path.relpath(there, page.parent)).as_posix()}{anchor})"
        return words if name in words or words.startswith("`") else f"{words} (`{name}`)"

    return LINK.sub(put_right, text)


def _read(app: Sphinx, docname: str, content: list[str]) -> None:
    source = Path(app.srcdir).resolve()
    page = of = Path(app.env.doc2path(docname)).resolve()
    text = content[0]
    if found := TEXT_OF.search(text):
        of = source.parent / found[1]
        text = of.read_text(encoding="utf-8")
        app.env.note_dependency(str(of))
    content[0] = rewritten(text, of, page, source)


def setup(app: Sphinx) -> dict[str, Any]:
    """Listen to pages that are read."""
    app.connect("source-read", _read)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
