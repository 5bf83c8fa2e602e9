"""From the end of one bead to the start of the next: out along the normal, across, in again; or from home and back.

    way = travel(setup, end, start, stage)   # None for either: the arm's home
    q, clearances = way                      # or a dict: why there is no way

Retracting and approaching are straight lines of the TCP. Across, all joints move together; where that is not free it is
tried further out, and then a way round is searched, which may end a whole turn of a joint from where the next bead was
to begin, if the bead can be run there as well. Metres, radians, seconds.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np

from ik import dls
from ik.chain import Floats
from ik.roll import RollWindow, apply_roll

from .as_run import travel_corners, wire_corners
from .between import unproved
from .collision import Clearances
from .edges import Edges
from .examine import Stretch
from .follow import JUMP
from .planner import Space, Trees, connect, rounded, sampled, shortened
from .setup import Setup

RETRACTS = (1.0, 2.0, 4.0)  # times the case's retract
WORTH = 1e-3  # m of clearance for which a travel goes further out
SEARCH_STEPS = np.deg2rad(
    [3.0, 1.0]
)  # between samples of a search; the finer where the way of the coarser did not hold
SHORTCUTS = 60
SEED = 20240
UNKNOWN_SPEED = 1.0  # rad/s, of joints whose speed has no limit
Way = tuple[Floats, Clearances]


def travel(setup: Setup, end: Stretch | None, start: Stretch | None, stage: int) -> Way | dict[str, Any]:
    """From the end of one bead to the start of the next: out along the normal, across, in again.

    Args:
        setup: what the search needs.
        end: what was welded last; None where the arm comes from its home.
        start: what is welded next; None where it goes home.
        stage: deposits laid by then.

    Returns:
        Samples (m, j) and their clearances; or why there is no way. It ends where
        ``start`` begins, or whole turns of joints from there by which :func:`turned` can turn all of it; from home it
        always ends where it begins.
    """
    return _Travel(setup, end, start, stage).search()


def turned(start: Stretch, way: Way) -> Stretch:
    """A stretch as it is run after a travel: turned by the whole turns that the travel ends off its beginning."""
    turn = way[0][-1] - start.q_targets[0]
    if not turn.any():
        return start
    return replace(start, q_targets=start.q_targets + turn, q=start.q + turn)


def can_leave(setup: Setup, end: Stretch, stage: int) -> bool:
    """Whether the torch can be drawn back from the end of a bead as far as the case asks for."""
    (leg,) = _legs(setup, [(end, -1)], setup.settings.retract)
    return not isinstance(leg, str) and isinstance(_collision(setup, leg, stage), Clearances)


class _Travel:
    """The search of one travel."""

    def __init__(self, setup: Setup, end: Stretch | None, start: Stretch | None, stage: int) -> None:
        self.setup, self.end, self.start, self.stage = setup, end, start, stage
        self.why: dict[str, Any] = {}
        self.wire = setup.wire

    def search(self) -> Way | dict[str, Any]:
        """The first way that is free with room, of ever dearer ones; without room, the one that has most of it."""
        clearest: Way | None = None
        leaves: list[Floats | str] = []
        arrives: list[Floats | str] = []
        for times in RETRACTS:
            retract = self.setup.settings.retract * times
            leave, arrive = self._ends(retract)
            leaves.append(leave)
            arrives.append(arrive)
            if isinstance(leave, str) or isinstance(arrive, str):
                self.why = self.why or {"on_the_way": leave if isinstance(leave, str) else str(arrive)}
                continue
            way = self._checked(leave, np.stack([leave[-1], arrive[-1]]), arrive)
            if way is None:
                continue
            if clearest is None or _room(way) > _room(clearest) + WORTH:
                clearest = way
            if _room(clearest) >= 2 * self.setup.settings.clearance:
                break
        if clearest is not None:
            return clearest
        out = self._free(leaves, "leaving")
        back = self._free(arrives, "arriving") if out else []
        if not out or not back:
            return self.why
        turns = [np.zeros(out[0].shape[1])]
        if self.end is not None and self.start is not None:
            turns = _turns(self.setup, self.start, back)
        return self._around(out, [arrive + turn for arrive in back for turn in turns])

    def _ends(self, retract: float) -> list[Floats | str]:
        """Ways out of the bead that ends and of the one that starts; at home there is nothing to get out of."""
        ends = [(self.end, -1), (self.start, 0)]
        legs = iter(_legs(self.setup, [(bead, at) for bead, at in ends if bead is not None], retract))
        return [self.setup.checker.scene.home[None] if bead is None else next(legs) for bead, _ in ends]

    def _free(self, legs: list[Floats | str], doing: str) -> list[Floats]:
        """Those ways out of a bead that are free themselves."""
        free: list[Floats] = []
        for leg in legs:
            found = {"on_the_way": leg} if isinstance(leg, str) else _collision(self.setup, leg, self.stage)
            if isinstance(found, dict):
                self.why = self.why if free else {**found, "while": doing}
            elif not isinstance(leg, str):
                free.append(leg)
        return free

    def _checked(self, leave: Floats, across: Floats, arrive: Floats) -> Way | None:
        """The whole travel, if it is free: out, by the corners across, and in."""
        middle = sampled(across, self.setup.settings.steps.angle)
        q = np.concatenate([leave, middle[1:], arrive[::-1][1:]])
        found = _collision(self.setup, q, self.stage)
        if not isinstance(found, Clearances):
            self.why = found
            return None
        cut = travel_corners(self.setup, q, found, self.stage) or self._dragged(middle, q, len(leave) - 1)
        if cut is not None:
            self.why = cut
            return None
        return q, found

    def _dragged(self, q: Floats, whole: Floats, first: int) -> dict[str, Any] | None:
        """What the wire is drawn through on the way across, if anything: a part of the whole from a first row on."""
        if self.wire is None:
            return None
        laid = np.full(len(q), self.stage)
        found = self.wire.clearances(q, laid)
        if found.distance.min() <= 0:
            hit = self.setup.describe(found, int(np.argmin(found.distance)))
        else:
            step, nearest = unproved(self.wire, self.setup.radius, q, laid, found)
            if not len(step):
                return wire_corners(self.wire, self.setup, whole, (first, found), self.stage)
            hit = self.setup.describe(nearest, 0)
        return {"on_the_way": "collision", **hit, "required_mm": 0.0}

    def _around(self, leaves: list[Floats], arrives: list[Floats]) -> Way | dict[str, Any]:
        """Search a way round what is in the way of the straight ones."""
        setup = self.setup
        chain = setup.solver.chain
        space = Space(chain.lower, chain.upper, np.maximum(setup.radius, 1e-3), _speed(setup))
        starts, goals = (np.array([leg[-1] for leg in legs]) for legs in (leaves, arrives))
        trees = Trees(starts, goals, self._hints(starts[0], goals[0]))
        for turn, step in enumerate(SEARCH_STEPS):
            edges = Edges(setup, self.stage, float(step), self.wire)
            found = connect(space, trees, edges, setup.settings.travel_attempts, SEED + turn)
            if found.way is None:
                shut_in = "leaving" if found.sizes[0] <= found.sizes[1] else "arriving"
                tried = {"attempts": setup.settings.travel_attempts, "while": shut_in}
                return {**self.why, "on_the_way": "collision", **edges.met(), **tried}
            short = shortened(space, found.way, edges, SHORTCUTS, SEED + turn)
            leave = leaves[int(np.argmin(np.abs(starts - short[0]).max(axis=1)))]
            arrive = arrives[int(np.argmin(np.abs(goals - short[-1]).max(axis=1)))]
            for across in (rounded(short, edges), short, found.way):
                way = self._checked(leave, across, arrive)
                if way is not None:
                    return way
        return self.why

    def _hints(self, start: Floats, goal: Floats) -> Floats:
        """Configurations with the arm drawn up, turned to either end or between them."""
        home = self.setup.checker.scene.home
        hints = np.stack([home, home, home, (start + goal) / 2])
        hints[1, 0], hints[2, 0] = start[0], goal[0]
        hints[3, 1:-3] = home[1:-3]
        return hints


def _legs(setup: Setup, ends: list[tuple[Stretch, int]], distance: float) -> list[Floats | str]:
    """Configurations from ends of beads (0 or -1) out along their normals, (m, j) each, or what stops them."""
    count = max(int(np.ceil(distance / (2 * setup.settings.steps.position))), 1)
    out = np.linspace(0, distance, count + 1)[1:, None]
    Ts, qs = [], []
    for stretch, at in ends:
        i = stretch.first if at == 0 else stretch.stop - 1
        T = np.repeat(apply_roll(setup.placed.rows([i]).Ts_base_target, stretch.roll[at]), count, axis=0)
        T[:, :3, 3] += out * setup.placed.normal[i]
        Ts.append(T)
        qs.append(np.repeat(stretch.q_targets[at][None], count, axis=0))
    found = dls.follow(setup.solver.chain, np.concatenate(Ts), np.concatenate(qs), RollWindow.fixed(0.0))
    legs: list[Floats | str] = []
    for k, (stretch, at) in enumerate(ends):
        mine = slice(k * count, (k + 1) * count)
        leg = np.concatenate([stretch.q_targets[at][None], found.q[mine]])
        if not found.ok[mine].all():
            legs.append("joint_limit")
        else:
            legs.append("jump" if np.abs(np.diff(leg, axis=0)).max() > JUMP else leg)
    return legs


def _room(way: Way) -> float:
    """The least clearance on a travel, m."""
    return float(way[1].distance.min())


def _collision(setup: Setup, q: Floats, stage: int) -> Clearances | dict[str, Any]:
    """Clearances of samples that are free, between them as well; or what they collide with."""
    laid = np.full(len(q), stage)
    found = setup.checker.clearances(q, laid)
    if found.distance.min() < setup.settings.clearance:
        return {"on_the_way": "collision", **setup.describe(found, int(np.argmin(found.distance)))}
    step, nearest = unproved(setup.checker, setup.radius, q, laid, found, least=setup.settings.kept)
    return {"on_the_way": "collision", **setup.describe(nearest, 0)} if len(step) else found


def _speed(setup: Setup) -> Floats:
    speed = setup.solver.chain.max_speed
    return np.where(np.isfinite(speed), speed, UNKNOWN_SPEED)


def _turns(setup: Setup, start: Stretch, arrives: list[Floats]) -> list[Floats]:
    """Whole turns of joints by which a bead and the ways to it can be turned inside the limits; none of them first."""
    chain = setup.solver.chain
    q = np.concatenate([start.q, *arrives])
    low, high = q.min(axis=0), q.max(axis=0)
    turns = []
    for j in range(chain.n):
        turn = 2 * np.pi * np.array([0, -1, 1])
        turns.append(turn[(low[j] + turn >= chain.lower[j]) & (high[j] + turn <= chain.upper[j])])
    return sorted((np.array(turn) for turn in product(*turns)), key=lambda turn: float(np.abs(turn).sum()))
