"""From the end of one bead to the start of the next: out along the normal, across, in again.

    way = travel(setup, end, start, stage)
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
from .setup import Setup

RETRACTS = (1.0, 2.0, 4.0)  # times the case's retract, until the travel is free
Way = tuple[Floats, Floats, Clearances]


def travel(setup: Setup, end: Stretch, start: Stretch, stage: int) -> Way | dict[str, Any]:
    """From the end of one bead to the start of the next: out along the normal, across, in again.

    Args:
        setup: what the search needs.
        end: what was welded last.
        start: what is welded next.
        stage: deposits laid by then.

    Returns:
        Samples (m, j), the time of each step (m - 1,), and their clearances; or why there is no way.
    """
    why: dict[str, Any] = {}
    for times in RETRACTS:
        retract = setup.settings.retract * times
        leave = _along_normal(setup, end.stop - 1, end.q_targets[-1], float(end.roll[-1]), retract)
        arrive = _along_normal(setup, start.first, start.q_targets[0], float(start.roll[0]), retract)
        if isinstance(leave, str) or isinstance(arrive, str):
            why = why or {"on_the_way": leave if isinstance(leave, str) else str(arrive)}
            continue
        q, dt = _joined(setup, leave, arrive[::-1])
        found = setup.checker.clearances(q, np.full(len(q), stage))
        if found.distance.min() < setup.settings.clearance:
            why = {"on_the_way": "collision", **setup.describe(found, int(np.argmin(found.distance)))}
            continue
        step, nearest = unproved(setup.checker, setup.radius, q, np.full(len(q), stage), found)
        if not len(step):
            return q, dt, found
        why = {"on_the_way": "collision", **setup.describe(nearest, 0)}
    return why


def _along_normal(setup: Setup, i: int, q: Floats, roll: float, distance: float) -> Floats | str:
    """Configurations from a target out along its normal, (m, j), or what stops it."""
    count = max(int(np.ceil(distance / (2 * setup.settings.steps.position))), 1)
    solver = setup.solver
    T = np.repeat(setup.placed.Ts_base_target[i : i + 1], count, axis=0)
    T[:, :3, 3] += np.linspace(0, distance, count + 1)[1:, None] * setup.placed.normal[i]
    found = dls.follow(solver.chain, T, np.repeat(q[None], count, axis=0), RollWindow.fixed(roll))
    if not found.ok.all():
        return "joint_limit"
    out = np.concatenate([q[None], found.q])
    if np.abs(np.diff(out, axis=0)).max() > JUMP:
        return "jump"
    return out


def _joined(setup: Setup, leave: Floats, arrive: Floats) -> tuple[Floats, Floats]:
    a, b = leave[-1], arrive[0]
    way = np.abs(b - a)
    count = max(int(np.ceil(way.max() / setup.settings.steps.angle)), 1)
    # a smooth start and stop, at half the joints' speed: accelerations are not looked at
    s = np.linspace(0, 1, count + 1)
    across = a + s[:, None] * (b - a)
    speed = setup.solver.chain.max_speed
    total = float((way / (0.5 * np.where(np.isfinite(speed), speed, 1.0))).max())
    out = 2 * setup.settings.steps.position / setup.settings.travel_speed
    dt = np.concatenate([np.full(len(leave) - 1, out), np.full(count, total / count), np.full(len(arrive) - 1, out)])
    return np.concatenate([leave, across[1:], arrive[1:]]), dt
