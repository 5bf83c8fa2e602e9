"""From the end of one bead to the start of the next: out along the normal, across, in again; or from home and back.

    way = travel(context, end, start, deposits_laid)   # None for either: the arm's home
    q, clearances = way                      # or a Failure: why there is no way

Retracting and approaching are straight lines of the TCP. Across, all joints move together; where that is not free it is
tried further out, and then a way round is searched, which may end a whole turn of a joint from where the next bead was
to begin, if the bead can be run there as well. Where the way out is not free as far as the case asks for, it is gone
as far as it is, and the way round begins there. Metres, radians, seconds.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import product
from typing import NamedTuple

import numpy as np

from ik.chain import Floats

from ...collision.checker import Checker
from ...collision.clearances import Clearances
from ...collision.proofs.between_samples import kept_on_steps, unproven_steps
from ...failure import ON_TRAVEL, Failure, Kind, SearchEffort
from ..context import Context
from ..edges.blended_check import travel_corners, wire_corners
from ..edges.edge_check import Stretch, collision_place
from .free_moves import FreeMoves
from .legs import Leg, end_legs, retract_legs
from .rrt_connect import Space, TreeRoots, connect, sampled, with_round_corners, with_shortcuts

RETRACTS = (1.0, 2.0, 4.0)  # times the case's retract
SHORTER = (1.0, 0.6, 0.3)  # of the way out that is free, where the whole is not
STRAIGHT = 1e-5  # m that the TCP is off the normal at most while it is drawn back along it
MORE_CLEARANCE = 1e-3  # m of clearance gained, from which on a travel goes further out
SEARCH_STEPS = np.deg2rad(
    [3.0, 1.0]
)  # between samples of a search; the finer where the way of the coarser did not hold
SHORTCUTS = 60
SEED = 20240
UNLIMITED_JOINT_SPEED = 1.0  # rad/s, of joints whose speed has no limit


class TravelPath(NamedTuple):
    """A travel that is free, and what was seen of it.

    Attributes:
        q: samples, (m, j), rad.
        clearances: the nearest pairs where it was looked; nothing at other samples.
        low: nothing is nearer at each sample, (m,), m.
        kept: nothing is nearer from each sample to the next, (m,), m; -inf after the last.
    """

    q: Floats
    clearances: Clearances
    low: Floats
    kept: Floats

    @classmethod
    def of(cls, checker: Checker, radius: Floats, q: Floats, seen: Clearances) -> TravelPath:
        """One all of whose samples were checked by a checker."""
        low = np.minimum(seen.distance, checker.reach)
        return cls(q, seen, low, kept_on_steps(low, q, radius))

    @property
    def at_least(self) -> Clearances:
        """Clearances at the samples, at least."""
        return Clearances(self.low, self.clearances.pair, self.clearances.position)


def travel(
    context: Context,
    end: Stretch | None,
    start: Stretch | None,
    deposits_laid: int,
    may_search: Callable[[], bool] | None = None,
) -> TravelPath | Failure:
    """From the end of one bead to the start of the next: out along the normal, across, in again.

    Args:
        context: what the search needs.
        end: what was welded last; None where the arm comes from its home.
        start: what is welded next; None where it goes home.
        deposits_laid: deposits laid by then.
        may_search: asked before a way round is searched, where no straight one is free: whether it may be.

    Returns:
        Samples (m, j) and their clearances; or why there is no way, or no straight one. It ends where ``start``
        begins, or whole turns of joints from there by which :func:`turned_to_travel_end` can turn all of it; from home
        it always ends where it begins.
    """
    return _TravelSearch(context, end, start, deposits_laid).search(may_search)


def turned_to_travel_end(start: Stretch, path: TravelPath) -> Stretch:
    """A stretch as it is run after a travel: turned by the whole turns that the travel ends off its beginning."""
    turn = (path[0][-1] - start.axes[0])[: start.q.shape[1]]
    if not turn.any():
        return start
    return replace(start, q_targets=start.q_targets + turn, q=start.q + turn)


def can_leave(context: Context, end: Stretch, deposits_laid: int) -> bool:
    """Whether the torch can be drawn back from the end of a bead as far as the case asks for."""
    (leg,) = retract_legs(context, [(end, -1)], context.settings.retract)
    return leg.failure is None and isinstance(_collision(context, leg.q, deposits_laid), Clearances)


def straight_retract(context: Context, path: TravelPath, stretch: Stretch, at: int) -> float:
    """Length of a travel's straight part along the normal of a bead's first (at = 0) or last (-1) target, m."""
    return straight_retracts(context, [(path, stretch, at)])[0]


def straight_retracts(context: Context, ends: Sequence[tuple[TravelPath, Stretch, int]]) -> list[float]:
    """The same of many travels."""
    if not ends:
        return []
    rows = [path[0][::-1] if at == 0 else path[0] for path, _, at in ends]
    chain = context.solver.chain
    points = chain.forward(np.concatenate(rows)[:, : chain.n])[:, :3, 3]
    out: list[float] = []
    for (_, stretch, at), p in zip(ends, np.split(points, np.cumsum([len(q) for q in rows])[:-1]), strict=True):
        i = stretch.first if at == 0 else stretch.stop - 1
        # the table stands while the torch is drawn back
        off, normal = p - context.placed.position[i], context.placed.normal[i]
        away = off @ normal
        straight = np.linalg.norm(off - away[:, None] * normal, axis=1) <= STRAIGHT
        straight &= np.concatenate([[True], np.diff(away) > -STRAIGHT])
        out.append(float(away[np.logical_and.accumulate(straight)].max(initial=0.0)))
    return out


class _TravelSearch:
    """The search of one travel."""

    def __init__(self, context: Context, end: Stretch | None, start: Stretch | None, deposits_laid: int) -> None:
        self.context, self.end, self.start, self.deposits_laid = context, end, start, deposits_laid
        self.failure: Failure | None = None
        self.wire = context.wire

    def search(self, may_search: Callable[[], bool] | None = None) -> TravelPath | Failure:
        """The first free path with enough room, cheap ones first; if none has enough, the one with most room."""
        clearest: TravelPath | None = None
        leaves: list[Leg] = []
        arrives: list[Leg] = []
        for times in RETRACTS:
            retract = self.context.settings.retract * times
            leave, arrive = end_legs(self.context, self.end, self.start, retract)
            leaves.append(leave)
            arrives.append(arrive)
            if leave.failure or arrive.failure:
                self.failure = self.failure or leave.failure or arrive.failure
                continue
            path = self._straight(leave.q, arrive.q)
            if path is None:
                continue
            if clearest is None or _room(path) > _room(clearest) + MORE_CLEARANCE:
                clearest = path
            if _room(clearest) >= 2 * self.context.settings.clearance:
                break
        if clearest is not None:
            return clearest
        out = self._free(leaves, "leaving")
        back = self._free(arrives, "arriving") if out else []
        if not out or not back:
            return self._failed()
        cut = len(out[0]) < len(leaves[0].q) or len(back[0]) < len(arrives[0].q)
        if cut or leaves[0].failure or arrives[0].failure:
            for shorter in zip(out, back, strict=False):  # of which none has been tried
                path = self._straight(*shorter)
                if path is not None:
                    return path
        if may_search is not None and not may_search():
            return self._failed()
        turns = [np.zeros(out[0].shape[1])]
        if self.end is not None and self.start is not None:
            turns = _turns(self.context, self.start, back)
        return self._around(out, [arrive + turn for arrive in back for turn in turns])

    def _failed(self) -> Failure:
        """Why there is no way: what was met first, or last."""
        assert self.failure is not None
        return self.failure

    def _straight(self, leave: Floats, arrive: Floats) -> TravelPath | None:
        """The direct travel: retract, straight across, approach; if it is free."""
        return self._checked(leave, np.stack([leave[-1], arrive[-1]]), arrive)

    def _free(self, legs: list[Leg], doing: str) -> list[Floats]:
        """Those ways out of a bead that are free themselves; where none is, as much of them as is."""
        free: list[Floats] = []
        for leg in legs:
            found = leg.failure or _collision(self.context, leg.q, self.deposits_laid)
            if isinstance(found, Failure):
                if not free:
                    self.failure = _with(found, shut_in=doing)
            else:
                free.append(leg.q)
        if free:
            return free
        leg = max(legs, key=lambda leg: len(leg.q))
        for length in self._free_lengths(leg):
            if not isinstance(_collision(self.context, leg.q[:length], self.deposits_laid), Failure):
                free.append(leg.q[:length])
        return free

    def _free_lengths(self, leg: Leg) -> list[int]:
        """Rows to go along a way out that is not free as a whole, the most first."""
        found = self.context.checker.clearances(leg.q, np.full(len(leg.q), self.deposits_laid))
        near = np.flatnonzero(found.distance < self.context.settings.clearance)
        most = int(near[0]) if len(near) else len(leg.q)
        lengths = {round(share * most) for share in SHORTER}
        return sorted((n for n in lengths if n > 1), reverse=True)

    def _checked(self, leave: Floats, across: Floats, arrive: Floats) -> TravelPath | None:
        """The whole travel, if it is free: out, by the corners across, and in."""
        middle = sampled(across, self.context.settings.steps.travel_angle)
        q = np.concatenate([leave, middle[1:], arrive[::-1][1:]])
        found = _collision(self.context, q, self.deposits_laid)
        if isinstance(found, Failure):
            self.failure = found
            return None
        cut = travel_corners(self.context, q, found, self.deposits_laid) or self._dragged(middle, q, len(leave) - 1)
        if cut is not None:
            self.failure = cut
            return None
        return TravelPath.of(self.context.checker, self.context.radius, q, found)

    def _dragged(self, q: Floats, whole: Floats, first: int) -> Failure | None:
        """What the wire touches on the way across, or None; from a first row of the travel on."""
        if self.wire is None:
            return None
        laid = np.full(len(q), self.deposits_laid)
        found = self.wire.clearances(q, laid)
        if found.distance.min() <= 0:
            hit = self.context.describe(found, int(np.argmin(found.distance)), ON_TRAVEL)
        else:
            step, nearest = unproven_steps(self.wire, self.context.radius, q, laid, found)
            if not len(step):
                return wire_corners(self.wire, self.context, whole, (first, found), self.deposits_laid)
            hit = self.context.describe(nearest, 0, ON_TRAVEL)
        return replace(hit, limit=0.0)

    def _around(self, leaves: list[Floats], arrives: list[Floats]) -> TravelPath | Failure:
        """Search a way round what is in the way of the straight ones."""
        context = self.context
        starts, goals = (np.array([leg[-1] for leg in legs]) for legs in (leaves, arrives))
        space = _space(context, starts[0], goals[0])
        trees = TreeRoots(starts, goals, self._hints(starts[0], goals[0]))
        for turn, step in enumerate(SEARCH_STEPS):
            edges = FreeMoves(context, self.deposits_laid, float(step), self.wire)
            found = connect(space, trees, edges, context.settings.travel_attempts, SEED + turn)
            if found.path is None:
                shut_in = "leaving" if found.sizes[0] <= found.sizes[1] else "arriving"
                return _with(self._met(edges.met()), attempts=context.settings.travel_attempts, shut_in=shut_in)
            short = with_shortcuts(space, found.path, edges, SHORTCUTS, SEED + turn)
            leave = leaves[int(np.argmin(np.abs(starts - short[0]).max(axis=1)))]
            arrive = arrives[int(np.argmin(np.abs(goals - short[-1]).max(axis=1)))]
            for across in (with_round_corners(short, edges), short, found.path):
                path = self._checked(leave, across, arrive)
                if path is not None:
                    return path
        return self._failed()

    def _met(self, met: Failure | None) -> Failure:
        """The collision that a search met most often, in place of what the straight way met."""
        known = replace(self._failed(), kind=Kind.COLLISION)
        if met is None or met.contact is None:
            return known
        contact = met.contact if known.contact is None else replace(met.contact, seen=known.contact.seen)
        return replace(known, measure=met.measure, limit=met.limit, contact=contact)

    def _hints(self, start: Floats, goal: Floats) -> Floats:
        """Configurations with the arm drawn up, turned to either end or between them."""
        home = self.context.checker.scene.home
        n = len(home)
        hints = np.stack([(start + goal) / 2] * 4)
        hints[:3, :n] = home
        hints[1, 0], hints[2, 0] = start[0], goal[0]
        hints[3, 1 : n - 3] = home[1:-3]
        if len(start) > n:  # the table turns while the arm is drawn up
            return np.concatenate([hints, *(_turned_to(hints[:3], n, end[n:]) for end in (start, goal))])
        return hints


def _with(failure: Failure, *, shut_in: str, attempts: int | None = None) -> Failure:
    """A failure with where the travel is shut in, and after how many attempts; what was known of the search stays."""
    effort = replace(failure.effort or SearchEffort(), shut_in=shut_in)
    return replace(failure, effort=effort if attempts is None else replace(effort, attempts=attempts))


def _room(path: TravelPath) -> float:
    """The least clearance on a travel, m."""
    return float(path.clearances.distance.min())


def _collision(context: Context, q: Floats, deposits_laid: int) -> Clearances | Failure:
    """Clearances of samples that are free, between them as well; or what they collide with."""
    laid = np.full(len(q), deposits_laid)
    found = context.checker.clearances(q, laid)
    if found.distance.min() < context.settings.clearance:
        return context.describe(found, int(np.argmin(found.distance)), ON_TRAVEL)
    step, nearest = unproven_steps(context.checker, context.radius, q, laid, found, least=context.settings.kept)
    if not len(step):
        return found
    return context.describe(nearest, 0, ON_TRAVEL, collision_place(nearest, 0, context))


def _space(context: Context, start: Floats, goal: Floats) -> Space:
    """Where a way is searched: all joints in their limits, a table that moves between where it is and where it goes."""
    chain, n = context.solver.chain, context.solver.chain.n
    low, high = np.minimum(start, goal)[n:], np.maximum(start, goal)[n:]
    return Space(
        np.concatenate([chain.lower, low]),
        np.concatenate([chain.upper, high]),
        np.maximum(context.radius, 1e-3),
        np.concatenate([_speed(context), np.full(len(low), UNLIMITED_JOINT_SPEED)]),
    )


def _turned_to(q: Floats, n: int, table: Floats) -> Floats:
    """Configurations with the table at given angles."""
    out = q.copy()
    out[:, n:] = table
    return out


def _speed(context: Context) -> Floats:
    speed = context.solver.chain.max_speed
    return np.where(np.isfinite(speed), speed, UNLIMITED_JOINT_SPEED)


def _turns(context: Context, start: Stretch, arrives: list[Floats]) -> list[Floats]:
    """Whole turns of joints by which a bead and the ways to it can be turned inside the limits; none of them first."""
    chain = context.solver.chain
    rest = arrives[0].shape[1] - chain.n
    q = np.concatenate([start.q, *(arrive[:, : chain.n] for arrive in arrives)])
    low, high = q.min(axis=0), q.max(axis=0)
    turns = []
    for j in range(chain.n):
        turn = 2 * np.pi * np.array([0, -1, 1])
        turns.append(turn[(low[j] + turn >= chain.lower[j]) & (high[j] + turn <= chain.upper[j])])
    turns += [np.zeros(1)] * rest  # the table's angles are what they are
    return sorted((np.array(turn) for turn in product(*turns)), key=lambda turn: float(np.abs(turn).sum()))
