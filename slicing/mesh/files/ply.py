"""Triangles of PLY and OFF files: polygons with a count in front, in text or in bytes of either order.

    found = read_ply(Path("part.ply"))
    found = read_off(Path("part.off"))

Of a PLY the elements `vertex` (x, y, z) and `face` (vertex_indices) are taken, whatever else stands beside them; one
with strips of triangles is refused.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ...arrays import Floats, Ints, PartError
from ..solid import require_few_faces
from .polygons import Triangles, triangulated

TYPES = {
    **{"char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2", "ushort": "u2"},
    **{"uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4", "float": "f4", "float32": "f4"},
    **{"double": "f8", "float64": "f8", "int64": "i8", "uint64": "u8"},
}
ORDERS = {"ascii": "=", "binary_little_endian": "<", "binary_big_endian": ">"}
STRIPS = ("tristrips", "tristrip")  # elements of triangles that share corners, as scanners write them
LONGEST_HEAD = 65536  # bytes in which a header ends


@dataclass(frozen=True)
class _Property:
    name: str
    kind: str
    count: str = ""  # type of a list's length; empty for a single number


@dataclass(frozen=True)
class _PlyElement:
    name: str
    rows: int
    properties: list[_Property] = field(default_factory=list)

    def least_bytes(self, text: bool) -> int:
        """How many bytes its rows take at least."""
        each = [2 if text else np.dtype(p.count or p.kind).itemsize for p in self.properties]
        return self.rows * sum(each)


def _bad(file: Path, what: str) -> PartError:
    return PartError(f"{file}: not readable as a {file.suffix.lstrip('.').upper()} mesh ({what})")


def read_ply(file: Path) -> Triangles:
    """Read a PLY file.

    Args:
        file: its path.

    Returns:
        Its triangles.

    Raises:
        PartError: a header that is none, or counts more than the file holds; an index without a vertex; one line.
    """
    with file.open("rb") as stream:
        head = stream.read(LONGEST_HEAD)
    end = re.search(rb"end_header[ \t]*(\r\n|\n|\r)", head)
    if not head.startswith(b"ply") or end is None:
        raise _bad(file, "its header does not begin with ply and end with end_header")
    order, elements = _header(file, head[: end.start()].decode("utf-8", errors="replace"))
    for element in elements:
        if element.name == "face":
            require_few_faces(str(file), element.rows)
        elif element.name in STRIPS and element.rows:
            raise PartError(f"{file}: has triangle strips ({element.name}), which are not read: export faces")
        room = file.stat().st_size - end.end()
        if element.least_bytes(order == "=") > room + 1:
            raise _bad(file, f"its header counts {element.rows:,} rows of {element.name}, the file has {room:,} bytes")
    data = file.read_bytes()[end.end() :]
    reader = _text_rows if order == "=" else _binary_rows
    try:
        found = reader(file, data, elements, order)
    except (ValueError, IndexError, OverflowError) as error:
        raise _bad(file, " ".join(str(error).split())[:120]) from None
    if "vertex" not in found or "face" not in found:
        raise PartError(f"{file}: no triangles in the file; a closed solid is needed")
    points = found["vertex"]
    assert isinstance(points, np.ndarray)
    count, corners = found["face"]
    return triangulated(points, count, corners, str(file))


def _header(file: Path, text: str) -> tuple[str, list[_PlyElement]]:
    """Byte order ("=" for text) and the elements."""
    order, elements = "", []
    for line in text.splitlines():
        words = line.split()
        try:
            if words[:1] == ["format"]:
                order = ORDERS[words[1]]
            elif words[:1] == ["element"]:
                elements.append(_PlyElement(words[1], int(words[2])))
            elif words[:2] == ["property", "list"]:
                elements[-1].properties.append(_Property(words[4], TYPES[words[3]], TYPES[words[2]]))
            elif words[:1] == ["property"]:
                elements[-1].properties.append(_Property(words[2], TYPES[words[1]]))
        except (KeyError, IndexError, ValueError):
            raise _bad(file, f"header line {line[:60]!r}") from None
    if not order or any(element.rows < 0 for element in elements):
        raise _bad(file, "its header has no format, or a count below 0")
    return order, elements


def _wanted(element: _PlyElement) -> tuple[list[str], str]:
    """Names of an element's numbers that are wanted, or of its list."""
    names = [p.name for p in element.properties]
    if element.name == "vertex":
        if any(p.count for p in element.properties if p.name in ("x", "y", "z")) or not {"x", "y", "z"} <= set(names):
            raise ValueError("its vertices have no x, y and z")
        return ["x", "y", "z"], ""
    for name in ("vertex_indices", "vertex_index"):
        if any(p.name == name and p.count for p in element.properties):
            return [], name
    raise ValueError("its faces have no list vertex_indices")


def _binary_rows(
    file: Path, data: bytes, elements: list[_PlyElement], order: str
) -> dict[str, Floats | tuple[Ints, Ints]]:
    found: dict[str, Floats | tuple[Ints, Ints]] = {}
    at = 0
    for element in elements:
        lists = [p for p in element.properties if p.count]
        sizes = {p.name: _first_count(data, at, element, order, p) for p in lists} if element.rows else {}
        kind = _row_type(element, order, sizes)
        rows = None
        if at + element.rows * kind.itemsize <= len(data):
            rows = np.frombuffer(data, dtype=kind, count=element.rows, offset=at)
            if any((rows["count " + p.name] != sizes[p.name]).any() for p in lists if element.rows):
                rows = None
        if rows is not None:
            at += element.rows * kind.itemsize
            if element.name in ("vertex", "face"):
                found[element.name] = _of_rows(element, rows, sizes)
        elif not lists:
            raise ValueError(f"it ends within its {element.name} rows")
        else:
            own, at = _uneven_rows(data, at, element, order)
            if element.name in ("vertex", "face"):
                found[element.name] = own
    return found


def _row_type(element: _PlyElement, order: str, sizes: dict[str, int]) -> np.dtype:
    """The type of a row if all lists are as long as in the first one."""
    fields: list[tuple[str, str] | tuple[str, str, tuple[int]]] = []
    for p in element.properties:
        if p.count:
            fields += [("count " + p.name, order + p.count), (p.name, order + p.kind, (sizes.get(p.name, 0),))]
        else:
            fields.append((p.name, order + p.kind))
    return np.dtype(fields)


def _first_count(data: bytes, at: int, element: _PlyElement, order: str, wanted: _Property) -> int:
    """How long a list is in the first row."""
    for p in element.properties:
        if not p.count:
            at += np.dtype(p.kind).itemsize
            continue
        size = int(np.frombuffer(data, order + p.count, 1, at)[0])
        if p is wanted:
            return max(size, 0)
        at += np.dtype(p.count).itemsize + max(size, 0) * np.dtype(p.kind).itemsize
    return 0


def _of_rows(element: _PlyElement, rows: np.ndarray, sizes: dict[str, int]) -> Floats | tuple[Ints, Ints]:
    names, listed = _wanted(element)
    if names:
        return np.stack([rows[name].astype(np.float64) for name in names], axis=1)
    size = sizes.get(listed, 0)
    corners = rows[listed].astype(np.int64).reshape(-1) if len(rows) else np.zeros(0, dtype=np.int64)
    return np.full(len(rows), size, dtype=np.int64), corners


def _uneven_rows(data: bytes, at: int, element: _PlyElement, order: str) -> tuple[Floats | tuple[Ints, Ints], int]:
    """Rows whose lists differ in length, one after the other."""
    names, listed = _wanted(element) if element.name in ("vertex", "face") else ([], "")
    places: list[list[float]] = []
    count: list[int] = []
    corners: list[int] = []
    for _ in range(element.rows):
        row: dict[str, float] = {}
        for p in element.properties:
            size = 1
            if p.count:
                size = int(np.frombuffer(data, order + p.count, 1, at)[0])
                at += np.dtype(p.count).itemsize
            values = np.frombuffer(data, order + p.kind, size, at) if size > 0 else np.zeros(0)
            at += size * np.dtype(p.kind).itemsize
            if p.name == listed:
                count.append(size)
                corners += values.astype(np.int64).tolist()
            elif p.name in names:
                row[p.name] = float(values[0])
        if names:
            places.append([row[name] for name in names])
    if names:
        return np.array(places, dtype=np.float64).reshape(-1, 3), at
    return (np.array(count, dtype=np.int64), np.array(corners, dtype=np.int64)), at


def _text_rows(
    file: Path, data: bytes, elements: list[_PlyElement], order: str
) -> dict[str, Floats | tuple[Ints, Ints]]:
    found: dict[str, Floats | tuple[Ints, Ints]] = {}
    lines = iter(line for line in data.decode("utf-8", errors="replace").splitlines() if line.strip())
    for element in elements:
        if element.name not in ("vertex", "face"):
            _skip(lines, element.rows)
            continue
        names, listed = _wanted(element)
        places: list[list[float]] = []
        count: list[int] = []
        corners: list[int] = []
        for _ in range(element.rows):
            line = next(lines, None)
            if line is None:
                raise ValueError(f"it ends within its {element.name} rows")
            row = _split(line.split(), element)
            if names:
                places.append([float(row[name][0]) for name in names])
            else:
                own = [int(word) for word in row[listed]]
                count.append(len(own))
                corners += own
        if names:
            found["vertex"] = np.array(places, dtype=np.float64).reshape(-1, 3)
        else:
            found["face"] = np.array(count, dtype=np.int64), np.array(corners, dtype=np.int64)
    return found


def _skip(lines: Iterator[str], rows: int) -> None:
    for _ in range(rows):
        next(lines, None)


def _split(words: list[str], element: _PlyElement) -> dict[str, list[str]]:
    """A row's words by property."""
    row: dict[str, list[str]] = {}
    at = 0
    for p in element.properties:
        size = 1
        if p.count:
            size, at = int(words[at]), at + 1
        row[p.name] = words[at : at + size]
        if len(row[p.name]) < size:
            raise ValueError(f"a row of {element.name} is too short: {' '.join(words)[:40]!r}")
        at += size
    return row


def read_off(file: Path) -> Triangles:
    """Read an OFF file (OFF, COFF, NOFF, CNOFF: what follows x, y and z in a vertex's line is left out).

    Args:
        file: its path.

    Returns:
        Its triangles.

    Raises:
        PartError: not its text, cut short, or an index without a vertex; one line.
    """
    text = file.read_bytes().decode("utf-8", errors="replace")
    lines = iter(line for line in (raw.split("#", 1)[0].split() for raw in text.splitlines()) if line)
    first = next(lines, [])
    if not first or not re.fullmatch(r"(ST)?C?N?OFF", first[0]):
        raise _bad(file, "its first line is not OFF")
    sizes = first[1:] or next(lines, [])
    try:
        n, m = int(sizes[0]), int(sizes[1])
        require_few_faces(str(file), m)
        points = [[float(word) for word in next(lines)[:3]] for _ in range(n)]
        rows = [next(lines) for _ in range(m)]
        polygons = [[int(word) for word in row[1 : 1 + int(row[0])]] for row in rows]
        if any(len(polygon) != int(row[0]) for polygon, row in zip(polygons, rows, strict=True)):
            raise ValueError("a face is too short")
        vertices = np.array(points, dtype=np.float64).reshape(n, 3)
    except StopIteration:
        raise _bad(file, "it ends before the last of its faces") from None
    except (ValueError, IndexError) as error:
        raise _bad(file, " ".join(str(error).split())[:120]) from None
    corners = [corner for polygon in polygons for corner in polygon]
    return triangulated(vertices, [len(polygon) for polygon in polygons], corners, str(file))
