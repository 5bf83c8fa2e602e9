"""The profile of a body of revolution: a polyline of (r, z), its distance field and its offsets.

A profile runs from the lowest point upwards, the body on its left (towards the axis). It is a function of z but
for steps: horizontal segments (shoulders, end faces). Beyond its ends it continues: a slanted or vertical end
segment goes straight on (to the axis, or for ever), a horizontal one that leads towards the axis reaches it and
closes the body, and one that leads outward becomes the cylinder of its outer radius.

    profile = Profile.of(((20.0, 0.0), (20.0, 30.0), (28.0, 50.0)))
    profile.distance(r, z)                     # signed, mm
    chain = profile.offset_chain(1.73, 5e-4)   # the exact offset curve, its arcs as short chords

The true offset is kept: an arc round every corner that sticks out, lines cut off where they meet at one that
goes in. A body below a function of z keeps that property when it grows, so the offset is the upper envelope of
the offset segments and of the circles about the corners; where these meet is solved, not sampled.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import numpy as np

from ..mesh.solid import Bools, Floats, Ints, PartError

FLAT_RATIO = 1e-6  # a segment that rises less than this share of its run is horizontal
UPRIGHT_RATIO = 1e-9  # one that runs less than this share of its rise is vertical: an apex so far away is rounding
ON_PROFILE_MM = 1e-5  # nearer than this the segment tells the normal, not the way to the foot
CHUNK = 2_000_000


@dataclass(frozen=True, eq=False)
class ProfileChain:
    """A polyline that is a function of z but for steps, with what it does beyond its ends.

    Attributes:
        r: (k,) radii of its points, mm, not below 0.
        z: (k,) heights, never falling; equal ones in a row are a step.
        slope: dr/dz below the first point and above the last; NaN where there is nothing (the body is closed).
    """

    r: Floats
    z: Floats
    slope: tuple[float, float]

    def radius_at(self, z: Floats) -> Floats:
        """Radius (n,) at heights; 0 where there is nothing."""
        radius = np.interp(z, self.z, self.r)
        for end, slope, out in ((0, self.slope[0], z < self.z[0]), (-1, self.slope[1], z > self.z[-1])):
            radius[out] = self.r[end] + slope * (z[out] - self.z[end])
        return np.fmax(radius, 0.0)  # 0 for NaN


@dataclass(frozen=True, eq=False)
class Profile:
    """A checked profile, continued beyond its ends.

    Attributes:
        points: (k, 2) r and z, mm, lowest first.
        open_ends: whether the first and the last segment run on for ever.
    """

    points: Floats
    open_ends: tuple[bool, bool]

    @classmethod
    def of(cls, profile_mm: tuple[tuple[float, float], ...]) -> Profile:
        """The profile through points (r, z), upwards or downwards.

        Raises:
            PartError: not a profile; says in one line what is wrong with it.
        """
        return _checked(tuple((float(r), float(z)) for r, z in profile_mm))

    def _segments(self) -> tuple[Floats, Floats, Floats, Floats]:
        """Starts (m, 2), unit directions (m, 2), and the range (m,), (m,) of the length along them."""
        step = np.diff(self.points, axis=0)
        length = np.hypot(step[:, 0], step[:, 1])
        low, high = np.zeros(len(length)), length.copy()
        if self.open_ends[0]:
            low[0] = -math.inf
        if self.open_ends[1]:
            high[-1] = math.inf
        return self.points[:-1], step / length[:, None], low, high

    def feet(self, r: Floats, z: Floats) -> tuple[Floats, Ints]:
        """Nearest points (n, 2) of the profile to (r, z), and the numbers (n,) of their segments."""
        start, along, low, high = self._segments()
        feet, number = np.zeros((len(r), 2)), np.zeros(len(r), dtype=np.int64)
        size = max(CHUNK // len(start), 1)
        for first in range(0, len(r), size):
            rows = slice(first, first + size)
            dr, dz = r[rows, None] - start[:, 0], z[rows, None] - start[:, 1]
            t = np.clip(dr * along[:, 0] + dz * along[:, 1], low, high)
            away = (dr - t * along[:, 0]) ** 2 + (dz - t * along[:, 1]) ** 2
            best = np.argmin(away, axis=1)
            number[rows] = best
            feet[rows] = start[best] + t[np.arange(len(best)), best, None] * along[best]
        return feet, number

    def inside(self, r: Floats, z: Floats) -> Bools:
        """Whether points (r, z) lie in the body."""
        low, high = self.points[0], self.points[-1]
        radius = np.interp(z, self.points[:, 1], self.points[:, 0])
        slope = _slopes(self)
        radius = np.where(z < low[1], low[0] + slope[0] * (z - low[1]), radius)
        radius = np.where(z > high[1], high[0] + slope[1] * (z - high[1]), radius)
        return np.asarray(r <= radius)  # NaN, where there is nothing, compares false

    def distance(self, r: Floats, z: Floats) -> Floats:
        """Signed distance (n,), mm, positive outside."""
        feet, _ = self.feet(r, z)
        away = np.hypot(r - feet[:, 0], z - feet[:, 1])
        return np.where(self.inside(r, z), -away, away)

    def normals(self, r: Floats, z: Floats) -> Floats:
        """Unit directions (n, 2) of growing distance; on the profile itself the normal of a segment."""
        _, along, _, _ = self._segments()
        feet, number = self.feet(r, z)
        out = np.stack([r - feet[:, 0], z - feet[:, 1]], axis=1)
        length = np.hypot(out[:, 0], out[:, 1])
        out *= np.where(self.inside(r, z), -1.0, 1.0)[:, None]
        segment = np.stack([along[number, 1], -along[number, 0]], axis=1)
        near = (length < ON_PROFILE_MM)[:, None]
        return np.where(near, segment, out / np.where(length > 0, length, 1.0)[:, None])

    def offset_chain(self, by_mm: float, sagitta_mm: float) -> ProfileChain:
        """The profile's offset outward, exact but for its arcs.

        Args:
            by_mm: not below 0.
            sagitta_mm: how far the arcs' chords may stray inward.

        Returns:
            The chain; the ends of its segments lie on the exact curve.
        """
        return _offset_chain(self, float(by_mm), float(sagitta_mm))

    def _pieces(self, by_mm: float) -> _ProfilePieces:
        """What the offset is made of: segments moved along their normals, circles about the points."""
        start, along, low, high = self._segments()
        rising = along[:, 1] > 0.0
        start, along, low, high = start[rising], along[rising], low[rising], high[rising]
        moved = start + by_mm * np.stack([along[:, 1], -along[:, 0]], axis=1)
        r, z = self.points.T
        return _ProfilePieces(
            np.append(moved[:, 0], r),
            np.append(moved[:, 1], z),
            np.append(along[:, 0] / along[:, 1], np.full(len(r), math.nan)),
            np.append(moved[:, 1] + low * along[:, 1], z - by_mm),
            np.append(moved[:, 1] + high * along[:, 1], z + by_mm),
            by_mm,
        )


@lru_cache(maxsize=1024)
def _offset_chain(profile: Profile, by_mm: float, sagitta_mm: float) -> ProfileChain:
    """The offset of a profile: the same layers are asked for it again and again."""
    slope = _slopes(profile)
    if by_mm == 0.0:
        points = profile.points.copy()
    else:
        pieces = profile._pieces(by_mm)
        bounds, winner = _envelope(pieces, np.arange(len(pieces.r)))
        points = _flattened(pieces, bounds, winner, by_mm, sagitta_mm)
    points.flags.writeable = False  # they are shared
    return ProfileChain(points[:, 0], points[:, 1], slope)


def _slopes(profile: Profile) -> tuple[float, float]:
    """dr/dz beyond the ends; NaN at an end that is closed."""
    step = np.diff(profile.points, axis=0)
    first, last = (float(s[0] / s[1]) if s[1] > 0 else math.nan for s in (step[0], step[-1]))
    return first if profile.open_ends[0] else math.nan, last if profile.open_ends[1] else math.nan


@lru_cache(maxsize=64)
def _checked(given: tuple[tuple[float, float], ...]) -> Profile:
    points = np.array(given, dtype=np.float64).reshape(-1, 2)
    if len(points) < 2:
        raise PartError(f"profile_mm: {len(points)} points do not make a profile; at least two (r, z) are needed")
    if not np.isfinite(points).all():
        raise PartError("profile_mm: holds numbers that are not finite; (r, z) in mm are needed")
    if points[:, 0].min() < 0:
        bad = int(np.argmin(points[:, 0]))
        raise PartError(f"profile_mm: crosses the axis (r = {points[bad, 0]:g} at point {bad}); r must not be below 0")
    step = np.diff(points, axis=0)
    if (np.hypot(step[:, 0], step[:, 1]) < ON_PROFILE_MM).any():
        bad = int(np.argmin(np.hypot(step[:, 0], step[:, 1])))
        raise PartError(f"profile_mm: points {bad} and {bad + 1} are the same; every segment needs a length above 0")
    flat = np.abs(step[:, 1]) <= FLAT_RATIO * np.abs(step[:, 0])
    if flat.all():
        raise PartError("profile_mm: all points at one height; the body needs a height")
    _refuse_crossing(points)
    rising = step[~flat, 1] > 0
    if rising.any() and not rising.all():
        raise PartError(
            "profile_mm: turns back in z (an undercut); z must only rise, or only fall, from point to point"
        )
    if not rising.all():
        points, flat = points[::-1].copy(), flat[::-1]
    for k in np.flatnonzero(flat):
        points[k + 1, 1] = points[k, 1]
    for below, above in pairwise(points):  # rows: they are views
        run, rise = np.abs(above - below)
        if run <= UPRIGHT_RATIO * rise:
            above[0] = below[0]
    inner = points[1:-1, 0]
    if (inner == 0.0).any():
        raise PartError("profile_mm: touches the axis between its ends; only its first and last point may lie there")
    return _continued(points)


def _refuse_crossing(points: Floats) -> None:
    """Segments must not cross, touch or run over one another, but for neighbours at their common point."""
    a, b = points[:-1], points[1:]
    for i in range(len(a)):
        d = b[i] - a[i]
        if i + 1 < len(a):
            e = b[i + 1] - a[i + 1]
            if abs(d[0] * e[1] - d[1] * e[0]) < 1e-12 * np.hypot(*d) * np.hypot(*e) and d @ e < 0:
                raise PartError(f"profile_mm: runs back over itself at point {i + 1}")
        if i + 2 >= len(a):
            continue
        p, q = a[i + 2 :], b[i + 2 :]
        side_p = d[0] * (p[:, 1] - a[i, 1]) - d[1] * (p[:, 0] - a[i, 0])
        side_q = d[0] * (q[:, 1] - a[i, 1]) - d[1] * (q[:, 0] - a[i, 0])
        e = q - p
        side_a = e[:, 0] * (a[i, 1] - p[:, 1]) - e[:, 1] * (a[i, 0] - p[:, 0])
        side_b = e[:, 0] * (b[i, 1] - p[:, 1]) - e[:, 1] * (b[i, 0] - p[:, 0])
        cross = (side_p * side_q <= 0) & (side_a * side_b <= 0) & ((side_p != side_q) | (side_a != side_b))
        if cross.any():
            raise PartError(f"profile_mm: crosses itself (segments {i} and {i + 2 + int(np.argmax(cross))})")


def _continued(points: Floats) -> Profile:
    """Add what lies beyond the ends, as the module's docstring says."""
    ends: list[bool] = []
    for last in (False, True):
        end, before = (points[-1], points[-2]) if last else (points[0], points[1])
        step = end - before
        extra: list[float] | None = None
        if end[0] == 0.0:
            is_open = False
        elif step[1] == 0.0:
            is_open = step[0] > 0  # a collar: goes on as a cylinder
            extra = [end[0], end[1] + (1.0 if last else -1.0)] if is_open else [0.0, end[1]]
        else:
            is_open = step[0] >= 0
            extra = None if is_open else [0.0, end[1] - end[0] * step[1] / step[0]]
        if extra is not None:
            points = np.concatenate([points, [extra]] if last else [[extra], points])
        ends.append(bool(is_open))
    return Profile(points, (ends[0], ends[1]))


@dataclass(frozen=True, eq=False)
class _ProfilePieces:
    """Functions r(z), one a row: lines r + slope (z - z0), or upper halves of circles where slope is NaN."""

    r: Floats
    z: Floats
    slope: Floats
    low: Floats
    high: Floats
    radius: float

    def at(self, number: Ints, z: Floats) -> Floats:
        """Values; -inf outside a piece's range or for number -1."""
        height = z - self.z[number]
        arc = np.sqrt(np.maximum(self.radius**2 - height**2, 0.0))
        slope = self.slope[number]
        value = self.r[number] + np.where(np.isnan(slope), arc, np.nan_to_num(slope) * height)
        out = (number < 0) | (z < self.low[number] - 1e-9) | (z > self.high[number] + 1e-9)
        return np.where(out, -math.inf, value)

    def meetings(self, a: Ints, b: Ints) -> Floats:
        """Heights (n, 2) where pieces meet, pair by pair; NaN where they do not."""
        arc_a, arc_b = np.isnan(self.slope[a]), np.isnan(self.slope[b])
        a, b = np.where(arc_a & ~arc_b, b, a), np.where(arc_a & ~arc_b, a, b)  # a line comes first
        line_a, line_b = ~np.isnan(self.slope[a]), ~np.isnan(self.slope[b])
        k, dr, dz = np.nan_to_num(self.slope[a]), self.r[b] - self.r[a], self.z[b] - self.z[a]
        with np.errstate(divide="ignore", invalid="ignore"):
            lines = self.z[a] + (dr - np.nan_to_num(self.slope[b]) * dz) / (k - np.nan_to_num(self.slope[b]))
            # line and circle about b, x from b's height:  (e + k x)² + x² = radius²
            e = k * dz - dr
            root = np.sqrt(self.radius**2 * (1 + k * k) - e * e)
            circle = [self.z[b] + (-k * e + sign * root) / (1 + k * k) for sign in (1.0, -1.0)]
            # two circles: from the middle of their centres, across
            apart2 = dr * dr + dz * dz
            across = np.sqrt(self.radius**2 / apart2 - 0.25) * dr
            twins = [0.5 * (self.z[a] + self.z[b]) + sign * across for sign in (1.0, -1.0)]
        both = line_a & line_b
        first, second = (np.where(line_a, np.where(both, lines, c), t) for c, t in zip(circle, twins, strict=True))
        return np.stack([first, second], axis=1)


def _envelope(pieces: _ProfilePieces, numbers: Ints) -> tuple[Floats, Ints]:
    """Upper envelope of pieces: bounds (k + 1,) of intervals of z, and (k,) which piece is on top (-1: none)."""
    if len(numbers) == 1:
        return np.array([pieces.low[numbers[0]], pieces.high[numbers[0]]]), numbers
    middle = len(numbers) // 2
    (bounds_a, on_a), (bounds_b, on_b) = (_envelope(pieces, n) for n in (numbers[:middle], numbers[middle:]))
    bounds = np.unique(np.concatenate([bounds_a, bounds_b]))
    centre = _centres(bounds)
    a, b = _lookup(bounds_a, on_a, centre), _lookup(bounds_b, on_b, centre)
    both = (a >= 0) & (b >= 0)
    meet = pieces.meetings(a[both], b[both])
    meet = meet[(meet > bounds[:-1][both][:, None]) & (meet < bounds[1:][both][:, None])]
    bounds = np.unique(np.concatenate([bounds, meet]))
    bounds = bounds[np.append(True, ~(np.diff(bounds) < 1e-12))]
    centre = _centres(bounds)
    a, b = _lookup(bounds_a, on_a, centre), _lookup(bounds_b, on_b, centre)
    top = np.where(pieces.at(b, centre) > pieces.at(a, centre), b, a)
    change = np.append(True, np.diff(top) != 0)
    return np.append(bounds[:-1][change], bounds[-1]), top[change]


def _centres(bounds: Floats) -> Floats:
    """A point within each interval, also of those that have no end."""
    low, high = bounds[:-1], bounds[1:]
    with np.errstate(invalid="ignore"):
        inner = np.where(np.isinf(low), high - 1.0, np.where(np.isinf(high), low + 1.0, 0.5 * (low + high)))
    return np.where(np.isinf(low) & np.isinf(high), 0.0, inner)


def _lookup(bounds: Floats, on: Ints, z: Floats) -> Ints:
    """The piece of an envelope at heights; -1 beyond it."""
    at = np.searchsorted(bounds, z) - 1
    return np.where((at < 0) | (at >= len(on)), -1, on[np.clip(at, 0, len(on) - 1)])


def _flattened(pieces: _ProfilePieces, bounds: Floats, on: Ints, radius: float, sagitta_mm: float) -> Floats:
    """Points (k, 2) of an envelope, arcs cut into chords; steps where neighbours differ at a bound."""
    most = max(2.0 * math.acos(max(1.0 - sagitta_mm / radius, -1.0)), 1e-3) if sagitta_mm < radius else math.pi / 2
    points: list[Floats] = []
    for low, high, piece in zip(bounds[:-1].tolist(), bounds[1:].tolist(), on.tolist(), strict=True):
        if not math.isnan(pieces.slope[piece]):
            ends = [z for z in (low, high) if math.isfinite(z)] or [float(pieces.z[piece])]
            z = np.array(ends)
            r = pieces.r[piece] + pieces.slope[piece] * (z - pieces.z[piece])
        else:
            first, last = (math.asin(min(max((v - float(pieces.z[piece])) / radius, -1.0), 1.0)) for v in (low, high))
            angle = np.linspace(first, last, max(math.ceil((last - first) / most), 1) + 1)
            z, r = pieces.z[piece] + radius * np.sin(angle), pieces.r[piece] + radius * np.cos(angle)
            z[0], z[-1] = low, high
        points.append(np.stack([np.maximum(r, 0.0), z], axis=1))
    chain = np.concatenate(points)
    new = np.append(True, (np.abs(np.diff(chain, axis=0)) > 1e-9).any(axis=1))
    chain = chain[new]
    chain[chain[:, 0] < 1e-9, 0] = 0.0
    # end faces of a closed body: down to the axis
    below = chain[:1] * [0.0, 1.0] if np.isfinite(bounds[0]) and chain[0, 0] > 0 else chain[:0]
    above = chain[-1:] * [0.0, 1.0] if np.isfinite(bounds[-1]) and chain[-1, 0] > 0 else chain[:0]
    return np.concatenate([below, chain, above])
