"""When the rows of travels are passed, and where on a travel the arm waits.

    found = timed_travels(job, [AskedTravel(way, leads_to, wait)])       # rows between the ends, time of the last step

Along the normal the torch retracts and approaches at the speed of the TCP asked for; across, and on ways from home and
back, the joints move as fast as they can. Radians, metres, seconds.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ik.chain import Floats

from ...arrays import Ints
from ...motion.motion import NO_MOVE
from ...rigid import inverse
from ...scene.table_kinematics import TableKinematics
from ...timing.time_law import TravelRows, time_travels
from ...units import METRES_PER_MM

if TYPE_CHECKING:
    from ...job.job import Job


@dataclass(frozen=True, eq=False)
class TimedRows:
    """Rows of a bead or a travel.

    Attributes:
        q: rows, (m, j), rad, or (m, j + 2) with E1 and E2.
        dt: time from the row before to each, (m,), s.
        arc: 1 while welding.
        target: that each row leads to, (m,).
    """

    q: Floats
    dt: Floats
    arc: int
    target: Ints


@dataclass(frozen=True, eq=False)
class AskedTravel:
    """A travel whose rows are to be timed.

    Attributes:
        path: its rows, from the last of a bead or from rest to the first of the next, (m, j), rad.
        leads_to: target.
        wait: in which the arm stands once it is drawn back, s.
        begins: whether the motion begins with it: its first row is its own then, as with
        ends: its last, where the motion ends with it.
    """

    path: Floats
    leads_to: int
    wait: float = 0.0
    begins: bool = False
    ends: bool = False

    def __post_init__(self) -> None:
        path = self.path
        moves = np.abs(np.diff(path, axis=0)).max(axis=1) > NO_MOVE
        moves[-1] |= not moves.any()
        path = np.concatenate([path[:1], path[1:-1][moves[:-1]], path[-1:]])
        if len(path) == 2:
            path = np.insert(path, 1, path.mean(axis=0), axis=0)  # a row with the arc off
        object.__setattr__(self, "path", path)


def timed_travels(job: Job, asked: Sequence[AskedTravel]) -> list[tuple[TimedRows, float]]:
    """Give travels their times, all of them together.

    Args:
        job: the job.
        asked: travels with the same axes.

    Returns:
        The rows of each between its ends, and the time of its last step. The ends are the beads' own rows, but for what
        the motion begins or ends with: there they are the travel's.
    """
    if not asked:
        return []
    places = on_the_part(job, np.concatenate([one.path for one in asked]))
    places_of = np.split(places, np.cumsum([len(one.path) for one in asked])[:-1])
    stops: list[int | None] = []
    rows: list[TravelRows] = []
    for one, p in zip(asked, places_of, strict=True):
        cap = _near_the_part(job, one.path, p, leaves=not one.begins, arrives=not one.ends)
        stop = retracted(job, p) if one.wait > 0 else None
        stops.append(stop)
        if stop is None:
            rows.append(TravelRows(one.path, cap))
        else:
            rows += [TravelRows(one.path[: stop + 1], cap[:stop]), TravelRows(one.path[stop:], cap[stop:])]
    times = iter(time_travels(rows, *limits_of(job, asked[0].path)))
    out: list[tuple[TimedRows, float]] = []
    for one, stop in zip(asked, stops, strict=True):
        path, dt = one.path, next(times)
        if stop is not None:
            path, dt = np.insert(path, stop, path[stop], axis=0), np.concatenate([dt, [one.wait], next(times)])
        if one.begins:
            path, dt = np.concatenate([path[:1], path]), np.concatenate([[0.0], dt])
        if one.ends:
            path, dt = np.concatenate([path, path[-1:]]), np.concatenate([dt, [0.0]])
        out.append((TimedRows(path[1:-1], dt[:-1], 0, np.full(len(path) - 2, one.leads_to)), float(dt[-1])))
    return out


def _near_the_part(job: Job, path: Floats, p: Floats, *, leaves: bool, arrives: bool) -> Floats:
    """Caps on the joints' speed where a travel retracts and approaches at the speed of the TCP asked for, (m - 1,)."""
    process = job.case.process
    near = process.retract_mm * METRES_PER_MM + NO_MOVE
    leaving = np.logical_and.accumulate(np.linalg.norm(p[1:] - p[0], axis=1) <= near)
    arriving = np.logical_and.accumulate(np.linalg.norm(p[:-1] - p[-1], axis=1)[::-1] <= near)[::-1]
    step = np.maximum(np.linalg.norm(np.diff(p, axis=0), axis=1), NO_MOVE)
    speed = process.travel_speed_mm_s * METRES_PER_MM * np.linalg.norm(np.diff(path, axis=0), axis=1) / step
    return np.where((leaving & leaves) | (arriving & arrives), np.maximum(speed, NO_MOVE), np.inf)


def retracted(job: Job, p: Floats) -> int:
    """The first sample of a travel that is off the part by the retraction, or else the farthest off."""
    off = np.linalg.norm(p - p[0], axis=1)[1:-1]
    far = np.flatnonzero(off >= job.case.process.retract_mm * METRES_PER_MM - NO_MOVE)
    return 1 + (int(far[0]) if len(far) else int(np.argmax(off)))


def limits_of(job: Job, rows: Floats) -> tuple[Floats, Floats]:
    """Speeds and accelerations of the axes that rows have: the arm's, or the table's as well."""
    drives = job.drives
    if rows.shape[1] > job.scene.chain.n:
        return drives.speed, drives.acceleration
    return drives.arm_speed, drives.arm_acceleration


def on_the_part(job: Job, rows: Floats) -> Floats:
    """Where the TCP is, (m, 3), m: seen from the part where the table moves, else from the base."""
    n = job.scene.chain.n
    Ts = job.scene.chain.forward(rows[:, :n])
    if rows.shape[1] > n:
        Ts = inverse(TableKinematics.of(job.scene).poses(rows[:, n:])) @ Ts
    return np.asarray(Ts[:, :3, 3])
