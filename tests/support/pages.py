"""Pages of results: what they hold."""

from __future__ import annotations

import re
from typing import Any

from cell.html.pack import unpack

NASTY = "<script>alert(1)</script> & \"quotes\" '{{data}}'"


def document_of(page: str) -> dict[str, Any]:
    found = re.search(r'<script type="text/plain" id="data">(.*?)</script>', page, re.DOTALL)
    assert found
    return unpack(found[1])
