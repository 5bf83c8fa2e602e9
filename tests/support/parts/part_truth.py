"""A decomposition held against what is known of the part.

found = judged(part, decompose(mesh))
found.kind, found.why                      # "right", ""
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from slicing.decomposition.body_hint import LEAST_SIDES
from slicing.decomposition.decompose import Decomposition, decompose
from slicing.mesh.solid import Mesh, PartError
from slicing.warning import Code, Warning

from .cad_parts import CadPart, Stands

AXIS_DEG, RADIUS_SHARE, VOLUME_SHARE = 0.05, 1e-3, 5e-3
DOUBTS = {Code.BODY_RADIUS, Code.BODY_RIVAL, Code.BODY_SMALL, Code.BODY_UNLIKE, Code.BODY_VOLUME}


@dataclass(frozen=True)
class Judgement:
    """What became of a part.

    Attributes:
        kind: right, refused, doubted or wrong.
        why: what is wrong, or the reason given.
    """

    kind: str
    why: str


def judged(part: CadPart, mesh: Mesh) -> Judgement:
    """Decompose a part's mesh and say what came of it.

    Args:
        part: with its truth.
        mesh: as it was loaded.

    Returns:
        The judgement.
    """
    try:
        found = decompose(mesh)
    except PartError as error:
        true = part.truth.sides < LEAST_SIDES and f"{LEAST_SIDES} sides" in str(error)
        return Judgement("right" if true else "refused", str(error))
    wrong = faults(part, found)
    if not wrong:
        return Judgement("right", "")
    doubts = [line for line in found.warnings if isinstance(line, Warning) and line.code in DOUBTS]
    return Judgement("doubted" if doubts else "wrong", "; ".join([*wrong[:3], *doubts[:1]]))


def faults(part: CadPart, found: Decomposition) -> list[str]:
    """What a decomposition says otherwise than the truth; empty where it is right.

    Args:
        part: with its truth.
        found: of its mesh.

    Returns:
        One line each.
    """
    truth, T = part.truth, found.T_part_input
    lines = []
    up, point = T[:3, :3] @ truth.direction, T[:3, :3] @ truth.point + T[:3, 3]
    tilt = math.degrees(math.asin(min(float(np.hypot(*up[:2])), 1.0)))
    if tilt > AXIS_DEG:
        lines.append(f"axis {tilt:.3f} deg off")
    middle = 0.5 * (found.body_mesh.vertices[:, 2].max() + found.body_mesh.vertices[:, 2].min())
    foot = point + up * (middle - point[2]) / up[2] if tilt < 45 else point
    away = float(np.hypot(*(foot[:2] - found.body.axis_xy_mm)))
    scale = max((one.radius_mm for one in truth.stands), default=1.0)
    if away > RADIUS_SHARE * scale:
        lines.append(f"axis {away:.4f} mm off")
    if len(found.sub_volumes) != len(truth.stands):
        lines.append(f"{len(found.sub_volumes)} sub-volumes, not {len(truth.stands)}")
        return lines
    left = list(range(len(truth.stands)))
    for mesh, body, cone in zip(found.sub_volumes, found.bodies, found.cones, strict=True):
        best = min(left, key=lambda k: _off(truth.stands[k], mesh.volume, body.radius_mm))
        left.remove(best)
        want = truth.stands[best]
        if abs(mesh.volume / want.volume_mm3 - 1) > VOLUME_SHARE:
            lines.append(f"{want.kind} {mesh.volume:.2f} mm3, not {want.volume_mm3:.2f}")
        if want.half_angle_deg == 0 and abs(body.radius_mm / want.radius_mm - 1) > RADIUS_SHARE:
            lines.append(f"radius {body.radius_mm:.4f}, not {want.radius_mm:.4f}")
        angle = 0.0 if cone is None else abs(cone.half_angle_deg)
        if abs(angle - abs(want.half_angle_deg)) > AXIS_DEG + 0.01 * abs(want.half_angle_deg):
            lines.append(f"half angle {angle:.3f}, not {abs(want.half_angle_deg):.3f}")
    total = found.body_mesh.volume + sum(mesh.volume for mesh in found.sub_volumes)
    if abs(total / truth.volume_mm3 - 1) > VOLUME_SHARE:
        lines.append(f"whole {total:.2f} mm3, not {truth.volume_mm3:.2f}")
    return lines


def _off(want: Stands, volume: float, radius: float) -> float:
    return abs(math.log(volume / want.volume_mm3)) + (
        abs(math.log(radius / want.radius_mm)) if want.half_angle_deg == 0 else 0.0
    )
