"""Retracting from beads along their normals; a travel begins so, and ends so in the opposite direction.

    legs = retract_legs(context, [(stretch, -1), (other, 0)], distance)    # the end of one, the start of the other
    legs[0].q, legs[0].failure

Straight lines of the TCP at the bead's own roll; collisions are not checked here. Metres, radians.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ik.chain import Floats
from ik.joint_turns import SLACK
from ik.roll import apply_roll

from ...failure import ON_TRAVEL, Failure, Kind, SearchEffort
from ...motion.motion import JUMP
from ...units import METRES_PER_MM
from ..context import Context
from ..edges.edge_check import Stretch
from ..edges.edge_tracking import EdgePoses, along

BETWEEN = 2e-3  # m between samples of the way off a bead and onto it


@dataclass(frozen=True, eq=False)
class Leg:
    """The straight retraction from an end of a bead.

    Attributes:
        q: as far as the arm can follow it, (m, j), rad.
        failure: what stops it there, and after how much of it; None where nothing does.
    """

    q: Floats
    failure: Failure | None = None


def retract_legs(context: Context, ends: Sequence[tuple[Stretch, int]], distance: float) -> list[Leg]:
    """Ways from ends of beads out along their normals.

    Args:
        context: what the beads were planned with.
        ends: beads, and which end of each: 0 or -1.
        distance: how far out, m.

    Returns:
        The way out of each, from its target on.
    """
    if not ends:
        return []
    count = max(int(np.ceil(distance / BETWEEN)), 1)
    target = np.array([stretch.first if at == 0 else stretch.stop - 1 for stretch, at in ends])
    roll, start = (np.array([getattr(stretch, name)[at] for stretch, at in ends]) for name in ("roll", "q_targets"))
    Ts = np.repeat(apply_roll(context.placed.rows(target).Ts_base_target, roll), count, axis=0)
    out = np.tile(np.linspace(0, distance, count + 1)[1:], len(ends))
    Ts[:, :3, 3] += out[:, None] * np.repeat(context.placed.normal[target], count, axis=0)
    found, ok = context.solver.next_to(Ts, np.repeat(start, count, axis=0))
    q = np.concatenate([start[:, None], found.reshape(len(ends), count, -1)], axis=1)
    whole = ok.reshape(len(ends), count).all(axis=1) & (np.abs(np.diff(q, axis=1)).max(axis=(1, 2)) <= JUMP)
    legs = [Leg(q[k]) if whole[k] else _stopped(context, stretch, at, distance) for k, (stretch, at) in enumerate(ends)]
    axes = context.placed.axes
    return [replace(leg, q=axes(leg.q, np.full(len(leg.q), i))) for leg, i in zip(legs, target.tolist(), strict=True)]


def end_legs(context: Context, end: Stretch | None, start: Stretch | None, distance: float) -> tuple[Leg, Leg]:
    """Retractions from the bead that ends and from the one that starts; at home there is none.

    Args:
        context: what the beads were planned with.
        end: what is welded last; None where the arm comes from its home.
        start: what is welded next; None where it goes home.
        distance: how far out, m.
    """
    ends = [(end, -1), (start, 0)]
    legs = iter(retract_legs(context, [(bead, at) for bead, at in ends if bead is not None], distance))
    leave, arrive = (_at_home(context, end, start) if bead is None else next(legs) for bead, _ in ends)
    return leave, arrive


def _at_home(context: Context, end: Stretch | None, start: Stretch | None) -> Leg:
    """The arm where it comes from or goes to, the table as at the bead."""
    span, rest = context.span, context.checker.scene.home
    if end is None:
        home, target = span.start, 0 if start is None else start.first
    else:
        home, target = span.end, end.stop - 1
    return Leg(context.placed.axes((rest if home is None else home)[None], np.array([target])))


def _stopped(context: Context, stretch: Stretch, at: int, distance: float) -> Leg:
    """A way out followed from the bead on, as far as limits and reach allow."""
    i = stretch.first if at == 0 else stretch.stop - 1
    p, n = context.placed.position[i], context.placed.normal[i]
    ends = np.stack([p, p + distance * n])[None], np.stack([n, n])[None], np.repeat(stretch.roll[at], 2)[None]
    count = max(int(np.ceil(distance / BETWEEN)), 1)
    start, t = stretch.q_targets[at][None], np.linspace(0, 1, count + 1)
    _, t, q = along(
        context.solver, EdgePoses(*ends, context.placed.reference), start, np.zeros(count + 1, dtype=np.int64), t
    )
    chain = context.solver.chain
    over = np.maximum(chain.lower - q, q - chain.upper)
    q = np.where(over <= SLACK, np.clip(q, chain.lower, chain.upper), q)
    good = np.isfinite(q[:, 0]) & (over <= SLACK).all(axis=1)
    good[1:] &= np.abs(np.diff(q, axis=0)).max(axis=1) <= JUMP
    stop = int(np.argmin(good)) if not good.all() else len(q)
    if stop == len(q):
        return Leg(q)
    reached = round(float(t[stop - 1]) * distance / METRES_PER_MM, 3)
    effort = SearchEffort(reached_mm=reached, retract_mm=round(distance / METRES_PER_MM, 3))
    if (over[stop] > SLACK).any():
        axis = chain.names[int(np.argmax(over[stop]))]
        return Leg(q[:stop], Failure(Kind.JOINT_LIMIT, axis=axis, place=ON_TRAVEL, effort=effort))
    kind = Kind.JUMP if np.isfinite(q[stop, 0]) else Kind.UNREACHABLE
    return Leg(q[:stop], Failure(kind, place=ON_TRAVEL, effort=effort))
