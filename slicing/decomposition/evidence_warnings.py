"""What a decomposition found compared with the mesh it was made of: what is doubtful is a typed warning.

Use:

    lines = missing_volume("propeller", whole_mm3, cut)      # [] where nothing is
    evidence.line                                            # "body: cylinder of radius 20 mm; 41.2 % of .."
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..arrays import Floats
from ..mesh.face_measures import enclosed_volume, face_normals
from ..warning import Code, Warning
from .axis import Axis
from .bands import Band, FoundBand
from .cut import Cut, CutPiece
from .outline import Outline, hills

VISIBLE_MM = 0.1  # a polygon's flats farther inside the cylinder than this are worth a warning
MISSING = 2e-4  # of the whole volume: what does not add up
SMALL = 0.15  # of the part's volume: a body this small may be a boss
ROUGH = 12  # slivers: so many are no accident
DOME, DOME_RAD, SMOOTH_RAD = 0.25, np.deg2rad(30.0), np.deg2rad(20.0)  # short, of the radius; a dome bends so; by steps
LEAST_SHARE, STRAYING = 0.25, 2e-3  # of the corners that lie on a body's surface; of its radius, how far they stray


@dataclass(frozen=True)
class Evidence:
    """What a body was known by.

    Attributes:
        kind: cylinder or cone.
        radius_mm: of the cylinder; of a cone the mean one.
        half_angle_deg: of the cone, 0 of a cylinder.
        axis_point_mm: (x, y, z) of the axis, input frame.
        axis_direction: of the axis, input frame.
        axis_share: of the part's surface, how much is turned about the axis and looks outward.
        share: of the part's surface, how much lies on that cylinder or cone.
        within_mm: how close the corners of its faces lie to it.
        corner_share: how much of the faces taken for it at first lies that close.
        directions: share of the directions about the axis in which it is there.
        left_out: what was not made a sub-volume, one line each.
    """

    kind: str
    radius_mm: float
    half_angle_deg: float
    axis_point_mm: tuple[float, float, float]
    axis_direction: tuple[float, float, float]
    axis_share: float
    share: float
    within_mm: float
    corner_share: float
    directions: float
    left_out: tuple[str, ...] = ()

    @property
    def line(self) -> str:
        """In words."""
        cone = f", half angle {self.half_angle_deg:.3g}°" if self.half_angle_deg else ""
        return (
            f"{self.kind} of radius {self.radius_mm:.6g} mm{cone}; {100 * self.share:.1f} % of the part's surface is on"
            f" it (within {max(self.within_mm, 0.001):.2g} mm, {100 * self.directions:.0f} % of the way round);"
            f" {100 * self.axis_share:.1f} % is turned about its axis"
        )

    def document(self) -> dict[str, object]:
        """As it stands in a JSON document."""
        return {
            "kind": self.kind,
            "radius_mm": self.radius_mm,
            "half_angle_deg": self.half_angle_deg,
            "axis_point_mm": list(self.axis_point_mm),
            "axis_direction": list(self.axis_direction),
            "axis_share": round(self.axis_share, 6),
            "share": round(self.share, 6),
            "within_mm": self.within_mm,
            "corner_share": round(self.corner_share, 6),
            "directions": round(self.directions, 6),
            "left_out": list(self.left_out),
        }


def frame_line(T_part_input: Floats) -> str:
    """In words, how a part was moved from its input's frame; empty where it was not.

    Args:
        T_part_input: (4, 4) from the input's frame to the part frame, mm.

    Returns:
        One line, or "".
    """
    if (T_part_input == np.eye(4)).all():
        return ""
    up = ", ".join(f"{v:.6g}" for v in np.round(T_part_input[2, :3], 9) + 0.0)
    origin = ", ".join(f"{v:.6g}" for v in np.round(-T_part_input[:3, :3].T @ T_part_input[:3, 3], 6) + 0.0)
    turn = math.degrees(math.acos(min(max(0.5 * (float(np.trace(T_part_input[:3, :3])) - 1.0), -1.0), 1.0)))
    return (
        f"the part was turned by {turn:.6g}° so that its axis is z: in the input's frame the part frame's "
        f"z is ({up}) and"
        f" its origin ({origin}) mm"
    )


def evidence_of(axis: Axis, bands: Sequence[FoundBand], radius_mm: float, area_mm2: float) -> Evidence:
    """What the body of a radius was known by.

    Args:
        axis: found, input frame.
        bands: about it.
        radius_mm: of the body.
        area_mm2: of the whole part's surface.

    Returns:
        The evidence.
    """
    turned = [f for f in bands if f.goes_round(0.2)]
    f = min(turned, key=lambda f: (abs(f.band.middle_radius - radius_mm) > 1e-6 * radius_mm, -f.band.area_mm2))
    rise = (f.band.radius_high - f.band.radius_low) / max(f.band.length, 1e-12)
    return Evidence(
        "cylinder" if f.band.is_cylinder else "cone",
        radius_mm,
        math.degrees(math.atan(rise)),
        _three(axis.point - (axis.point @ axis.direction) * axis.direction),
        _three(axis.direction),
        sum(f.band.area_mm2 for f in turned) / area_mm2,
        f.band.area_mm2 / area_mm2,
        float(f"{f.within_mm:.3g}"),
        f.share,
        f.turn,
    )


def _three(vector: Floats) -> tuple[float, float, float]:
    x, y, z = (round(float(v), 9) for v in vector)
    return x, y, z


def doubtful_radius(name: str, evidence: Evidence) -> list[Warning]:
    """A line where few corners lie on the body's surface, or not close to it."""
    stray = evidence.within_mm > STRAYING * evidence.radius_mm
    if evidence.corner_share >= LEAST_SHARE and not stray:
        return []
    only = "only " if evidence.corner_share < LEAST_SHARE else ""  # else they lie far off it
    return [
        Warning(
            Code.BODY_RADIUS,
            f"{name}: the body's radius {evidence.radius_mm:.6g} mm is uncertain: {only}"
            f"{100 * evidence.corner_share:.0f} % of the corners there lie on it, within {evidence.within_mm:.2g} mm"
            " (part.body.radius_mm sets it)",
        )
    ]


def domed_body(name: str, outline: Outline, radius_mm: float) -> list[Warning]:
    """A line where the body's cylinder is a short stretch of a ball or a dome, whose axis may be any."""
    sections = [s for s in outline.sections if s.area_mm2 > 0]
    for k, section in enumerate(sections):
        if not section.is_cylinder or section.radius_low != radius_mm or section.length >= DOME * radius_mm:
            continue
        if all(_bends(sections[k::way]) >= DOME_RAD for way in (1, -1)):
            text = (
                f"{name}: the body's radius {radius_mm:.6g} mm is uncertain: it was measured on"
                f" {section.length:.3g} mm of a ball or a dome (part.body sets axis and radius)"
            )
            return [Warning(Code.BODY_RADIUS, text)]
    return []


def _bends(sections: Sequence[Band]) -> float:
    """By how much an outline bends on smoothly from its first section, rad."""
    angle = [math.atan2(s.radius_high - s.radius_low, max(s.length, 1e-12)) for s in sections]
    steps = np.abs(np.diff(angle))
    smooth = int(np.argmax(np.append(steps, np.inf) > SMOOTH_RAD))
    return abs(angle[smooth] - angle[0])


def rival_axis(name: str, axis: Axis) -> list[Warning]:
    """A line where another axis has nearly as much turned about it."""
    rival = axis.rival
    largest = None if rival is None else rival.largest()
    if rival is None or largest is None:
        return []
    direction = ", ".join(f"{v:.4g}" for v in np.round(rival.direction, 5) + 0.0)
    return [
        Warning(
            Code.BODY_RIVAL,
            f"{name}: another round body may be meant: radius {largest.band.middle_radius:.6g} mm about an axis along"
            f" ({direction}), with {rival.area_mm2:.0f} mm² turned about it against {axis.area_mm2:.0f} mm²; the larger"
            " one is taken (to choose, turn the axis to z and set part.body.radius_mm)",
        )
    ]


def coarse_bodies(name: str, outline: Outline, radii: set[float]) -> list[Warning]:
    """A line for each cylinder in use that is visibly a polygon."""
    flats = {
        s.radius_low: s.flat_mm
        for s in outline.sections
        if s.is_cylinder and s.radius_low in radii and s.flat_mm > VISIBLE_MM
    }
    return [
        Warning(
            Code.BODY_POLYGON,
            f"{name}: the body of radius {radius:.6g} mm is a polygon of about"
            f" {round(math.pi / math.acos(1 - flat / radius))} sides, whose flats lie {flat:.2f} mm inside the"
            " cylinder; sub-volumes begin on the cylinder",
        )
        for radius, flat in sorted(flats.items())
    ]


def what_is_left(name: str, cut: Cut) -> list[Warning]:
    """Lines about what was not made a sub-volume."""
    lines = []
    if cut.on_ends:
        volume = sum(left.volume_mm3 for left in cut.on_ends)
        lines.append(
            Warning(
                Code.LEFT_ON_ENDS,
                f"{name}: {volume:.0f} mm³ stand only on the body's ends or steps; they are left with the body",
            )
        )
    for left in cut.floating:
        lines.append(
            Warning(
                Code.FLOATING_PIECE,
                f"{name}: a piece of {left.volume_mm3:.0f} mm³ touches nothing and is {left.gap_mm:.3f} mm "
                "off the body;"
                " it is not sliced, and counts as part of the body, there from the start",
            )
        )
    seen = [sliver for sliver in cut.slivers if sliver.height_mm > 1e-3]
    if seen:
        most, volume = max(s.height_mm for s in seen), sum(s.volume_mm3 for s in seen)
        if len(seen) >= ROUGH:
            lines.append(
                Warning(
                    Code.BODY_RADIUS,
                    f"{name}: the body's surface is not made of cylinders and cones (a ball of scattered faces is"
                    f" not): {len(seen)} slivers stand out of those that were found, and a sub-volume may "
                    "be among them",
                )
            )
        lines.append(
            Warning(
                Code.SLIVERS,
                f"{name}: {len(seen)} slivers left out (at most {most:.3f} mm high, {volume:.3g} mm³ together)",
            )
        )
    return lines


def turned_steps(name: str, cut: Cut) -> list[Warning]:
    """A line about what goes round the body like a thread and was left with it."""
    if not cut.steps:
        return []
    most, volume = max(s.height_mm for s in cut.steps), sum(s.volume_mm3 for s in cut.steps)
    many = f"{len(cut.steps)} ridges go" if len(cut.steps) > 1 else "a ridge goes"
    return [
        Warning(
            Code.BODY_STEP,
            f"{name}: {many} right round the body, up to {most:.3g} mm high and wider than high, {volume:.4g} mm³"
            " together, like a thread or a turned step: left with the body (part.body.radius_mm makes "
            "whatever is wider"
            " a sub-volume)",
        )
    ]


def volume_of(piece: CutPiece) -> float:
    """Volume of a closed piece, mm³."""
    return enclosed_volume(piece.vertices, piece.faces, face_normals(piece.vertices, piece.faces))


def missing_volume(name: str, whole_mm3: float, cut: Cut) -> list[Warning]:
    """A line where body and sub-volumes do not add up to the part."""
    parts = volume_of(cut.body) + sum(volume_of(piece) for piece in cut.pieces)
    if abs(whole_mm3 - parts) <= MISSING * whole_mm3:
        return []
    return [
        Warning(
            Code.BODY_VOLUME,
            f"{name}: body and sub-volumes together have {parts:.6g} mm³, the part {whole_mm3:.6g} mm³:"
            f" {whole_mm3 - parts:+.4g} mm³ are {'missing' if parts < whole_mm3 else 'too much'}",
        )
    ]


def full_volume(outline: Outline) -> float:
    """Volume of a body without its bores, mm³."""
    return sum(
        math.pi / 3 * s.length * (s.radius_low**2 + s.radius_low * s.radius_high + s.radius_high**2)
        for s in outline.sections
    )


def small_body(name: str, outline: Outline, whole_mm3: float) -> list[Warning]:
    """A line where the body, without its bores, is a small part of the whole."""
    full = full_volume(outline)
    if full >= SMALL * whole_mm3:
        return []
    return [
        Warning(
            Code.BODY_SMALL,
            f"{name}: the body, radius {outline.widest:.6g} mm, is {100 * full / whole_mm3:.0f} % of the part's volume;"
            " if another body is meant, set part.body.radius_mm or give the sub-volumes as meshes of their own",
        )
    ]


def rings_of(outline: Outline) -> list[str]:
    """A line for each ring of the body that could be a sub-volume."""
    return [
        f"a ring of radius {hill.top:.6g} mm, z {hill.low:.6g} .. {hill.high:.6g} mm, is taken as a step of the body;"
        f" part.body.radius_mm: {hill.base:.6g} makes it a sub-volume"
        for hill in hills(outline.sections)
        if hill.between and hill.top - hill.base > 0.02 * hill.base
    ]


def conical(cone: Band) -> tuple[float, float]:
    """Radius at z = 0 and half angle, degrees, of a cone."""
    rise = (cone.radius_high - cone.radius_low) / cone.length
    return float(cone.radius_at(np.array(0.0))), math.degrees(math.atan(rise))
