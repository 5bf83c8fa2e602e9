"""What all pages share: templates of ``cell/html/web``, scripts in one, and a policy that lets nothing be loaded.

    page("sweep.html", script_of(("data", "sweep")), {"title": escape(title), "data": pack.text(document)})

What is filled in has to be escaped by the caller.
"""

from __future__ import annotations

import base64
import hashlib
import re
from collections.abc import Mapping, Sequence
from importlib import resources


def template(name: str) -> str:
    """A file of ``cell/html/web``."""
    return resources.files("cell.html").joinpath("web", name).read_text(encoding="utf-8")


def script_of(names: Sequence[str]) -> str:
    """Modules as one, in order of use: a page of one file has nothing to import from."""
    whole = "\n".join(template(f"{name}.js") for name in names)
    whole = re.sub(r'^import [^;]*? from "\./\w+\.js";\n', "", whole, flags=re.MULTILINE)
    return re.sub(r"^export ", "", whole, flags=re.MULTILINE)


def policy(script: str) -> str:
    """Content policy: nothing is loaded, and no script runs but the page's own."""
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    return (
        f"default-src 'none'; script-src 'sha256-{digest}'; style-src 'unsafe-inline'; img-src data: blob:; "
        "base-uri 'none'; form-action 'none'"
    )


def page(name: str, script: str, fill: Mapping[str, str]) -> str:
    """A whole page.

    Args:
        name: of its template.
        script: from :func:`script_of`; empty for none.
        fill: what stands at ``{{key}}``, escaped already, with ``heading`` for the window's title; ``policy``,
            ``script`` and ``ready`` are filled in here.

    Returns:
        The file; UTF-8.
    """
    # without a script it is ready as it stands
    known = {**fill, "policy": policy(script), "script": script, "ready": "" if script else ' data-ready="1"'}
    # one pass, so that nothing filled in is filled in again
    return re.sub(r"\{\{(\w+)\}\}", lambda m: known[m.group(1)], template("head.html") + template(name))
