"""The metal of beads as convex pieces, made of the beads themselves: a rectangle swept along each.

    for name, corners in bead_hulls(targets, width_mm=5.0): ...     # "deposit/3/SV1/0", (k, 3) mm

Where a bead bends little, many of its segments become one piece: the hull of all their corners, which holds them. At
corners every segment is carried on until the two hold all of the bead's round outer side.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ..mesh.solid import Floats, Mesh
from ..targets.targets import Targets

MOST_OFF = 0.1  # of a bead's width: how far a bead may bow off the chord of one piece
FLAT = 1e-6  # thickness over length, below which a piece has no volume
MOST_TURN = np.deg2rad(10.0)  # between the deposition directions of one piece


def bead_hulls(targets: Targets, width_mm: float, *, below: bool = False) -> Iterator[tuple[str, Floats]]:
    """Convex pieces that hold the metal of every bead.

    Args:
        targets: the beads.
        width_mm: of a bead.
        below: whether the metal lies below its targets, against the deposition direction, and not above them.

    Yields:
        Name ``deposit/NUMBER/SUB-VOLUME/PIECE`` and corners, (k, 3), part frame, mm. Numbers count layers over all
        sub-volumes.
    """
    first = first_deposits(targets)
    count: dict[int, int] = {}
    for bead in range(len(targets.closed)):
        rows = slice(*np.searchsorted(targets.bead, [bead, bead + 1]).tolist())
        sub_volume = int(targets.sub_volume_index[rows.start])
        number = first[sub_volume] + int(targets.layer[rows.start])
        corners = _corners(targets, rows, width_mm, below)
        for a, b in _runs(targets.position[rows], targets.normal[rows], MOST_OFF * width_mm):
            piece = count.get(number, 0)
            count[number] = piece + 1
            piece_corners = _with_volume(corners[a : b - 1].reshape(-1, 3), width_mm)
            yield f"deposit/{number}/{targets.sub_volume[sub_volume]}/{piece}", piece_corners


def first_deposits(targets: Targets) -> tuple[int, ...]:
    """Number of the first layer of each sub-volume, counting layers over all of them; at the end how many there are."""
    layers = [
        int(targets.layer[targets.sub_volume_index == k].max(initial=-1)) + 1 for k in range(len(targets.sub_volume))
    ]
    return tuple(np.concatenate([[0], np.cumsum(layers)]).tolist())


def _corners(targets: Targets, rows: slice, width_mm: float, below: bool) -> Floats:
    """Corners of a bead along each of its segments, (n - 1, 8, 3): a rectangle swept from target to target.

    At the bead's ends it goes half a width further on. At corners it goes as far as the two segments' outer sides meet,
    half a width at most: round a corner a bead is round, and a rectangle half a width longer holds that.
    """
    p, n, t = targets.position[rows], targets.normal[rows], targets.tangent[rows]
    half = width_mm / 2
    height = targets.thickness_mm[rows, None] * n
    low = p - height if below else p
    step = np.diff(p, axis=0)
    starts, stops = _across(step, n[:-1], t[:-1]), _across(step, n[1:], t[1:])
    further = np.full(len(p), half)
    cosine = (stops[:-1] * starts[1:]).sum(axis=1)
    further[1:-1] = half * np.sqrt(np.clip((1.0 - cosine) / np.maximum(1.0 + cosine, 1e-12), 0.0, 1.0))
    out = []
    for way, k, sign in ((starts, slice(None, -1), -1.0), (stops, slice(1, None), 1.0)):
        side = half * np.cross(n[k], way)
        end = low[k] + sign * further[k, None] * way
        out += [end - side, end + side, end + height[k] - side, end + height[k] + side]
    return np.stack(out, axis=1)


def _across(step: Floats, normal: Floats, tangent: Floats) -> Floats:
    """Unit directions of segments (n, 3) across the deposition directions; where they run along these, the tangents."""
    way = step - (step * normal).sum(axis=1)[:, None] * normal
    length = np.linalg.norm(way, axis=1)[:, None]
    runs_along = length <= FLAT * np.linalg.norm(step, axis=1)[:, None]
    return np.asarray(np.where(runs_along, tangent, way / np.where(runs_along, 1.0, length)))


def _with_volume(corners: Floats, width_mm: float) -> Floats:
    """A piece's corners (k, 3); of a bead that rises along its deposition direction a column as wide as the bead."""
    spread, axes = np.linalg.svd(corners - corners.mean(axis=0), full_matrices=False)[1:]
    if spread[2] > FLAT * spread[0]:
        return corners
    half = width_mm / 2 * axes[2]
    return np.concatenate([corners - half, corners + half])


def _runs(p: Floats, n: Floats, off: float) -> Iterator[tuple[int, int]]:
    """Rows of a bead, from and to (exclusive), each run nearly straight; runs share their ends."""
    start = 0
    while start < len(p) - 1:
        stop = start + 2
        while stop < len(p) and _straight(p[start : stop + 1], n[start : stop + 1], off):
            stop += 1
        yield start, stop
        start = stop - 1


def _straight(p: Floats, n: Floats, off: float) -> bool:
    chord = p[-1] - p[0]
    length = float(np.linalg.norm(chord))
    if length == 0.0:
        return False
    away = p - p[0]
    along = away @ chord / length
    across = np.linalg.norm(away - along[:, None] * (chord / length), axis=1)
    turn = float((n @ n[0]).min())
    return bool(across.max() <= off and (np.diff(along) > 0).all() and turn >= np.cos(MOST_TURN))


def hulls_mesh(name: str, hulls: Sequence[Floats]) -> Mesh:
    """Convex pieces as one mesh of several shells, to look at.

    Args:
        name: of the mesh.
        hulls: corners of each piece, (k, 3), mm.
    """
    from scipy.spatial import ConvexHull

    vertices: list[Floats] = []
    faces = []
    count = 0
    for corners in hulls:
        hull = ConvexHull(corners)
        face = hull.simplices
        a, b, c = (corners[face[:, k]] for k in range(3))
        inward = (np.cross(b - a, c - a) * hull.equations[:, :3]).sum(axis=1) < 0
        face = np.where(inward[:, None], face[:, ::-1], face)
        vertices.append(corners)
        faces.append(face + count)
        count += len(corners)
    return Mesh(name, np.concatenate(vertices), np.concatenate(faces).astype(np.int64))
