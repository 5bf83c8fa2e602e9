"""From the end of one bead to the start of the next: out along the normal, across, in again.

    way = travel(planner, end, start, stage)
    q, dt, clearances = way                  # or a dict: why there is no way

Retracting and approaching are straight lines of the TCP; across, all joints move together. A travel that is not free is
tried again further out. Metres, radians, seconds.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ik import dls
from ik.chain import Floats
from ik.roll import RollWindow

from .bead import Stretch
from .between import unproved
from .collision import Clearances
from .follow import JUMP
from .plan import Planner

RETRACTS = (1.0, 2.0, 4.0)  # times the case's retract, until the travel is free


def travel(
    planner: Planner, end: Stretch, start: Stretch, stage: int
) -> tuple[Floats, Floats, Clearances] | dict[str, Any]:
    """From the end of one bead to the start of the next: out along the normal, across, in again.

    Args:
        planner: of the beads.
        end: what was welded last.
        start: what is welded next.
        stage: deposits laid by then.

    Returns:
        Samples (m, j), the time of each step (m - 1,), and their clearances; or why there is no way.
    """
    why: dict[str, Any] = {}
    for times in RETRACTS:
        retract = planner.settings.retract * times
        leave = _along_normal(planner, end.stop - 1, end.q_targets[-1], float(end.roll[-1]), retract)
        arrive = _along_normal(planner, start.first, start.q_targets[0], float(start.roll[0]), retract)
        if isinstance(leave, str) or isinstance(arrive, str):
            why = why or {"on_the_way": leave if isinstance(leave, str) else str(arrive)}
            continue
        q, dt = _joined(planner, leave, arrive[::-1])
        found = planner.checker.clearances(q, np.full(len(q), stage))
        if found.distance.min() < planner.settings.clearance:
            why = {"on_the_way": "collision", **planner.describe(found, int(np.argmin(found.distance)))}
            continue
        step, nearest = unproved(planner.checker, planner.radius, q, np.full(len(q), stage), found)
        if not len(step):
            return q, dt, found
        why = {"on_the_way": "collision", **planner.describe(nearest, 0)}
    return why


def _along_normal(planner: Planner, i: int, q: Floats, roll: float, distance: float) -> Floats | str:
    """Configurations from a target out along its normal, (m, j), or what stops it."""
    count = max(int(np.ceil(distance / (2 * planner.settings.steps.position))), 1)
    solver = planner.solver
    T = np.repeat(planner.placed.Ts_base_target[i : i + 1], count, axis=0)
    T[:, :3, 3] += np.linspace(0, distance, count + 1)[1:, None] * planner.placed.normal[i]
    found = dls.follow(solver.chain, T, np.repeat(q[None], count, axis=0), RollWindow.fixed(roll))
    if not found.ok.all():
        return "joint_limit"
    out = np.concatenate([q[None], found.q])
    if np.abs(np.diff(out, axis=0)).max() > JUMP:
        return "jump"
    return out


def _joined(planner: Planner, leave: Floats, arrive: Floats) -> tuple[Floats, Floats]:
    a, b = leave[-1], arrive[0]
    way = np.abs(b - a)
    count = max(int(np.ceil(way.max() / planner.settings.steps.angle)), 1)
    # a smooth start and stop, at half the joints' speed: accelerations are not looked at
    s = np.linspace(0, 1, count + 1)
    across = a + s[:, None] * (b - a)
    speed = planner.solver.chain.max_speed
    total = float((way / (0.5 * np.where(np.isfinite(speed), speed, 1.0))).max())
    out = 2 * planner.settings.steps.position / planner.settings.travel_speed
    dt = np.concatenate([np.full(len(leave) - 1, out), np.full(count, total / count), np.full(len(arrive) - 1, out)])
    return np.concatenate([leave, across[1:], arrive[1:]]), dt
