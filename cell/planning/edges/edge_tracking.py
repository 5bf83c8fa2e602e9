"""The motion between two targets: the arm tracked along the bead in small steps.

    track = track_edges(solver, placed, start, roll, q, limits, steps)
    track.q                          # (m, j) samples of all edges, ends included
    track.broken                     # {edge: Failure} of those that cannot be followed

Poses are interpolated in space, not joints: the position along the bead's chord, the wire's direction along the great
circle, the roll evenly; the arm is brought onto every one of them from the joint-linear guess. Metres and radians.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ik import closed_form, dls
from ik.chain import Chain, Floats
from ik.joint_turns import SLACK
from ik.roll import RollWindow, apply_roll, wrap
from ik.singularity import KINDS, SingularityLimits, margins
from ik.solver import Solver

from ...arrays import Ints
from ...failure import ON_BEAD, Failure, Kind
from ...motion.motion import JUMP
from ...rigid import frames, great_circle
from ...scene.placement import PlacedTargets
from ...units import MARGIN_UNITS
from ..context import CLOSE, BeadTolerance, Steps

DENSE = np.deg2rad(3.0)  # most that a joint turns between samples of a way that is followed from its beginning
CLOSEST = 2.0**-24  # share of an edge: what still turns further within it jumps
SAME_CONFIGURATION = 1e-6  # rad: configurations nearer than this are one
BOWED, MOST_PARTS = 1.1, 16.0  # times what is measured half-way, and parts of an edge for that at most
MOST_STEPS = 720  # of an edge that is followed step by step


@dataclass(frozen=True, eq=False)
class Track:
    """Samples of several edges, one after the other.

    Attributes:
        edge: edge of each sample, (m,).
        fraction: place on the edge, 0 to 1, (m,).
        q: configurations, (m, j), rad.
        position: TCP where the bead stands still, (m, 3), m; see ``PlacedTargets.bead``.
        table: E1, E2, (m, 2), rad; (m, 0) where the table stands.
        margin: singularity margins, (m, 4).
        broken: what is wrong with edges, by edge: that they jump, or a joint limit, a margin or the reach.
    """

    edge: Ints
    fraction: Floats
    q: Floats
    position: Floats
    table: Floats
    margin: Floats
    broken: dict[int, Failure]


@dataclass(frozen=True, eq=False)
class EdgePoses:
    """Poses between targets, each given by its edge and its place on it.

    Attributes:
        position: of the edges' ends, (e, 2, 3), m.
        normal: deposition direction there, (e, 2, 3).
        roll: there, (e, 2), rad; the short way is taken.
        reference: see :class:`cell.scene.placement.PlacedTargets`.
        moving: the same where the table moves along them: all of this is in the part's frame then.
        tables: of the edges' ends, (e, 2, 2), rad.
    """

    position: Floats
    normal: Floats
    roll: Floats
    reference: tuple[Floats, Floats]
    moving: PlacedTargets | None = None
    tables: Floats | None = None

    @classmethod
    def of(cls, placed: PlacedTargets, start: Ints, roll: Floats) -> EdgePoses:
        """The edges from targets ``start`` to the next ones."""
        ends = np.stack([start, start + 1], axis=1)
        bead = placed.bead
        if placed.moving is None:
            return cls(bead.position[ends], bead.normal[ends], roll, bead.reference)
        return cls(bead.position[ends], bead.normal[ends], roll, bead.reference, placed, placed.moving.tables[ends])

    @property
    def swing(self) -> Floats:
        """How far the wire's direction turns, (e,), rad."""
        n = self.normal
        return np.asarray(np.arccos(np.clip(np.einsum("ei,ei->e", n[:, 0], n[:, 1]), -1.0, 1.0)))

    @property
    def turn(self) -> Floats:
        """How far the roll turns, (e,), rad."""
        return wrap(self.roll[:, 1] - self.roll[:, 0])

    @property
    def table_turn(self) -> Floats:
        """How far the table's axes turn at most, (e,), rad."""
        if self.tables is None:
            return np.zeros(len(self.roll))
        return np.asarray(np.abs(self.tables[:, 1] - self.tables[:, 0]).max(axis=1))

    def points(self, edge: Ints, t: Floats) -> Floats:
        """Where the TCP is, (m, 3), m, in the frame in which the edges are given."""
        p = self.position
        return np.asarray(p[edge, 0] + t[:, None] * (p[edge, 1] - p[edge, 0]))

    def table_at(self, edge: Ints, t: Floats) -> Floats:
        """Table angles, (m, 2), rad; (m, 0) where the table stands."""
        if self.tables is None:
            return np.empty((len(edge), 0))
        a, b = self.tables[edge, 0], self.tables[edge, 1]
        return np.asarray(a + t[:, None] * (b - a))

    def at(self, edge: Ints, t: Floats) -> Floats:
        """Poses of the TCP in the base frame, (m, 4, 4)."""
        n = self.normal
        T0 = frames(self.points(edge, t), great_circle(n[edge, 0], n[edge, 1], t, self.swing[edge]), self.reference)
        Ts = apply_roll(T0, self.roll[edge, 0] + t * self.turn[edge])
        return Ts if self.moving is None else self.moving.carried(Ts, self.table_at(edge, t))


def track_edges(
    solver: Solver,
    placed: PlacedTargets,
    start: Ints,
    roll: Floats,
    q: Floats,
    limits: SingularityLimits,
    steps: Steps,
) -> Track:
    """Follow edges from target ``start`` to ``start + 1``.

    Args:
        solver: the arm.
        placed: the targets.
        start: first target of each edge, (e,).
        roll: roll at both ends, (e, 2), rad; the short way is taken.
        q: configurations at both ends, (e, 2, j), rad.
        limits: singularity margins to keep on the way.
        steps: density.

    Returns:
        The track; the edges' ends are samples of it, as given.
    """
    poses = EdgePoses.of(placed, start, roll)
    reach = np.maximum(np.abs(q[:, 1] - q[:, 0]).max(axis=1), poses.table_turn)
    edge, t = _sampled(poses, reach, steps, _bowed(solver, poses, q))
    Ts = poses.at(edge, t)
    guess = q[edge, 0] + t[:, None] * (q[edge, 1] - q[edge, 0])
    inner = (t > 0) & (t < 1)
    out = guess.copy()
    out[inner], ok = solver.next_to(Ts[inner], guess[inner])
    margin = margins(solver.chain, solver.geometry, out)
    broken = np.zeros(len(start), dtype=bool)
    least = limits.values(solver.geometry is not None)
    # the ends have been judged as targets
    thin = inner & (margin < least).any(axis=1)
    broken[edge[thin]] = True
    lost = np.flatnonzero(inner)[~ok]
    broken[edge[lost]] = True
    same = edge[1:] == edge[:-1]
    far = same & (np.abs(out[1:] - out[:-1]).max(axis=1) > JUMP)
    broken[edge[1:][far]] = True
    track = Track(edge, t, out, poses.points(edge, t), poses.table_at(edge, t), margin, {})
    again = np.flatnonzero(broken)  # what is wrong with them is known once they are followed from their beginning
    return _with_dense(solver, poses, q, limits, track, again) if len(again) else track


def off_bead(T: Floats, position: Floats, normal: Floats, close: BeadTolerance) -> Floats:
    """Deviation of TCP poses (m, 4, 4) from points and deposition directions, (m,), as shares of the tolerance."""
    off = np.linalg.norm(T[:, :3, 3] - position, axis=1)
    # half the chord, since an angle as small as this is lost in its cosine
    wire_angle = 2 * np.arcsin(np.clip(np.linalg.norm(T[:, :3, 2] + normal, axis=1) / 2, 0.0, 1.0))
    return np.maximum(off / close.bead_distance, wire_angle / close.wire_angle)


def _bowed(solver: Solver, poses: EdgePoses, q: Floats) -> Floats:
    """Parts of each edge, (e,), in which straight joint motion stays close to the bead: its error falls by n**2."""
    edge, half = np.arange(len(q)), np.full(len(q), 0.5)
    T = solver.chain.forward((q[:, 0] + q[:, 1]) / 2)
    if poses.moving is not None:
        T = poses.moving.seen(T, poses.table_at(edge, half))
    p, n = poses.position, poses.normal
    along = p[:, 1] - p[:, 0]
    t = np.clip(((T[:, :3, 3] - p[:, 0]) * along).sum(axis=1) / np.maximum((along**2).sum(axis=1), 1e-30), 0.0, 1.0)
    off = off_bead(T, poses.points(edge, t), great_circle(n[:, 0], n[:, 1], t, poses.swing), CLOSE)
    return np.minimum(np.sqrt(BOWED * off), MOST_PARTS)


def _sampled(poses: EdgePoses, reach: Floats, steps: Steps, least: Floats) -> tuple[Ints, Floats]:
    """Edge and place of samples dense enough for all edges, ends included.

    Args:
        poses: the edges.
        reach: how far any axis turns on each, (e,), rad.
        steps: how far samples are apart at most.
        least: parts of each at least, (e,).
    """
    count = np.maximum.reduce(
        [
            least,
            np.linalg.norm(poses.position[:, 1] - poses.position[:, 0], axis=1) / steps.position,
            np.maximum.reduce([poses.swing, np.abs(poses.turn), reach]) / steps.angle,
        ]
    )
    count = np.maximum(np.ceil(count - 1e-9), 1).astype(np.int64)
    edge = np.repeat(np.arange(len(count)), count + 1)
    first = np.concatenate([[0], np.cumsum(count + 1)[:-1]])
    return edge, (np.arange(len(edge)) - first[edge]) / count[edge]


def _with_dense(
    solver: Solver, poses: EdgePoses, q: Floats, limits: SingularityLimits, track: Track, again: Ints
) -> Track:
    """The track with some edges followed from their beginning, and judged by that."""
    kept = ~np.isin(track.edge, again)
    mine = ~kept
    edge, t, out = along(solver, poses, q[:, 0], track.edge[mine], track.fraction[mine])
    margin = margins(solver.chain, solver.geometry, out)
    broken = {}
    least = limits.values(solver.geometry is not None)
    for e in again.tolist():
        rows = np.flatnonzero(edge == e)
        found = _judged(solver, out[rows], margin[rows], least, q[e])
        if found is not None:
            broken[e] = found
        out[rows[-1]] = q[e, 1]
    out = np.where(np.isfinite(out), out, q[edge, 0])
    order = np.lexsort((np.concatenate([track.fraction[kept], t]), np.concatenate([track.edge[kept], edge])))

    def joined(a: Any, b: Any) -> Any:
        return np.concatenate([a[kept], b])[order]

    return Track(
        edge=joined(track.edge, edge),
        fraction=joined(track.fraction, t),
        q=joined(track.q, out),
        position=joined(track.position, poses.points(edge, t)),
        table=joined(track.table, poses.table_at(edge, t)),
        margin=joined(track.margin, margin),
        broken=broken,
    )


def along(solver: Solver, poses: EdgePoses, start: Floats, edge: Ints, t: Floats) -> tuple[Ints, Floats, Floats]:
    """Follow edges from their first ends without regard to joint limits.

    Args:
        solver: the arm.
        poses: the edges.
        start: configuration that each edge begins in, (e, j), rad.
        edge: edge of each sample, ascending, (m,).
        t: its place, ascending on each edge, from 0 to 1, (m,).

    Returns:
        Edge, place (more of them where joints turn fast) and configuration of samples, (m',), (m',) and (m', j), rad,
        NaN from where the arm cannot follow. Where two are further apart than ``DENSE`` there is a jump between them.
    """
    if solver.form is None:
        return _step_by_step(solver.chain, poses, start, edge, t)
    raw = closed_form.solve(solver.form, poses.at(edge, t))
    first = np.searchsorted(edge, edge)
    # the branch is that of the beginning
    off = np.abs(wrap(raw[first] - start[edge][:, None])).max(axis=-1)
    branch = np.argmin(np.where(np.isnan(off), np.inf, off), axis=1)
    q = raw[np.arange(len(raw)), branch]
    while True:
        step = np.abs(wrap(np.diff(q, axis=0))).max(axis=1)
        gap = np.isnan(step) & (np.isnan(q[1:, 0]) != np.isnan(q[:-1, 0]))
        wide = (edge[1:] == edge[:-1]) & ((step > DENSE) | gap) & (np.diff(t) > CLOSEST)
        k = np.flatnonzero(wide)
        if not len(k):
            break
        t_new = (t[k] + t[k + 1]) / 2
        q_new = closed_form.solve(solver.form, poses.at(edge[k], t_new))[np.arange(len(k)), branch[k]]
        q, t = np.insert(q, k + 1, q_new, axis=0), np.insert(t, k + 1, t_new)
        edge, branch = np.insert(edge, k + 1, edge[k]), np.insert(branch, k + 1, branch[k])
    # in the turns of the beginning; what comes after a gap is not reached
    first = np.searchsorted(edge, edge)
    move = np.concatenate([np.zeros((1, q.shape[1])), wrap(np.diff(q, axis=0))])
    move[first == np.arange(len(edge))] = 0.0
    total = np.cumsum(move, axis=0)
    lost = np.isnan(total)
    if lost.any():  # a gap ends its own edge alone
        for e in np.unique(edge):
            rows = edge == e
            total[rows] = np.cumsum(move[rows], axis=0)
    total -= np.where(np.isnan(total[first]), 0.0, total[first])
    return edge, t, start[edge] + total


def _step_by_step(chain: Chain, poses: EdgePoses, start: Floats, edge: Ints, t: Floats) -> tuple[Ints, Floats, Floats]:
    """As :func:`along` for an arm without a closed form: every sample from the one before."""
    which, count = np.unique(edge, return_counts=True)
    count = np.minimum(4 * count, MOST_STEPS)
    edge = np.repeat(which, count + 1)
    k = np.arange(len(edge)) - np.searchsorted(edge, edge)
    t = k / np.repeat(count, count + 1)
    Ts, first = poses.at(edge, t), np.searchsorted(edge, which)
    out = np.full((len(edge), chain.n), np.nan)
    out[first] = start[which]
    before = start[which].copy()
    for step in range(1, int(count.max(initial=0)) + 1):
        live = np.flatnonzero((step <= count) & np.isfinite(before[:, 0]))
        rows = first[live] + step
        # the same turn as in the step before
        last = out[rows - 1]
        guess = last + (last - out[rows - 2] if step > 1 else 0.0)
        found = dls.track_one(chain, Ts[rows], guess, RollWindow.fixed(0.0))
        good = found.ok & (np.abs(found.q - last).max(axis=1) <= DENSE)
        out[rows] = np.where(good[:, None], found.q, np.nan)
        before[live] = out[rows]
    return edge, t, out


def _judged(solver: Solver, q: Floats, margin: Floats, least: Floats, ends: Floats) -> Failure | None:
    """The first failure on an edge tracked from its beginning; None where there is none."""
    chain = solver.chain
    over = np.maximum(chain.lower - q, q - chain.upper)
    inner = slice(1, len(q) - 1)
    thin = np.flatnonzero((margin[inner] < least).any(axis=1)) + 1
    outside = np.flatnonzero((over > SLACK).any(axis=1))
    lost = np.flatnonzero(np.isnan(q[:, 0]))
    far = np.flatnonzero(np.abs(np.diff(q, axis=0)).max(axis=1) > JUMP) + 1
    come = [int(rows[0]) if len(rows) else len(q) for rows in (thin, outside, lost, far)]
    first = int(np.argmin(come))
    if come[first] == len(q):
        off = q[-1] - ends[1]
        j = int(np.argmax(np.abs(off)))
        if abs(off[j]) <= SAME_CONFIGURATION:
            return None
        off_deg = round(float(np.rad2deg(off[j])), 3)
        return Failure(Kind.ARRIVES_OFF, measure=off_deg, axis=chain.names[j], place=ON_BEAD)
    if first == 0:
        return thinnest(margin[inner][thin - 1], least).at(ON_BEAD)
    if first == 1:
        j = int(np.argmax(np.nanmax(over, axis=0)))
        over_deg = round(float(np.rad2deg(np.nanmax(over[:, j]))), 3)
        return Failure(Kind.JOINT_LIMIT, measure=over_deg, axis=chain.names[j], place=ON_BEAD)
    if first == 2 and solver.form is None:
        j = int(np.argmax(over[come[first] - 1]))
        # the limit that is nearest where it can follow no further
        return Failure(Kind.JOINT_LIMIT, axis=chain.names[j], place=ON_BEAD)
    return Failure(Kind.UNREACHABLE if first == 2 else Kind.JUMP, place=ON_BEAD)


def thinnest(margin: Floats, least: Floats) -> Failure:
    """The margin of (m, 4) that is smallest in proportion to its limit (4,)."""
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(least > 0, margin / least, np.inf)
    k, kind = np.unravel_index(int(np.argmin(share)), share.shape)
    _, factor = MARGIN_UNITS[KINDS[kind]]
    return Failure(
        Kind.SINGULAR,
        measure=round(float(margin[k, kind]) * factor, 3),
        limit=round(float(least[kind]) * factor, 3),
        singularity=KINDS[kind],
    )
