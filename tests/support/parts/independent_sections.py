"""Sections of a solid by the surfaces of layers, made without the slicer: area, loops, holes.

found = section(solid, Cylinder((0, 0), 25.0), 0.01)      # of the surface 0.01 mm farther out
found.area_mm2, found.loops, found.holes

The solid (manifold3d) is cut with a body of revolution of 1024 sides, or by manifold3d's own plane. The offset of a
profile is shapely's buffer.
"""

from __future__ import annotations

import math
from collections import defaultdict
from dataclasses import dataclass

import numpy as np
import shapely
from manifold3d import CrossSection, Manifold, Mesh64

from slicing.mesh.solid import Mesh
from slicing.surfaces.surfaces import Cone, Cylinder, Plane, Revolved, Surface

SIDES = 1024
MARGIN_MM = 1.0
FAR_MM = 1e3


@dataclass(frozen=True)
class Section:
    """What a surface cuts out of a solid.

    Attributes:
        area_mm2: of the region.
        length_mm: of its border.
        loops: how many borders enclose more than the least area.
        holes: how many of these are holes; -1 where one winds about the axis.
    """

    area_mm2: float
    length_mm: float
    loops: int
    holes: int


def solid_of_mesh(mesh: Mesh) -> Manifold:
    """A mesh as a manifold3d solid."""
    return Manifold(Mesh64(np.array(mesh.vertices, order="C"), np.ascontiguousarray(mesh.faces, dtype=np.uint64)))


def section(solid: Manifold, surface: Surface, out_mm: float, least_mm2: float = 0.0) -> Section:
    """Cut a solid by a surface moved outward.

    Args:
        solid: manifold3d, part frame.
        surface: of a layer.
        out_mm: how far it is moved.
        least_mm2: loops of less do not count.

    Returns:
        The section.
    """
    if isinstance(surface, Plane):
        return _flat(solid, surface.offset(out_mm), least_mm2)
    low, high = (float(v) for v in np.asarray(solid.bounding_box()).reshape(2, 3)[:, 2])
    turned = _turned(surface, out_mm, low - MARGIN_MM, high + MARGIN_MM)
    data = (solid ^ turned).to_mesh64()
    runs = np.asarray(data.run_index, dtype=np.int64) // 3
    mine = np.repeat(np.asarray(data.run_original_id, dtype=np.int64), np.diff(runs)) == turned.original_id()
    vertices = np.asarray(data.vert_properties, dtype=np.float64)[:, :3] - [*surface.axis_point, 0.0]
    return _of_faces(vertices, np.asarray(data.tri_verts).astype(np.int64)[mine], least_mm2)


def _flat(solid: Manifold, plane: Plane, least_mm2: float) -> Section:
    u, v = plane.axes()
    turn = np.stack([u, v, np.asarray(plane.normal)])
    shift = -turn @ np.asarray(plane.point)
    cut = solid.transform(np.column_stack([turn, shift])).slice(0.0)
    loops = [shapely.LinearRing(loop) for loop in cut.to_polygons()]
    counted = [loop for loop in loops if shapely.Polygon(loop).area > least_mm2]
    holes = sum(not loop.is_ccw for loop in counted)
    return Section(cut.area(), sum(loop.length for loop in loops), len(counted), holes)


def _turned(surface: Cylinder | Cone | Revolved, out_mm: float, low: float, high: float) -> Manifold:
    """The body that a surface bounds, between two heights."""
    if isinstance(surface, Cylinder):
        outline = [(0.0, low), (surface.radius + out_mm, low), (surface.radius + out_mm, high), (0.0, high)]
    elif isinstance(surface, Cone):
        half = math.radians(surface.half_angle_deg)
        strip = shapely.box(0.0, low, 1e4, high)
        ends = [(surface.radius + out_mm / math.cos(half) + math.tan(half) * z, z) for z in (low - 1e3, high + 1e3)]
        inner = shapely.Polygon([(-1e5, low - 1e3), *ends, (-1e5, high + 1e3)])
        outline = list(inner.intersection(strip).exterior.coords)[:-1]
    else:
        profile = list(surface.profile)
        if profile[0][1] > profile[-1][1]:
            profile = profile[::-1]
        right = [*_gone_on(profile[::-1])[::-1], *profile, *_gone_on(profile)]
        body = shapely.Polygon([*right, *((-r, z) for r, z in reversed(right))]).buffer(0)
        grown = body.buffer(surface.offset_mm + out_mm, quad_segs=256)
        outline = list(grown.intersection(shapely.box(0.0, low, 1e4, high)).exterior.coords)[:-1]
    grow = 1.0 / math.sqrt(math.cos(math.pi / SIDES))  # the polygon's sides are as far out as its corners, in the mean
    if not shapely.LinearRing(outline).is_ccw:
        outline = outline[::-1]
    solid = Manifold.revolve(CrossSection([outline]), SIDES).scale((grow, grow, 1.0))
    return solid.translate((*surface.axis_point, 0.0)).as_original()


def _gone_on(profile: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """What lies beyond a profile's last point: straight on to the axis or far away; from a collar a cylinder."""
    (r0, z0), (r, z) = profile[-2:]
    if r <= 0.0:
        return []
    if z == z0:
        return [(r, z + math.copysign(FAR_MM, z - profile[0][1]))] if r > r0 else [(0.0, z)]
    steps = r / (r0 - r) if r < r0 else FAR_MM / abs(z - z0)
    return [(r + steps * (r - r0), z + steps * (z - z0))]


def _of_faces(vertices: np.ndarray, faces: np.ndarray, least_mm2: float) -> Section:
    """Area, border and loops of some faces of a mesh about the axis."""
    corners = vertices[faces]
    area = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    sides = {(int(f[k]), int(f[(k + 1) % 3])) for f in faces for k in range(3)}
    border = [(a, b) for a, b in sides if (b, a) not in sides]
    after: dict[int, list[int]] = defaultdict(list)
    for a, b in border:
        after[a].append(b)
    length, loops, holes, winding = 0.0, 0, 0, False
    while after:
        at = first = next(iter(after))
        loop = []
        while True:
            loop.append(at)
            ways = after[at]
            at_next = ways.pop()
            if not ways:
                del after[at]
            at = at_next
            if at == first:
                break
        points = vertices[[*loop, first]]
        length += float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())
        turn = np.unwrap(np.arctan2(points[:, 1], points[:, 0]))
        if abs(turn[-1] - turn[0]) > math.pi:
            loops, winding = loops + 1, True
            continue
        # on cones and profiles about right, which will do to tell slivers from loops
        r = np.hypot(points[:, 0], points[:, 1])
        along = np.append(0.0, np.cumsum(np.hypot(np.diff(r), np.diff(points[:, 2])) * np.sign(np.diff(points[:, 2]))))
        enclosed = float((r[:-1] * np.diff(turn) * 0.5 * -(along[1:] + along[:-1])).sum())
        if abs(enclosed) > least_mm2:
            loops, holes = loops + 1, holes + (enclosed < 0)
    return Section(float(area.sum()), length, loops, -1 if winding else holes)
