"""The table turning from one pose to another while the arm stands still: its way, proved free, and its time.

    turn = TurnSearch(job).search(q, (E1, E2), (E1, E2), deposits_laid)
    turn.table, turn.dt_s                     # or a Failure: why there is no way

Both axes move together on a straight line, or one after the other where that is not free, or by way of the table
level. The arm keeps the clearance from all that moves, its wire does not touch the part, and what stands on the table
touches nothing: at the samples and between them. Metres, radians, seconds.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from ik.chain import Floats

from ..collision.checker import NEVER, Checker
from ..collision.clearances import CLEARANCE_REACH, Clearances, SeesClearances
from ..collision.proofs.between_samples import unproven_steps
from ..collision.proofs.reach_radii import all_radii, table_radii
from ..collision.table_clearances import TableChecker, with_table_axes
from ..collision.wire import WIRE_REACH, wire_scene
from ..failure import Contact, Failure, FailurePlace, Kind, Where
from ..planning.context import settings_of
from ..scene.scene import Scene
from ..timing.time_law import time_travel
from ..units import METRES_PER_MM

if TYPE_CHECKING:
    from ..job.job import Job

Angles = tuple[float, float]
STEP = np.deg2rad(1.0)  # between samples
STILL_S = (
    0.02  # s that everything stands between two ways: a controller stops exactly where a row repeats the one before
)


@dataclass(frozen=True, eq=False)
class TableTurn:
    """A way of the table that is free.

    Attributes:
        q: where the arm stands, (j,), rad.
        rows: E1, E2 as it is run, (m, 2), rad; it stands between two ways.
        dt_s: time of each step between them, (m - 1,), s.
        looked_at: samples of E1, E2, (k, 2), rad.
        clearances: the arm's from everything, at these samples.
        deposits_laid: deposits laid.
    """

    q: Floats
    rows: Floats
    dt_s: Floats
    looked_at: Floats
    clearances: Clearances
    deposits_laid: int

    @property
    def axes(self) -> Floats:
        """All axes at the samples checked, (k, j + 2), rad."""
        return np.concatenate([np.tile(self.q, (len(self.looked_at), 1)), self.looked_at], axis=1)


def nearest_turn(scene: Scene, pose: Angles, before: Angles) -> Angles:
    """The same pose with whole turns of its axes added that bring it nearest to where the table stands.

    Args:
        scene: the cell.
        pose: E1, E2, rad.
        before: where they stand, rad.

    Returns:
        E1, E2, rad, within the axes' ranges.
    """
    out = []
    for value, at, (low, high), there in zip(pose, before, scene.table_range, scene.has_axis, strict=True):
        turn = 2 * np.pi
        near = round((at - value) / turn)
        same = [value + (near + k) * turn for k in (-1, 0, 1)] if there else []
        inside = [v for v in same if low - 1e-9 <= v <= high + 1e-9]
        out.append(min(inside, key=lambda v: abs(v - at)) if inside else value)
    return float(out[0]), float(out[1])


def turn_time(job: Job, a: Angles, b: Angles) -> float:
    """Seconds that the table takes from one pose straight to another, (E1, E2), rad."""
    table = _sampled(np.array([a, b]))
    return float(_times(job, table).sum())


class TurnSearch:
    """Finds ways of a job's table; what they all need is prepared once."""

    def __init__(self, job: Job) -> None:
        """Prepare.

        Args:
            job: the job.
        """
        self.job, self.scene = job, job.scene
        settings = settings_of(job)
        self.clearance, self.kept = settings.clearance, settings.kept
        self.radius, self.table_radius = all_radii(job.scene), table_radii(job.scene)
        self.arm = Checker(with_table_axes(job.scene), (0.0, 0.0), max(CLEARANCE_REACH, 2 * settings.clearance))
        wire = wire_scene(job.scene)
        self.wire = None if wire is None else Checker(with_table_axes(wire), (0.0, 0.0), WIRE_REACH, pair_gap=NEVER)
        self.table = TableChecker(job.scene, CLEARANCE_REACH)

    def search(self, q: Floats, a: Angles, b: Angles, deposits_laid: int) -> TableTurn | Failure:
        """The first of the ways from one pose to another that is free.

        Args:
            q: where the arm stands, (j,), rad.
            a: E1, E2 that the table comes from, rad.
            b: E1, E2 that it goes to, rad.
            deposits_laid: deposits laid by then.

        Returns:
            The way; or what is in its way, of the straight one.
        """
        why: Failure | None = None
        for corners in _ways(self.scene, a, b):
            table = _sampled(corners)
            found = self._checked(q, table, deposits_laid)
            if isinstance(found, Clearances):
                rows, dt_s = _run(self.job, corners)
                return TableTurn(q, rows, dt_s, table, found, deposits_laid)
            why = why or found
        assert why is not None
        return why

    def _checked(self, q: Floats, table: Floats, deposits_laid: int) -> Clearances | Failure:
        axes = np.concatenate([np.tile(q, (len(table), 1)), table], axis=1)
        alone = self._met(self.table, self.table_radius, table, deposits_laid, 0.0)
        if isinstance(alone, Failure):
            return alone
        found = self._met(self.arm, self.radius, axes, deposits_laid, self.clearance, self.kept)
        if isinstance(found, Failure):
            return found
        if self.wire is not None:
            drawn = self._met(self.wire, self.radius, axes, deposits_laid, 0.0)
            if isinstance(drawn, Failure):
                return drawn
        return found

    def _met(
        self,
        checker: SeesClearances,
        radius: Floats,
        rows: Floats,
        deposits_laid: int,
        least: float,
        kept: float | None = None,
    ) -> Clearances | Failure:
        """Clearances of samples that keep one, between them as well; or what they meet."""
        laid = np.full(len(rows), deposits_laid)
        found = checker.clearances(rows, laid)
        k = int(np.argmin(found.distance))
        if found.distance[k] < least:
            return self._failure(found, k, least)
        step, nearest = unproven_steps(checker, radius, rows, laid, found, least=least if kept is None else kept)
        return self._failure(nearest, 0, least) if len(step) else found

    def _failure(self, found: Clearances, k: int, least: float) -> Failure:
        distance = float(found.distance[k])
        contact = Contact(
            pair=tuple(self.scene.geom_name(int(g)) for g in found.pair[k] if g >= 0),
            world_xyz_mm=tuple(round(float(v) / METRES_PER_MM, 2) for v in found.position[k]),
        )
        measure = round(distance / METRES_PER_MM, 3) if np.isfinite(distance) else CLEARANCE_REACH / METRES_PER_MM
        return Failure(
            Kind.COLLISION,
            measure=measure,
            limit=round(least / METRES_PER_MM, 3),
            contact=contact,
            place=FailurePlace(Where.TABLE_TURN),
        )


def _ways(scene: Scene, a: Angles, b: Angles) -> Iterator[Floats]:
    """Corners of the ways tried, the shortest first."""
    level = float(np.clip(0.0, *scene.table_range[0]))
    tried: list[tuple[Angles, ...]] = []
    for between in ([], [(b[0], a[1])], [(a[0], b[1])], [(level, a[1]), (level, b[1])]):
        way = [a]
        for corner in (*between, b):
            if max(abs(corner[0] - way[-1][0]), abs(corner[1] - way[-1][1])) > 1e-9:
                way.append(corner)
        if tuple(way) not in tried:
            tried.append(tuple(way))
            yield np.array(way if len(way) > 1 else [a, a])


def _sampled(corners: Floats) -> Floats:
    """Samples on straight lines between corners, (m, 2)."""
    rows = [corners[:1]]
    for start, end in pairwise(corners):
        count = max(int(np.ceil(np.abs(end - start).max() / STEP - 1e-9)), 1)
        rows.append(start + np.arange(1, count + 1)[:, None] / count * (end - start))
    return np.concatenate(rows)


def _run(job: Job, corners: Floats) -> tuple[Floats, Floats]:
    """Rows of straight ways from corner to corner, each from rest to rest, (m, 2), and their times, (m - 1,), s."""
    rows, times = [corners[:1]], []
    for k, (start, end) in enumerate(pairwise(corners)):
        if k:
            rows.append(start[None])
            times.append(np.array([STILL_S]))
        leg = _sampled(np.array([start, end]))
        rows.append(leg[1:])
        times.append(_times(job, leg))
    return np.concatenate(rows), np.concatenate(times)


def _times(job: Job, table: Floats) -> Floats:
    """Times of the steps of one straight way, from rest to rest, (m - 1,), s."""
    drives = job.drives
    return time_travel(table, drives.speed[-2:], drives.acceleration[-2:])
