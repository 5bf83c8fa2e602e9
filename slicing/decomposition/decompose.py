"""One mesh of a whole part into its round body and the sub-volumes that stand on it.

    parts = decompose(load_mesh("propeller.stl"))
    parts.body.radius_mm                        # 9.7
    for mesh, body in zip(parts.sub_volumes, parts.bodies):
        slice_sub_volume(mesh, body, SlicingParameters())

The body is found as the surface of revolution with the largest cylinders (`slicing.decomposition.axis`), its outline
along the axis by `slicing.decomposition.outline`. The solid outside of that outline is cut off
(`slicing.decomposition.cut`): the borders of the cut are the concave loops of the paper, and the cut closes each
sub-volume with a cap on the body.

What counts as body: cylinders and cones about the axis, bores or not, with their steps. A ring that stands out
farther than it is long is a flange, hence a sub-volume; a lower one is a step of the body, and so is a land of the
body's own diameter between narrow grooves. `BodyHint.radius_mm` says otherwise: whatever is wider stands on the body.
What stands on an end of the body alone stays with the body. Where nothing stands on the largest round body, the next
axis is tried.

Order and names. SV1, SV2, .. by height of the centroid along the axis (heights closer than a thousandth of the part's
extent are one), then by its azimuth about the axis from +x counter-clockwise, rings first. The order depends on the
solid, not on its faces; turning the part about its axis changes only who is first among those at one height.

Source: Lettori et al. 2024, section 3.2 (sub-volumes by concave loops); Ding et al. 2016 (core and overhangs).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..mesh.face_measures import face_normals
from ..mesh.solid import Floats, Ints, Mesh, PartError, mesh_from_arrays
from ..surfaces.bodies import Body, ConicalBody, CylindricalBody, RevolvedBody
from ..warning import Code, Warning
from .axis import Axis, parallel_axis
from .bands import Band, FoundBand
from .body_hint import LEAST_SIDES, BodyHint, decomposition_frame, hinted_axis
from .cut import Cut, CutPiece, arrays_of, clearance, cut_off, solid_of
from .evidence_warnings import (
    SMALL,
    Evidence,
    coarse_bodies,
    conical,
    domed_body,
    doubtful_radius,
    evidence_of,
    full_volume,
    missing_volume,
    rings_of,
    rival_axis,
    small_body,
    turned_steps,
    what_is_left,
)
from .outline import Outline, body_outline, without_collars
from .outline_ends import carried_through
from .piece_doubts import doubtful_pieces
from .turned_faces import HINTED_TURN, PartFaces, find_bands

SAME_HEIGHT = 1e-3  # of the part's extent: centroids at one height
HINT_MM = 0.01  # how far a hint's radius may
LEAST_SEEN, SMALL_SEEN = 0.5, 0.9  # of a body's length: with less it is no body; of one that is small against the part
CARRIES = 0.1  # share of a root that makes a step count as what it stands on
DRAFT_MM = 0.5  # a cone so near its mean cylinder where a sub-volume stands: cylindrical layers begin on it


@dataclass(frozen=True, eq=False)
class Decomposition:
    """A part taken apart, in the part frame (z is parallel to the axis).

    Attributes:
        body: the cylinder that is the body: the largest one, or the hint's.
        bodies: the cylinder that each sub-volume stands on, in their order; a stepped body has several.
        cones: the cone that each stands on, None for those on cylinders.
        body_mesh: the part without its sub-volumes.
        sub_volumes: named SV1, SV2, ..; the corners of their roots lie on the body.
        outline: outline of the body about its axis, cylinders and cones, lowest first.
        T_part_input: (4, 4) rigid motion from the input's frame to the part frame, mm: the identity where the axis
            is parallel to z in the input already; else the least rotation, the axis on z, and its point nearest to
            the input's origin at the part's origin.
        warnings: one line each.
        evidence: what the body was known by.
        beside_outline: solids that stand out of the outline and are no sub-volume: on its ends, like a thread, or
            touching nothing.
    """

    body: CylindricalBody
    bodies: tuple[CylindricalBody, ...]
    cones: tuple[ConicalBody | None, ...]
    body_mesh: Mesh
    sub_volumes: tuple[Mesh, ...]
    outline: Outline
    T_part_input: Floats
    warnings: tuple[str, ...] = ()
    evidence: Evidence | None = None
    beside_outline: tuple[Mesh, ...] = ()

    def bodies_for(self, strategy: str) -> tuple[Body, ...]:
        """What each sub-volume stands on, seen as a slicing strategy needs it.

        Args:
            strategy: revolved takes the whole outline, conical and planar the cone where there is one, the others
                the cylinder.

        Returns:
            One body a sub-volume.

        Raises:
            PartError: the outline is no profile.
        """
        if strategy == "revolved":
            return (RevolvedBody(self.outline.points, self.body.axis_xy_mm),) * len(self.bodies)
        if strategy in ("conical", "planar"):
            return tuple(cone or body for cone, body in zip(self.cones, self.bodies, strict=True))
        return self.bodies


def decompose(mesh: Mesh, hint: BodyHint | None = None, alone: bool = False) -> Decomposition:
    """Find the round body of a part and cut off what stands on it.

    Args:
        mesh: the whole part, mm. Shells that overlap are united first.
        hint: what is known about the body.
        alone: whether a body on which nothing stands will do.

    Returns:
        Body and sub-volumes.

    Raises:
        PartError: no round body, nothing stands on it, a hint that does not fit, or a mesh that bounds no solid.
    """
    hint = hint or BodyHint()
    solid = solid_of(mesh.vertices, mesh.faces, mesh.name)
    vertices, faces, _ = arrays_of(solid)
    middle = 0.5 * (vertices.min(axis=0) + vertices.max(axis=0))
    skin = PartFaces.of(vertices - middle, _outer(vertices - middle, faces), mesh.noise_mm)
    axis = hinted_axis(mesh, hint, skin, middle)
    skin = replace(skin, half_facet_rad=axis.half_facet_rad)
    T_part_input, axis_xy = decomposition_frame(axis, vertices)
    # about the part's own middle: lengths are the part's, however far it lies from the origin
    into_axis = T_part_input.copy()
    into_axis[:2, 3] -= axis_xy
    heights = vertices @ into_axis[2, :3] + into_axis[2, 3]
    up = 0.5 * float(heights.min() + heights.max())
    into_axis[2, 3] -= up
    solid = solid.transform(into_axis[:3])
    bands = find_bands(replace(skin, vertices=vertices).moved(into_axis))
    bands, outline, radius = _outline(mesh, bands, hint)
    bare = outline
    outline = carried_through(solid, bare)
    if hint.radius_mm is None:
        _require_seen(mesh, bare, outline, float(solid.volume()))
    done = _cut(mesh, solid, outline, hint.radius_mm, alone)
    if isinstance(done, str):
        return _about_another(mesh, hint, axis, (skin, middle, done))
    outline, cut, reported = done
    extent = skin.extent
    pieces = [cut.pieces[k] for k in (_order([piece.centroid for piece in cut.pieces], extent) if cut.pieces else [])]
    outline = outline.lifted(up)
    roots = [_root(f"SV{k + 1}", piece, outline, up) for k, piece in enumerate(pieces)]
    area = float(np.linalg.norm(face_normals(vertices, faces), axis=1).sum()) / 2
    evidence = evidence_of(axis, bands, radius, area)
    left = what_is_left(mesh.name, cut)
    warnings = [
        *mesh.warnings,
        *doubtful_radius(mesh.name, evidence),
        *domed_body(mesh.name, outline, radius),
        *rival_axis(mesh.name, axis),
        *reported,
        *coarse_bodies(mesh.name, outline, {radius, *(root.radius for root in roots)}),
        *left,
        *missing_volume(mesh.name, float(solid.volume()), cut),
        *small_body(mesh.name, outline, float(solid.volume())),
        *doubtful_pieces(mesh.name, pieces, outline.lifted(-up), extent, hint.radius_mm is not None),
        *(line for root in roots for line in root.lines),
        *axis.lines,
    ]
    shift = np.array([*axis_xy, up])
    return Decomposition(
        CylindricalBody(radius, axis_xy),
        tuple(CylindricalBody(root.radius, axis_xy, root.off_mm) for root in roots),
        tuple(None if root.cone is None else ConicalBody(*conical(root.cone), axis_xy) for root in roots),
        _mesh(f"{mesh.name} body", cut.body, shift, mesh),
        tuple(_mesh(f"SV{k + 1}", piece, shift, mesh) for k, piece in enumerate(pieces)),
        outline,
        T_part_input,
        tuple(warnings),
        replace(evidence, left_out=(*map(str, left), *rings_of(outline))),
        _beside_outline(mesh, cut, shift),
    )


def _outer(vertices: Floats, faces: Ints) -> Ints:
    """The faces of shells that face outward: a closed cavity's walls are no body's surface."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    graph = coo_array((np.ones(len(start)), (start, end)), shape=(len(vertices), len(vertices)))
    shell = connected_components(graph, directed=False)[1][faces[:, 0]]
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    volume = np.bincount(shell, (a * np.cross(b, c)).sum(axis=1))
    return faces[volume[shell] > 0]


def _require_seen(mesh: Mesh, bare: Outline, outline: Outline, whole_mm3: float) -> None:
    """Refuse a body most of whose length is inside of what should stand on it; bare: before it was carried on."""
    seen = sum(s.length for s in bare.sections if s.area_mm2 > 0) / (outline.high - outline.low)
    least = LEAST_SEEN if full_volume(outline) >= SMALL * whole_mm3 else SMALL_SEEN
    if seen < least:
        raise PartError(
            f"{mesh.name}: no round body found; an outer cylinder or cone of at least {LEAST_SIDES} sides is needed:"
            f" the largest one, of radius {outline.widest:.6g} mm, lies open along only {100 * seen:.0f} % of its"
            f" length (part.body.radius_mm: {outline.widest:.6g} takes it for the body)"
        )


def _cut(
    mesh: Mesh, solid: Any, outline: Outline, told_mm: float | None, alone: bool
) -> tuple[Outline, Cut, list[Warning]] | str:
    """What stands on the body; where nothing does, what was taken for its steps, or nothing if that will do.

    Why not, where nothing does: no error yet, whose frames would hold solids beyond the process' end.
    """
    cut = cut_off(solid, outline, mesh.noise_mm, math.inf if told_mm is None else told_mm)
    if cut.pieces or alone:
        return outline, cut, turned_steps(mesh.name, cut)
    narrower = without_collars(outline)
    if cut.steps or narrower.sections != outline.sections:
        cut = cut_off(solid, narrower, mesh.noise_mm, 0.0)
        if cut.pieces:
            line = (
                f"{mesh.name}: nothing else stands on the round body, so its rings are taken as sub-volumes, even low"
                f" ones; part.body.radius_mm: {narrower.widest:.6g} asks for the same"
            )
            return narrower, cut, [Warning(Code.BODY_COLLAR, line)]
    radii = sorted({s.radius_low for s in outline.sections if s.is_cylinder})
    steps = (
        f"; its steps have the radii {', '.join(f'{r:g}' for r in radii)} mm: part.body.radius_mm makes whatever is"
        " wider a sub-volume"
        if len(radii) > 1
        else ""
    )
    largest = outline.dominant()
    radius = told_mm or (outline.widest if largest is None else largest.middle_radius)
    return (
        f"{mesh.name}: nothing stands on its round body (radius {radius:.6g} mm); sub-volumes on the outside of"
        f" a cylinder are needed{steps}"
    )


def _about_another(mesh: Mesh, hint: BodyHint, axis: Axis, of: tuple[PartFaces, Floats, str]) -> Decomposition:
    """A part taken apart about another axis, nothing standing on the body about the one with most about it."""
    skin, middle, bare = of
    rival = None if hint != BodyHint() else axis.rival or parallel_axis(skin, axis)
    if rival is None:
        raise PartError(bare)
    x, y, z = (rival.point + middle).tolist()
    a, b, c = rival.direction.tolist()
    try:
        found = decompose(mesh, BodyHint((x, y, z), (a, b, c)))
    except PartError:
        raise PartError(bare) from None
    line = (
        f"{mesh.name}: nothing stands on the largest round body, with {axis.area_mm2:.0f} mm² turned about its axis;"
        f" the next one, of radius {found.body.radius_mm:.6g} mm, is taken (part.body.radius_mm chooses)"
    )
    return replace(found, warnings=(*found.warnings, Warning(Code.BODY_RIVAL, line)))


def _beside_outline(mesh: Mesh, cut: Cut, shift: Floats) -> tuple[Mesh, ...]:
    """What stands out of the outline and is no sub-volume, as solids."""
    name = f"{mesh.name} beside its body"
    return tuple(mesh_from_arrays(name, corners + shift, faces, mesh.noise_mm) for corners, faces in cut.beside_outline)


def _mesh(name: str, piece: CutPiece, shift: Floats, source: Mesh) -> Mesh:
    return mesh_from_arrays(name, piece.vertices + shift, piece.faces, source.noise_mm)


def _outline(mesh: Mesh, bands: list[FoundBand], hint: BodyHint) -> tuple[list[FoundBand], Outline, float]:
    """The bands, their radii without rounding, the body's outline and its radius."""
    bands = [_tidy(f, mesh.noise_mm) for f in bands]
    if hint.radius_mm is not None:
        bands = _with_radius(mesh, bands, hint.radius_mm)
    outline = body_outline(bands, hint.radius_mm)
    largest = None if outline is None else outline.dominant()
    if outline is None or largest is None:
        raise PartError(f"{mesh.name}: no round body found; an outer cylinder or cone is needed")
    radius = largest.radius_low if largest.is_cylinder else round(largest.middle_radius, 4)
    return bands, outline, radius if hint.radius_mm is None else hint.radius_mm


def _tidy(found: FoundBand, noise_mm: float) -> FoundBand:
    """A cylinder's radius without the digits that are rounding: 9.7 and not 9.70000036."""
    if not found.band.is_cylinder:
        return found
    radius = found.band.radius_low
    step, within = 2 * clearance(noise_mm, radius), found.within_mm
    digits = math.ceil(-math.log10(step)) if within <= step else math.floor(-math.log10(within))
    tidy = round(radius, digits)
    over = found.band.over_mm + (max(radius - tidy, 0.0) if within > step else 0.0)
    return replace(found, band=replace(found.band, radius_low=tidy, radius_high=tidy, over_mm=over))


def _with_radius(mesh: Mesh, bands: list[FoundBand], radius_mm: float) -> list[FoundBand]:
    """The bands, the cylinder that the hint means brought to its radius."""
    slack = HINT_MM + 4 * mesh.noise_mm
    round_ones = [f for f in bands if f.is_round(HINTED_TURN)]
    for f in round_ones:
        radius = f.band.radius_low
        if radius - f.band.flat_mm - slack <= radius_mm <= radius + slack:
            over = max(radius - radius_mm, 0.0)
            band = replace(f.band, radius_low=radius_mm, radius_high=radius_mm, over_mm=over)
            return [replace(f, band=band), *(other for other in bands if other is not f)]
    radii = sorted({round(f.band.radius_low, 3) for f in round_ones})
    raise PartError(
        f"{mesh.name}: radius_mm {radius_mm:g} is not the radius of an outer cylinder about the part's "
        "axis; the radii are"
        f" {', '.join(f'{r:g}' for r in radii[:6])}"
    )


@dataclass(frozen=True)
class _Root:
    """What a piece stands on: the cylinder to slice it about, the cone if it is one, and what is unusual about it."""

    radius: float
    cone: Band | None
    lines: tuple[str, ...]
    off_mm: float = 0.0


def _root(name: str, piece: CutPiece, outline: Outline, up: float) -> _Root:
    """What a piece stands on: on a step the lesser radius, so that no layer is missed; on a cone the mean one."""
    corners = piece.vertices[piece.faces[piece.root]]
    area = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    height = corners[:, :, 2].mean(axis=1) + up
    share = np.bincount(outline.section_at(height), area, minlength=len(outline.sections)) / area.sum()
    carrying = [s for s, w in zip(outline.sections, share, strict=True) if w >= CARRIES]
    on_cylinders = sum(w for s, w in zip(outline.sections, share, strict=True) if s.is_cylinder)
    radii = sorted({s.radius_low for s in carrying if s.is_cylinder})
    lines, cone, off = [], None, 0.0
    if radii and on_cylinders >= 0.5:
        radius = radii[0]
        if len(radii) > 1:
            steps = ", ".join(f"{r:g}" for r in radii)
            lines.append(f"{name}: stands on a step of the body (radii {steps} mm); layers start at {radius:g} mm")
    else:
        radius = round(float((outline.radius_at(height) * area).sum() / area.sum()), 4)
        cones = [s for s in carrying if not s.is_cylinder]
        cone = cones[0] if len(cones) == 1 and not radii else None
        follow = "planar, conical and revolved" if cone else "revolved"
        feet = outline.radius_at(corners[:, :, 2] + up)
        off = float(np.abs(feet - radius).max())
        lines.append(
            f"{name}: stands on a cone; {follow} layers follow the cone, cylindrical layers follow its mean radius,"
            f" {radius:g} mm, which is up to {off:.2f} mm off the cone"
        )
        off = math.ceil(1e4 * off) / 1e4 if off <= DRAFT_MM else 0.0
    if piece.feet > 1:
        lines.append(f"{name}: stands on the body in {piece.feet} places, like a bridge; it is kept as one sub-volume")
    return _Root(radius, cone, tuple(lines), off)


def _order(centroids: list[Floats], extent: float) -> list[int]:
    """Numbers of the pieces by height, then azimuth from +x counter-clockwise."""
    groups: list[list[int]] = []
    for k in sorted(range(len(centroids)), key=lambda k: float(centroids[k][2])):
        if groups and centroids[k][2] - centroids[groups[-1][-1]][2] <= SAME_HEIGHT * extent:
            groups[-1].append(k)
        else:
            groups.append([k])

    def azimuth(k: int) -> float:
        x, y = centroids[k][:2]
        if math.hypot(x, y) <= SAME_HEIGHT * extent:
            return -1.0  # a ring
        return (math.atan2(y, x) + SAME_HEIGHT) % (2 * math.pi)  # just below +x is on +x

    return [k for group in groups for k in sorted(group, key=azimuth)]
