"""Numbers for a page: arrays and a document in one compressed block of text, and back again.

    pack = Pack()
    text = pack.text({"t_s": pack.put(t, "f4")})       # base64 of gzip
    document = unpack(text)                            # arrays in their places

Inside: the length of the JSON (4 bytes, little-endian), the JSON, spaces up to a multiple of 8, the arrays. An array's
place in the JSON holds ``{"at": byte, "n": count, "type": "f4"}``. ``web/data.js`` reads the same.
"""

from __future__ import annotations

import base64
import gzip
import json
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

ALIGN = 8  # bytes; typed arrays begin at multiples of their size


class Pack:
    """Collects arrays."""

    def __init__(self) -> None:
        self._chunks: list[bytes] = []
        self._size = 0

    def put(self, values: ArrayLike, kind: str) -> dict[str, Any]:
        """Add an array.

        Args:
            values: of any shape; stored flat.
            kind: f4, i2, i1, u1, u2, i4 or u4.

        Returns:
            What stands for it in the document.
        """
        array = np.ascontiguousarray(values, dtype=np.dtype(f"<{kind}"))
        place = {"at": self._size, "n": array.size, "type": kind}
        data = array.tobytes()
        data += b"\0" * (-len(data) % ALIGN)
        self._chunks.append(data)
        self._size += len(data)
        return place

    def text(self, document: dict[str, Any]) -> str:
        """The document with its arrays, as text; the same for the same content."""
        head = json.dumps(document, allow_nan=False, separators=(",", ":")).encode()
        head += b" " * (-(len(head) + 4) % ALIGN)
        whole = len(head).to_bytes(4, "little") + head + b"".join(self._chunks)
        return base64.b64encode(gzip.compress(whole, 9, mtime=0)).decode()


def unpack(text: str) -> dict[str, Any]:
    """The document of :meth:`Pack.text`, arrays (flat) in their places."""
    whole = gzip.decompress(base64.b64decode(text))
    start = 4 + int.from_bytes(whole[:4], "little")

    def array(d: dict[str, Any]) -> Any:
        if d.keys() != {"at", "n", "type"}:
            return d
        found: NDArray[Any] = np.frombuffer(whole, f"<{d['type']}", d["n"], start + d["at"])
        return found

    document: dict[str, Any] = json.loads(whole[4:start], object_hook=array)
    return document
