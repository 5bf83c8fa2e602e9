"""What the table does in a motion: how near to upright the beads are laid, and what the axes are asked for.

    use = table_use(result)                   # None without a motion
    use.document(), use.in_words()

Between targets the deposition direction is sampled as it is laid: along the great circle, the table turning evenly.
Radians.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ik.chain import Floats

from ..arrays import Ints
from ..job.table_winding import upright_of
from ..motion.motion import Motion
from ..rigid import great_circle
from ..scene.placement import PlacedTargets
from .result import Result

PLACES = np.linspace(0.0, 1.0, 9)  # between a target and the next at which the direction is checked
STILL = np.deg2rad(0.01)  # a turn back by less is none
NAMES = ("E1", "E2")

LEAST_TURN_DEG = 0.5  # an axis that turns less in all is not spoken of


@dataclass(frozen=True)
class TableUse:
    """Uprightness of a motion, and the use of its axes.

    Attributes:
        max_deg: greatest angle off up along the beads.
        at_target: the target at or after which it is.
        mean_deg: mean angle over the beads' length.
        within_deg: the angle that is asked for, or 10.
        share_within: share of the length that is within it.
        travel_deg: how far E1 and E2 turn in all.
        reversals: how often each turns back.
        slowest_axis: the axis that uses most of its speed while welding.
        slowest_share: how much of it, of its speed.
    """

    max_deg: float
    at_target: int
    mean_deg: float
    within_deg: float
    share_within: float
    travel_deg: tuple[float, float]
    reversals: tuple[int, int]
    slowest_axis: str
    slowest_share: float

    def document(self) -> dict[str, Any]:
        """As reports write it."""
        return {
            "upright": {
                "max_deg": round(self.max_deg, 3),
                "at_target": self.at_target,
                "mean_deg": round(self.mean_deg, 3),
                "within_deg": round(self.within_deg, 3),
                "share_within": round(self.share_within, 4),
            },
            "travel_deg": {name: round(v, 3) for name, v in zip(NAMES, self.travel_deg, strict=True)},
            "reversals": dict(zip(NAMES, self.reversals, strict=True)),
            "slowest_axis": {"axis": self.slowest_axis, "share_of_speed": round(self.slowest_share, 4)},
        }

    def in_words(self) -> str:
        """On one line."""
        turns = ", ".join(
            f"{name} {deg:.0f} deg with {k} reversals"
            for name, deg, k in zip(NAMES, self.travel_deg, self.reversals, strict=True)
            if deg >= LEAST_TURN_DEG
        )
        return (
            f"up to {self.max_deg:.1f} deg off upright (target {self.at_target}), {self.mean_deg:.1f} deg on average, "
            f"{100 * self.share_within:.0f} % of the length within {self.within_deg:g} deg"
            f"{f'; {turns}' if turns else ''}; {self.slowest_axis} at {100 * self.slowest_share:.0f} % of its speed"
            " while welding"
        )


def table_use(result: Result) -> TableUse | None:
    """What the table does in a result's motion; None where it has none."""
    motion = result.motion
    if motion is None:
        return None
    job = result.job
    off, weight, target = _along(result.placed, job.scene.T_world_base()[2, :3], job.targets.bead)
    limit = upright_of(job.case)
    worst = int(np.argmax(off))
    share, axis = _slowest(motion, job.drives.speed)
    total = max(float(weight.sum()), 1e-30)
    return TableUse(
        max_deg=float(np.rad2deg(off[worst])),
        at_target=int(target[worst]),
        mean_deg=float(np.rad2deg((off * weight).sum() / total)),
        within_deg=float(np.rad2deg(limit)),
        share_within=float(weight[off <= limit + 1e-9].sum() / total),
        travel_deg=_pair(np.rad2deg(np.abs(np.diff(motion.table, axis=0)).sum(axis=0))),
        reversals=(_reversals(motion.table[:, 0]), _reversals(motion.table[:, 1])),
        slowest_axis=job.drives.names[axis],
        slowest_share=share,
    )


def _pair(values: Floats) -> tuple[float, float]:
    return float(values[0]), float(values[1])


def _along(placed: PlacedTargets, up: Floats, bead_of_target: Ints) -> tuple[Floats, Floats, Ints]:
    """Angle off up at places along the beads, the length that each stands for, and the target before it."""
    bead = placed.bead
    on = np.flatnonzero(np.diff(bead_of_target) == 0)
    length = np.linalg.norm(bead.position[on + 1] - bead.position[on], axis=1)
    share = np.full(len(PLACES), 1.0 / (len(PLACES) - 1))
    share[[0, -1]] /= 2
    off = []
    for t in PLACES:
        there = np.full(len(on), t)
        normal = great_circle(bead.normal[on], bead.normal[on + 1], there)
        if placed.moving is not None:
            normal = placed.moving.kinematics.directions(placed.tables(on, there), normal)
        off.append(2 * np.arcsin(np.clip(np.linalg.norm(normal - up, axis=1) / 2, 0.0, 1.0)))
    target = np.tile(on, len(PLACES))
    return np.concatenate(off), np.concatenate([length * s for s in share]), target


def _reversals(angle: Floats) -> int:
    """How often an angle turns back by more than ``STILL``."""
    count, direction, extreme = 0, 0, float(angle[0])
    for value in angle.tolist():
        if direction == 0:
            if abs(value - extreme) > STILL:
                direction, extreme = (1 if value > extreme else -1), value
        elif (value - extreme) * direction >= 0:
            extreme = value
        elif abs(value - extreme) > STILL:
            count, direction, extreme = count + 1, -direction, value
    return count


def _slowest(motion: Motion, speed: Floats) -> tuple[float, int]:
    """Greatest share of its speed that any axis uses while welding, and which."""
    axes = np.concatenate([motion.q, motion.table], axis=1)
    use = np.abs(np.diff(axes, axis=0)) / np.diff(motion.t_s)[:, None] / speed
    most = np.where(motion.welding[:, None], use, 0.0).max(axis=0)
    return float(most.max()), int(np.argmax(most))
