"""The part as its case gives it: in one mesh that is taken apart, or as sub-volumes on a body that is told.

    part = read_part(case)
    for mesh, body in zip(part.meshes, part.bodies): ...

The part frame is that of the meshes, with z along the body's axis; a mesh whose axis lies elsewhere is turned.
"""

from __future__ import annotations

from dataclasses import dataclass

from slicing.bodies import Body
from slicing.part import Mesh, PartError, load_mesh

from .errors import InputError
from .sections import Case


@dataclass(frozen=True, eq=False)
class PartInput:
    """What is to be sliced.

    Attributes:
        meshes: the sub-volumes, part frame, mm.
        bodies: what each of them stands on.
        body_mesh: the body's own shape, or None for a cylinder.
        warnings: one line each.
    """

    meshes: tuple[Mesh, ...]
    bodies: tuple[Body, ...]
    body_mesh: Mesh | None
    warnings: tuple[str, ...] = ()


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
    # keys that end in _mm are mm, whatever units the meshes are in
    body = Body(part.body.radius_mm, part.body.axis_xy_mm)
    own = None if part.body.mesh is None else load_mesh(case.path_of(part.body.mesh), part.units, "body")
    return PartInput(tuple(loaded), (body,) * len(loaded), own)


def _whole(case: Case, loaded: list[Mesh]) -> PartInput:
    from slicing.decompose import BodyHint, decompose

    part = case.part
    loaded.append(load_mesh(case.path_of(str(part.mesh)), part.units))
    hint = None
    if part.body is not None:
        hint = BodyHint((*part.body.axis_xy_mm, 0.0), (0.0, 0.0, 1.0), part.body.radius_mm)
    found = decompose(loaded[0], hint)
    return PartInput(found.sub_volumes, found.bodies, found.body_mesh, found.warnings)


def _taken(case: Case, found: PartInput) -> PartInput:
    if not case.part.take:
        return found
    names = [mesh.name for mesh in found.meshes]
    for name in case.part.take:
        if name not in names:
            raise InputError(f"{case.path}: part.take: no sub-volume {name!r}; there are {', '.join(names)}")
    keep = [names.index(name) for name in case.part.take]
    meshes, bodies = (tuple(of[i] for i in keep) for of in (found.meshes, found.bodies))
    return PartInput(meshes, bodies, found.body_mesh, found.warnings)
