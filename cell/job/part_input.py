"""The part as its case gives it: in one mesh that is taken apart, or as sub-volumes on a given body.

    part = read_part(case)
    for mesh, body in zip(part.meshes, part.bodies): ...

The part frame is that of the meshes, with z along the body's axis; a mesh whose axis lies elsewhere is turned.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ik.chain import Floats
from slicing import (
    BODY_NAME,
    STRATEGIES,
    Body,
    Code,
    ConicalBody,
    CylindricalBody,
    Mesh,
    PartError,
    RevolvedBody,
    Warning,
    fits,
    load_mesh,
    low_part_warnings,
    turned_solid,
)

from ..case.files import require_part_files
from ..case.part_sections import BodySection
from ..case.sections import Case
from ..errors import InputError
from ..progress import phase

if TYPE_CHECKING:
    from slicing import Evidence

OFF_PLATE_MM = 0.5  # a body printed this far above or below the plate gets a warning


@dataclass(frozen=True, eq=False)
class PartInput:
    """What is to be sliced.

    Attributes:
        meshes: the sub-volumes, part frame, mm.
        bodies: what each of them stands on, as the case's strategy sees it.
        body_mesh: the body's own shape, to look at; None where it has no mesh.
        profile: the body as (r, z) points about its axis, mm, lowest first, which collides; None where the hull of
            body_mesh does.
        warnings: one line each.
        others: the same for every strategy that is made for what they stand on.
        body_solid: the body as a solid to be sliced; None where it is there from the start.
        T_part_input: (4, 4) rigid motion from the input's frame to the part frame, mm; the identity where it is
            not moved.
        evidence: what the body of a part in one mesh was known by.
        round_body: its surface.
        built: sub-volumes that are there from the start, with what they stand on.
        beside_profile: solids that are there from the start beside what the profile holds.
    """

    meshes: tuple[Mesh, ...]
    bodies: tuple[Body, ...]
    body_mesh: Mesh | None
    profile: tuple[tuple[float, float], ...] | None
    warnings: tuple[str, ...] = ()
    others: dict[str, tuple[Body, ...]] = field(default_factory=dict)
    body_solid: Mesh | None = None
    T_part_input: Floats = field(default_factory=lambda: np.eye(4))
    evidence: Evidence | None = None
    round_body: Body | None = None
    built: tuple[tuple[Mesh, Body], ...] = ()
    beside_profile: tuple[Mesh, ...] = ()


def found_lines(T_part_input: Floats, evidence: Evidence | None) -> tuple[str, ...]:
    """The report's lines about the body that was found and about the part's rotation."""
    body = () if evidence is None else (f"body: {evidence.line}",)
    if evidence is None and np.array_equal(T_part_input, np.eye(4)):
        return ()
    from slicing import frame_line

    frame = frame_line(T_part_input)
    return (*body, *((f"frame: {frame}",) if frame else ()))


def found_document(T_part_input: Floats, evidence: Evidence | None) -> dict[str, Any]:
    """The same as it stands in a JSON document: keys `T_part_input` and `body`."""
    return {
        "T_part_input": [[float(v) for v in row] for row in T_part_input.tolist()],
        "body": None if evidence is None else evidence.document(),
    }


@phase("reading the part")
def read_part(case: Case) -> PartInput:
    """Load a case's meshes, and take the part apart if it comes in one.

    Args:
        case: the case.

    Returns:
        The part; of its sub-volumes those that the case takes.

    Raises:
        InputError: a mesh is missing or cannot be used, or a sub-volume is taken that is not there; one line.
    """
    if case.part.absent:
        raise InputError(
            f"{case.path}: part: none: there is nothing to build; such a case goes with rbam check --program"
        )
    if case.part.toolpath is not None:
        raise InputError(f"{case.path}: part.toolpath: its beads are laid already; there is nothing to slice")
    require_part_files(case)
    meshes: list[Mesh] = []
    try:
        found = _whole(case, meshes) if case.part.mesh is not None else _pieces(case, meshes)
        if case.slicing.body is not None:
            found = _with_body(case, found)
    except PartError as error:
        # what looked odd about the meshes, a wrong unit above all, is often why
        hints = "".join(f"; {line}" for mesh in meshes for line in mesh.warnings)
        raise InputError(f"{error}{hints}") from None
    return _taken(case, found)


def read_body(case: Case, z_mm: tuple[float, float], laid: Sequence[str] = ()) -> PartInput:
    """The body alone, which beads that are laid elsewhere lie on, with the sub-volumes that are built already.

    Args:
        case: the case.
        z_mm: where it ends where neither the case nor a mesh says so.
        laid: names of the sub-volumes that the beads are of.

    Returns:
        The part, without sub-volumes that are to be built. Those that are neither laid nor built are reported as absent
        where the beads, or part.take, have some of the sub-volumes' names.

    Raises:
        InputError: the body is not given, or a mesh cannot be used; one line.
    """
    part = case.part
    try:
        if part.mesh is not None or part.built:
            found = _whole(case, []) if part.mesh is not None else _pieces(case, [])
            return _beside_toolpath(case, found, laid)
        if part.body is None:
            raise InputError(f"{case.path}: part.body: needs radius_mm, the radius of the cylinder they stand on")
        body = _body_of_case(part.body)
        left_out = _left_out(case, [f"SV{i + 1}" for i in range(len(part.sub_volumes))], laid)
        if part.body.mesh is not None:
            own = load_mesh(case.path_of(part.body.mesh), part.units, "body")
            return PartInput((), (), own, None, (*own.warnings, *left_out), round_body=body)
        ends = z_mm if part.body.z_mm is None else part.body.z_mm
        return PartInput((), (), None, _profile(body, ends, []), left_out, round_body=body)
    except PartError as error:
        raise InputError(str(error)) from None


def _pieces(case: Case, loaded: list[Mesh]) -> PartInput:
    part = case.part
    if part.body is None:
        raise InputError(f"{case.path}: part.body: needs radius_mm, the radius of the cylinder they stand on")
    for i, name in enumerate(part.sub_volumes):
        loaded.append(load_mesh(case.path_of(name), part.units, f"SV{i + 1}"))
    body = _body_of_case(part.body)
    bodies: tuple[Body, ...] = (body,) * len(loaded)
    others = {strategy: bodies for strategy in STRATEGIES if fits(strategy, body)}
    if part.body.mesh is not None:
        own = load_mesh(case.path_of(part.body.mesh), part.units, "body")
        return PartInput(tuple(loaded), bodies, own, None, own.warnings, others, round_body=body)
    if not loaded and part.body.profile_mm is None and part.body.z_mm is None:
        raise InputError(f"{case.path}: part.body.z_mm: needed of a body alone, its lower and upper end")
    profile = _profile(body, part.body.z_mm, loaded)
    return PartInput(tuple(loaded), bodies, None, profile, others=others, round_body=body)


def _body_of_case(body: BodySection) -> Body:
    """The body that a case gives; keys that end in _mm are mm, whatever units the meshes are in."""
    if body.profile_mm is not None:
        return RevolvedBody(tuple(body.profile_mm), body.axis_xy_mm)
    if body.half_angle_deg is not None:
        return ConicalBody(body.radius_mm or 0.0, body.half_angle_deg, body.axis_xy_mm)
    return CylindricalBody(body.radius_mm or 0.0, body.axis_xy_mm)


def _profile(body: Body, z_mm: tuple[float, float] | None, meshes: Sequence[Mesh]) -> tuple[tuple[float, float], ...]:
    """A body's (r, z) points; its ends are the sub-volumes' where the case does not say."""
    if isinstance(body, RevolvedBody):
        points = body.profile_mm
        return points if points[0][1] <= points[-1][1] else points[::-1]
    if z_mm is None:
        heights = np.array([mesh.bounds[:, 2] for mesh in meshes])
        z_mm = float(heights.min()), float(heights.max())
    slope = np.tan(np.deg2rad(body.half_angle_deg)) if isinstance(body, ConicalBody) else 0.0
    return tuple((max(float(body.radius_mm + slope * z), 0.0), z) for z in z_mm)


def _whole(case: Case, loaded: list[Mesh]) -> PartInput:
    from slicing import BodyHint, decompose

    part = case.part
    mesh = load_mesh(case.path_of(str(part.mesh)), part.units)
    low = low_part_warnings(mesh, part.units, case.slicing.h_layer_mm)
    loaded.append(replace(mesh, warnings=(*mesh.warnings, *low)))
    hint = None
    if part.body is not None:
        if part.body.half_angle_deg is not None or part.body.profile_mm is not None:
            raise InputError(f"{case.path}: part.body: with part.mesh only radius_mm and axis_xy_mm are allowed")
        hint = BodyHint((*part.body.axis_xy_mm, 0.0), (0.0, 0.0, 1.0), part.body.radius_mm)
    found = decompose(loaded[0], hint, alone=case.slicing.body is not None)
    bodies = found.bodies_for(case.slicing.strategy)
    others = {strategy: found.bodies_for(strategy) for strategy in STRATEGIES}
    return PartInput(
        found.sub_volumes,
        bodies,
        found.body_mesh,
        found.outline.points,
        found.warnings,
        others,
        T_part_input=found.T_part_input,
        evidence=found.evidence,
        round_body=found.body if not bodies else bodies[0],
        beside_profile=found.beside_outline,
    )


def _with_body(case: Case, found: PartInput) -> PartInput:
    """The part with its body as a solid to be printed as well."""
    assert found.round_body is not None
    solid, body, warnings = found.body_mesh, found.bodies[0] if found.bodies else found.round_body, found.warnings
    if solid is None:
        profile = found.profile or ()
        solid = turned_solid(profile, body.axis_xy_mm, case.slicing.tolerance_mm)
        if case.part.body is not None and case.part.body.profile_mm is None and case.part.body.z_mm is None:
            ends = f"{profile[0][1]:g} .. {profile[-1][1]:g}"
            warnings += (
                f"{BODY_NAME}: part.body.z_mm is not given; the body ends where its sub-volumes end, z = {ends} mm",
            )
    gap = float(solid.bounds[0, 2]) + case.part.position_mm[2]
    if abs(gap) > OFF_PLATE_MM:
        text = f"{BODY_NAME}: its lower end is {gap:.3f} mm off what the part stands on (part.position_mm)"
        warnings += (Warning(Code.PART_NOT_ON_SUPPORT, text, sub_volume=BODY_NAME),)
    return replace(found, warnings=warnings, body_solid=replace(solid, name=BODY_NAME), round_body=body)


def _taken(case: Case, found: PartInput) -> PartInput:
    """The part with what is taken to be built, what is there already, and a warning of what is neither."""
    names = [mesh.name for mesh in found.meshes]
    take, built = _checked(case, names)
    if not case.part.take and not built:
        return found
    keep = [names.index(name) for name in take if name != BODY_NAME]
    there = tuple((found.meshes[i], found.bodies[i]) for i in map(names.index, built))
    absent = [name for name in names if name not in (*take, *built)]
    warnings = found.warnings
    if absent:
        warnings += (_absent(absent),)
    return replace(
        found,
        meshes=tuple(found.meshes[i] for i in keep),
        bodies=tuple(found.bodies[i] for i in keep),
        others={strategy: tuple(bodies[i] for i in keep) for strategy, bodies in found.others.items()},
        built=there,
        warnings=warnings,
    )


def _beside_toolpath(case: Case, found: PartInput, laid: Sequence[str]) -> PartInput:
    """What stands beside beads that are laid elsewhere: the body, and sub-volumes that are built already."""
    names, built = [mesh.name for mesh in found.meshes], list(case.part.built)
    unknown = [name for name in built if name not in names]
    if unknown:
        raise InputError(
            f"{case.path}: part.built: no sub-volume {unknown[0]!r}; there are {', '.join(names) or 'none'}"
        )
    both = [name for name in built if name in laid]
    if both:
        raise InputError(f"{case.path}: part.built: the toolpath lays {both[0]} as well; it is one or the other")
    there = tuple((found.meshes[i], found.bodies[i]) for i in map(names.index, dict.fromkeys(built)))
    warnings = (*found.warnings, *_left_out(case, names, laid))
    return replace(found, meshes=(), bodies=(), built=there, warnings=warnings)


def _left_out(case: Case, names: Sequence[str], laid: Sequence[str]) -> tuple[Warning, ...]:
    """A warning of sub-volumes that are neither laid nor built; beads of other names may be all of the part's."""
    known = [*case.part.take, *(name for name in laid if name in names)]
    absent = [name for name in names if name not in (*known, *case.part.built)]
    return (_absent(absent),) if known and absent else ()


def _absent(names: Sequence[str]) -> Warning:
    """A warning of sub-volumes that are not in the cell."""
    text = (
        f"{', '.join(names)}: neither in part.take nor in part.built, so not in the cell; collisions with "
        f"{'it' if len(names) == 1 else 'them'} are not checked"
    )
    return Warning(Code.SUB_VOLUME_ABSENT, text, sub_volume=names[0] if len(names) == 1 else "")


def _checked(case: Case, names: Sequence[str]) -> tuple[list[str], list[str]]:
    """Names of what is taken and what is built already.

    Raises:
        InputError: a name that there is not, that stands twice, or that is built on a body still to be printed.
    """
    part, known = case.part, ", ".join(names)
    for name in part.take:
        if name == BODY_NAME and case.slicing.body is None:
            raise InputError(f"{case.path}: part.take: {name} is printed only with slicing: {{body: planar}}")
    for key, given, allowed in (("take", part.take, [*names, BODY_NAME]), ("built", part.built, names)):
        for i, name in enumerate(given):
            if name not in allowed:
                raise InputError(f"{case.path}: part.{key}: no sub-volume {name!r}; there are {known}")
            if name in given[:i]:
                raise InputError(f"{case.path}: part.{key}: {name} is listed twice")
    both = [name for name in part.built if name in part.take]
    if both:
        raise InputError(f"{case.path}: part.built: {both[0]} is in part.take as well; list it in one of them")
    if part.built and case.slicing.body is not None:
        raise InputError(
            f"{case.path}: part.built: {part.built[0]} cannot be built before the body it stands on, "
            "which slicing.body prints"
        )
    take = list(part.take) or [name for name in names if name not in part.built]
    if not take and names:
        raise InputError(f"{case.path}: part.built: {known} are all built: nothing is left to build")
    return take, list(part.built)
