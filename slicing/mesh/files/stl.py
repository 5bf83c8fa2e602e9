"""Triangles of an STL file, binary or text.

    found = read_stl(Path("part.stl"))
    found.vertices, found.faces, found.lines

Which of the two a file is follows from its bytes, not from its first word: many binary files begin with "solid".
Bytes after the last triangle that the header counts are reported; a second file put behind the first one is read.
"""

from __future__ import annotations

import re
import struct
from pathlib import Path

import numpy as np

from ...arrays import Floats, PartError
from ...warning import Code, Warning
from ..solid import require_few_faces
from .polygons import Triangles

HEAD, COUNT, FACE = 80, 84, 50  # bytes of the header, of it with the count, of a triangle
HEAD_BYTES = 4096  # bytes that tell text from numbers
TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
NUMBER = rb"[-+0-9.,eEdDnNaAiIfFtTyY]+"


def read_stl(file: Path) -> Triangles:
    """Read an STL file.

    Args:
        file: its path.

    Returns:
        Its triangles, each with three vertices of its own.

    Raises:
        PartError: cut short, or text that is no STL; one line.
    """
    size = file.stat().st_size
    with file.open("rb") as stream:
        head = stream.read(HEAD_BYTES)
    stated = struct.unpack("<I", head[HEAD:COUNT])[0] if size >= COUNT else -1
    if stated >= 0 and COUNT + FACE * stated == size:
        return _read_binary(file)
    return _read_text(file) if _is_text(head) else _read_binary(file)


def _is_text(head: bytes) -> bool:
    """Whether a file's first bytes are an STL's text."""
    return b"\0" not in head and re.search(rb"(?i)\b(solid|facet|endsolid)\b", head) is not None


def _read_binary(file: Path) -> Triangles:
    size = file.stat().st_size
    parts: list[Floats] = []
    at = 0
    with file.open("rb") as stream:
        while size - at >= COUNT:
            stream.seek(at + HEAD)
            count = struct.unpack("<I", stream.read(4))[0]
            end = at + COUNT + FACE * count
            if end > size:
                if parts:
                    break
                raise PartError(
                    f"{file}: not readable as a STL mesh (its header counts {count:,} triangles, which take"
                    f" {end:,} bytes; the file has {size:,})"
                )
            if parts and count == 0:
                break  # padding
            require_few_faces(str(file), count + sum(len(part) for part in parts))
            data = np.frombuffer(stream.read(FACE * count), dtype=TRIANGLE)
            parts.append(data["corners"].reshape(-1, 3).astype(np.float64))
            at = end
    if not parts:
        raise PartError(
            f"{file}: not readable as a STL mesh (it has neither the text form nor a header of {COUNT} bytes)"
        )
    lines: list[str] = []
    if len(parts) > 1:
        lines.append(
            Warning(Code.MESH_FILE, f"{file}: {len(parts)} binary STL files one after the other; all were read")
        )
    if at < size:
        detail = f"{size - at:,} bytes after the last triangle were not read: the header does not count them"
        lines.append(Warning(Code.MESH_FILE, f"{file}: {detail}"))
    return _of_corners(np.concatenate(parts), lines)


def _read_text(file: Path) -> Triangles:
    text = file.read_bytes()
    # the names of solids may hold any word
    text = re.sub(rb"(?im)^[ \t]*(end)?solid\b[^\r\n]*", b"", text)
    found = re.findall(rb"(?i)\bvertex\s+(" + NUMBER + rb")\s+(" + NUMBER + rb")\s+(" + NUMBER + rb")", text)
    facets = len(re.findall(rb"(?i)\bfacet\s+normal\b", text))
    corners = len(re.findall(rb"(?i)\bvertex\b", text))
    require_few_faces(str(file), facets)
    if len(found) != corners or corners != 3 * facets:
        raise PartError(
            f"{file}: not readable as a STL mesh ({facets} facets with {len(found)} readable of {corners} vertices;"
            " a facet needs three vertices, a vertex three numbers)"
        )
    try:
        points = np.array(found, dtype=np.bytes_).reshape(-1, 3).astype(np.float64)
    except ValueError:
        bad = next(number for vertex in found for number in vertex if not _is_number(number)).decode("ascii")
        hint = "; numbers are written with a point, not a comma" if "," in bad else ""
        raise PartError(f"{file}: not readable as a STL mesh (number {bad!r}{hint})") from None
    return _of_corners(points, [])


def _is_number(text: bytes) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _of_corners(corners: Floats, lines: list[str]) -> Triangles:
    """Triangles of corners (3 m, 3)."""
    return Triangles(corners, np.arange(len(corners), dtype=np.int64).reshape(-1, 3), tuple(lines))
