"""The borders of layers compared with the solid: how long they are, how many loops, and whether they enclose anything.

    lines = hold_borders("SV1", mesh, layers, cut_mm)   # one typed line for each layer that does not fit

An area says nothing of a border that encloses none: a bridge of no width between two legs, a slit, a lost loop of a
hundredth of the area. Two questions are asked of every layer:

- *What does the solid say?* The mesh, its faces made small, is cut by the layer's surface face by face, straight
  between the sides of each: lengths and number of loops follow from which faces are neighbours. None of the exact
  curves are used. A layer is reported only if its border fits no surface within REACH_MM of its own.
- *Does every border part material from what is none?* Where the region has nothing on either side of a border it is a
  bridge of no width: a bead would be laid in the air. Where it has material on both sides (solids that touch) two
  beads would run on one another; that is reported, and no more.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import singledispatch

import numpy as np

from ..curves.loops import Curve
from ..layers.layer import SLIVER_MM, Layer
from ..layers.outside_body import region_of
from ..mesh.components import components
from ..mesh.mesh_edges import edges_of_faces
from ..mesh.solid import Floats, Ints, Mesh
from ..surfaces.offsets import Offsets
from ..surfaces.surfaces import Cone, Cylinder, Plane, Surface
from ..warning import Code, Warning

LENGTH_SHARE, LENGTH_MM = 0.02, 0.5  # what a border's length may be off
SHORT_MM = 1.0  # loops up to this length are not counted
SLIVERS = 2.0  # times the width up to which layers leave loops out: those of the solid may be there or not
REACH_MM = 0.02  # how far to either side of its surface a layer may fit
SAGITTA_MM = 0.5  # by how much a face may bulge out of a layer's surface between its corners
FINER_FACES = 10.0  # how much smaller the faces where a layer seems wrong
ROOT_STEPS = 4  # of the search for where a side meets a layer's surface
LEAST_SIDE = 2e-3  # of the part's extent: faces are not made smaller than this
MOST_FACES = 150_000  # faces are not divided once there are so many
NO_WIDTH_MM = 0.002  # half the width of what has none
BESIDE_MM = 0.02  # how far beside a border it is looked whether there is material


@dataclass(frozen=True, eq=False)
class _FineMesh:
    """A mesh whose faces are small enough to be cut straight."""

    vertices: Floats
    faces: Ints


def hold_borders(name: str, mesh: Mesh, layers: Sequence[Layer], cut_mm: Sequence[float]) -> tuple[Warning, ...]:
    """Hold the borders of layers against their solid, and against the regions that they enclose.

    Args:
        name: of the sub-volume.
        mesh: what the sub-volume has outside its body.
        layers: its layers.
        cut_mm: (k,) how far outside its surface each layer's curves lie.

    Returns:
        Lines of the codes `layer_length`, `layer_loops` and `layer_seam`.
    """
    side = _largest_side(mesh, layers)
    fine = _divided(_FineMesh(mesh.vertices, mesh.faces), side)
    lines: list[Warning] = []
    for layer, at in zip(layers, cut_mm, strict=True):
        detail = _against_solid(name, fine, layer, at)
        if detail and math.isfinite(side):
            near = _divided(fine, side / FINER_FACES, layer.surface.offset(at))
            detail = _against_solid(name, near, layer, at)
        lines += detail
        lines += _against_region(name, layer)
    return tuple(lines)


def _largest_side(mesh: Mesh, layers: Sequence[Layer]) -> float:
    """How long a face's side may be: planes cut faces straight, round surfaces bulge between the corners."""
    radius = math.inf
    for layer in layers:
        for axis in layer.surface.axis_points:
            points = np.concatenate([curve.points for curve in layer.curves])
            radius = min(radius, float(np.hypot(*(points[:, :2] - axis).T).min()))
    if not math.isfinite(radius):
        return math.inf
    return max(math.sqrt(8.0 * SAGITTA_MM * radius), LEAST_SIDE * float(np.ptp(mesh.bounds, axis=0).max()))


def _divided(mesh: _FineMesh, most_mm: float, near: Surface | None = None) -> _FineMesh:
    """Faces with no side longer than most_mm, near a surface if one is given; neighbours stay neighbours."""
    vertices, faces = mesh.vertices, mesh.faces
    while math.isfinite(most_mm) and len(faces) < MOST_FACES:
        edges, of_side = edges_of_faces(len(vertices), faces)
        a, b = vertices[edges[:, 0]], vertices[edges[:, 1]]
        length = np.sqrt(((b - a) ** 2).sum(axis=1))
        long = length > most_mm
        if near is not None:
            height = np.abs(near.distance(vertices))
            long &= np.minimum(height[edges[:, 0]], height[edges[:, 1]]) < length + REACH_MM
        if not long.any():
            break
        number = len(vertices) + np.cumsum(long) - 1
        vertices = np.concatenate([vertices, 0.5 * (a[long] + b[long])])
        faces = _halved(faces, np.where(long, number, -1)[of_side])
    return _FineMesh(vertices, faces)


def _halved(faces: Ints, middle: Ints) -> Ints:
    """Faces divided at the middles (m, 3) of their sides, -1 where a side stays whole."""
    count = (middle >= 0).sum(axis=1)
    rows = np.arange(len(faces))
    # turned so that the first side is divided, and of two divided ones the last side is whole
    turned = np.where(count == 2, np.argmin(middle, axis=1) + 1, np.argmax(middle >= 0, axis=1))
    a, b, c = (faces[rows, (turned + k) % 3] for k in range(3))
    ab, bc, ca = (middle[rows, (turned + k) % 3] for k in range(3))
    one, two, three = (np.flatnonzero(count == k) for k in (1, 2, 3))
    parts = [faces[count == 0]]
    parts += [np.stack(corners, axis=1)[one] for corners in ((a, ab, c), (ab, b, c))]
    parts += [np.stack(corners, axis=1)[two] for corners in ((ab, b, bc), (a, ab, c), (ab, bc, c))]
    parts += [np.stack(corners, axis=1)[three] for corners in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))]
    return np.concatenate(parts)


def section_loops(vertices: Floats, faces: Ints, surface: Surface) -> tuple[Floats, Floats]:
    """The loops in which faces meet a surface, straight from side to side of each face.

    Args:
        vertices: (n, 3) mm.
        faces: (m, 3) of a closed mesh, so small that none meets the surface without a corner on either side of it.
        surface: the surface.

    Returns:
        Lengths (k,) and mean widths (k,) of the loops, mm. A width follows from the area that the loop encloses seen
        along the direction in which that is greatest: it is none that is too great.
    """
    height = surface.distance(vertices)
    above = (height > 0.0)[faces]
    count = above.sum(axis=1)
    rows = np.flatnonzero((count == 1) | (count == 2))
    if len(rows) == 0:
        return np.zeros(0), np.zeros(0)
    alone: Ints = np.argmax(above[rows] == (count[rows] == 1)[:, None], axis=1).astype(np.int64)
    corner = [faces[rows, (alone + k) % 3] for k in range(3)]
    keys = [np.minimum(corner[0], o) * len(vertices) + np.maximum(corner[0], o) for o in corner[1:]]
    nodes, node = np.unique(np.concatenate(keys), return_inverse=True)
    lower, higher = nodes // len(vertices), nodes % len(vertices)
    places = _crossings(vertices[lower], vertices[higher], height[lower], height[higher], surface)
    one, other = node[: len(rows)], node[len(rows) :]
    loops, label = components(len(nodes), one, other)
    length = _summed(label[one], np.sqrt(((places[other] - places[one]) ** 2).sum(axis=1)), loops)
    way = np.where(count[rows] == 1, 1.0, -1.0)[:, None]  # along the loop, whichever side of the surface is cut off
    twice = way * np.cross(places[one] - vertices[0], places[other] - vertices[0])
    area = np.sqrt(sum(_summed(label[one], twice[:, k], loops) ** 2 for k in range(3)))
    return length, area / np.maximum(length, 1e-12)


def _summed(label: Ints, values: Floats, count: int) -> Floats:
    """Sums (count,) of the values of each label."""
    return np.asarray(np.bincount(label, weights=values, minlength=count), dtype=np.float64)


def _crossings(a: Floats, b: Floats, height_a: Floats, height_b: Floats, surface: Surface) -> Floats:
    """Where the sides from a to b (n, 3), whose ends lie on either side of a surface, meet it."""
    low, high, share = np.zeros(len(a)), np.ones(len(a)), height_a / (height_a - height_b)
    at_low, at_high = height_a, height_b
    for _ in range(0 if surface.is_flat else ROOT_STEPS):
        at = surface.distance(a + share[:, None] * (b - a))
        same = (at > 0.0) == (at_low > 0.0)
        low, at_low = np.where(same, share, low), np.where(same, at, at_low)
        high, at_high = np.where(same, high, share), np.where(same, at_high, at)
        width = np.where(at_low == at_high, 1.0, at_low - at_high)
        share = low + np.clip(at_low / width, 0.0, 1.0) * (high - low)
    found: Floats = a + share[:, None] * (b - a)
    return found


def reaches(layer: Layer) -> tuple[float, ...]:
    """How far from its surface a layer may fit, of REACH_MM; the first one on a body outward only: below it is nothing.

    Args:
        layer: the layer.
    """
    return (0.1, 1.0) if layer.on_body else (-0.1, 0.1, -1.0, 1.0)


def _against_solid(name: str, fine: _FineMesh, layer: Layer, cut_mm: float) -> list[Warning]:
    """Lines if the length or the number of a layer's loops fits no section of the solid near its surface."""
    own = np.array([curve.length_mm for curve in layer.curves])
    total, count = float(own.sum()), int((own > SHORT_MM).sum())
    lengths, counts = [], []
    for by in (0.0, *reaches(layer)):
        found, width = section_loops(fine.vertices, fine.faces, layer.surface.offset(cut_mm + by * REACH_MM))
        wide = found[width > SLIVERS * SLIVER_MM]  # of what is narrower layers hold some, and leave the rest out
        lengths += [float(found.sum()), float(wide.sum())]
        counts.append((int((wide > 1.5 * SHORT_MM).sum()), int((found > SHORT_MM / 1.5).sum())))
        slack = LENGTH_SHARE * max(total, *lengths[-2:]) + LENGTH_MM
        long_enough = min(lengths) - slack <= total <= max(lengths) + slack
        as_many = min(low for low, _ in counts) <= count <= max(high for _, high in counts)
        if long_enough and as_many:
            return []
    where = f"{name}: layer {layer.index}"
    detail = []
    if not long_enough:
        detail.append(
            (Code.LAYER_LENGTH, f"its borders are {total:.1f} mm long, the solid's section has {lengths[0]:.1f} mm")
        )
    if not as_many:
        detail.append((Code.LAYER_LOOPS, f"it has {count} loops, the solid's section has {counts[0][0]}"))
    return [
        Warning(code, f"{where}: {text}: the layer is wrong", sub_volume=name, layer=layer.index)
        for code, text in detail
    ]


def _against_region(name: str, layer: Layer) -> list[Warning]:
    """Lines if borders of a layer run along one another, with nothing or with material on both sides."""
    import shapely

    curves = [curve for curve in layer.curves if curve.closed]
    flat = _flat(layer.surface, curves)
    if flat is None or not flat:
        return []
    lines = shapely.MultiLineString([np.concatenate([loop, loop[:1]]) for loop in flat])
    region = region_of(flat)
    opened = region.buffer(-NO_WIDTH_MM, join_style="mitre").buffer(2.0 * NO_WIDTH_MM, join_style="mitre")
    filled = region.buffer(NO_WIDTH_MM, join_style="mitre").buffer(-BESIDE_MM, join_style="mitre")
    bridge, inside = float(lines.difference(opened).length), float(lines.intersection(filled).length)
    where, most = f"{name}: layer {layer.index}", LENGTH_SHARE * lines.length + LENGTH_MM
    found: list[Warning] = []
    if bridge > most:
        detail = f"{bridge:.1f} of {lines.length:.1f} mm of its borders enclose nothing (a bridge of no width)"
        found.append(
            Warning(Code.LAYER_LENGTH, f"{where}: {detail}: the layer is wrong", sub_volume=name, layer=layer.index)
        )
    if inside > most:
        detail = f"{inside:.1f} of {lines.length:.1f} mm of its borders run within its material (solids that touch)"
        found.append(Warning(Code.LAYER_SEAM, f"{where}: {detail}", sub_volume=name, layer=layer.index))
    return found


@singledispatch
def _flat(surface: Offsets, curves: Sequence[Curve]) -> list[Floats] | None:
    """Loops (n, 2) in one plane, lengths as on the surface or nearly so; None where they cannot be laid there."""
    return None


@_flat.register(Plane)
def _(surface: Plane, curves: Sequence[Curve]) -> list[Floats] | None:
    return [surface.unrolled(curve.points) for curve in curves]


@_flat.register(Cylinder)
@_flat.register(Cone)
def _(surface: Cylinder | Cone, curves: Sequence[Curve]) -> list[Floats] | None:
    """As on a cylinder; not where they go right round the axis."""
    if any(curve.winding for curve in curves) or not curves:
        return None
    x, y = surface.axis_point
    angles = [np.arctan2(curve.points[:, 1] - y, curve.points[:, 0] - x) for curve in curves]
    every = np.sort(np.concatenate(angles))
    gap = np.diff(np.append(every, every[0] + 2 * math.pi))
    step = max(float(np.abs(np.diff(np.unwrap(a), append=np.unwrap(a)[:1])).max()) for a in angles)
    widest = int(np.argmax(gap))
    if gap[widest] <= 1.001 * step:
        return None  # no meridian that no loop passes
    begin = every[(widest + 1) % len(every)] - 1e-9
    radius = float(np.hypot(*(curves[0].points[:, :2] - [x, y]).T).mean())
    along = math.hypot(1.0, surface.slope)
    return [
        np.stack([radius * ((a - begin) % (2 * math.pi)), along * curve.points[:, 2]], axis=1)
        for a, curve in zip(angles, curves, strict=True)
    ]
