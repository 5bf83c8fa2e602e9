"""The greatest speeds along a rounded path, on a grid, under the joints' accelerations: what time laws are made of.

    x = greatest_squares([GridBounds(slope, bend, step, top)], max_acceleration)[0]     # squares, from rest to rest

A joint's acceleration on a step is a u + b x, with the path's own acceleration u and the square x of its speed at the
step's start: a is the path's slope at the start or at the end, b its bend. So every bound is linear in x, and of what
can follow a value on a step, forwards or backwards, the greatest is the least of a few straight lines. On a step on
which the path is straight they are one; where the speed is well within what all joints can, none is worked out. Of
several paths all are worked out together, as those of one path that stands wherever two of them meet.

Radians and seconds; the unit of the path's length is the caller's.

Source: Pham and Pham, A new approach to time-optimal path parameterization based on reachability analysis, IEEE T-RO
2018 (controllable sets backwards, greedily forwards).
"""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ik.chain import Floats

from ..arrays import Ints

FLAT_SLOPE = 1e-12  # slope that counts as none
STRAIGHT = 1e-12  # share of the slope that it changes by at most on a step that counts as straight
FIRST, MOST = 32, 1024  # steps whose lines are worked out at a time: where a limit does not follow, and further on
SAME_LINE = 1e-12  # share of a line's value that is rounding
_Line = tuple[float, float]  # slope and value at 0


@dataclass(frozen=True, eq=False)
class GridBounds:
    """What bounds the speed along a path on a grid, but for the joints' accelerations.

    Attributes:
        slope: of the path at the grid, (j, n + 1).
        bend: its change along each step, (j, n).
        step: lengths, (n,).
        top: greatest squares that other bounds allow, (n + 1,).
    """

    slope: Floats
    bend: Floats
    step: Floats
    top: Floats


def greatest_squares(paths: Sequence[GridBounds], max_acceleration: Floats) -> list[Floats]:
    """Squares of the greatest speeds on grids: a backward pass for stopping, then a greedy forward pass.

    Args:
        paths: each run from rest to rest; one at least.
        max_acceleration: of the joints, (j,), rad/s^2; infinite where unknown.

    Returns:
        Those of each path, (n + 1,).
    """
    ends = np.cumsum([len(path.top) for path in paths])
    # from one path to the next there is a step on which nothing bends, and at its ends they stand
    straight, one = np.zeros((len(max_acceleration), 1)), np.ones(1)
    slope, top = np.concatenate([path.slope for path in paths], axis=1), np.concatenate([path.top for path in paths])
    bend = np.concatenate([part for path in paths for part in (path.bend, straight)][:-1], axis=1)
    step = np.concatenate([part for path in paths for part in (path.step, one)][:-1])
    steps = _StepBounds(slope, bend, step, max_acceleration)
    limit = np.minimum(top, np.append(steps.most(top[:-1]), np.inf))
    limit[ends - 1] = 0.0
    backwards = ends[-1] - np.append(0, ends[:-1])[::-1]
    beta = _lowered(limit[::-1], _Pass(steps, backwards=True), backwards)[::-1]
    beta[np.append(0, ends[:-1])] = 0.0
    x = np.maximum(_lowered(beta, _Pass(steps, backwards=False), ends), 0.0)
    return np.split(x, ends[:-1])


@dataclass(frozen=True, eq=False)
class _TwoLines:
    """Of the lines of steps that follow one another two that are the least of them: the first up to where they cross.

    Attributes:
        every: all lines of the steps of which two are not enough.
        slope: of the one that is least at 0, (g,); NaN where two are not enough.
        give: its value at 0, (g,).
        other_slope: of the one that is least at the limit, (g,).
        other_give: its value at 0, (g,).
    """

    every: dict[int, list[_Line]]
    slope: list[float]
    give: list[float]
    other_slope: list[float]
    other_give: list[float]


class _StepBounds:
    """The bounds of all steps, as far as they are asked for."""

    def __init__(self, slope: Floats, bend: Floats, step: Floats, max_acceleration: Floats) -> None:
        self._slope, self._bend, self.h, self._limit = slope, bend, 2 * step, max_acceleration[:, None]
        steep = (np.abs(slope) / self._limit).max(axis=0)
        steep = np.maximum(steep[:-1], steep[1:])
        # no joint takes a greater share of its acceleration than |u| times the one and x times the other
        self._by_x = (np.abs(bend) / self._limit).max(axis=0)
        self._by_u = steep + self.h * self._by_x
        self.bent: NDArray[np.bool_] = self.h * self._by_x > STRAIGHT * steep
        with np.errstate(divide="ignore"):
            self.rise = self.h / steep  # of x on a straight step, at most

    def within(self, x: Floats) -> NDArray[np.bool_]:
        """Steps on which squares of the speed (n + 1,) follow from one another either way, for certain."""
        return np.abs(np.diff(x)) / self.h * self._by_u + x[:-1] * self._by_x <= 1.0

    def most(self, top: Floats) -> Floats:
        """The greatest x at each step's start from which anything can follow, (n,); infinite where it is above top."""
        out = np.full(len(self.h), np.inf)
        # what goes on at its speed is allowed
        some = np.flatnonzero(self.bent & (top * self._by_x > 1.0))
        if not len(some):
            return out
        reach, r = self._bounds(some)
        a, b = self._terms(some)
        with np.errstate(divide="ignore", invalid="ignore"):
            most = np.where((np.abs(a) <= FLAT_SLOPE) & (np.abs(b) > 0), self._both_limits / np.abs(b), np.inf)
            least = most.min(axis=0)
            for k in range(len(reach)):
                # one joint's lower bound against all upper bounds
                apart = r - r[k]
                cross = np.where(apart > FLAT_SLOPE, (reach + reach[k]) / apart, np.inf)
                least = np.minimum(least, cross.min(axis=0))
            # the speed at the step's end is not below 0
            apart = r - 1.0 / self.h[some]
            out[some] = np.minimum(least, np.where(apart > FLAT_SLOPE, reach / apart, np.inf).min(axis=0))
        return out

    def lines(self, some: Ints) -> tuple[Floats, Floats]:
        """Slopes and values at 0, (k, s) each, of what bounds x at the ends of bent steps (s,): x' <= gain x + give."""
        reach, r = self._bounds(some)
        h = self.h[some]
        return 1 - h * r, h * reach

    def _terms(self, some: Ints) -> tuple[Floats, Floats]:
        """Every joint's a and b at the starts of steps and at their ends, (2 j, s) each."""
        bend = self._bend[:, some]
        a = np.concatenate([self._slope[:, some], self._slope[:, some + 1] + self.h[some] * bend])
        return a, np.concatenate([bend, bend])

    @property
    def _both_limits(self) -> Floats:
        return np.concatenate([self._limit, self._limit])

    def _bounds(self, some: Ints) -> tuple[Floats, Floats]:
        """Bounds on the path's acceleration on steps, (2 j, s) each: |u + r x| <= reach."""
        a, b = self._terms(some)
        idle = np.abs(a) <= FLAT_SLOPE
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(idle, np.inf, self._both_limits / np.abs(a)), np.where(idle, 0.0, b / a)


class _Pass:
    """The steps in the order in which they are processed, with what can follow on each."""

    def __init__(self, steps: _StepBounds, *, backwards: bool) -> None:
        self._steps, self._backwards = steps, backwards
        order = slice(None, None, -1 if backwards else 1)
        self._rise, self._bent = steps.rise[order], steps.bent[order]
        self._order = order

    def starts(self, limit: Floats) -> Ints:
        """Steps on which limits (n + 1,) do not follow from one another."""
        known = self._steps.within(limit[self._order])[self._order]
        some = np.flatnonzero(~known)
        after = limit[some] + self._rise[some]
        bent = self._bent[some]
        gain, give = self._lines(some[bent])
        after[bent] = (gain * limit[some[bent]] + give).min(axis=0)
        return some[~(limit[some + 1] <= after)]

    def least_at(self, i: int, x: float) -> float:
        """The greatest that can follow a value on a step."""
        if not self._bent[i]:
            return x + float(self._rise[i])
        gain, give = self._lines(np.array([i]))
        return float((gain * x + give).min())

    def two(self, blocks: Sequence[tuple[int, int]], limit: Floats) -> list[_TwoLines]:
        """Of the lines of steps the two that are the least of them from 0 to limits.

        Args:
            blocks: the steps, each from one to one before another.
            limit: of each step, (n,) at least.
        """
        some = np.concatenate([np.arange(*block) for block in blocks])
        out = np.ones((4, len(some)))
        out[1] = out[3] = self._rise[some]
        mine, every = np.flatnonzero(self._bent[some]), {}
        if len(mine):
            gain, give = self._lines(some[mine])
            at_limit = gain * limit[some[mine]] + give
            step, one, other = np.arange(len(mine)), give.argmin(axis=0), at_limit.argmin(axis=0)
            a, b, c, d = gain[one, step], give[one, step], gain[other, step], give[other, step]
            with np.errstate(divide="ignore", invalid="ignore"):
                crossing = (d - b) / (a - c)
                # the least of straight lines is concave: what is not below these two where they cross is so nowhere
                least = (gain * crossing + give).min(axis=0)
                known = (one == other) | (least >= a * crossing + b - SAME_LINE * np.abs(b))
            known &= np.isfinite(at_limit[other, step])
            out[:, mine] = np.where(known, a, np.nan), b, c, d
            for n in np.flatnonzero(~known).tolist():
                every[int(some[mine[n]])] = list(zip(gain[:, n].tolist(), give[:, n].tolist(), strict=True))
        ends = np.cumsum([stop - first for first, stop in blocks])[:-1]
        lines = [np.split(each, ends) for each in out]
        return [_TwoLines(every, *(each[k].tolist() for each in lines)) for k in range(len(blocks))]

    def _lines(self, some: Ints) -> tuple[Floats, Floats]:
        """Slopes and values at 0 of the lines of bent steps, (k, s) each."""
        if not self._backwards:
            return self._steps.lines(some)
        gain, give = self._steps.lines(len(self._rise) - 1 - some)
        with np.errstate(divide="ignore", invalid="ignore"):
            on = gain > FLAT_SLOPE
            return np.where(on, 1 / gain, 0.0), np.where(on, give / gain, np.inf)


def _lowered(limit: Floats, steps: _Pass, ends: Ints) -> Floats:
    """The greatest values below limits of which each can follow on the one before.

    Where the limits themselves follow from one another, which is most of a bead at its speed, nothing is worked out.

    Args:
        limit: (n + 1,); the first of a path is its first value.
        steps: n of them.
        ends: one past the last value of each path.

    Returns:
        (n + 1,).
    """
    x, starts = limit.tolist(), steps.starts(limit)
    of_path = np.split(starts, np.searchsorted(starts, ends[:-1]))
    fall = [_falls(x, some.tolist(), end - 1, steps) for some, end in zip(of_path, ends.tolist(), strict=True)]
    asked = [(run, block) for run in fall for block in [next(run, None)] if block is not None]
    while asked:  # by all paths together
        lines = steps.two([block for _, block in asked], limit)
        answered = [(run, _next_block(run, some)) for (run, _), some in zip(asked, lines, strict=True)]
        asked = [(run, block) for run, block in answered if block is not None]
    return np.array(x)


_Falls = Generator[tuple[int, int], _TwoLines, None]


def _next_block(run: _Falls, lines: _TwoLines) -> tuple[int, int] | None:
    try:
        return run.send(lines)
    except StopIteration:
        return None


def _falls(x: list[float], starts: list[int], last: int, steps: _Pass) -> _Falls:
    """Lower the values of one path where they do not follow.

    Args:
        x: values of all paths, which are lowered.
        starts: steps of this one on which they do not follow.
        last: number of its last value.
        steps: the steps.

    Yields:
        Steps whose lines are asked for, from the first to one past the last; it takes those lines.
    """
    done, low, high = 0, 0, -1  # lines are known of the steps from low up to high
    lines: _TwoLines | None = None
    for start in starts:
        i = max(start, done)
        # plain floats: of two numbers a time numpy is the slower
        while i < last:
            if lines is None or not low <= i < high:
                count = min(2 * (high - low), MOST) if i == high else FIRST
                low, high = i, min(i + count, last)
                lines = yield low, high
                slope, give = lines.slope, lines.give
                other_slope, other_give = lines.other_slope, lines.other_give
            v, k = x[i], i - low
            one, other = slope[k] * v + give[k], other_slope[k] * v + other_give[k]
            if one != one or v < 0.0:
                v = min([a * v + b for a, b in lines.every[i]]) if i in lines.every else steps.least_at(i, v)
            else:
                v = one if one < other else other
            i += 1
            if not v < x[i]:
                break
            x[i] = v
        done = max(done, i)
