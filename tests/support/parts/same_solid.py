"""One solid as other meshes: the same surface from other faces, in another order, in another place or unit.

vertices, faces = retriangulated(vertices, faces, rng)     # the same planes, other diagonals
"""

from __future__ import annotations

import numpy as np

Arrays = tuple[np.ndarray, np.ndarray]
FLAT = 1e-9  # of the extent: how far a corner may lie off a neighbour's plane


def _sides(faces: np.ndarray) -> dict[tuple[int, int], int]:
    """The face that each directed side belongs to."""
    return {(int(f[k]), int(f[(k + 1) % 3])): n for n, f in enumerate(faces) for k in range(3)}


def retriangulated(vertices: np.ndarray, faces: np.ndarray, rng: np.random.Generator, rounds: int = 4) -> Arrays:
    """Other diagonals in the same planes: neighbours of one plane that make a convex quadrilateral swap theirs.

    Args:
        vertices: (n, 3).
        faces: (m, 3), closed and oriented.
        rng: which diagonals.
        rounds: how often every side is looked at.

    Returns:
        The same vertices, other faces.
    """
    faces = faces.copy()
    extent = float(np.ptp(vertices, axis=0).max())
    for _ in range(rounds):
        side = _sides(faces)
        touched: set[int] = set()
        pairs = [(a, b) for a, b in side if a < b and (b, a) in side]
        for n in rng.permutation(len(pairs)).tolist():
            a, b = pairs[n]
            one, other = side[a, b], side[b, a]
            if one in touched or other in touched or rng.random() < 0.3:
                continue
            c, d = (int(next(v for v in faces[f] if v not in (a, b))) for f in (one, other))
            if (c, d) in side or (d, c) in side or not _convex(vertices[[a, d, b, c]], FLAT * extent):
                continue
            faces[one], faces[other] = (a, d, c), (d, b, c)
            touched |= {one, other}
    return vertices, faces


def _convex(corners: np.ndarray, slack: float) -> bool:
    """Whether four corners (4, 3) are a convex quadrilateral in one plane, none of them on a side."""
    ahead = np.roll(corners, -1, axis=0) - corners
    turns = np.cross(ahead, np.roll(ahead, -1, axis=0))
    normal = np.cross(corners[2] - corners[0], corners[3] - corners[1])
    size = float(np.linalg.norm(normal))
    if size <= slack**2:
        return False
    normal = normal / size
    flat = np.abs((corners - corners[0]) @ normal).max() <= slack
    lengths = np.linalg.norm(ahead, axis=1)
    return bool(flat and (turns @ normal > 1e-6 * lengths * np.roll(lengths, -1)).all())


def split(vertices: np.ndarray, faces: np.ndarray, rng: np.random.Generator, count: int) -> Arrays:
    """New vertices on sides of faces, each side divided on both of its faces.

    Args:
        vertices: (n, 3).
        faces: (m, 3), closed and oriented.
        rng: which sides, and where on them.
        count: how many.

    Returns:
        Vertices and faces.
    """
    points, rows = list(vertices), [tuple(int(v) for v in f) for f in faces]
    for _ in range(count):
        side = {(f[k], f[(k + 1) % 3]): n for n, f in enumerate(rows) for k in range(3)}
        a, b = list(side)[int(rng.integers(len(side)))]
        new = len(points)
        share = float(rng.uniform(0.2, 0.8))
        points.append((1 - share) * points[a] + share * points[b])
        for start, end in ((a, b), (b, a)):
            n = side[start, end]
            third = next(v for v in rows[n] if v not in (a, b))
            rows[n] = (start, new, third)
            rows.append((new, end, third))
    return np.array(points), np.array(rows, dtype=np.int64)


def shuffled(vertices: np.ndarray, faces: np.ndarray, rng: np.random.Generator) -> Arrays:
    """Faces, their corners and the vertices in another order."""
    order = rng.permutation(len(vertices))
    number = np.empty(len(order), dtype=np.int64)
    number[order] = np.arange(len(order))
    faces = number[faces[rng.permutation(len(faces))]]
    turn = rng.integers(3, size=len(faces))
    return vertices[order], np.stack([faces[np.arange(len(faces)), (turn + k) % 3] for k in range(3)], axis=1)
