"""The lines along the middle of a narrow flat region: where one bead is all that fits.

    lines = middle_lines(polygon, width_mm=5.0)      # [(line (n, 2), closed), ..]; empty where it is too short

The Voronoi edges of points on the border that lie within the region are its medial axis; the longest way along them is
the line. Its ends are drawn back so that the bead's round end comes to the region's end, as far as there is room. A
region with holes has closed ways about them instead: what is left of the axis without its dead ends.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..mesh.solid import Floats

MOST_POINTS = 600  # on the border
SMOOTH = 0.02  # how far the line may be straightened, as a share of the bead's width
FINE = 0.125  # spacing of the points on the border as a share of the bead's width


def middle_lines(polygon: Any, width_mm: float) -> list[tuple[Floats, bool]]:
    """The middle lines of a region narrower than a bead.

    Args:
        polygon: shapely, mm.
        width_mm: of the bead.

    Returns:
        (n, 2) mm each, and whether it is closed (the first point not repeated); none where there is no line of any
        length.
    """
    import shapely
    from scipy.spatial import Voronoi

    width_mm = min(width_mm, polygon.length)  # of a bead wider than that nothing changes any more
    step = max(FINE * width_mm, polygon.length / MOST_POINTS)
    step = min(step, 0.3 * polygon.area / max(polygon.length, 1e-9) + 1e-3 * width_mm)
    rings = [polygon.exterior, *polygon.interiors]
    points = np.concatenate([_along(ring, max(step, polygon.length / (4 * MOST_POINTS))) for ring in rings])
    if len(points) < 8:
        return []
    voronoi = Voronoi(points)
    corners = voronoi.vertices
    shapely.prepare(polygon)
    inside = shapely.contains_xy(polygon, corners[:, 0], corners[:, 1])
    edges = np.array([e for e in voronoi.ridge_vertices if e[0] >= 0], dtype=np.int64).reshape(-1, 2)
    edges = edges[inside[edges].all(axis=1)]
    if len(edges) == 0:
        return []
    if len(polygon.interiors):
        return [(_smooth(corners[way], closed, width_mm), closed) for way, closed in _ways_about(edges)]
    line = _drawn_back(corners[_longest_way(corners, edges)], polygon, width_mm)
    return [] if line is None else [(line, False)]


def _smooth(way: Floats, closed: bool, width_mm: float) -> Floats:
    import shapely

    line = shapely.LineString(np.concatenate([way, way[:1]]) if closed else way)
    points = np.asarray(line.simplify(SMOOTH * width_mm).coords)
    return points[:-1] if closed else points


def _ways_about(edges: np.ndarray) -> list[tuple[np.ndarray, bool]]:
    """A graph without its dead ends, as ways from fork to fork and rounds."""
    beside: dict[int, set[int]] = {}
    for a, b in edges.tolist():
        beside.setdefault(a, set()).add(b)
        beside.setdefault(b, set()).add(a)
    dead = [k for k, others in beside.items() if len(others) == 1]
    while dead:
        k = dead.pop()
        for other in beside.pop(k, set()):
            beside[other].discard(k)
            if len(beside[other]) == 1:
                dead.append(other)
    ways = []
    forks = [k for k, others in beside.items() if len(others) > 2]
    for start in (*forks, *beside):
        while beside.get(start):
            way = [start]
            while beside[way[-1]] and (len(way) == 1 or way[-1] not in forks):
                after = beside[way[-1]].pop()
                beside[after].discard(way[-1])
                way.append(after)
            closed = way[0] == way[-1]
            ways.append((np.array(way[:-1] if closed else way), closed))
    return [(way, closed) for way, closed in ways if len(way) > 2]


def _along(ring: Any, step: float) -> Floats:
    """Points on a ring at about even spacing."""
    corners = np.asarray(ring.coords)
    way = np.append(0.0, np.cumsum(np.hypot(*np.diff(corners, axis=0).T)))
    at = np.arange(max(int(np.ceil(way[-1] / step)), 4))
    at = at / len(at) * way[-1]
    return np.column_stack([np.interp(at, way, corners[:, k]) for k in (0, 1)])


def distances(points: Floats, border: Any) -> Floats:
    """Distances of points from a border: with a tree of its sides, as borders of fine layers have thousands.

    Args:
        points: (n, 2) mm.
        border: shapely line or lines, mm.

    Returns:
        (n,) mm.
    """
    import shapely

    ends = [np.asarray(line.coords) for line in shapely.get_parts(border)]
    tree = shapely.STRtree(np.concatenate([shapely.linestrings(np.stack([e[:-1], e[1:]], axis=1)) for e in ends]))
    of, away = tree.query_nearest(shapely.points(points), return_distance=True, all_matches=False)
    found = np.full(len(points), np.inf)
    found[of[0]] = away
    return found


def _longest_way(corners: Floats, edges: np.ndarray) -> np.ndarray:
    """Numbers of corners along the longest of the shortest ways: from anywhere to the farthest, and on again."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components, dijkstra

    length = np.sqrt(((corners[edges[:, 0]] - corners[edges[:, 1]]) ** 2).sum(axis=1)) + 1e-12
    graph = coo_matrix((length, (edges[:, 0], edges[:, 1])), shape=(len(corners),) * 2).tocsr()
    _, piece = connected_components(graph, directed=False)
    main = int(np.argmax(np.bincount(piece[edges[:, 0]], weights=length)))
    best: list[int] = [int(edges[np.flatnonzero(piece[edges[:, 0]] == main)[0], 0])]
    for _ in range(2):
        far, before = dijkstra(graph, directed=False, indices=best[0], return_predecessors=True)
        at = int(np.argmax(np.where(np.isfinite(far), far, -1.0)))
        best = [at]
        while before[best[-1]] >= 0:
            best.append(int(before[best[-1]]))
    return np.array(best)


def _drawn_back(way: Floats, polygon: Any, width_mm: float) -> Floats | None:
    """The way without the ends that run into corners, and no nearer to the region's ends than half a width."""
    import shapely
    from shapely.ops import substring

    room = distances(way, polygon.boundary)
    wide = np.flatnonzero(room >= 0.5 * np.median(room))
    way, room = way[wide[0] : wide[-1] + 1], room[wide[0] : wide[-1] + 1]
    if len(way) < 2:
        return None
    line = shapely.LineString(way)
    back = [max(0.5 * width_mm - float(r), 0.0) for r in (room[0], room[-1])]
    if line.length > sum(back) + 0.1 * width_mm:
        line = substring(line, back[0], line.length - back[1])
    out = np.asarray(line.simplify(SMOOTH * width_mm).coords)
    return out if line.length > 1e-3 else None
