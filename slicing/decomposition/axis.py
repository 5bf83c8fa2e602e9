"""Find the axis a mesh is turned about: candidates by consensus, least squares on corners with outliers out.

1. Candidates: `slicing.decomposition.axis_candidates`, by votes of the faces that are curved round something.
2. The best are refined: the corners of all cylinders and cones about an axis are fitted at once, over the axis' place
   and tilt and each surface's radius and slope, in ever narrower strips. A corner counts the less the farther off it
   lies, and not at all where it lies outside the strip: fillets' and walls' corners drop out. The strip in which the
   most lies within the least width is kept.
3. The axis with the largest round surface wins; the next one that is another axis is its rival.

    axis = find_axis(PartFaces.of(mesh.vertices, mesh.faces, mesh.noise_mm))
    axis.to_z @ point                        # homogeneous: the axis becomes z
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..mesh.mesh_edges import neighbours
from ..mesh.solid import Floats, Ints
from ..warning import Warning
from .axis_candidates import FEW_SIDES, LEVEL, MANY_SIDES, Roundness, candidates, rotation_to_z
from .bands import HALF_FACET_RAD, LEAST_TURN, FoundBand
from .robust_line import biweights, densest
from .turned_faces import FEW_SIDES_RAD, PartFaces, find_bands, ridge_weights

__all__ = ["LEVEL", "Axis", "find_axis", "measured", "rotation_to_z"]

REFINED = 8  # candidates worth a least-squares fit
LEAST_SCORE = 0.15  # of the best candidate's score
MOST_ROUNDS = 16
ROUGH = 1e-3  # of the part's extent: a quarter of what corners may stray by about an axis that is not fitted yet
ROUGH_FACET_RAD = np.deg2rad(5.0)  # more in half a facet than of an axis that is fitted
SHRINK = 0.5
STARTING_TURN = 0.1  # share of the directions in which a surface must be seen before the axis is fitted
SEARCHED = 12  # bands examined on the way
MEASURED, MEASURED_SHARE = 24, 0.01  # bands that tell one axis from another; of the largest round one
BANDS, FITTED_SHARE = 4, 0.1  # of which so many are fitted together; of the largest round one
LEAST_CORNERS = 6
FEW_SIDES_TURN = 0.75  # of the directions: a box with its edges cut off has four sides alike, in two thirds of them
FEW_SIDES_WIN = 3.0  # times the area of what has many sides about one axis
RIVAL = 0.5  # of the area: another axis with as much is reported
SAME_AXIS_RAD, SAME_AXIS = np.deg2rad(6.0), 0.05  # of the part's reach: axes closer than this are one
LATERAL = 0.05  # cosine: faces that run along an axis
Z_FIRST = 0.98  # of the area: as good as equal


@dataclass(frozen=True, eq=False)
class Axis:
    """An axis and what is turned about it.

    Attributes:
        point: (3,) a point of the axis, mm.
        direction: (3,) unit.
        bands: cylinders and cones about it, in the frame in which it is z.
        area_mm2: of those that are long and go round.
        spread_mm: how far their corners stray from them (half the width of the strip that holds most).
        rival: another axis with a large area about it, None where there is none.
        lines: warnings about it.
        half_facet_rad: half the angle of the coarsest polygon that passes for round about it.
    """

    point: Floats
    direction: Floats
    bands: tuple[FoundBand, ...] = ()
    area_mm2: float = 0.0
    spread_mm: float = 0.0
    rival: Axis | None = None
    lines: tuple[Warning, ...] = ()
    half_facet_rad: float = HALF_FACET_RAD

    @property
    def to_z(self) -> Floats:
        """(4, 4) rigid motion that takes the axis to z, its point nearest to the origin to the origin.

        The least rotation that does so; none if the axis is parallel to z.
        """
        turn = rotation_to_z(self.direction)
        foot = self.point - (self.point @ self.direction) * self.direction
        motion = np.eye(4)
        motion[:3, :3], motion[:3, 3] = turn, -turn @ foot
        return motion

    def largest(self) -> FoundBand | None:
        """The largest cylinder, or the largest cone where there is no cylinder."""
        round_ones = [f for f in self.bands if f.is_body()]
        return max(round_ones, key=lambda f: (f.band.is_cylinder, f.band.area_mm2), default=None)


def find_axis(
    skin: PartFaces, point: Floats | None = None, direction: Floats | None = None, least_turn: float = LEAST_TURN
) -> Axis | None:
    """The axis with the largest cylinders and cones about it.

    Args:
        skin: of the part, about the origin.
        point: (3,) a point of the axis where it is known, mm.
        direction: (3,) unit, where it is known.
        least_turn: share of the directions about the axis that its surfaces must face.

    Returns:
        The axis, fitted to the mesh (near what was given), or None if nothing is turned about any.
    """
    few = replace(skin, half_facet_rad=FEW_SIDES_RAD)
    few_turn = max(least_turn, FEW_SIDES_TURN) if least_turn >= LEAST_TURN else least_turn
    if point is not None and direction is not None:
        axis = _refined(skin, Axis(point, direction), least_turn)
        axis = axis if axis.area_mm2 > 0 else _refined(few, Axis(point, direction), few_turn)
        # nothing near: the one that is there says how far off the point is
        return axis if axis.area_mm2 > 0 else find_axis(skin, None, direction, least_turn)
    found = _axes(skin, (point, direction), least_turn, MANY_SIDES)
    most = max((axis.area_mm2 for axis in found), default=0.0)
    if _few_sided_mm2(skin) > RIVAL * most:
        found = _joined(found, _axes(few, (point, direction), few_turn, FEW_SIDES), skin.extent)
    if not found:
        return None if point is None else find_axis(skin, None, direction, least_turn)
    most = max(axis.area_mm2 for axis in found)
    # as good as equal: the one nearest to z
    even = [axis for axis in found if axis.area_mm2 >= Z_FIRST * most]
    best = max(even, key=lambda a: round(abs(float(a.direction[2])), 6))
    rivals = [axis for axis in (*found, *_beside(skin, best, least_turn)) if axis is not best]
    rivals = [axis for axis in rivals if axis.area_mm2 >= RIVAL * most]
    return replace(best, rival=max(rivals, key=lambda a: a.area_mm2, default=None))


def _beside(skin: PartFaces, axis: Axis, least_turn: float) -> list[Axis]:
    """Axes parallel to another one, where the faces that are not turned about it leave room for one."""
    left = _not_about(skin, axis)
    corners = left.vertices[left.faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    size = np.sqrt((normal**2).sum(axis=1))
    upright = np.abs(normal @ axis.direction) < LATERAL * size
    if 0.5 * float(size[upright].sum()) < RIVAL * axis.area_mm2:
        return []
    return _axes(
        replace(left, faces=left.faces[upright], plane=left.plane[upright]), (None, axis.direction), least_turn
    )


def _not_about(skin: PartFaces, axis: Axis) -> PartFaces:
    """The faces that are not turned about an axis."""
    turned = [f.faces for f in axis.bands if f.is_body()]
    left = np.delete(np.arange(len(skin.faces)), np.concatenate(turned)) if turned else np.arange(len(skin.faces))
    return replace(skin, faces=skin.faces[left], plane=skin.plane[left])


def _axes(
    skin: PartFaces, hint: tuple[Floats | None, Floats | None], least_turn: float, kind: Roundness = MANY_SIDES
) -> list[Axis]:
    """Axes that have something round about them, fitted."""
    reach = skin.extent
    trials = candidates(skin.vertices, skin.faces, hint, kind)
    found: list[Axis] = []
    tried: list[Axis] = []
    for trial in trials:
        start = Axis(trial.point, trial.direction)
        if len(tried) == REFINED or trial.score < LEAST_SCORE * trials[0].score:
            break
        if any(_same(start, axis, reach) for axis in found):
            continue
        tried.append(start)
        axis = _refined(skin, start, least_turn)
        if axis.area_mm2 > 0 and not any(_same(axis, other, 0.1 * reach) for other in found):
            found.append(axis)
    return found


def _few_sided_mm2(skin: PartFaces) -> float:
    """Area of the planes that meet others as the sides of a polygon of 8 to 13 sides do."""
    corners = skin.vertices[skin.faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    size = np.sqrt((normal**2).sum(axis=1))
    a, b = neighbours(len(skin.vertices), skin.faces)
    bend = (normal[a] * normal[b]).sum(axis=1) / np.maximum(size[a] * size[b], 1e-300)
    convex = ((corners[b].mean(axis=1) - corners[a].mean(axis=1)) * (normal[a] - normal[b])).sum(axis=1) < 0
    sides = (bend < np.cos(2 * HALF_FACET_RAD)) & (bend > np.cos(2 * FEW_SIDES_RAD)) & convex
    planes = np.unique(skin.plane[np.concatenate([a[sides], b[sides]])])
    return 0.5 * float(size[np.isin(skin.plane, planes)].sum())


def _joined(fine: list[Axis], coarse: list[Axis], reach: float) -> list[Axis]:
    """Axes of surfaces of many and of few sides; about one axis the few count where they are by far the most."""
    kept = list(fine)
    for axis in coarse:
        same = [k for k, other in enumerate(kept) if _same(axis, other, 0.1 * reach)]
        if not same:
            kept.append(axis)
        elif axis.area_mm2 > FEW_SIDES_WIN * kept[same[0]].area_mm2:
            kept[same[0]] = axis
    return kept


def parallel_axis(skin: PartFaces, axis: Axis) -> Axis | None:
    """An axis beside another one and parallel to it, as a shaft's beside its eccentric disc's.

    Args:
        skin: of the part, about the origin.
        axis: the other one, found in it.

    Returns:
        The axis with the largest cylinders and cones of the faces that are not turned about the other one.
    """
    if not any(f.is_body() for f in axis.bands):
        return None
    return find_axis(_not_about(skin, axis), None, axis.direction)


def _same(a: Axis, b: Axis, reach: float) -> bool:
    """Two axes are one as far as a search goes."""
    if np.linalg.norm(np.cross(a.direction, b.direction)) > np.sin(SAME_AXIS_RAD):
        return False
    away = a.point - b.point
    return bool(np.linalg.norm(away - (away @ b.direction) * b.direction) <= SAME_AXIS * reach)


def measured(skin: PartFaces, axis: Axis, least_turn: float = LEAST_TURN) -> Axis:
    """An axis as it stands, with the largest bands about it.

    Args:
        skin: of the part.
        axis: whose bands are not known, or no longer.
        least_turn: share of the directions about the axis that its surfaces must face.

    Returns:
        The axis with its bands and their area.
    """
    bands = find_bands(skin.moved(axis.to_z), MEASURED, MEASURED_SHARE)
    area = sum(f.band.area_mm2 for f in bands if f.is_body(least_turn))
    return replace(axis, bands=tuple(bands), area_mm2=area, half_facet_rad=skin.half_facet_rad)


@dataclass(frozen=True, eq=False)
class _FacetCorners:
    """Corners of the bands about an axis: which, of which band, what they weigh; and the bands' slopes."""

    vertex: Ints
    band: Ints
    weight: Floats
    slopes: list[float]
    flat: float
    radius: float


def _corners_of(skin: PartFaces, axis: Axis, least_turn: float) -> _FacetCorners | None:
    """The corners of the largest bands that go round an axis; None where there are none."""
    found = find_bands(skin.moved(axis.to_z), SEARCHED, 0.5 * FITTED_SHARE)
    bands = [f for f in found if f.is_body(least_turn, 0.0)]
    if not bands:
        return None
    bands = [f for f in bands[:BANDS] if f.band.area_mm2 >= FITTED_SHARE * bands[0].band.area_mm2]
    parts = []
    for k, f in enumerate(bands):
        used, weight = ridge_weights(skin.faces[f.faces], skin.plane[f.faces], f.face_area)
        parts.append((used, np.full(len(used), k), weight))
    vertex, band, weight = (np.concatenate(column) for column in zip(*parts, strict=True))
    slopes = [(f.band.radius_high - f.band.radius_low) / max(f.band.length, 1e-12) for f in bands]
    flat = max(max(f.band.flat_mm, f.within_mm) for f in bands)
    return _FacetCorners(vertex, band, weight / weight.sum(), slopes, flat, max(f.band.middle_radius for f in bands))


def _refined(skin: PartFaces, axis: Axis, least_turn: float) -> Axis:
    """Robust least squares on the corners of the largest bands, over place, tilt, radii and slopes."""
    best = replace(axis, spread_mm=np.inf)
    # about an axis that is not fitted yet, facets of a coarse polygon stand askew as well
    rough = replace(
        skin, noise_mm=max(ROUGH * skin.extent, skin.noise_mm), half_facet_rad=skin.half_facet_rad + ROUGH_FACET_RAD
    )
    for seen, turn in ((rough, STARTING_TURN), (skin, least_turn)):
        corners = _corners_of(seen, best, turn)
        if corners is None:
            break
        best = _narrowed(skin.vertices, best, corners, skin.noise_mm)
    if not np.isfinite(best.spread_mm):
        return axis
    return measured(skin, best, least_turn)


def _narrowed(vertices: Floats, axis: Axis, corners: _FacetCorners, noise_mm: float) -> Axis:
    """Fit in ever narrower strips; the axis of the best of them."""
    floor = max(4 * noise_mm, 1e-7 * corners.radius)
    width = max(2 * corners.flat, 1e-3 * corners.radius, 16 * floor)
    slopes, best, most = list(corners.slopes), axis, -1.0
    for _ in range(3 * MOST_ROUNDS):
        motion = axis.to_z
        local = vertices[corners.vertex] @ motion[:3, :3].T + motion[:3, 3]
        away = np.hypot(local[:, 0], local[:, 1])
        middle = float((corners.weight * local[:, 2]).sum())
        off = np.empty(len(away))
        for k, slope in enumerate(slopes):
            mine = corners.band == k
            value = away[mine] - slope * (local[mine, 2] - middle)
            off[mine] = value - densest(value, corners.weight[mine], width)[0]
        inside = np.abs(off) <= width
        share = float(corners.weight[inside].sum())
        if share / width**0.5 > most:
            most, best = share / width**0.5, replace(axis, spread_mm=width)
        weight = corners.weight * biweights(off, width)
        if (weight > 0).sum() < LEAST_CORNERS:
            break
        step = _step(local, away, off, (weight, corners.band, len(slopes), middle))
        slopes = [slope + float(change) for slope, change in zip(slopes, step[4:], strict=True)]
        back = motion[:3, :3].T
        centre = axis.point + back[:, 2] * (middle - float((motion[:3, :3] @ axis.point)[2]))
        direction = back @ np.array([step[2], step[3], 1.0])
        axis = Axis(centre + back @ np.array([step[0], step[1], 0.0]), direction / np.linalg.norm(direction))
        moved = max(float(np.hypot(*step[:2])), float(np.hypot(*step[2:4])) * float(np.ptp(local[:, 2])))
        if moved < 0.2 * width:
            if width <= floor:
                break
            width = max(width * SHRINK, floor)
    return best


def _step(local: Floats, away: Floats, off: Floats, of: tuple[Floats, Ints, int, float]) -> Floats:
    """Weighted least-squares step (4 + bands,): shift in x, y at the middle height, tilt in x, y, and slopes."""
    weight, band, count, middle = of
    unit = local[:, :2] / np.maximum(away, 1e-300)[:, None]
    height = (local[:, 2] - middle)[:, None]
    belongs = band[:, None] == np.arange(count)
    columns = np.concatenate([unit, unit * height, belongs * height, belongs], axis=1)
    size = np.maximum(np.sqrt(np.einsum("ij,ij,i->j", columns, columns, weight)), 1e-300)
    columns = columns / size
    # few columns, normal equations; sums and not BLAS, whose threads cost more than they save
    square = np.einsum("ij,ik,i->jk", columns, columns, weight)
    solved: Floats = np.linalg.lstsq(square, np.einsum("ij,i,i->j", columns, off, weight), rcond=1e-9)[0] / size
    return solved[: 4 + count]
