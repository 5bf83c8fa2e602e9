"""Links whose shapes collide with nothing, and wires that are none: what a check leaves out.

    links_without_shapes(model, arm_joints, table_joints, piece)      # typed warnings, one a model
    wire_warnings(model, wire_geom)                                      # likewise

A link is what moves together: the bodies between one axis and the next, and what is welded to them.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import mujoco
import numpy as np
from numpy.typing import NDArray

from slicing import Code, Warning

from ..arrays import Ints
from .composition import BodyOwner

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
