"""What may touch what in a composed cell: contact bits, and the pairs that MuJoCo would leave out.

set_contact_bits(world, case)             # everything against everything, but for the wire on the part
pair_tool_with_forearm(world, case)       # the tool against the link before the flange's
"""

from __future__ import annotations

import mujoco

from .errors import InputError
from .sections import Case

# contact bits: the wire may touch the part and nothing else
SOLID, WIRE = 1, 2


def set_contact_bits(world: mujoco.MjSpec, case: Case) -> None:
    """Everything may hit everything, but for the wire on the part (a model's own bits only say what collides)."""
    wires = set(case.tool.wire)
    for wire in wires:
        if world.geom(wire) is None:
            raise InputError(f"{case.path}: tool.wire: {case.tool.model} has no geom named {wire!r}")
    part = {"support"}
    for geom in world.geoms:
        if not (geom.contype or geom.conaffinity):
            continue
        if geom.name in wires:
            geom.contype, geom.conaffinity = WIRE, 0
        elif geom.name in part or geom.name.startswith(("deposit/", "body/")):
            geom.contype, geom.conaffinity = SOLID, SOLID
        else:
            geom.contype, geom.conaffinity = SOLID, SOLID | WIRE


def pair_tool_with_forearm(world: mujoco.MjSpec, case: Case) -> None:
    """Name the pairs of the tool and the link before the last.

    MuJoCo leaves out parent and child, and the tool is welded to the last link, so that its pairs with that link's
    parent would never be tested. What is bolted onto the flange itself turns about the flange's own axis and stays out.
    """
    last = world.joint(case.robot.joints[-1])
    if last is None:
        return  # _bind says so
    flange_body, forearm = last.parent, last.parent.parent
    tool_geoms = [g for body in flange_body.bodies for g in _all_geoms(body) if g.contype or g.conaffinity]
    for mine in tool_geoms:
        if mine.name.endswith("_mount") or mine.name in case.tool.wire:
            continue
        for other in (g for g in forearm.geoms if g.contype or g.conaffinity):
            world.add_pair(name=f"{mine.name}~{other.name}", geomname1=mine.name, geomname2=other.name)


def _all_geoms(body: mujoco.MjsBody) -> list[mujoco.MjsGeom]:
    found = list(body.geoms)
    for child in body.bodies:
        found += _all_geoms(child)
    return found
