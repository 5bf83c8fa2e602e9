"""What stands on the table or in the cell: support, part, deposits and fixtures.

Use:

    add_part(assembly, shape); add_fixture(assembly, fixture)
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from manifold3d import Manifold

from ik.chain import Floats
from slicing import Code, Mesh, PartError, PartShape, Warning

from ..case.cell_sections import Fixture
from ..case.fields import LEAST_SIZE_MM
from ..case.part_sections import Support
from ..case.sections import Case
from ..errors import InputError
from ..mjcf.fixture_mesh import FILLED, fixture_mesh
from ..units import METRES_PER_MM
from .composition import BodyOwner, CellAssembly, one_line
from .contacts import SOLID, WIRE
from .equipment import PLATE, quaternion_about

MANY_PIECES = 256  # of the part in one body

COLOUR = {
    "support": (0.42, 0.44, 0.47, 1.0),
    "body": (0.62, 0.65, 0.69, 1.0),
    "part": (0.36, 0.62, 0.86, 1.0),
    "deposit": (0.36, 0.62, 0.86, 0.35),
    "fixture": (0.55, 0.50, 0.40, 1.0),
}


def _table_body(assembly: CellAssembly) -> mujoco.MjsBody:
    """The body that holds the table's site; of a fixed table its plate."""
    positioner = assembly.case.positioner
    if not positioner.joints:
        return assembly.world.body(PLATE)
    return assembly.world.site(assembly.name(BodyOwner.POSITIONER, "sites", positioner.table)).parent


def add_part(assembly: CellAssembly, part: PartShape, together: int = MANY_PIECES) -> None:
    """Put support and part onto the positioner's table, with a site ``part`` at the part's frame."""
    case, world = assembly.case, assembly.world
    pos, quat = assembly.table
    fixed = _table_body(assembly).add_body(name="workpiece", pos=pos, quat=quat)
    assembly.piece["workpiece"] = BodyOwner.SUPPORT
    lift = 0.0 if case.support is None else _add_support(world, fixed, case.support)
    place = np.array(case.part.position_mm) * METRES_PER_MM + (0.0, 0.0, lift)
    body = fixed.add_body(name="part", pos=place, quat=quaternion_about((0.0, 0.0, case.part.rotation_deg)))
    assembly.piece["part"] = BodyOwner.PART
    # of the cell's own defaults: those of the table's body would count otherwise (childclass)
    body.add_site(default=world.default, name="part", size=(0.002, 0.002, 0.002), group=4)
    _add_visuals(assembly, body, part)
    assembly.warnings += _filled_body(case, part)
    _add_hulls(assembly, body, part, together)


def _add_support(world: mujoco.MjSpec, body: mujoco.MjsBody, support: Support) -> float:
    """The support that the part stands on: it is seen and it collides. Its height, m."""
    radius, height = support.radius_mm * METRES_PER_MM, support.height_mm * METRES_PER_MM
    shape = {
        "default": world.default,
        "type": mujoco.mjtGeom.mjGEOM_CYLINDER,
        "size": (radius, height / 2, 0),
        "pos": (0, 0, height / 2),
        "rgba": COLOUR["support"],
    }
    body.add_geom(name="support", group=3, contype=SOLID, conaffinity=SOLID, **shape)
    body.add_geom(name="support_visual", group=2, contype=0, conaffinity=0, **shape)
    return height


def _add_visuals(assembly: CellAssembly, body: mujoco.MjsBody, part: PartShape) -> None:
    """What is seen of the part."""
    world = assembly.world
    for name, mesh in part.visual.items():
        if world.geom(name) is not None:  # such as support_visual
            own = name.removesuffix("_visual")
            raise InputError(
                f"{assembly.case.path}: sub-volume {own}: the cell has a shape {name}; give it another name"
            )
        world.add_mesh(
            name=name,
            uservert=(mesh.vertices * METRES_PER_MM).ravel(),
            userface=mesh.faces.astype(np.int32).ravel(),
        )
        colour = COLOUR["body" if name == "body_visual" else "part"]
        body.add_geom(
            default=world.default,
            name=name,
            type=mujoco.mjtGeom.mjGEOM_MESH,
            meshname=name,
            rgba=colour,
            group=2,
            contype=0,
            conaffinity=0,
        )


def _add_hulls(assembly: CellAssembly, body: mujoco.MjsBody, part: PartShape, together: int) -> None:
    """What the part collides with: convex pieces of its body and deposits; many of them in bodies of their own."""
    several = len(part.hulls) > together
    holder, world = body, assembly.world
    for i, (name, vertices) in enumerate(part.hulls.items()):
        if several and i % together == 0:
            # MuJoCo goes through every geom of a body that may be hit: what lies far off is left out body by body
            holder = body.add_body(name=f"pieces_{i // together}")
            assembly.piece[holder.name] = BodyOwner.PART
        world.add_mesh(name=name, uservert=(vertices * METRES_PER_MM).ravel())
        holder.add_geom(
            default=world.default,
            name=name,
            type=mujoco.mjtGeom.mjGEOM_MESH,
            meshname=name,
            rgba=COLOUR["deposit" if name.startswith("deposit/") else "body"],
            group=3,
            contype=SOLID,
            conaffinity=SOLID,
        )


def _filled_body(case: Case, part: PartShape) -> Iterator[Warning]:
    """Say by how much a body that is given by its mesh counts with more than that, since its convex hull does."""
    if case.part.body is None or case.part.body.mesh is None or "body/0" not in part.hulls:
        return
    mesh = part.visual["body_visual"]
    volume = float(np.einsum("ij,ij->", mesh.vertices[mesh.faces[:, 0]], _crossed(mesh)) / 6)
    excess = Manifold.hull_points(mesh.vertices).volume() / abs(volume) - 1 if volume else np.inf
    if excess > FILLED:
        text = (
            f"part.body.mesh: collisions are checked with its convex hull, which fills its hollows and has "
            f"{100 * excess:.0f} % more volume; part.body.profile_mm is exact for a turned body"
        )
        yield Warning(Code.CONCAVE_BODY, text)


def _crossed(mesh: Mesh) -> Floats:
    crossed: Floats = np.cross(mesh.vertices[mesh.faces[:, 1]], mesh.vertices[mesh.faces[:, 2]])
    return crossed


def add_fixture(assembly: CellAssembly, fixture: Fixture) -> None:
    """Put a fixture onto the floor or the table.

    Raises:
        InputError: its mesh is missing, or its name is another's.
    """
    case, world = assembly.case, assembly.world
    if not fixture.name.strip() or not fixture.name.isprintable():
        raise InputError(
            f"{case.path}: fixtures: {fixture.name!r} is not a name; one line of printable characters is needed"
        )
    if "/" in fixture.name or world.geom(fixture.name) or world.body(f"fixture/{fixture.name}"):
        raise InputError(
            f"{case.path}: fixtures: the name {fixture.name!r} is already used, or contains a /; choose another"
        )
    parent, name = world.worldbody, f"fixture/{fixture.name}"
    if fixture.on == "table":
        pos, quat = assembly.table
        parent = _table_body(assembly).add_body(name=f"{name}/frame", pos=pos, quat=quat)
        assembly.on_table.add(name)
    body = parent.add_body(
        name=name,
        pos=np.array(fixture.position_mm) * METRES_PER_MM,
        quat=quaternion_about(fixture.rotation_deg),
    )
    assembly.piece[name] = BodyOwner.FIXTURE
    options = {
        "default": world.default,
        "name": fixture.name,
        "rgba": COLOUR["fixture"],
        "group": 3,
        "contype": SOLID,
        "conaffinity": SOLID | WIRE,
    }
    if fixture.mesh is not None:
        _add_solids(assembly, fixture, body, options)
        return
    if fixture.box is not None:
        shape = {"type": mujoco.mjtGeom.mjGEOM_BOX, "size": np.array(fixture.box.size_mm) * METRES_PER_MM / 2}
    elif fixture.cylinder is not None:
        radius, height = fixture.cylinder.radius_mm, fixture.cylinder.height_mm
        shape = {
            "type": mujoco.mjtGeom.mjGEOM_CYLINDER,
            "size": np.array([radius, height / 2, 0]) * METRES_PER_MM,
        }
    body.add_geom(**shape, **options)
    body.add_geom(**{**shape, **options, **_to_look_at(name)})
    extent = 2 * float(np.max(shape["size"])) / METRES_PER_MM
    if extent < LEAST_SIZE_MM:
        text = f"fixtures.{fixture.name}: largest extent {extent:.4g} mm; lengths are in mm, not in m"
        assembly.warnings.append(Warning(Code.FIXTURE_SMALL, text))


def _to_look_at(name: str) -> dict[str, Any]:
    return {"name": f"{name}/visual", "group": 2, "contype": 0, "conaffinity": 0}


def _add_solids(assembly: CellAssembly, fixture: Fixture, body: mujoco.MjsBody, options: dict[str, Any]) -> None:
    """Add a fixture's mesh: what is seen of it, and its convex pieces, which collide.

    Raises:
        InputError: there is no such file, or it cannot be used.
    """
    case, world = assembly.case, assembly.world
    path, where = Path(case.path_of(str(fixture.mesh))), f"{case.path}: fixtures.{fixture.name}.mesh"
    if not path.is_file():
        raise InputError(f"{where}: {path}: no such file")
    try:
        found = fixture_mesh(path.resolve(), fixture.units)
    except (PartError, ValueError) as error:
        raise InputError(f"{where}: {one_line(error)}") from None
    assembly.warnings += found.warnings(fixture.name, fixture.units)
    name = f"fixture/{fixture.name}"
    place = {"type": mujoco.mjtGeom.mjGEOM_MESH, "pos": found.centre}
    # a shell's inertia: that of a volume is refused where the mesh is not closed, or turned inside out
    shell = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL
    world.add_mesh(
        name=f"{name}/mesh",
        uservert=found.vertices.ravel(),
        userface=found.faces.astype(np.int32).ravel(),
        inertia=shell,
    )
    body.add_geom(**{**options, **place, **_to_look_at(name), "meshname": f"{name}/mesh"})
    for number, vertices in enumerate(found.solid.pieces, start=1):
        piece = f"{name}/{number}"
        world.add_mesh(name=piece, uservert=vertices.ravel(), inertia=shell)
        own = fixture.name if len(found.solid.pieces) == 1 else piece
        body.add_geom(**{**options, **place, "name": own, "meshname": piece})
