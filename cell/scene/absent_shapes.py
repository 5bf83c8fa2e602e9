"""Links without colliding shapes, and shapes wrongly called the wire: what a check leaves out.

    links_without_shapes(model, arm_joints, table_joints, piece)      # typed warnings, one a model
    wire_warnings(model, wire_geom)                                      # likewise

A link is everything that moves together: the bodies between one axis and the next, and bodies welded to them.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise

import mujoco
import numpy as np
from numpy.typing import NDArray

from slicing import Code, Warning

from ..arrays import Ints
from .composition import BodyOwner

TINY = 0.02  # share of the way from a joint to the next within which a link's shapes are not meant so
THICK_WIRE = 2.5e-3  # m: half the thickness of the thickest welding wire


def links_without_shapes(
    model: mujoco.MjModel, arm_joints: Sequence[int], table_joints: Sequence[int], piece: Ints
) -> Iterator[Warning]:
    """Say which links have no shapes that collide.

    Args:
        model: the compiled cell, with its contact bits.
        arm_joints: ids of the arm's joints.
        table_joints: ids of the positioner's.
        piece: what each geom belongs to, of ``cell.scene.composition.BodyOwner``, (ngeom,).

    Yields:
        One warning for each model that has such links.
    """
    hard = (model.geom_contype | model.geom_conaffinity) != 0
    link = link_of_body(model, (*arm_joints, *table_joints))[model.geom_bodyid]
    if not (hard & (piece == BodyOwner.TOOL)).any():
        text = (
            "tool.model: no shape of the tool collides, so collisions with it are not checked; shapes need "
            "contype or conaffinity"
        )
        yield Warning(Code.LINK_WITHOUT_SHAPES, text)
    for what, joints, kind in (
        ("robot", arm_joints, BodyOwner.ROBOT),
        ("positioner", table_joints, BodyOwner.POSITIONER),
    ):
        bare = []
        for joint in joints:
            body = int(model.jnt_bodyid[joint])
            if not (hard & (piece == kind) & (link == body)).any() and _is_last(model, joint, joints):
                bare.append(model.body(body).name)
        if bare:
            text = (
                f"{what}.model: no shape of {', '.join(bare)} collides, so collisions with it are not checked; "
                "shapes need contype or conaffinity"
            )
            yield Warning(Code.LINK_WITHOUT_SHAPES, text)


def tiny_links(model: mujoco.MjModel, arm_joints: Sequence[int], piece: Ints) -> Iterator[Warning]:
    """Say which links have shapes that are far too small for them: a mesh that was scaled from mm twice.

    Args:
        model: the compiled cell, with its contact bits.
        arm_joints: ids of the arm's joints, from the base on.
        piece: as of :func:`links_without_shapes`.

    Yields:
        One warning, if there is such a link.
    """
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    hard = ((model.geom_contype | model.geom_conaffinity) != 0) & (piece == BodyOwner.ROBOT)
    link = link_of_body(model, arm_joints)[model.geom_bodyid]
    tiny = []
    for joint, after in pairwise(arm_joints):
        body, anchor = int(model.jnt_bodyid[joint]), data.xanchor[joint]
        own, way = np.flatnonzero(hard & (link == body)), float(np.linalg.norm(data.xanchor[after] - anchor))
        reach = np.linalg.norm(data.geom_xpos[own] - anchor, axis=1) + model.geom_rbound[own]
        if len(own) and float(reach.max()) < TINY * way:
            tiny.append(f"{model.body(body).name} ({1e3 * reach.max():.2g} of {1e3 * way:.0f} mm)")
    if tiny:
        text = (
            f"robot.model: the shapes of {', '.join(tiny)} are tiny for the way to the next joint, most of which is "
            "not checked for collisions; are meshes scaled twice?"
        )
        yield Warning(Code.LINK_WITHOUT_SHAPES, text)


def wire_warnings(model: mujoco.MjModel, wire_geom: NDArray[np.bool_]) -> Iterator[Warning]:
    """Say what is not checked for the shapes that the case calls the wire.

    Args:
        model: the compiled cell, with its contact bits.
        wire_geom: which geoms they are, (ngeom,).

    Yields:
        One warning for each kind of gap.
    """
    wires = np.flatnonzero(wire_geom & ((model.geom_contype | model.geom_conaffinity) != 0))
    if not len(wires):
        yield Warning(
            Code.WIRE_SHAPE,
            "tool.wire: no wire that collides: whether the wire runs through metal, at a bead or on a travel, is not "
            "checked",
        )
    thick = [g for g in wires.tolist() if float(np.sort(model.geom_aabb[g, 3:])[0]) > THICK_WIRE]
    if thick:
        names = ", ".join(f"{model.geom(g).name} ({2e3 * np.sort(model.geom_aabb[g, 3:])[0]:.0f} mm)" for g in thick)
        yield Warning(
            Code.WIRE_SHAPE,
            f"tool.wire: {names} is thicker than a wire: shapes named there may touch the part; name only the wire",
        )


def _is_last(model: mujoco.MjModel, joint: int, joints: Sequence[int]) -> bool:
    """Whether no later joint of the list turns the same body: what is between two such has no extent."""
    return all(
        other == joint or model.jnt_bodyid[other] != model.jnt_bodyid[joint] or other < joint for other in joints
    )


def link_of_body(model: mujoco.MjModel, joints: Sequence[int]) -> Ints:
    """By body the body of the last of these joints that moves it; 0 where none does, (nbody,).

    Args:
        model: a compiled model.
        joints: ids.
    """
    own = set(model.jnt_bodyid[list(joints)].tolist())
    link = np.zeros(model.nbody, dtype=np.int64)
    for body in range(1, model.nbody):  # parents come first
        link[body] = body if body in own else link[model.body_parentid[body]]
    return link
