"""Whether the part stands on what carries it, neither inside it nor in the air above it; and fixtures that are sunk.

    for line in part_contact_warnings(scene, shape): ...          # typed warnings
    for line in sunk(scene): ...

Things on the table do not move against the table, so no check of a motion compares the two.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import mujoco
import numpy as np

from slicing import Code, PartShape, Warning

from ..arrays import Ints
from ..units import METRES_PER_MM
from .absent_shapes import link_of_body
from .composition import BodyOwner

if TYPE_CHECKING:
    from .scene import Scene

OFF_MM = 0.5  # that a part may be off what it stands on
NEAR_BY = 0.05  # m: out to here distances are of interest
SUNK_MM = 1.0  # that a fixture may reach into what stands still against it
CARRIERS = (BodyOwner.SUPPORT, BodyOwner.POSITIONER, BodyOwner.FIXTURE)


def part_contact_warnings(scene: Scene, shape: PartShape) -> Iterator[Warning]:
    """Warn of parts that are sunk into what carries them, and of a body that nothing carries.

    Args:
        scene: the composed cell.
        shape: what its part was made from.

    Yields:
        Typed warnings.
    """
    model = scene.model
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    names = [model.geom(g).name for g in range(model.ngeom)]
    carriers = carriers_of(scene)
    half_bead = 0.5 * scene.case.beads.width_mm * METRES_PER_MM
    ground = carriers[scene.piece_of_geom[carriers] != BodyOwner.FIXTURE]  # fixtures may stand for more of the part
    for what, of_part, beads in _what_stands(names, shape):
        off_mm = float(shape.visual[f"{what}_visual"].vertices[:, 2].min()) + scene.case.part.position_mm[2]
        apart, found = _nearest(model, data, of_part, ground)
        if off_mm < -OFF_MM and apart < -(OFF_MM * METRES_PER_MM + (half_bead if beads else 0.0)):
            text = (
                f"part.position_mm: the {what} is inside {names[found]}: its lower end is {-off_mm:.1f} mm "
                "below the surface "
                "that the part stands on"
            )
            yield Warning(Code.PART_NOT_ON_SUPPORT, text, sub_volume=what if beads else "")
        if not beads and _nearest(model, data, of_part, carriers)[0] > OFF_MM * METRES_PER_MM:
            body = scene.case.part.body
            ends = body is not None and body.z_mm is None and body.radius_mm is not None and body.mesh is None
            hint = " (part.body.z_mm is not given, so the body ends where its sub-volumes end)" if ends else ""
            above = f"its lower end is {abs(off_mm):.1f} mm {'above' if off_mm > 0 else 'below'}"
            where = above if abs(off_mm) > OFF_MM else "it stands beside"
            text = f"part.position_mm: nothing carries the body: {where} the surface that the part stands on{hint}"
            yield Warning(Code.PART_NOT_ON_SUPPORT, text)


def carriers_of(scene: Scene) -> Ints:
    """Shapes that carry the part: the table's that move along with it, the support, and fixtures on the table.

    Args:
        scene: the composed cell.

    Returns:
        Their geoms, (k,).
    """
    model = scene.model
    link = link_of_body(model, _axes(scene))
    along = link[model.geom_bodyid] == link[int(model.site_bodyid[scene.sites["table"]])]
    return np.flatnonzero(scene.contact_bits.any(axis=0) & along & np.isin(scene.piece_of_geom, CARRIERS))


def sunk(scene: Scene) -> Iterator[Warning]:
    """Warn of fixtures that reach into shapes of the models or the support that never move against them.

    Args:
        scene: the composed cell.

    Yields:
        One warning a fixture.
    """
    model = scene.model
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    link = link_of_body(model, [*scene.arm_joints.tolist(), *_axes(scene)])[model.geom_bodyid]
    solid, piece = scene.contact_bits.any(axis=0), scene.piece_of_geom
    fixed = solid & np.isin(piece, (BodyOwner.ROBOT, BodyOwner.POSITIONER, BodyOwner.SUPPORT))
    fixed &= model.geom_type != mujoco.mjtGeom.mjGEOM_PLANE  # a floor of a model's own: fixtures are let into it
    deepest: dict[str, tuple[float, int]] = {}
    for geom in np.flatnonzero(solid & (piece == BodyOwner.FIXTURE)).tolist():
        apart, other = _nearest(model, data, np.array([geom]), np.flatnonzero(fixed & (link == link[geom])))
        name = scene.geom_name(geom)
        deepest[name] = min(deepest.get(name, (np.inf, -1)), (apart, other))
    for name, (apart, other) in deepest.items():
        if apart < -SUNK_MM * METRES_PER_MM:
            text = (
                f"fixtures.{name}.position_mm: it reaches {-apart / METRES_PER_MM:.1f} mm into "
                f"{scene.geom_name(other)}, which never moves relative to it: the collision of the two is not checked"
            )
            yield Warning(Code.FIXTURE_SUNK, text)


def _axes(scene: Scene) -> list[int]:
    """Joints of the axes that the table has: one that it has not moves nothing against the rest."""
    joints: list[int] = scene.table_joints[scene.has_axis].tolist()
    return joints


def _what_stands(names: list[str], shape: PartShape) -> Iterator[tuple[str, Ints, bool]]:
    """The body and each sub-volume: what it is called, its geoms, and whether its beads may stand out of it."""
    kind = np.array([name.split("/")[0] for name in names])
    owner = np.array([_sub_volume(name) for name in names])
    for visual in shape.visual:
        what = visual.removesuffix("_visual")
        if what == "body":
            yield what, np.flatnonzero(kind == "body"), False
        else:
            yield what, np.flatnonzero(np.isin(kind, ("deposit", "built")) & (owner == what)), True


def _sub_volume(name: str) -> str:
    words = name.split("/")
    place = {"deposit": 2, "built": 1}.get(words[0], 0)
    return words[place] if 0 < place < len(words) else ""


def _nearest(model: mujoco.MjModel, data: mujoco.MjData, of_part: Ints, carriers: Ints) -> tuple[float, int]:
    """The least signed distance of some geoms from others, m, and which of these it is to; -1 where none is near."""
    least, found, ends = np.inf, -1, np.zeros(6)
    for carrier in carriers.tolist():
        apart = np.linalg.norm(data.geom_xpos[of_part] - data.geom_xpos[carrier], axis=1)
        near = of_part[apart - model.geom_rbound[of_part] - model.geom_rbound[carrier] <= NEAR_BY]
        for geom in near.tolist():
            distance = mujoco.mj_geomDistance(model, data, geom, carrier, NEAR_BY, ends)
            if distance < min(least, NEAR_BY):
                least, found = distance, carrier
    return least, found
