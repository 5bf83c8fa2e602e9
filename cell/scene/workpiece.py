"""What stands on the table or in the cell: support, part, deposits and fixtures.

Use:

    add_part(assembly, shape); add_fixture(assembly, fixture)
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from manifold3d import Manifold

from ik.chain import Floats
from slicing import Code, Mesh, PartError, PartShape, Warning, read_triangles

from ..case.cell_sections import Fixture
from ..case.part_sections import Support
from ..case.sections import Case
from ..errors import InputError
from ..mjcf.convex_pieces import ConvexPieces, convex_pieces
from ..units import METRES_PER_MM
from .composition import BodyOwner, CellAssembly, one_line
from .contacts import SOLID, WIRE
from .equipment import PLATE, UNIT, quaternion_about

MANY_PIECES = 256  # of the part in one body

SMALL_MM = 5.0  # of a fixture's mesh, that is rather in another unit
FILLED = 0.01  # of a fixture's volume that its convex pieces may hold besides it without a word

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
    _add_visuals(world, body, part)
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


def _add_visuals(world: mujoco.MjSpec, body: mujoco.MjsBody, part: PartShape) -> None:
    """What is seen of the part."""
    for name, mesh in part.visual.items():
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
    if fixture.box is not None:
        shape = {"type": mujoco.mjtGeom.mjGEOM_BOX, "size": np.array(fixture.box.size_mm) * METRES_PER_MM / 2}
    elif fixture.cylinder is not None:
        radius, height = fixture.cylinder.radius_mm, fixture.cylinder.height_mm
        shape = {
            "type": mujoco.mjtGeom.mjGEOM_CYLINDER,
            "size": np.array([radius, height / 2, 0]) * METRES_PER_MM,
        }
    else:
        shape = {
            "type": mujoco.mjtGeom.mjGEOM_MESH,
            "meshname": _fixture_mesh(world, case, fixture),
        }
        for solid in _solids(assembly, fixture, shape):
            body.add_geom(**{**options, **solid})
    if fixture.mesh is None:
        body.add_geom(**shape, **options)
    look = {**options, "name": f"{name}/visual", "group": 2, "contype": 0, "conaffinity": 0}
    body.add_geom(**shape, **look)


def _fixture_mesh(world: mujoco.MjSpec, case: Case, fixture: Fixture) -> str:
    """Add a fixture's mesh; its name.

    Raises:
        InputError: there is no such file.
    """
    path = Path(case.path_of(str(fixture.mesh)))
    if not path.is_file():
        raise InputError(f"{case.path}: fixtures.{fixture.name}.mesh: {path}: no such file")
    name = f"fixture/{fixture.name}/mesh"
    try:
        _add_mesh(world, name, path.resolve(), UNIT[fixture.units])
    except PartError as error:
        raise InputError(f"{case.path}: fixtures.{fixture.name}.mesh: {one_line(error)}") from None
    return name


def _add_mesh(spec: mujoco.MjSpec, name: str, path: Path, scale: float) -> None:
    """Add a mesh file to a model; of an OBJ all objects, of which MuJoCo takes the faces of the first alone.

    Raises:
        PartError: an OBJ cannot be read.
    """
    if path.suffix.lower() != ".obj":
        spec.add_mesh(name=name, file=str(path), scale=[scale] * 3)
        return
    found = read_triangles(path)
    faces = found.faces.astype(np.int32)
    spec.add_mesh(name=name, uservert=(found.vertices * scale).ravel(), userface=faces.ravel())


def _solids(assembly: CellAssembly, fixture: Fixture, shape: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """What collides of a fixture's mesh, as options of geoms: itself where it is convex, else convex pieces."""
    case, world = assembly.case, assembly.world
    path = Path(case.path_of(str(fixture.mesh))).resolve()
    changed = path.stat()
    try:
        found = _cut_up(str(path), UNIT[fixture.units], changed.st_mtime_ns, changed.st_size)
    except ValueError as error:
        raise InputError(f"{case.path}: fixtures.{fixture.name}.mesh: {one_line(error)}") from None
    corners = np.concatenate(found.pieces)
    extent = float(np.ptp(corners, axis=0).max()) / METRES_PER_MM
    if extent < SMALL_MM:
        text = f"largest extent {extent:.4g} mm with units: {fixture.units}; is it in another?"
        assembly.warnings.append(Warning(Code.MESH_UNITS, f"fixtures.{fixture.name}.mesh: {text}"))
    if found.excess > FILLED:
        more = "collisions are checked with its convex hull, since it is not closed"
        if np.isfinite(found.excess):
            more = (
                f"the shape for collisions has {100 * found.excess:.0f} % more volume, which fills some of its hollows"
            )
        text = f"fixtures.{fixture.name}.mesh: {more}; several fixtures of simple shapes are exact"
        assembly.warnings.append(Warning(Code.CONCAVE_FIXTURE, text))
    if len(found.pieces) == 1:
        yield {**shape, "name": fixture.name}
        return
    for number, vertices in enumerate(found.pieces, start=1):
        name = f"fixture/{fixture.name}/{number}"
        world.add_mesh(name=name, uservert=vertices.ravel())
        yield {**shape, "meshname": name, "name": name}


@lru_cache(maxsize=32)
def _cut_up(path: str, scale: float, *_changed: int) -> ConvexPieces:
    """A mesh file as convex pieces, m, as MuJoCo reads it.

    Raises:
        ValueError: MuJoCo does not read it.
    """
    import trimesh

    spec = mujoco.MjSpec()
    _add_mesh(spec, "mesh", Path(path), scale)
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname="mesh")
    model = spec.compile()
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, model.mesh_quat[0])
    vertices = model.mesh_vert.astype(np.float64) @ turn.reshape(3, 3).T + model.mesh_pos[0]
    return convex_pieces(trimesh.Trimesh(vertices, model.mesh_face, process=False))
