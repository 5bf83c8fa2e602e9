"""Triangles of a Wavefront OBJ file: its polygons divided as they are, its relative indices counted where they stand.

    found = read_obj(Path("part.obj"))
    found.vertices, found.faces, found.lines

Objects, groups, materials, normals and texture coordinates change nothing: all faces are taken together. Lines and
points are left out; curves and free-form surfaces are refused.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ...arrays import PartError
from ..solid import require_few_faces
from .polygons import Triangles, triangulated

FREE_FORM = frozenset({"surf", "curv", "curv2"})


def read_obj(file: Path) -> Triangles:
    """Read an OBJ file.

    Args:
        file: its path.

    Returns:
        Its triangles.

    Raises:
        PartError: a number that is none, an index without a vertex, a polygon that crosses itself, free-form
            surfaces; one line that names the file's line.
    """
    text = file.read_bytes().decode("utf-8", errors="replace")
    if "\0" in text:
        raise PartError(f"{file}: not readable as a OBJ mesh (its text is not UTF-8)")
    points: list[list[float]] = []
    count: list[int] = []
    corners: list[int] = []
    joined = ""
    for number, raw in enumerate(text.splitlines(), start=1):
        line = joined + raw
        if line.endswith("\\"):
            joined = line[:-1] + " "
            continue
        joined = ""
        words = line.split("#", 1)[0].split() if "#" in line else line.split()
        if not words:
            continue
        kind = words[0]
        if kind == "v":
            points.append(_position(file, number, words))
        elif kind == "f":
            polygon = _corners(file, number, words[1:], len(points))
            count.append(len(polygon))
            corners += polygon
        elif kind in FREE_FORM:
            raise PartError(f"{file}: line {number}: free-form geometry ({kind}) is not read; export polygons")
    require_few_faces(str(file), sum(count) - 2 * len(count))
    highest = max(corners, default=-1)
    if highest >= len(points):
        raise PartError(f"{file}: a face names vertex {highest + 1}; the file has {len(points)}")
    return triangulated(np.array(points, dtype=np.float64).reshape(-1, 3), count, corners, str(file))


def _position(file: Path, number: int, words: list[str]) -> list[float]:
    try:
        place = [float(words[1]), float(words[2]), float(words[3])]
    except (ValueError, IndexError):
        hint = "; numbers are written with a point, not a comma" if any("," in word for word in words) else ""
        raise PartError(
            f"{file}: line {number}: {' '.join(words)[:60]!r} is not a vertex of three numbers{hint}"
        ) from None
    return place


def _corners(file: Path, number: int, words: list[str], known: int) -> list[int]:
    """Vertices of a face, from 0; relative ones count back from the vertices read so far."""
    found: list[int] = []
    for word in words:
        try:
            index = int(word.split("/", 1)[0])
        except ValueError:
            raise PartError(f"{file}: line {number}: {word[:40]!r} does not name a vertex") from None
        place = index - 1 if index > 0 else known + index
        if index == 0 or place < 0:
            raise PartError(f"{file}: line {number}: a face names vertex {index}; {known} are read there")
        found.append(place)
    return found
