"""Time laws: how fast a given joint path can be run.

    law = time_path(q, s, max_speed, max_acceleration, cap=speeds, zone=1e-3)   # along a bead, s in metres of the TCP
    law.t, law.speed                                # at every sample; law.cause(a, b) says what slows it down
    dt = time_travel(q, max_speed, max_acceleration)                            # from rest to rest
    laws = time_paths([PathRows(q, s, cap, zone)], max_speed, max_acceleration)     # of many, which costs less for each

The fastest law there is under joint speeds, joint accelerations and a cap on the path's own speed, from rest to rest.
A path of straight pieces has corners, which no axis can run through at any speed; a controller rounds them. So the
path that is timed is the samples' moving average over ``zone`` each way: straight where they are straight, and at a
corner the parabola of a controller's blend (C_DIS with that distance), which leaves the corner by a quarter of the
zone times the change of direction (0.35 of the zone at a right angle). The samples themselves stay as they are; that
the rounded path is free as well is ``cell.collision.blended_corners``'.
Radians and seconds; the unit of the path's length is the caller's.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ik.chain import Floats

from .blending import TRAVEL_ZONE, kept_zone, mirrored
from .greatest_speeds import FLAT_SLOPE, GridBounds, greatest_squares
from .time_grid import PER_ZONE, counting_corners, time_grid

FEW = 1000  # grid steps, up to which all pieces are processed finely
EVEN = 0.99  # of the square of the speed: where it is less beside more, the speed changes
TOGETHER = 50_000  # grid steps of paths that are worked out together


@dataclass(frozen=True, eq=False)
class TimeLaw:
    """When a path's samples are passed.

    Attributes:
        t: time at every sample, (m,), s, from 0.
        speed: speed along the path at every sample, (m,), in its unit of length a second.
        grid: path lengths between and at the samples at which the law was worked out, (g,).
        use: share of its speed, and of its acceleration, that every joint needs there, (g, 2, j).
    """

    t: Floats
    speed: Floats
    grid: Floats
    use: Floats

    def cause(self, low: float, high: float) -> tuple[int, str]:
        """What holds the speed down between two path lengths.

        Args:
            low: from here.
            high: to here.

        Returns:
            The joint that is used most, and "speed" or "acceleration".
        """
        here = (self.grid >= low) & (self.grid <= high)
        kind, joint = np.unravel_index(int(np.argmax(self.use[here].max(axis=0))), self.use.shape[1:])
        return int(joint), ("speed", "acceleration")[int(kind)]


def time_path(
    q: Floats, s: Floats, max_speed: Floats, max_acceleration: Floats, *, cap: Floats | float, zone: float
) -> TimeLaw:
    """The fastest time law along a path, from rest to rest.

    Args:
        q: samples, (m, j), rad.
        s: path length at each, (m,), ascending.
        max_speed: of the joints, (j,), rad/s; infinite where unknown.
        max_acceleration: of the joints, (j,), rad/s^2; infinite where unknown.
        cap: greatest speed along the path on each step between samples, (m - 1,) or one for all.
        zone: distance each way over which corners are rounded; at most half the path. With 0 corners are stopped in.

    Returns:
        The law.

    Raises:
        ValueError: the path does not move on between two samples, a cap is not above 0, or the zone below 0.
    """
    every = np.broadcast_to(np.asarray(cap, dtype=float), len(s) - 1)
    return time_paths([PathRows(q, s, every, zone)], max_speed, max_acceleration)[0]


@dataclass(frozen=True, eq=False)
class PathRows:
    """A path that is to be run from rest to rest.

    Attributes:
        q: samples, (m, j), rad.
        s: path length at each, (m,), ascending.
        cap: greatest speed along the path on each step between samples, (m - 1,).
        zone: distance each way over which corners are rounded; at most half the path. With 0 corners are stopped in.
    """

    q: Floats
    s: Floats
    cap: Floats
    zone: float


def time_paths(paths: Sequence[PathRows], max_speed: Floats, max_acceleration: Floats) -> list[TimeLaw]:
    """As :func:`time_path`, of several paths of the same joints.

    Args:
        paths: the paths.
        max_speed: of the joints, (j,), rad/s; infinite where unknown.
        max_acceleration: of the joints, (j,), rad/s^2; infinite where unknown.

    Returns:
        The law of each.

    Raises:
        ValueError: as of :func:`time_path`.
    """
    for one in paths:
        if len(one.s) < 2 or not np.all(np.diff(one.s) > 0) or not np.all(one.cap > 0) or not one.zone >= 0:
            raise ValueError("a time law needs a path that moves on at every sample, caps above 0 and a zone")
    limits = max_speed, max_acceleration
    found = _timed([_Path.of(one.q, one.s, limits, one.cap, one.zone) for one in paths])
    return [timed.with_use(one.s - one.s[0]) for timed, one in zip(found, paths, strict=True)]


@dataclass(frozen=True, eq=False)
class _Path:
    """A path to be timed.

    Attributes:
        q: samples, (m, j), rad.
        s: path length at each, (m,), from 0.
        zone: over which corners are rounded.
        fastest: greatest speeds of its pieces, (m - 1,).
        max_speed: of the joints, (j,), rad/s.
        max_acceleration: of the joints, (j,), rad/s^2.
        corners: path lengths of the corners that count.
    """

    q: Floats
    s: Floats
    zone: float
    fastest: Floats
    max_speed: Floats
    max_acceleration: Floats
    corners: Floats

    @classmethod
    def of(cls, q: Floats, s: Floats, limits: tuple[Floats, Floats], cap: Floats, zone: float) -> _Path:
        """A path whose length may begin anywhere."""
        max_speed, max_acceleration = limits
        s = s - s[0]
        raw = np.diff(q, axis=0) / np.diff(s)[:, None]
        zone = kept_zone(zone, s[-1])
        with np.errstate(divide="ignore"):
            # the samples' own path has to keep the speeds as well, in which a short piece is not averaged with others
            fastest = np.minimum((max_speed / np.abs(raw)).min(axis=1), cap)
        most = float(fastest.max())
        corners = counting_corners(s, raw, np.maximum(most / max_speed, most**2 / (2 * zone * max_acceleration)))
        return cls(q, s, zone, fastest, max_speed, max_acceleration, corners)


@dataclass(frozen=True, eq=False)
class _Timed:
    """A path's law on a grid.

    Attributes:
        path: the path.
        grid: path lengths, (g,).
        slope: of the rounded path there, (j, g), and
        bend: its change along each grid step, (j, g - 1).
        x: squares of the greatest speeds, (g,).
    """

    path: _Path
    grid: Floats
    slope: Floats
    bend: Floats
    x: Floats

    def times(self, s: Floats) -> Floats:
        """When path lengths (m,) are passed, s."""
        speed = np.sqrt(self.x)
        dt = 2 * np.diff(self.grid) / np.maximum(speed[:-1] + speed[1:], 1e-300)
        return np.interp(s, self.grid, np.concatenate([[0.0], np.cumsum(dt)]))

    def with_use(self, s: Floats) -> TimeLaw:
        """The law at path lengths (m,), and what it needs of every joint."""
        slope, bend, x, path = self.slope, self.bend, self.x, self.path
        u = np.diff(x) / (2 * np.diff(self.grid))
        before = np.abs(slope[:, 1:] * u + bend * x[1:])
        after = np.abs(slope[:, :-1] * u + bend * x[:-1])
        most = np.maximum(np.append(after, after[:, -1:], axis=1), np.append(before[:, :1], before, axis=1))
        use = np.empty((len(x), 2, len(slope)))
        use[:, 0] = (np.abs(slope) * np.sqrt(x) / path.max_speed[:, None]).T
        use[:, 1] = (most / path.max_acceleration[:, None]).T
        return TimeLaw(self.times(s), np.sqrt(np.interp(s, self.grid, x)), self.grid, use)


def _timed(paths: Sequence[_Path]) -> list[_Timed]:
    """The fastest laws of paths of the same joints."""
    uneven = _uneven(paths)
    grids = [time_grid(path.s, path.zone, path.corners, fine) for path, fine in zip(paths, uneven, strict=True)]
    return _laws(paths, grids)


def _laws(paths: Sequence[_Path], grids: Sequence[Floats]) -> list[_Timed]:
    """The fastest laws of paths of the same joints on grids; one grid at a time would cost more."""
    out: list[_Timed] = []
    block = np.cumsum([len(grid) for grid in grids]) // TOGETHER
    for some in np.split(np.arange(len(paths)), np.flatnonzero(np.diff(block)) + 1):
        mine = [(paths[i], grids[i], _bounds(paths[i], grids[i])) for i in some.tolist()]
        if mine:
            x = greatest_squares([bounds for _, _, bounds in mine], mine[0][0].max_acceleration)
            out += [_Timed(*one[:2], one[2].slope, one[2].bend, each) for one, each in zip(mine, x, strict=True)]
    return out


def _bounds(path: _Path, grid: Floats) -> GridBounds:
    """What bounds the speed along a path on a grid."""
    slope, bend = _blended(path.q, path.s, grid, path.zone)
    piece = np.clip(np.searchsorted(path.s, (grid[:-1] + grid[1:]) / 2) - 1, 0, len(path.s) - 2)
    with np.errstate(divide="ignore"):
        most = path.fastest[piece]
        top = np.minimum(np.concatenate([most[:1], most]), np.concatenate([most, most[-1:]]))
    top = _within_speeds(slope / path.max_speed[:, None], top**2)
    return GridBounds(slope, bend, np.diff(grid), top)


def _within_speeds(share: Floats, top: Floats) -> Floats:
    """Squares of speeds at a grid's points with which no joint is too fast there, nor between two of them, (g,).

    On a step a joint's slope and the square x of the path's speed are linear. Where the slope grows from a to b and x
    falls, the joint can be faster within the step than at its ends. The square of its speed is a cubic there. It still
    rises at the step's end, and so is greatest there, if x at the start is at most 3 - 2 a/b times x at the end.

    Args:
        share: slope over greatest speed of every joint, (j, g).
        top: greatest squares by other bounds, (g,).
    """
    square = share**2
    most = square.max(axis=0)
    with np.errstate(divide="ignore"):
        out = np.minimum(top, 1 / most)
    # on other steps no joint can be too fast
    some = np.flatnonzero(np.maximum(most[:-1], most[1:]) * np.maximum(top[:-1], top[1:]) > 1.0)
    for here, beside in ((some, some + 1), (some + 1, some)):
        end = square[:, beside]
        grows = end > square[:, here]
        bound = (3 * end - 2 * share[:, here] * share[:, beside]) / np.where(grows, end, 1.0) ** 2
        out[here] = np.minimum(out[here], np.where(grows, bound, np.inf).min(axis=0))
    return out


def _uneven(paths: Sequence[_Path]) -> list[NDArray[np.bool_]]:
    """Pieces of each path, (m - 1,), on which the speed changes, and those beside them: others need no finer grid.

    They are computed by the law on a grid of the samples and of where the roundings of corners begin and end: a law
    that keeps to its bounds, though it need not be the fastest.
    """
    out = [np.ones(len(path.s) - 1, dtype=bool) for path in paths]
    many = [k for k, path in enumerate(paths) if path.s[-1] * PER_ZONE / path.zone + len(path.s) - 1 > FEW]
    some = [paths[k] for k in many]
    grids = [time_grid(path.s, path.zone, path.corners, ~out[k]) for k, path in zip(many, some, strict=True)]
    for k, law in zip(many, _laws(some, grids), strict=True):
        x, first = law.x, np.searchsorted(law.grid, law.path.s)
        low, high = np.minimum.reduceat(x, first[:-1]), np.maximum.reduceat(x, first[:-1])
        low, high = np.minimum(low, x[first[1:]]), np.maximum(high, x[first[1:]])
        uneven = low < EVEN * high
        out[k] = uneven | np.append(uneven[1:], False) | np.append(False, uneven[:-1])
    return out


def time_stops(
    q: Floats, s: Floats, max_speed: Floats, max_acceleration: Floats, *, cap: Floats, stops: NDArray[np.int64]
) -> TimeLaw:
    """The fastest time law along a path that stops in some of its samples.

    Args:
        q: samples, (m, j), rad.
        s: path length at each, (m,), ascending from 0.
        max_speed: of the joints, (j,), rad/s; infinite where unknown.
        max_acceleration: of the joints, (j,), rad/s^2; infinite where unknown.
        cap: greatest speed along the path on each step between samples, (m - 1,).
        stops: samples at which it stops, ascending, the first and the last among them. Those between follow one another
            smoothly: the path is averaged over a step each way.

    Returns:
        The law.
    """
    pieces = [
        PathRows(q[a : b + 1], s[a : b + 1], cap[a:b], float((s[b] - s[a]) / (b - a)))
        for a, b in pairwise(stops.tolist())
    ]
    laws = time_paths(pieces, max_speed, max_acceleration)
    begins = np.cumsum([0.0, *(law.t[-1] for law in laws)])
    return TimeLaw(
        np.concatenate([[0.0], *(begin + law.t[1:] for begin, law in zip(begins[:-1], laws, strict=True))]),
        np.concatenate([[0.0], *(law.speed[1:] for law in laws)]),
        np.concatenate([s[a] + law.grid for a, law in zip(stops[:-1], laws, strict=True)]),
        np.concatenate([law.use for law in laws]),
    )


def time_travel(
    q: Floats,
    max_speed: Floats,
    max_acceleration: Floats,
    *,
    cap: Floats | float = np.inf,
    zone: float = TRAVEL_ZONE,
) -> Floats:
    """Times of the steps of a travel, as fast as the joints can, from rest to rest.

    Args:
        q: samples, (m, j), rad; a sample may repeat the one before.
        max_speed: of the joints, (j,), rad/s; infinite where unknown.
        max_acceleration: of the joints, (j,), rad/s^2; infinite where unknown.
        cap: greatest speed of all joints together (the norm of theirs) on each step, (m - 1,) or one for all, rad/s.
        zone: rounding of corners, rad of joint travel each way.

    Returns:
        (m - 1,), s; 0 where a sample repeats the one before.
    """
    every = np.broadcast_to(np.asarray(cap, dtype=float), len(q) - 1)
    return time_travels([TravelRows(q, every)], max_speed, max_acceleration, zone)[0]


@dataclass(frozen=True, eq=False)
class TravelRows:
    """A travel from rest to rest.

    Attributes:
        q: samples, (m, j), rad; a sample may repeat the one before.
        cap: greatest speed of all joints together (the norm of theirs) on each step, (m - 1,), rad/s.
    """

    q: Floats
    cap: Floats


def time_travels(
    travels: Sequence[TravelRows], max_speed: Floats, max_acceleration: Floats, zone: float = TRAVEL_ZONE
) -> list[Floats]:
    """As :func:`time_travel`, of several travels of the same joints.

    Args:
        travels: the travels.
        max_speed: of the joints, (j,), rad/s; infinite where unknown.
        max_acceleration: of the joints, (j,), rad/s^2; infinite where unknown.
        zone: rounding of corners, rad of joint travel each way.

    Returns:
        Of each, (m - 1,), s; 0 where a sample repeats the one before.
    """
    # joints without a known speed weigh nothing, but something has to end the travel
    limits = np.where(np.isfinite(max_speed), max_speed, 1.0), max_acceleration
    out, paths, steps = [], [], []
    for one in travels:
        way = np.linalg.norm(np.diff(one.q, axis=0), axis=1)
        moves = way > FLAT_SLOPE
        out.append(np.zeros(len(way)))
        if moves.any():
            s = np.concatenate([[0.0], np.cumsum(way[moves])])
            paths.append(_Path.of(one.q[np.concatenate([[True], moves])], s, limits, one.cap[moves], zone))
            steps.append((out[-1], moves))
    for (dt, moves), timed in zip(steps, _timed(paths), strict=True):
        dt[moves] = np.diff(timed.times(timed.path.s))
    return out


def _blended(q: Floats, s: Floats, grid: Floats, zone: float) -> tuple[Floats, Floats]:
    """Slope at the grid, (j, g), and its change along each grid step, (j, g - 1), of the samples' moving average."""
    t, far = mirrored(q, s)
    t_step, far = np.diff(t), np.ascontiguousarray(far.T)
    raw = np.diff(far, axis=1) / t_step

    def at(u: Floats) -> Floats:
        k = np.clip(np.searchsorted(t, u, side="right") - 1, 0, len(t_step) - 1)
        return np.asarray(raw[:, k] * (u - t[k]) + far[:, k])

    slope = (at(grid + zone) - at(grid - zone)) / (2 * zone)
    return slope, np.diff(slope, axis=1) / np.diff(grid)
