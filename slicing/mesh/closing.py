"""Makes a closed surface of faces that are nearly one, with safe repairs only, and reports every repair.

    points, faces, lines = closed_surface("blade", points, faces)

Safe are the repairs that leave the solid what it plainly is:

- faces that name vertices which are no numbers, where the rest is closed without them;
- duplicate faces: one of each is kept; two that look in opposite directions bound nothing and both go;
- open edges whose ends lie on those of another (less than JOIN_MM apart and less than a tenth of the shortest open
  edge): joined;
- vertices that lie on open edges of other faces (T-vertices): those faces divided there, no vertex moved;
- holes less than HOLE_MM across: filled;
- faces that disagree with their neighbours about which side is outside: turned, as few as possible;
- edges shared by four faces or more: divided, so that each wedge of material has an edge of its own.

Anything else is refused with how many open edges there are, and where. A surface with two faces on every edge, one
running each way, is passed on as it is: that check costs one sort.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..arrays import Bools, Floats, Ints, PartError
from ..warning import Code, Warning
from .face_measures import face_normals
from .mesh_edges import MeshEdges

JOIN_MM = 0.01  # farther apart two vertices are never one: the tolerance of curves
JOIN_SHARE = 0.1  # of the shortest open edge
HOLE_MM = 0.05  # across; filling it changes no bead
MOST_PASSES = 50  # of dividing faces at T-vertices: one side of a face each


def repaired(text: str) -> Warning:
    """A line about a repair."""
    return Warning(Code.MESH_REPAIRED, text)


def closed_surface(name: str, points: Floats, faces: Ints) -> tuple[Floats, Ints, list[str]]:
    """Close and orient a surface as far as that is safe.

    Args:
        name: for the messages.
        points: (n, 3) mm; may hold numbers that are not finite.
        faces: (m, 3) vertex indices, each face of three different vertices.

    Returns:
        Vertices and faces with two faces on every edge that agree about which side is outside, every vertex used;
        and a line for each kind of repair.

    Raises:
        PartError: not closed, or not orientable.
    """
    finite = np.asarray(np.isfinite(points).all(axis=1))
    lines: list[str] = []
    if not finite.all():
        faces = _without_unknown(name, finite, faces, lines)
    points, faces = _used(name, points, faces, lines)
    edges = MeshEdges.of(len(points), faces)
    if edges.is_surface:
        return points, faces, lines
    points, faces, edges = _closed(name, points, faces, edges, lines)
    if (edges.balance != 0).any():
        faces, edges = _agreed(name, len(points), faces, edges, lines)
    if (edges.count > 2).any():
        points, faces = _divided(name, points, faces, edges, lines)
    return points, faces, lines


def _without_unknown(name: str, finite: Bools, faces: Ints, lines: list[str]) -> Ints:
    """Faces without those at vertices that are no numbers; refused where that leaves a hole."""
    named = ~finite[faces].all(axis=1)
    kept = faces[~named]
    if len(kept) == 0 or (named.any() and not MeshEdges.of(len(finite), kept).is_closed):
        raise PartError(f"{name}: {int((~finite).sum())} vertices are not finite numbers (NaN or infinite)")
    if named.any():
        lines.append(repaired(f"{name}: dropped {int(named.sum())} faces with vertices that are not finite numbers"))
    return kept


def _used(name: str, points: Floats, faces: Ints, lines: list[str]) -> tuple[Floats, Ints]:
    """Vertices that some face uses, and the faces with their new numbers."""
    used = np.zeros(len(points), dtype=bool)
    used[faces] = True
    if used.all():
        return points, faces
    lines.append(repaired(f"{name}: dropped {int((~used).sum())} vertices that no face uses"))
    return points[used], (np.cumsum(used) - 1)[faces]


def _closed(
    name: str, points: Floats, faces: Ints, edges: MeshEdges, lines: list[str]
) -> tuple[Floats, Ints, MeshEdges]:
    """Drop duplicate faces, join open edges, fill tiny holes; refuse what is open then."""
    if (edges.count > 2).any():
        faces, edges = _without_duplicates(name, len(points), faces, edges, lines)
    if not edges.is_closed:
        points, faces, edges = _joined(name, points, faces, edges, lines)
    if not edges.is_closed:
        faces, edges = _divided_at_vertices(name, points, faces, edges, lines)
    if not edges.is_closed:
        faces, edges = _filled(name, points, faces, edges, lines)
    if not edges.is_closed:
        raise PartError(_open_line(name, points, faces, edges))
    return points, faces, edges


def _without_duplicates(name: str, n: int, faces: Ints, edges: MeshEdges, lines: list[str]) -> tuple[Ints, MeshEdges]:
    """One face of each set of duplicates; none of two that look in opposite directions, unless that opens a hole."""
    ordered = np.sort(faces, axis=1)
    a, b, c = faces.T
    turns = (a < b) ^ (b < c) ^ (a < c)  # even permutation of the sorted ones
    order = np.lexsort(ordered.T)
    new = np.append(True, (ordered[order[1:]] != ordered[order[:-1]]).any(axis=1))
    group = np.cumsum(new) - 1
    if new.all():
        return faces, edges
    net = np.bincount(group, weights=np.where(turns[order], 1.0, -1.0))
    agreeing = turns[order] == (net[group] > 0)  # the first of those that look the way most do stands for all
    rank = np.where(agreeing, 0, 1) * len(faces) + np.arange(len(faces))
    first = np.minimum.reduceat(rank, np.flatnonzero(new)) % len(faces)
    for chosen in (order[first[net != 0]], order[first]):
        kept = faces[np.sort(chosen)]
        found = MeshEdges.of(n, kept)
        if len(kept) and found.is_closed:
            break
    if edges.is_closed and not found.is_closed:
        return faces, edges
    lines.append(repaired(f"{name}: dropped {len(faces) - len(kept)} duplicate faces"))
    return kept, found


def _joined(
    name: str, points: Floats, faces: Ints, edges: MeshEdges, lines: list[str]
) -> tuple[Floats, Ints, MeshEdges]:
    """Vertices of open edges that lie on one another made one."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    sides = edges.odd_sides()
    start, end = faces.ravel()[sides], np.roll(faces, -1, axis=1).ravel()[sides]
    length = np.sqrt(((points[end] - points[start]) ** 2).sum(axis=1))
    reach = min(JOIN_MM, JOIN_SHARE * float(length[length > 0].min(initial=np.inf)))
    border = np.unique(np.append(start, end))
    pairs = cKDTree(points[border]).query_pairs(reach, output_type="ndarray")
    if len(pairs) == 0:
        return points, faces, edges
    n = len(border)
    graph = coo_array((np.ones(len(pairs), dtype=bool), (pairs[:, 0], pairs[:, 1])), shape=(n, n))
    _, label = connected_components(graph, directed=False)
    number = np.arange(len(points))
    number[border] = border[np.unique(label, return_index=True)[1][label]]
    joined = number[faces]
    a, b, c = joined.T
    joined = joined[(a != b) & (b != c) & (c != a)]
    found = MeshEdges.of(len(points), joined)
    before, after = int((edges.count % 2).sum()), int((found.count % 2).sum())
    if after >= before:
        return points, faces, edges
    apart = float(np.sqrt(((points - points[number]) ** 2).sum(axis=1)).max())
    moved = faces[(number != np.arange(len(points)))[faces].any(axis=1)]
    most = 0.5 * apart * float(np.sqrt((face_normals(points, moved) ** 2).sum(axis=1)).sum())
    lines.append(
        repaired(
            f"{name}: closed {before - after} open edges by joining vertices up to {apart:.2g} mm apart (at most"
            f" {most:.2g} mm³)"
        )
    )
    points, joined = _used(name, points, joined, [])
    return points, joined, MeshEdges.of(len(points), joined)


def _divided_at_vertices(
    name: str, points: Floats, faces: Ints, edges: MeshEdges, lines: list[str]
) -> tuple[Ints, MeshEdges]:
    """Faces divided where a vertex of an open edge lies on a side of theirs; as they were if that closes nothing."""
    found, of_found, count, farthest = faces, edges, 0, 0.0
    for _ in range(MOST_PASSES):
        gone, new, on, off = _at_vertices(points, found, of_found)
        if not gone:
            break
        found = np.concatenate([np.delete(found, gone, axis=0), np.array(new, dtype=np.int64)])
        of_found = MeshEdges.of(len(points), found)
        count, farthest = count + on, max(farthest, off)
        if of_found.is_closed:
            break
    if int((of_found.count % 2).sum()) >= int((edges.count % 2).sum()):
        return faces, edges
    many = "1 vertex" if count == 1 else f"{count} vertices"
    reported = f"{name}: divided faces at {many} on their sides (T-vertices, up to {farthest:.2g} mm off)"
    lines.append(repaired(reported))
    return found, of_found


def _at_vertices(points: Floats, faces: Ints, edges: MeshEdges) -> tuple[list[int], list[list[int]], int, float]:
    """Faces to divide along one open side each, the faces they become, at how many vertices, and how far off these."""
    from scipy.spatial import cKDTree

    sides = edges.odd_sides()
    start, end = faces.ravel()[sides], np.roll(faces, -1, axis=1).ravel()[sides]
    border = np.unique(np.append(start, end))
    length = np.sqrt(((points[end] - points[start]) ** 2).sum(axis=1))
    reach = min(JOIN_MM, JOIN_SHARE * float(length[length > 0].min(initial=np.inf)))
    tree = cKDTree(points[border])
    new: list[list[int]] = []
    gone: dict[int, None] = {}
    count, farthest = 0, 0.0
    for side in sides[np.argsort(-length, kind="stable")].tolist():
        face, k = divmod(side, 3)
        a, b, c = (int(faces[face, (k + i) % 3]) for i in range(3))
        on, off = ([], 0.0) if face in gone else _on_side(points, a, b, border, tree, reach)
        if on and c not in on:
            chain = [a, *on, b]
            new += [[chain[i], chain[i + 1], c] for i in range(len(chain) - 1)]
            gone[face] = None
            count, farthest = count + len(on), max(farthest, off)
    return list(gone), new, count, farthest


def _on_side(points: Floats, a: int, b: int, border: Ints, tree: Any, reach: float) -> tuple[list[int], float]:
    """Vertices between a and b on the straight line between them, in their order, and how far off."""
    way = points[b] - points[a]
    length = float(np.sqrt(way @ way))
    if length <= 0.0:
        return [], 0.0
    near = border[tree.query_ball_point(0.5 * (points[a] + points[b]), 0.5 * length + reach)]
    from_a = points[near] - points[a]
    along = from_a @ way / length
    off = np.sqrt(np.maximum(((from_a - along[:, None] * way / length) ** 2).sum(axis=1), 0.0))
    on = np.flatnonzero((off <= reach) & (along > reach) & (along < length - reach))
    if len(on) == 0:
        return [], 0.0
    on = on[np.argsort(along[on], kind="stable")]
    return near[on].tolist(), float(off[on].max())


def _filled(name: str, points: Floats, faces: Ints, edges: MeshEdges, lines: list[str]) -> tuple[Ints, MeshEdges]:
    """Holes too small to matter filled with a fan."""
    new, widest, count = [], 0.0, 0
    for loop in _holes(faces, edges):
        across = float(np.ptp(points[loop], axis=0).max())
        if across > HOLE_MM:
            continue
        count, widest = count + 1, max(widest, across)
        # the new faces run against the open sides
        new += [[loop[0], loop[k + 1], loop[k]] for k in range(1, len(loop) - 1)]
    if not new:
        return faces, edges
    most = count * widest**3
    lines.append(repaired(f"{name}: filled {count} holes of at most {widest:.2g} mm across (at most {most:.2g} mm³)"))
    faces = np.concatenate([faces, np.array(new, dtype=np.int64)])
    return faces, MeshEdges.of(len(points), faces)


def _holes(faces: Ints, edges: MeshEdges) -> list[Ints]:
    """Vertices of each loop of open edges, in the order of the faces beside it; loops that fork are left out."""
    sides = edges.side[np.repeat(edges.count == 1, edges.count)]
    start, end = faces.ravel()[sides].tolist(), np.roll(faces, -1, axis=1).ravel()[sides].tolist()
    after = dict(zip(start, end, strict=True))
    loops: list[Ints] = []
    if len(after) < len(start):
        return loops
    while after:
        first, at = next(iter(after.items()))
        loop = [first]
        del after[first]
        while at in after:
            loop.append(at)
            at = after.pop(at)
        if at == first and len(loop) > 2:
            loops.append(np.array(loop, dtype=np.int64))
    return loops


def _open_line(name: str, points: Floats, faces: Ints, edges: MeshEdges) -> str:
    """How many edges are open, and where the widest hole is."""
    sides = edges.odd_sides()
    count = int((edges.count % 2).sum())
    more = int(((edges.count % 2 == 1) & (edges.count > 1)).sum())
    shared = f", {more} of them shared by 3 faces or more" if more else ""
    loops = _holes(faces, edges)
    middle = points[faces.ravel()[sides]][:1]
    around = ""
    if loops:
        widths = [float(np.ptp(points[loop], axis=0).max()) for loop in loops]
        middle = points[loops[int(np.argmax(widths))]]
        around = f" round {len(loops)} hole{'s'[: len(loops) - 1]}, the widest {max(widths):.3g} mm"
    at = ", ".join(f"{v:.3f}" for v in middle.mean(axis=0))
    return (
        f"{name}: the mesh is not closed ({count} open edges{shared}{around}, at ({at}) mm);"
        " a watertight solid is needed"
    )


def _agreed(name: str, n: int, faces: Ints, edges: MeshEdges, lines: list[str]) -> tuple[Ints, MeshEdges]:
    """Turn faces so that neighbours run along their common edge in opposite ways, as few faces as will do."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    m, pairs = len(faces), edges.pairs()
    start = faces.ravel()
    same = start[pairs[:, 0]] == start[pairs[:, 1]]
    a, b = pairs.T // 3
    # every face twice, as it is and turned; two that fit are joined
    rows = np.concatenate([a, a + m])
    columns = np.concatenate([np.where(same, b + m, b), np.where(same, b, b + m)])
    graph = coo_array((np.ones(len(rows), dtype=bool), (rows, columns)), shape=(2 * m, 2 * m))
    _, label = connected_components(graph, directed=False)
    as_is, turned = label[:m], label[m:]
    cost = np.bincount(turned, minlength=int(label.max()) + 1)
    turn = (cost[turned] < cost[as_is]) | ((cost[turned] == cost[as_is]) & (turned < as_is))
    found = np.where(turn[:, None], faces[:, ::-1], faces)
    after = MeshEdges.of(n, found)
    if (as_is == turned).any() or (after.balance != 0).any():
        bad = int((edges.balance != 0).sum())
        raise PartError(f"{name}: {bad} edges join faces that disagree about which side is outside")
    lines.append(repaired(f"{name}: turned {int(turn.sum())} faces that disagreed about which side is outside"))
    return found, after


def _divided(name: str, points: Floats, faces: Ints, edges: MeshEdges, lines: list[str]) -> tuple[Floats, Ints]:
    """Give every wedge of material at an edge of four faces or more an edge of its own."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    many = np.flatnonzero(edges.count > 2)
    pairs = [edges.pairs()]
    for k in many.tolist():
        sides = edges.side[edges.first[k] : edges.first[k] + edges.count[k]]
        pairs.append(_wedges(points, faces, sides))
    one, other = np.concatenate(pairs).T
    # corners at the start of one side and the end of the other are the same vertex
    following = lambda side: side - side % 3 + (side + 1) % 3  # noqa: E731
    rows = np.concatenate([one, following(one)])
    columns = np.concatenate([following(other), other])
    size = 3 * len(faces)
    graph = coo_array((np.ones(len(rows), dtype=bool), (rows, columns)), shape=(size, size))
    _, label = connected_components(graph, directed=False)
    lines.append(repaired(f"{name}: divided {len(many)} edges shared by four faces or more"))
    where = np.unique(label, return_index=True)[1]
    return points[faces.ravel()[where]], label.reshape(-1, 3).astype(np.int64)


def _wedges(points: Floats, faces: Ints, sides: Ints) -> Ints:
    """Pairs (k, 2) of the sides of one edge between whose faces there is material."""
    start, end = faces.ravel()[sides], np.roll(faces, -1, axis=1).ravel()[sides]
    low, high = int(min(start[0], end[0])), int(max(start[0], end[0]))
    axis = points[high] - points[low]
    away = points[np.roll(faces, -2, axis=1).ravel()[sides]] - points[low]
    across = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
    angle = np.arctan2(away @ np.cross(axis, across) / np.sqrt(axis @ axis), away @ across)
    # counter-clockwise about the edge material begins at a face that runs against it and ends at one that runs along
    forward = (start == low)[np.lexsort((start == low, angle))]
    sides = sides[np.lexsort((start == low, angle))]
    waiting: list[int] = []
    found: list[tuple[int, int]] = []
    for along, side in 2 * list(zip(forward.tolist(), sides.tolist(), strict=True)):
        if side in (s for pair in found for s in pair) or side in waiting:
            continue
        if not along:
            waiting.append(side)
        elif waiting:
            found.append((waiting.pop(), side))
    return np.array(found, dtype=np.int64)
