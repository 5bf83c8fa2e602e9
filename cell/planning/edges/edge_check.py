"""A bead to be planned, and its edges followed densely and checked: what is wrong with each, or the stretch it makes.

    bead = SearchedBead.of(context, first, stop)
    found = check_edges(bead, start, roll, q)
    found.causes                     # for each edge: why it does not hold, or None
    found.stretch(e)                 # the Stretch of an edge that holds

Metres, radians, seconds.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ik.bead_path import LARGEST_STEP
from ik.chain import Floats

from ...arrays import Ints
from ...collision.clearances import Clearances
from ...collision.proofs.motion_clearance import MotionSamples, clearance_along
from ...failure import ON_BEAD, CollisionPlace, Failure
from ...motion.deposition_speed import STRETCH
from ...scene.placement import PlacedTargets
from ..context import Context
from .edge_tracking import Track, track_edges

STEP_PER_METRE = np.deg2rad(1500.0)  # rad/m: along a bead a joint that turns faster costs more, as it may be a flip
UNLIMITED_SPEED = 1e3  # rad/s: weighs nothing


@dataclass(frozen=True, eq=False)
class SearchedBead:
    """What a search for the way along a bead starts from. Targets count from the bead's first.

    Attributes:
        context: what all beads share.
        first: number of the bead's first target in the whole part.
        placed: its targets.
        deposits_before: deposits laid before each of them, (t,).
        times: what the deposition takes from each target to the next, (t - 1,), s.
        slowest: what it may take at most, (t - 1,), s.
        largest: most that any joint usually moves from each target to the next, (t - 1,), rad.
        speed: joint speed limits, (j,), rad/s.
    """

    context: Context
    first: int
    placed: PlacedTargets
    deposits_before: Ints
    times: Floats
    slowest: Floats
    largest: Floats
    speed: Floats

    @classmethod
    def of(cls, context: Context, first: int, stop: int) -> SearchedBead:
        """Targets from ``first`` up to ``stop`` of the part."""
        here = slice(first, stop)
        placed = context.placed.rows(here)
        length = np.linalg.norm(np.diff(placed.bead.position, axis=0), axis=1)
        deposition = context.settings.speed[first : first + len(length)]
        speed = context.solver.chain.max_speed
        times = np.where(length > 0, length / deposition, np.inf)
        with np.errstate(divide="ignore"):
            # a speed is held over a stretch, of which what lies between two targets can be a small part
            slowest = np.maximum(times, STRETCH / deposition) / np.float64(context.settings.least_share)
        return cls(
            context=context,
            first=first,
            placed=placed,
            deposits_before=context.deposits_before[here],
            times=times,
            slowest=slowest,
            # neighbours far apart may stand far apart
            largest=np.clip(length * STEP_PER_METRE, LARGEST_STEP, np.pi),
            speed=np.where(np.isfinite(speed), speed, UNLIMITED_SPEED),
        )

    @classmethod
    def apart(cls, context: Context, targets: Ints) -> SearchedBead:
        """Targets that are checked one by one, with no way between them; they count from 0."""
        bead = cls.of(context, 0, 1)
        none = np.full(max(len(targets) - 1, 0), np.inf)
        placed, before = context.placed.rows(targets), context.deposits_before[targets]
        return replace(
            bead, placed=placed, deposits_before=before, times=none, slowest=none, largest=np.full(len(none), np.pi)
        )

    def __len__(self) -> int:
        return len(self.deposits_before)


@dataclass(frozen=True, eq=False)
class Stretch:
    """A run of targets with its dense samples.

    Attributes:
        first: first target.
        q_targets: configuration at each target, (t, j), rad.
        roll: roll at each target, (t,), rad.
        edge: target that each sample follows, (m,).
        fraction: place between that target and the next, (m,).
        q: samples, (m, j), rad.
        position: TCP where the bead stands still, (m, 3), m; see ``PlacedTargets.bead``.
        table: E1, E2 of the samples, (m, 2), rad; (m, 0) where the table stands.
        clearances: the nearest pairs where it was looked; nothing at other samples.
        low: nothing is nearer at each sample, (m,), m.
        kept: nothing is nearer from each sample to the next, (m,), m; -inf where that is not known, as at the last.
        margin: singularity margins of the samples, (m, 4).
    """

    first: int
    q_targets: Floats
    roll: Floats
    edge: Ints
    fraction: Floats
    q: Floats
    position: Floats
    table: Floats
    clearances: Clearances
    low: Floats
    kept: Floats
    margin: Floats

    @property
    def axes(self) -> Floats:
        """All axes that move, (m, j) or (m, j + 2), rad."""
        return np.concatenate([self.q, self.table], axis=1)

    @property
    def stop(self) -> int:
        """One past the last target."""
        return self.first + len(self.q_targets)


@dataclass(frozen=True, eq=False)
class CheckedEdges:
    """Edges that have been followed.

    Attributes:
        first: number of the bead's first target in the whole part.
        start: first target of each edge, (e,).
        roll: at both ends, (e, 2), rad.
        q: at both ends, (e, 2, j), rad.
        track: their samples.
        clearances: the nearest pairs where it was looked; nothing at other samples.
        low: nothing is nearer at each sample, (m,), m.
        kept: nor from each to the next, (m,), m; see ``Stretch``.
        causes: why an edge does not hold, None where it does, (e,).
    """

    first: int
    start: Ints
    roll: Floats
    q: Floats
    track: Track
    clearances: Clearances
    low: Floats
    kept: Floats
    causes: list[Failure | None]

    def stretch(self, e: int) -> Stretch:
        """One edge as a stretch, its targets counted in the whole part."""
        mine = np.flatnonzero(self.track.edge == e)
        return self._stretch(self.start[e], self.q[e], self.roll[e], mine)

    def whole(self) -> Stretch:
        """All edges, which follow each other, as one stretch."""
        return self.run(0, len(self.start) - 1)

    def run(self, a: int, b: int) -> Stretch:
        """Edges from one to another, which follow each other, as one stretch."""
        edge = self.track.edge
        # an edge's last sample is the next edge's first
        mine = np.flatnonzero((edge >= a) & (edge <= b) & ((self.track.fraction < 1) | (edge == b)))
        q = np.concatenate([self.q[a : b + 1, 0], self.q[b : b + 1, 1]])
        roll = np.concatenate([self.roll[a : b + 1, 0], self.roll[b : b + 1, 1]])
        return self._stretch(self.start[a], q, roll, mine)

    def _stretch(self, start: int, q: Floats, roll: Floats, mine: Ints) -> Stretch:
        track = self.track
        return Stretch(
            first=self.first + int(start),
            q_targets=q,
            roll=roll,
            edge=self.first + self.start[track.edge[mine]],
            fraction=track.fraction[mine],
            q=track.q[mine],
            position=track.position[mine],
            table=track.table[mine],
            clearances=self.clearances.rows(mine),
            low=self.low[mine],
            kept=np.append(self.kept[mine[:-1]], -np.inf),
            margin=track.margin[mine],
        )


def collision_place(nearest: Clearances, k: int, context: Context) -> CollisionPlace:
    """At a sample where the nearest pair there is too near; else between samples, where no proof was found."""
    return (
        CollisionPlace.BETWEEN_SAMPLES
        if nearest.distance[k] >= context.settings.clearance
        else CollisionPlace.AT_SAMPLE
    )


def check_edges(bead: SearchedBead, start: Ints, roll: Floats, q: Floats) -> CheckedEdges:
    """Follow edges and check them, between the targets too.

    Args:
        bead: whose edges.
        start: first target of each edge, (e,).
        roll: roll at both ends, (e, 2), rad.
        q: configurations at both ends, (e, 2, j), rad.

    Returns:
        The edges with what is wrong with them.
    """
    context = bead.context
    track = track_edges(context.solver, bead.placed, start, roll, q, context.limits, context.settings.steps)
    laid = bead.deposits_before[start[track.edge]]
    # where one edge begins as the one before ended, once is enough
    axes = np.concatenate([track.q, track.table], axis=1)
    again = np.append(False, (np.diff(track.edge) == 1) & (np.diff(laid) == 0) & ~np.diff(axes, axis=0).any(axis=1))
    rows = np.flatnonzero(~again)
    apart = np.cumsum(np.diff(track.edge, prepend=-1).astype(bool) & ~again)[rows]
    # a step belongs to the edge on which it ends
    samples = MotionSamples(axes[rows], laid[rows], apart, track.edge[rows])
    found = clearance_along(context.checker, context.radius, samples, context.settings.kept)
    unsafe = dict(zip(track.edge[rows[found.open + 1]].tolist(), range(len(found.open)), strict=True))
    of = np.cumsum(~again) - 1
    clear, nearest = found.seen.rows(of), found.nearest
    first = np.searchsorted(track.edge, np.arange(len(start)))
    least = np.minimum.reduceat(clear.distance, first) if len(start) else clear.distance
    causes: list[Failure | None] = []
    for e in range(len(start)):
        if e in track.broken:
            causes.append(track.broken[e])
        elif least[e] < context.settings.clearance:
            mine = np.flatnonzero(track.edge == e)
            worst = int(mine[np.argmin(clear.distance[mine])])
            causes.append(context.describe(clear, worst, ON_BEAD))
        elif e in unsafe:
            causes.append(context.describe(nearest, unsafe[e], ON_BEAD, collision_place(nearest, unsafe[e], context)))
        else:
            causes.append(None)
    return CheckedEdges(bead.first, start, roll, q, track, clear, found.low[of], found.kept[of], causes)
