"""The part as shapes that collide: its body, and what has been deposited layer by layer.

What counts at any moment is the material laid so far, so every layer becomes convex pieces of its own, numbered in
the order of deposition; a check then looks only at deposits below the current number::

    shape = part_shape(sliced, body_mesh=None, profile=None)
    shape.hulls["deposit/7/SV1/0"]            # (k, 3) vertices, part frame, mm
    shape.first_deposit                       # number of each sub-volume's first layer

A layer that is far from convex (a ring, a C, a hole) is cut into pieces until each fills most of its hull, so that the
torch can still go in where there is room. Pieces cover what they stand for: where a border is the centre line of a
bead, that bead stands out of its layer by half its width (``beyond_borders``). A piece reaches from its layer's surface
out to the next layer's; planes of strategy planar are the tops of their layers, and pieces lie below them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from slicing.arrays import Floats

from ..beads.infill import only_areas
from ..beads.lay import LaidSubVolume
from ..layers.layer import Layer, SlicedSubVolume
from ..mesh.hull import convex_hull, hull_planes
from ..mesh.solid import Mesh
from ..parameters import BeadParameters
from ..surfaces.surfaces import Cone, Cylinder, Plane, Revolved, Round, Surface
from .round_sectors import sectors

if TYPE_CHECKING:
    from shapely import Polygon

FILLED = 0.8  # share of its hull that a piece has to fill
SMALLEST_MM = 4.0  # pieces are not cut further
SAME_MM = 1e-6  # heights that differ by less are one
SIMPLIFY_MM = 0.05  # curves are thinned to this before they become hulls, and hulls are padded by it
HULL_VERTICES = 200  # vertices of a body's hull at most
MANY_POINTS = 500_000  # of hulls, from which those that are not needed are left out: they would fill the memory
ROUND = 48  # corners of a body given as a cylinder


@dataclass(frozen=True, eq=False)
class PartShape:
    """Shapes of the part, part frame, mm.

    Attributes:
        visual: meshes to look at, by geom name.
        hulls: vertices of convex pieces, by geom name: "body/...", "deposit/NUMBER/SUB-VOLUME/PIECE", and of what is
            there from the start "built/SUB-VOLUME/LAYER/PIECE" ("rest" for LAYER: of what no layer holds).
        first_deposit: number of the first layer of each sub-volume.
        n_deposits: layers in all.
    """

    visual: dict[str, Mesh]
    hulls: dict[str, Floats]
    first_deposit: tuple[int, ...]
    n_deposits: int


def part_shape(
    sliced: Sequence[SlicedSubVolume],
    body_mesh: Mesh | None,
    profile: Sequence[tuple[float, float]] | None,
    beyond_mm: Sequence[Floats] | None = None,
    built: Sequence[tuple[SlicedSubVolume, Floats]] = (),
    most_points: int = MANY_POINTS,
) -> PartShape:
    """Shapes of a sliced part.

    Args:
        sliced: the sub-volumes, all on one body.
        body_mesh: the body's own shape, to look at; its convex hull collides where there is no profile.
        profile: the body as (r, z) points about its axis, mm, lowest first; band by band it is what collides.
        beyond_mm: how far the beads of each sub-volume's layers reach beyond the layers' borders, from
            :func:`beyond_borders`; not at all where left out.
        built: sub-volumes that are there from the start, each with how far its beads reach beyond the layers' borders.
        most_points: of what is laid, beyond which those that its hulls do not need are left out.

    Returns:
        The shapes.

    Raises:
        ValueError: neither body_mesh nor profile is given, and the body is not among what is printed.
    """
    body = sliced[0].body
    if any(s.stands_on_plate for s in sliced):
        visual: dict[str, Mesh] = {}  # the body grows like everything else: nothing of it is there before
        hulls: dict[str, Floats] = {}
    else:
        visual, hulls = body_shape(body.axis_xy_mm, body_mesh, profile)
    visual = {f"{s.name}_visual": s.mesh for s in (*sliced, *(s for s, _ in built))} | visual
    hulls |= built_hulls(built)
    laid = dict(_laid_hulls(sliced, beyond_mm))
    if sum(map(len, laid.values())) > most_points:
        laid = dict(_laid_hulls(sliced, beyond_mm, few=True))
    first = np.cumsum([0, *(len(s.layers) for s in sliced)]).tolist()
    return PartShape(visual, hulls | laid, tuple(first[:-1]), first[-1])


def _laid_hulls(
    sliced: Sequence[SlicedSubVolume], beyond_mm: Sequence[Floats] | None, *, few: bool = False
) -> Iterator[tuple[str, Floats]]:
    """Names and vertices of what is laid, layer by layer."""
    number = 0
    for i, s in enumerate(sliced):
        for layer in s.layers:
            beyond = 0.0 if beyond_mm is None else float(beyond_mm[i][layer.index])
            for k, slab in enumerate(_slabs(s, layer, beyond, few=few)):
                yield f"deposit/{number}/{s.name}/{k}", convex_hull(slab)[0] if few else slab
            number += 1


def body_shape(
    axis_xy_mm: tuple[float, float], body_mesh: Mesh | None, profile: Sequence[tuple[float, float]] | None
) -> tuple[dict[str, Mesh], dict[str, Floats]]:
    """Shapes of a body that is there from the start.

    Args:
        axis_xy_mm: where its axis is.
        body_mesh: its own shape, to look at; its convex hull collides where there is no profile.
        profile: (r, z) points about the axis, mm, lowest first; band by band it is what collides.

    Returns:
        What is looked at, and vertices of convex pieces, both by geom name.

    Raises:
        ValueError: neither is given.
    """
    if profile is not None:
        bands = [(low, high) for low, high in pairwise(profile) if high[1] > low[1]]
        hulls = {f"body/{i}": _band(axis_xy_mm, *band) for i, band in enumerate(bands)}
        return {"body_visual": body_mesh or solid_of_revolution(axis_xy_mm, profile)}, hulls
    if body_mesh is not None:
        return {"body_visual": body_mesh}, {"body/0": _thinned_hull(body_mesh.vertices)}
    raise ValueError("a part needs the shape of its body: a mesh or a profile")


def built_hulls(built: Sequence[tuple[SlicedSubVolume, Floats]]) -> dict[str, Floats]:
    """Vertices of convex pieces of sub-volumes that are there from the start, by geom name.

    Args:
        built: each with how far its beads reach beyond the layers' borders, (layers,), mm.
    """
    hulls: dict[str, Floats] = {}
    for s, beyond in built:
        for layer in s.layers:
            slabs = enumerate(_slabs(s, layer, float(beyond[layer.index])))
            hulls.update((f"built/{s.name}/{layer.index}/{k}", slab) for k, slab in slabs)
    return hulls


def beyond_borders(laid: LaidSubVolume, parameters: BeadParameters) -> Floats:
    """How far the beads of a sub-volume's layers reach beyond the layers' borders at most, (layers,), mm.

    Half a width where a border is a bead's centre line, and where a place is narrower than a bead. Beads whose edge
    is the border stay within, but for surfaces that cannot be unrolled, on which they may stand out.

    Args:
        laid: the beads.
        parameters: what they were laid with.
    """
    half, layers = 0.5 * parameters.width_mm, laid.sliced.layers
    if parameters.first_mm < half:
        return np.full(len(layers), half - parameters.first_mm)
    beyond = np.array([0.0 if layer.surface.is_straight else half for layer in layers])
    beyond[[bead.layer for bead in laid.beads if bead.thin]] = half
    return beyond


def _slabs(s: SlicedSubVolume, layer: Layer, beyond: float, *, few: bool = False) -> Iterator[Floats]:
    """Hull points of a layer's pieces."""
    above, down = s.layers[layer.index + 1 :][:1], s.metal_below_mm(layer.index)
    for points in _pieces(layer, beyond, few=few):
        normals = layer.surface.normals(points)
        height = np.zeros(len(points)) if down else _heights(s, layer, points, above)
        top = points + normals * (height + SIMPLIFY_MM)[:, None]
        yield np.concatenate([points - normals * (down + SIMPLIFY_MM), top])


def _heights(s: SlicedSubVolume, layer: Layer, points: Floats, above: Sequence[Layer]) -> Floats:
    """How high a layer's metal stands at points (n, 3): up to the next layer, and at least as thick as it is laid."""
    if not above:
        return np.full(len(points), max(layer.thickness_mm[1], SIMPLIFY_MM))
    height = np.maximum(-above[0].surface.distance(points), 0.0)
    # where the next layer is flatter it lies less far above the middle of this one than this one's bead is thick
    thick = np.minimum(s.thickness_at(layer.index, points), layer.thickness_mm[1])
    return np.where(thick > height + SAME_MM, thick, height)


def _pieces(layer: Layer, beyond: float, *, few: bool) -> Iterator[Floats]:
    """Outlines of a layer's nearly convex pieces, carried on beyond its borders, each (k, 3), mm."""
    yield from PIECES[type(layer.surface)](layer, layer.surface, beyond, few)


def _flat_pieces(layer: Layer, surface: Plane, beyond: float, _few: bool) -> Iterator[Floats]:
    for polygon in _polygons(layer, surface, beyond):
        for piece in _cut(polygon):
            yield surface.lifted(np.asarray(piece.exterior.coords)[:-1])


def _bowed_pieces(layer: Layer, surface: Cylinder, beyond: float, few: bool) -> Iterator[Floats]:
    """On a cylinder: as if it were unrolled, but for rings, which have no outline then."""
    if any(_winds(surface.axis_point, c.points) for c in layer.curves if c.closed):
        yield from _by_sectors(layer, surface, beyond, few)
        return
    for polygon in _polygons(layer, surface, beyond):
        for piece in _cut(polygon, np.pi * surface.radius):
            # straight in the unrolled plane is bowed in space: corners alone would cut the crown off
            bowed = piece.segmentize(2 * np.sqrt(SIMPLIFY_MM * surface.radius))
            yield surface.lifted(np.asarray(bowed.exterior.coords)[:-1])


def _by_sectors(layer: Layer, surface: Round, beyond: float, few: bool) -> Iterator[Floats]:
    yield from (_carried_on(surface, piece, beyond) for piece in sectors(layer, surface, SIMPLIFY_MM, few=few))


PIECES: dict[type, Callable[..., Iterator[Floats]]] = {
    Plane: _flat_pieces,
    Cylinder: _bowed_pieces,
    Cone: _by_sectors,
    Revolved: _by_sectors,
}


def _winds(axis_point: tuple[float, float], points: Floats) -> bool:
    angle = np.unwrap(np.arctan2(*(points[[*range(len(points)), 0], :2] - axis_point).T[::-1]))
    return bool(abs(angle[-1] - angle[0]) > np.pi)


def _carried_on(surface: Surface, points: Floats, beyond: float) -> Floats:
    """Points whose hull holds what is less than ``beyond`` from given ones, along the surface and across its normal."""
    if beyond == 0.0:
        return points
    normals = surface.normals(points)
    around = np.stack([-normals[:, 1], normals[:, 0], np.zeros(len(points))], axis=1)
    around /= np.maximum(np.linalg.norm(around, axis=1), 1e-12)[:, None]
    up = np.cross(normals, around)
    far = np.sqrt(2.0) * beyond  # a square on its corner holds the circle
    square = np.concatenate([points + far * way for way in (around, -around, up, -up)])
    off = surface.distance(square)
    if np.abs(off).max() <= SIMPLIFY_MM:
        return square
    # the surface bends away: an octagon across the normal, and one on the surface, hold the circle between them
    turns, far = np.arange(8) * np.pi / 4, beyond / np.cos(np.pi / 8)
    flat = np.concatenate([points + far * (np.cos(t) * around + np.sin(t) * up) for t in turns])
    return np.concatenate([flat, flat - surface.distance(flat)[:, None] * surface.normals(flat)])


def _polygons(layer: Layer, surface: Cylinder | Plane, beyond: float) -> Iterator[Polygon]:
    """The layer's regions in its unrolled surface, carried on beyond their borders."""
    outer = [c for c in layer.curves if c.closed and not c.hole]
    holes = [c for c in layer.curves if c.closed and c.hole]
    for curve in outer:
        flat = surface.unrolled(curve.points)
        polygon = _region(flat)
        for hole in holes:
            inner = _region(_same_turn(surface, hole.points, flat))
            if inner.area < polygon.area:  # else this is an island within the hole
                polygon = polygon.difference(inner)
        # eight chords a quarter turn, moved out to hold the circle
        polygon = polygon.buffer(beyond / np.cos(np.pi / 32), quad_segs=8).buffer(SIMPLIFY_MM, join_style="mitre")
        yield polygon.simplify(SIMPLIFY_MM)


def _region(flat: Floats) -> Any:
    """What a flat border encloses; one that crosses itself, if only by rounding, would lose corners when widened."""
    import shapely

    return only_areas(shapely.make_valid(shapely.Polygon(flat)))


def _same_turn(surface: Cylinder | Plane, points: Floats, like: Floats) -> Floats:
    """Unrolled points on the same turn as another curve's."""
    flat, turn = surface.unrolled(points), surface.turn_mm
    if turn:
        flat[:, 0] += turn * np.round((like[:, 0].mean() - flat[:, 0].mean()) / turn)
    return flat


def _cut(region: Polygon, widest: float = np.inf) -> Iterator[Polygon]:
    """Halve a region until every piece fills its hull and is no wider: more than half a turn closes about the axis."""
    import shapely

    for polygon in getattr(region, "geoms", [region]):
        if polygon.is_empty or polygon.geom_type != "Polygon":
            continue
        x0, y0, x1, y1 = polygon.bounds
        wide = x1 - x0 > widest
        filled = polygon.area >= FILLED * polygon.convex_hull.area or max(x1 - x0, y1 - y0) < SMALLEST_MM
        if filled and not wide:
            yield polygon
            continue
        xm, ym = (x0 + x1) / 2, (y0 + y1) / 2
        halves = (
            (shapely.box(x0, y0, xm, y1), shapely.box(xm, y0, x1, y1))
            if wide or x1 - x0 > y1 - y0
            else (shapely.box(x0, y0, x1, ym), shapely.box(x0, ym, x1, y1))
        )
        for half in halves:
            yield from _cut(polygon.intersection(half), widest)


Point = tuple[float, float]


def _ring(axis: tuple[float, float], point: Point, stretch: float) -> Floats:
    """Corners of a ring about the axis, (ROUND, 3)."""
    angle = 2 * np.pi * np.arange(ROUND) / ROUND
    r = max(point[0] * stretch, 1e-3)
    x, y = axis[0] + r * np.cos(angle), axis[1] + r * np.sin(angle)
    return np.stack([x, y, np.full(ROUND, point[1])], axis=1)


def _band(axis: tuple[float, float], low: Point, high: Point) -> Floats:
    """Vertices of a frustum with flat sides that covers the round one, (2 * ROUND, 3)."""
    covering = 1 / np.cos(np.pi / ROUND)
    return np.concatenate([_ring(axis, low, covering), _ring(axis, high, covering)])


def solid_of_revolution(axis: tuple[float, float], profile: Sequence[Point]) -> Mesh:
    """The profile turned about its axis, as a closed mesh.

    Args:
        axis: (x, y) of an axis parallel to z, mm.
        profile: (r, z) from end to end, mm, r above 0.
    """
    rings = [_ring(axis, point, 1.0) for point in profile]
    ends = [[*axis, profile[0][1]], [*axis, profile[-1][1]]]
    i = np.arange(ROUND)
    j = (i + 1) % ROUND
    faces = []
    for k in range(len(profile) - 1):
        a, b = k * ROUND, (k + 1) * ROUND
        faces += [np.stack([a + i, a + j, b + j], axis=1), np.stack([a + i, b + j, b + i], axis=1)]
    top, bottom = (len(profile) - 1) * ROUND, len(profile) * ROUND
    faces.append(np.stack([j, i, np.full(ROUND, bottom)], axis=1))
    faces.append(np.stack([top + i, top + j, np.full(ROUND, bottom + 1)], axis=1))
    return Mesh("body", np.concatenate([*rings, ends]), np.concatenate(faces).astype(np.int64))


def _thinned_hull(vertices: Floats) -> Floats:
    """Few points whose hull covers all the given ones: extremes in many directions, grown by what they miss."""
    if len(vertices) <= HULL_VERTICES:
        return vertices
    centre = vertices.mean(axis=0)
    # thin slabs: directions are spread in the frame in which the points are as wide every way
    spread, turn = np.linalg.eigh(np.cov((vertices - centre).T))
    scale = turn / np.sqrt(np.maximum(spread, 1e-6))
    even = (vertices - centre) @ scale
    chosen = even[np.unique(np.argmax(even @ _directions(HULL_VERTICES).T, axis=0))]
    normals, offsets = hull_planes(chosen)
    grown = chosen * max(1.0, float(((even @ normals.T).max(axis=0) / offsets).max()))
    return centre + grown @ np.linalg.inv(scale)


def _directions(count: int) -> Floats:
    """Unit vectors spread evenly over the sphere, (count, 3): a Fibonacci spiral."""
    k = np.arange(count)
    z, turn = 1 - (2 * k + 1) / count, k * np.pi * (3 - np.sqrt(5))
    return np.stack([np.cos(turn) * np.sqrt(1 - z**2), np.sin(turn) * np.sqrt(1 - z**2), z], axis=1)
