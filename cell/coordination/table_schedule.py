"""Where the table is at every target: the deposition direction near to up, the axes as slow as that allows.

    way = Schedule(freedom, upright, speed)
    tables = way.along(normals, bead_of_target, length, aim=aim).tables        # (n, 2) rad

What is exactly upright is known in closed form: two solutions, and E2 undefined where a direction is along it. Taken is
not that, but what comes with the least squares of the axes' speeds (each against what it can do) inside the cone about
up: where a direction is near to E2's own, or hardly changes, the table stands or tilts, and does not race. It is found
by pulling every target towards exactly upright just as hard as keeps it in the cone; each pull is a banded system of
equations. Radians and metres.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solveh_banded

from ik.chain import Floats

from ..arrays import Ints
from ..rigid import great_circle
from ..scene.table_freedom import TURN, TableFreedom

MOST_ADJUSTMENTS = 80  # of the pulls' adjustment
SHARES = (0.95, 0.85, 0.7, 0.5, 0.25)  # of the cone, to be kept at the targets, so that all of it is between them
KEPT_CONE = 0.995  # of the cone, to be kept all along
BETWEEN = np.linspace(0.0, 1.0, 9)  # places on the way from target to target that are checked
TRAVEL = 0.5  # m that count for the way from bead to bead
CALM = 0.5  # m of a bead over which the table comes back to upright where nothing else pulls it
LEAST_LENGTH = 1e-5  # m between targets, at least
STRONGEST = 1e12
UNLIMITED_AXIS_SPEED = np.deg2rad(
    100.0
)  # rad/s of an axis that has no limit: it only weighs one axis against the other
SAME_LEAN = 1e-9


@dataclass(frozen=True, eq=False)
class TableMotion:
    """Table angles along a part.

    Attributes:
        tables: E1, E2 at each target, (n, 2), rad.
        off: greatest angle from up on the way from each target to the next of its bead, (n,), rad.
    """

    tables: Floats
    off: Floats


@dataclass(frozen=True, eq=False)
class Schedule:
    """What the table is to keep.

    Attributes:
        freedom: its axes.
        upright: how far off up the deposition direction may be, rad.
        speed: of the axes, (2,), rad/s.
    """

    freedom: TableFreedom
    upright: float
    speed: Floats

    def along(
        self, normals: Floats, bead_of_target: Ints, length: Floats, *, side: int = 0, aim: Floats | None = None
    ) -> TableMotion:
        """Table angles at all targets of a part.

        Args:
            normals: deposition directions, (n, 3), part frame.
            bead_of_target: bead of each target, (n,), ascending.
            length: to the next target, (n - 1,), m.
            side: which of the two solutions beads begin with.
            aim: direction that is exact, (3,), base frame; up where left out.

        Returns:
            The table's way; where ``off`` is beyond the cone none was found that keeps it.
        """
        exact = self._tracked(normals, bead_of_target, side, aim)
        goal = self.freedom.kinematics.up if aim is None else aim
        lean = float(np.arccos(np.clip(goal @ self.freedom.kinematics.up, -1.0, 1.0)))
        best: TableMotion | None = None
        for share in SHARES:
            tables = self._relaxed(normals, bead_of_target, length, exact, share * (self.upright - lean), goal)
            off = self._off(normals, bead_of_target, tables)
            if best is None or off.max() < best.off.max() - SAME_LEAN:
                best = TableMotion(tables, off)
            if off.max() <= KEPT_CONE * self.upright:
                break
        assert best is not None
        return best

    def _tracked(self, normals: Floats, bead_of_target: Ints, side: int, aim: Floats | None) -> Floats:
        """Exactly upright angles, (n, 2): one solution all along a bead, in turns that the axes have."""
        f = self.freedom
        some = f.exact(normals, aim)
        if not f.moves[1]:
            return self._tilted(some[0], bead_of_target)
        if f.moves[0]:
            # in one piece over its range, before one solution is followed from target to target
            some = np.stack([np.stack([f.wrapped(each)[:, 0], each[:, 1]], axis=1) for each in some])
        width = f.turns(normals, some[0], self.upright).min(axis=1)
        free = width >= np.pi / 2  # E2 does as it likes: another solution may follow
        out = np.empty_like(some[0])
        ends = np.flatnonzero(np.diff(bead_of_target, prepend=-1, append=bead_of_target[-1] + 1))
        before: Floats | None = None
        for first, stop in zip(ends[:-1].tolist(), ends[1:].tolist(), strict=True):
            mine, wide = some[:, first:stop], np.stack([width[first:stop]] * 2, axis=1)
            beads = []
            for start in (side, 1 - side)[: len(some)]:
                bead = self._one_bead(mine, free[first:stop], min(start, len(some) - 1))
                turns, over = self._turns(bead[:, 1], wide, None if before is None else float(before[1]))
                bead[:, 1] += turns
                if f.moves[0]:
                    over += self._tilted_into_range(bead, None if before is None else float(before[0]))
                beads.append((round(over, 6), bead))
            # the other solution only where this one does not fit into the ranges
            bead = min(beads, key=lambda each: each[0])[1]
            out[first:stop], before = bead, bead[-1]
        if f.moves[0] and free.any():
            E1 = f.kinematics.nearest(normals[free], out[free, 1], 0, aim)
            about = out[free, 0] if self._tilts_round() else f.middle(0)
            out[free, 0] = (E1 - about + np.pi) % TURN - np.pi + about
        return out

    def _tilts_round(self) -> bool:
        """Whether E1 has a whole turn or more, so that the same direction comes at several of its angles."""
        return not self.freedom.high[0] - self.freedom.low[0] < TURN

    def _tilted_into_range(self, bead: Floats, before: float | None) -> float:
        """Add whole turns to E1 of one bead's angles (t, 2), so that it is in its range; how far it is outside, rad."""
        if self._tilts_round():
            bead[:, 0] = np.unwrap(bead[:, 0])
            turns, _ = self._turns(bead[:, 0], np.zeros((len(bead), 2)), before, axis=0)
            bead[:, 0] += turns
        low, high = self.freedom.low[0] - self.upright, self.freedom.high[0] + self.upright
        return float(np.maximum(np.maximum(bead[:, 0] - high, low - bead[:, 0]), 0.0).max())

    def _tilted(self, exact: Floats, bead_of_target: Ints) -> Floats:
        """Angles (n, 2) of a table that E1 alone moves: steady along a bead, in turns that it has."""
        out = exact.copy()
        ends = np.flatnonzero(np.diff(bead_of_target, prepend=-1, append=bead_of_target[-1] + 1))
        before: float | None = None
        for first, stop in pairwise(ends.tolist()):
            bead = np.unwrap(exact[first:stop, 0])
            turns, _ = self._turns(bead, np.zeros((len(bead), 2)), before, axis=0)
            out[first:stop, 0] = bead + turns
            before = float(out[stop - 1, 0])
        return out

    def _one_bead(self, some: Floats, free: NDArray[np.bool_], start: int) -> Floats:
        """One bead's exact angles, (t, 2), steady: E2 does not jump but where it does as it likes.

        Args:
            some: solutions, (s, t, 2), rad.
            free: targets at which E2 does as it likes, (t,): from the one before to the one after it turns evenly.
            start: solution to begin with.
        """
        out, speed = some[start].copy(), self._speed()
        fixed = np.flatnonzero(~free)
        if not len(fixed):
            return out
        last = out[fixed[0]]
        for i in fixed[1:].tolist():
            there = some[:, i].copy()
            there[:, 1] += TURN * np.round((last[1] - there[:, 1]) / TURN)
            if self._tilts_round():
                there[:, 0] += TURN * np.round((last[0] - there[:, 0]) / TURN)
            # the other solution is nearer only across the place where E2 is undefined
            k = int(np.argmin((np.abs(there - last) / speed).max(axis=1)))
            out[i] = last = there[k]
        out[free, 1] = np.interp(np.flatnonzero(free), fixed, out[fixed, 1])
        return out

    def _turns(self, angle: Floats, width: Floats, before: float | None, axis: int = 1) -> tuple[float, float]:
        """Whole turns that bring a bead into an axis' range as far as can be, nearest to the bead before; and the rest.

        Args:
            angle: of the axis along the bead, (t,), rad.
            width: how far it may be off, down and up, (t, 2), rad.
            before: where the bead before ended, rad; None where there is none.
            axis: 0 of E1, 1 of E2.

        Returns:
            The turns, and how far the bead is outside the range with them, rad.
        """
        low, high = self.freedom.low[axis], self.freedom.high[axis]
        ends = [abs(at) / TURN for at in (low, high, 0.0 if before is None else before) if np.isfinite(at)]
        most_turns = 2 + int(np.ceil(max(ends)))
        turns = TURN * (np.arange(-most_turns, most_turns + 1) + np.round(-angle.mean() / TURN))
        over = np.zeros(len(turns))
        if np.isfinite(low) and np.isfinite(high):
            most, least = (angle - width[:, 0]).max(), (angle + width[:, 1]).min()
            over = np.maximum(np.maximum(most + turns - high, low - least - turns), 0.0)
        away = np.abs(angle[0] + turns - (0.0 if before is None else before))
        k = int(np.lexsort((away, np.round(over, 6)))[0])
        return float(turns[k]), float(over[k])

    def _speed(self) -> Floats:
        return np.where(np.isfinite(self.speed), self.speed, UNLIMITED_AXIS_SPEED)

    def _relaxed(
        self, normals: Floats, bead_of_target: Ints, length: Floats, exact: Floats, cone: float, goal: Floats
    ) -> Floats:
        """Angles of least squared speed inside a cone about a direction, (n, 2), and inside the axes' ranges."""
        f = self.freedom
        n = len(normals)
        same = np.diff(bead_of_target) == 0
        stiff = 1.0 / np.where(same, np.maximum(length, LEAST_LENGTH), TRAVEL)
        weight = 1.0 / self._speed() ** 2
        pull = f.kinematics.pull(exact, normals)  # (n, 2, 3)
        metric = np.einsum("nax,nbx->nab", pull, pull)
        force, wall = np.full(n, stiff.mean() if n > 1 else 1.0), np.zeros((n, 2))
        weakest = np.append(np.where(same, np.maximum(length, LEAST_LENGTH), LEAST_LENGTH), LEAST_LENGTH)
        weakest *= weight.min() / CALM**2
        tables = np.clip(exact, f.low, f.high)
        for _ in range(MOST_ADJUSTMENTS):
            bound = np.clip(tables, f.low, f.high)
            tables = _solved(stiff, weight, force[:, None, None] * metric, exact, wall, bound, f.moves)
            off = f.kinematics.off(np.clip(tables, f.low, f.high), normals, goal)
            force = np.clip(force * np.clip(off / max(cone, 1e-6), 0.3, 3.0), weakest, STRONGEST)
            outside = (tables < f.low) | (tables > f.high)
            wall = np.where(outside, np.clip(4 * wall, stiff.mean() * weight, STRONGEST), wall / 2)
        tables = np.where(f.moves, np.clip(tables, f.low, f.high), exact)
        return self._into_cone(normals, tables, np.clip(exact, f.low, f.high), cone, goal)

    def _into_cone(self, normals: Floats, tables: Floats, exact: Floats, cone: float, goal: Floats) -> Floats:
        """Angles drawn towards the exact ones where they are outside the cone."""
        off = self.freedom.kinematics.off(tables, normals, goal)
        bad = np.flatnonzero(off > cone)
        if not len(bad):
            return tables
        out = tables.copy()
        low, high = np.zeros(len(bad)), np.ones(len(bad))
        for _ in range(30):
            middle = (low + high) / 2
            there = exact[bad] + middle[:, None] * (tables[bad] - exact[bad])
            good = self.freedom.kinematics.off(there, normals[bad], goal) <= cone
            low, high = np.where(good, middle, low), np.where(good, high, middle)
        out[bad] = exact[bad] + low[:, None] * (tables[bad] - exact[bad])
        return out

    def _off(self, normals: Floats, bead_of_target: Ints, tables: Floats) -> Floats:
        """Greatest angle from up at each target and on the way to the next of its bead, (n,), rad."""
        k = self.freedom.kinematics
        off = k.off(tables, normals)
        on = np.flatnonzero(np.diff(bead_of_target) == 0)
        for t in BETWEEN[1:-1]:
            there = great_circle(normals[on], normals[on + 1], np.full(len(on), t))
            off[on] = np.maximum(off[on], k.off(tables[on] + t * (tables[on + 1] - tables[on]), there))
        return off


def _solved(
    stiff: Floats, weight: Floats, metric: Floats, exact: Floats, wall: Floats, bound: Floats, moves: Any
) -> Floats:
    """Angles (n, 2) with the least sum of squared speeds and pulls."""
    n = len(exact)
    band = np.zeros((3, 2 * n))  # upper diagonals of the two axes' equations, one target after the other
    right = np.zeros((n, 2))
    held = np.zeros(n)
    held[:-1] += stiff
    held[1:] += stiff
    diagonal = held[:, None] * weight + metric[:, [0, 1], [0, 1]] + wall
    right += np.einsum("nab,nb->na", metric, exact) + wall * bound
    band[2] = np.where(moves, diagonal, 1.0).reshape(-1)
    right = np.where(moves, right, exact)
    if moves.all():
        band[1, 1::2] = metric[:, 0, 1]
    band[0, 2:] = (-stiff[:, None] * np.where(moves, weight, 0.0)).reshape(-1)
    return np.asarray(solveh_banded(band, right.reshape(-1))).reshape(n, 2)
