"""Whether a tool's TCP is where its wire ends, and its z axis the wire's.

    warnings = check_wire_end(model, tcp, wire_geom, case)      # refuses a TCP across the wire, beside it, or before it

What is checked of a bead is checked of the TCP: where the wire is elsewhere, the bead would be. Metres.
"""

from __future__ import annotations

from collections.abc import Iterator

import mujoco
import numpy as np
from numpy.typing import NDArray

from ik.chain import Floats
from slicing import Code, Warning

from ..case.sections import Case
from ..errors import InputError
from ..units import METRES_PER_MM

WIRE_OFF = 5.0  # deg that a wire may be off the TCP's z axis: cast bends it a little
WIRE_AHEAD = 0.1  # share of its length by which a wire's middle may lie ahead of the TCP
BESIDE = 2e-3  # m that a TCP may be beside the wire's end: cast, again
OFF_END = 2e-3  # m that it may be ahead of the end, or behind it, without a word
ROUND = (int(mujoco.mjtGeom.mjGEOM_CYLINDER), int(mujoco.mjtGeom.mjGEOM_CAPSULE))


def check_wire_end(model: mujoco.MjModel, site: int, wires: NDArray[np.bool_], case: Case) -> tuple[Warning, ...]:
    """Refuse a TCP whose z axis is not the wire's, that points back into the nozzle, or that is beside the wire's end.

    Args:
        model: the composed cell.
        site: id of the TCP's.
        wires: which geoms are the wire, (ngeom,).
        case: says what they are called.

    Returns:
        Warnings: of a TCP that is on the wire's line, but not at its end.

    Raises:
        InputError: what is wrong, in deg or mm.
    """
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    place, z = data.site_xpos[site], data.site_xmat[site].reshape(3, 3)[:, 2]
    where = f"{case.path}: tool.tcp: "
    behind, length = 0.0, 0.0
    for geom in np.flatnonzero(wires):
        turn = data.geom_xmat[geom].reshape(3, 3)
        behind += float((place - data.geom_xpos[geom] - turn @ model.geom_aabb[geom, :3]) @ z)
        length += float(np.abs(turn.T @ z) @ model.geom_aabb[geom, 3:])
        if int(model.geom_type[geom]) not in ROUND:
            continue
        off = float(np.rad2deg(np.arccos(np.clip(abs(z @ turn[:, 2]), 0, 1))))
        if off > WIRE_OFF:
            raise InputError(
                f"{where}the z axis of site {case.tool.tcp} is {off:.0f} deg off the wire {model.geom(geom).name}; it "
                "must point along the wire"
            )
    if behind < -WIRE_AHEAD * length:  # a TCP is at the wire's end: the wire's middle lies behind it
        raise InputError(
            f"{where}the z axis of site {case.tool.tcp} points back along the wire into the nozzle; it must point in "
            "the direction of wire feed, out of the nozzle, and the site must be at the wire's end"
        )
    ends = [_end(model, data, geom, z) for geom in np.flatnonzero(wires).tolist()]
    if not ends:
        return ()
    beside = _beside(np.array([(end - place) - (end - place) @ z * z for end, _ in ends]))
    if beside > max(BESIDE, *(wide for _, wide in ends)):
        raise InputError(
            f"{where}site {case.tool.tcp} is {beside / METRES_PER_MM:.1f} mm beside the end of the wire "
            f"({', '.join(case.tool.wire)}); it must be at the wire's end"
        )
    return tuple(_off_end(max(float((end - place) @ z) for end, _ in ends), case))


def _beside(ends: Floats) -> float:
    """How far the TCP is from the ends of wires, or from between two of them as of a tandem torch, m.

    Args:
        ends: seen along the wire, from the TCP, (k, 3).
    """
    a, b = (ends[k] for k in np.triu_indices(len(ends)))
    way = b - a
    square = np.einsum("ki,ki->k", way, way)
    share = np.clip(-np.einsum("ki,ki->k", a, way) / np.where(square > 0, square, 1.0), 0.0, 1.0)
    return float(np.linalg.norm(a + share[:, None] * way, axis=1).min())


def _off_end(ahead: float, case: Case) -> Iterator[Warning]:
    """Say that a wire ends before the TCP, or that it goes on behind it."""
    if abs(ahead) <= OFF_END:
        return
    far = f"{abs(ahead) / METRES_PER_MM:.1f} mm"
    what = (
        f"goes on {far} ahead of site {case.tool.tcp}: that much of it would be in the metal"
        if ahead > 0
        else f"ends {far} before site {case.tool.tcp}: whether metal is in between is not checked"
    )
    yield Warning(Code.WIRE_SHAPE, f"tool.tcp: the wire ({', '.join(case.tool.wire)}) {what}; the TCP is its end")


def _end(model: mujoco.MjModel, data: mujoco.MjData, geom: int, z: Floats) -> tuple[Floats, float]:
    """Where a wire's shape ends in a direction, world frame; and half of how wide it is, m."""
    turn, box = data.geom_xmat[geom].reshape(3, 3), model.geom_aabb[geom]
    along = int(np.argmax(np.abs(turn.T @ z) * box[3:]))
    side = np.sign(turn[:, along] @ z) * box[3 + along]
    end: Floats = data.geom_xpos[geom] + turn @ box[:3] + side * turn[:, along]
    return end, float(np.delete(box[3:], along).max())
