"""The part as its case gives it: in one mesh that is taken apart, or as sub-volumes on a body that is told.

    part = read_part(case)
    for mesh, body in zip(part.meshes, part.bodies): ...

The part frame is that of the meshes, with z along the body's axis; a mesh whose axis lies elsewhere is turned.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from slicing.bodies import Body, ConicalBody, RevolvedBody, RoundBody
from slicing.part import Mesh, PartError, load_mesh

from .errors import InputError
from .sections import Body as BodySection
from .sections import Case
from .terminal import stage


@dataclass(frozen=True, eq=False)
class PartInput:
    """What is to be sliced.

    Attributes:
        meshes: the sub-volumes, part frame, mm.
        bodies: what each of them stands on.
        body_mesh: the body's own shape, to look at; None where it is only told.
        profile: the body as (r, z) points about its axis, mm, lowest first, which collides; None where the hull of
            body_mesh does.
        warnings: one line each.
    """

    meshes: tuple[Mesh, ...]
    bodies: tuple[RoundBody, ...]
    body_mesh: Mesh | None
    profile: tuple[tuple[float, float], ...] | None
    warnings: tuple[str, ...] = ()


@stage("reading the part")
def read_part(case: Case) -> PartInput:
    """Load a case's meshes, and take the part apart if it comes in one.

    Args:
        case: the case.

    Returns:
        The part; of its sub-volumes those that the case takes.

    Raises:
        InputError: a mesh is missing or cannot be used, or a sub-volume is taken that is not there; one line.
    """
    meshes: list[Mesh] = []
    try:
        found = _whole(case, meshes) if case.part.mesh is not None else _pieces(case, meshes)
    except PartError as error:
        # what looked odd about the meshes, a wrong unit above all, is often why
        hints = "".join(f"; {line}" for mesh in meshes for line in mesh.warnings)
        raise InputError(f"{error}{hints}") from None
    return _taken(case, found)


def _pieces(case: Case, loaded: list[Mesh]) -> PartInput:
    part = case.part
    if part.body is None:
        raise InputError(f"{case.path}: part.body: needs radius_mm, the radius of the cylinder they stand on")
    for i, name in enumerate(part.sub_volumes):
        loaded.append(load_mesh(case.path_of(name), part.units, f"SV{i + 1}"))
    body = _told(part.body)
    bodies = (body,) * len(loaded)
    if part.body.mesh is not None:
        own = load_mesh(case.path_of(part.body.mesh), part.units, "body")
        return PartInput(tuple(loaded), bodies, own, None)
    return PartInput(tuple(loaded), bodies, None, _profile(body, part.body.z_mm, loaded))


def _told(body: BodySection) -> RoundBody:
    """The body a case tells of; keys that end in _mm are mm, whatever units the meshes are in."""
    if body.profile_mm is not None:
        return RevolvedBody(tuple(body.profile_mm), body.axis_xy_mm)
    if body.half_angle_deg is not None:
        return ConicalBody(body.radius_mm or 0.0, body.half_angle_deg, body.axis_xy_mm)
    return Body(body.radius_mm or 0.0, body.axis_xy_mm)


def _profile(
    body: RoundBody, z_mm: tuple[float, float] | None, meshes: Sequence[Mesh]
) -> tuple[tuple[float, float], ...]:
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
    from slicing.decompose import BodyHint, decompose

    part = case.part
    loaded.append(load_mesh(case.path_of(str(part.mesh)), part.units))
    hint = None
    if part.body is not None:
        if part.body.half_angle_deg is not None or part.body.profile_mm is not None:
            raise InputError(f"{case.path}: part.body: as a hint for part.mesh it takes radius_mm and axis_xy_mm")
        hint = BodyHint((*part.body.axis_xy_mm, 0.0), (0.0, 0.0, 1.0), part.body.radius_mm)
    found = decompose(loaded[0], hint)
    return PartInput(found.sub_volumes, found.bodies, found.body_mesh, found.outline.points, found.warnings)


def _taken(case: Case, found: PartInput) -> PartInput:
    if not case.part.take:
        return found
    names = [mesh.name for mesh in found.meshes]
    for name in case.part.take:
        if name not in names:
            raise InputError(f"{case.path}: part.take: no sub-volume {name!r}; there are {', '.join(names)}")
    keep = [names.index(name) for name in case.part.take]
    return replace(found, meshes=tuple(found.meshes[i] for i in keep), bodies=tuple(found.bodies[i] for i in keep))
