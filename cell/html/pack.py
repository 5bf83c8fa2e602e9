"""Numbers for a page: arrays and a document in one compressed block of text, and back again.

    pack = Pack()
    text = pack.text({"t_s": pack.put(t, "f4")})       # base64 of gzip
    document = unpack(text)                            # arrays in their places

Inside: the length of the JSON (4 bytes, little-endian), the JSON, spaces up to a multiple of 8, the arrays. An array's
place in the JSON holds ``{"at": byte, "n": count, "type": "f4"}``. Numbers that change little from one to the next are
:meth:`Pack.steps`: multiples of a share of their unit, of each column the differences of neighbours (or of those), with
the sign in the lowest bit, the lowest bytes of all first, then the next ones: a few bits each when compressed.
``web/data.js`` reads the same.
"""

from __future__ import annotations

import base64
import gzip
import json
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ik.chain import Floats

ALIGN = 8  # bytes; typed arrays begin at multiples of their size
STEPS = "steps"  # type of an array of :meth:`Pack.steps`
LARGEST_STEPS = 2**49  # steps from 0 of such a number: its differences are whole numbers in JavaScript


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
        return {"at": self._add(array.tobytes()), "n": array.size, "type": kind}

    def steps(self, values: ArrayLike, per_unit: float = 1.0) -> dict[str, Any]:
        """Add numbers that change little from row to row, rounded: half a step off at most.

        Args:
            values: (n,) or (n, k); NaN stays NaN.
            per_unit: steps a unit: 100 keeps two decimals.

        Returns:
            What stands for them in the document; they come out flat, row after row.

        Raises:
            ValueError: an infinite number, or one of so many steps that they cannot be distinguished.
        """
        array = np.asarray(values, dtype=np.float64)
        columns = array.reshape(-1, array.shape[1] if array.ndim == 2 else 1).T
        unknown = np.isnan(columns)
        whole = np.rint(np.where(unknown, 0.0, columns) * per_unit)
        if whole.size and not np.abs(whole).max() < LARGEST_STEPS:
            raise ValueError(f"{np.abs(columns).max()} in steps of 1/{per_unit:g}: too many to be told apart")
        whole = _held_over(whole, unknown).astype(np.int64)
        order, changes = _fewest_bits(whole)
        changes = (changes << 1) ^ (changes >> 63)  # 0, -1, 1, -2, .. as 0, 1, 2, 3, ..
        planes = max((int(changes.max(initial=0)).bit_length() + 7) // 8, 1)
        data = b"".join(((changes >> 8 * p) & 255).astype(np.uint8).tobytes() for p in range(planes))
        place: dict[str, Any] = {"at": self._add(data), "n": array.size, "type": STEPS, "per": per_unit}
        place |= {"columns": len(columns), "planes": planes, "order": order}
        if unknown.any():
            edge = np.diff(unknown.ravel().astype(np.int8), prepend=0, append=0)
            place["gaps"] = self.put(np.flatnonzero(edge), "u4")  # starts and ends in turn, column after column
        return place

    def _add(self, data: bytes) -> int:
        """Where bytes stand."""
        at = self._size
        self._chunks += [data, b"\0" * (-len(data) % ALIGN)]
        self._size += len(data) + -len(data) % ALIGN
        return at

    def text(self, document: dict[str, Any]) -> str:
        """The document with its arrays, as text; the same for the same content."""
        head = json.dumps(document, allow_nan=False, separators=(",", ":")).encode()
        head += b" " * (-(len(head) + 4) % ALIGN)
        whole = len(head).to_bytes(4, "little") + head + b"".join(self._chunks)
        return base64.b64encode(gzip.compress(whole, 9, mtime=0)).decode()


def _held_over(whole: Floats, unknown: NDArray[np.bool_]) -> Floats:
    """Numbers whose unknown ones are the last known, (k, n): no change there."""
    last = np.maximum.accumulate(np.where(unknown, 0, np.arange(whole.shape[1])), axis=1)
    return np.take_along_axis(whole, last, axis=1)


def _fewest_bits(whole: NDArray[np.int64]) -> tuple[int, NDArray[np.int64]]:
    """Differences along each row, of the first order or of the second, whichever are smaller."""
    once = np.diff(whole, axis=1, prepend=0)
    twice = np.diff(once, axis=1, prepend=0)
    bits = [float(np.log2(1.0 + np.abs(d)).sum()) for d in (once, twice)]
    return (2, twice) if bits[1] < bits[0] else (1, once)


def unpack(text: str) -> dict[str, Any]:
    """The document of :meth:`Pack.text`, arrays (flat) in their places."""
    whole = gzip.decompress(base64.b64decode(text))
    start = 4 + int.from_bytes(whole[:4], "little")

    def array(d: dict[str, Any]) -> Any:
        if not {"at", "n", "type"} <= d.keys():
            return d
        at = start + d["at"]
        if d["type"] == STEPS:
            return _from_steps(np.frombuffer(whole, np.uint8, d["n"] * d["planes"], at), d)
        found: NDArray[Any] = np.frombuffer(whole, f"<{d['type']}", d["n"], at)
        return found

    document: dict[str, Any] = json.loads(whole[4:start], object_hook=array)
    return document


def _from_steps(data: NDArray[np.uint8], place: dict[str, Any]) -> Floats:
    """The numbers of :meth:`Pack.steps`, flat."""
    planes = data.reshape(place["planes"], -1).astype(np.int64)
    coded = sum((plane << 8 * p for p, plane in enumerate(planes)), np.zeros(place["n"], dtype=np.int64))
    whole = ((coded >> 1) ^ -(coded & 1)).reshape(place["columns"], -1)
    for _ in range(place["order"]):
        whole = np.cumsum(whole, axis=1)
    out = (whole / place["per"]).ravel()
    for first, stop in np.asarray(place.get("gaps", ())).reshape(-1, 2):
        out[first:stop] = np.nan
    return np.ascontiguousarray(out.reshape(place["columns"], -1).T).ravel()
