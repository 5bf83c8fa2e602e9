"""The quick search of a bead: a path through a few stations and between them. It suffices for most beads.

    stretch = StationSearch(bead, roll_step, ends).run()      # None: search in full

Stations are at most a ``Spacing`` apart along the bead. Every roll and branch is checked there; between stations only
rolls near the path through the stations, in its branch. If the path collides at a station, rolls around it are checked
and another path is taken; if it collides between two stations, another station is added there. A path counts only once
all of it has been tracked and checked. If no path is found here, there may still be one.

Metres, radians, seconds.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ik import bead_path_quick as banded
from ik.bead_path import ROLL_COST
from ik.chain import Floats
from ik.roll import wrap

from ..arrays import Ints
from ..failure import Kind
from .blocked_rolls import with_blocked_rolls
from .configurations import NEAR_COST, near_cost
from .edges.edge_check import SearchedBead, Stretch, check_edges
from .stations import STILL, Spacing, StationNodes, nodes_of_poses

ROUNDS, PATHS_A_ROUND = 8, 24  # paths followed, and paths through the stations before each; then the full search
FREE_PATHS = 4  # paths that are free, but near something, before the clearest of them is taken
ROLL_SAMPLES_APART = 2  # samples the roll may change between stations
BESIDE = np.array([-1.0, -0.5, 0.0, 0.5, 1.0])  # rolls checked between stations, samples
NEARBY = np.array([-1, 0, 1])  # of those, from target to target
EARLIER, LATER = slice(None, -1), slice(1, None)
MORE = 3  # stations put in at a time
ELSEWHERE = np.deg2rad(40.0)  # an end is another one where some joint is further away
COLLISION_PENALTY = 2.0  # s that a node is worth avoiding where nodes beside it collide
UNKNOWN, FREE, HIT = 0, 1, 2


@dataclass(frozen=True, eq=False)
class Ends:
    """The configuration before the bead, and configurations that its ends have to differ from.

    Attributes:
        q_before: where the arm comes from, (j,), rad, or None.
        begin_off: configurations to begin well off, each (j,), rad.
        end_off: configurations to end well off.
    """

    q_before: Floats | None = None
    begin_off: Sequence[Floats] = ()
    end_off: Sequence[Floats] = ()


class StationSearch:
    """One bead's search. Targets count from the bead's first."""

    def __init__(
        self,
        bead: SearchedBead,
        roll_step: float,
        ends: Ends,
        spacing: Spacing | None = None,
        nodes: StationNodes | None = None,
    ) -> None:
        """Check every node of the stations.

        Args:
            bead: what to search a way along; see :meth:`suits`.
            roll_step: distance of the roll's samples, rad.
            ends: of the way.
            spacing: of the stations; what suits the roll's window where left out.
            nodes: of the stations, where they are known.
        """
        self.bead, self.context, self.roll_step, self.ends = bead, bead.context, roll_step, ends
        self.chain = bead.context.solver.chain
        self.bounds = banded.Bounds(
            speed=bead.speed,
            times=bead.times,
            largest=bead.largest,
            roll_price=ROLL_COST / roll_step,
            roll_step=np.full(len(bead.times), roll_step),
        )
        if nodes is None:
            (nodes,) = StationNodes.of_each([bead], roll_step, spacing)
        self.rolls = bead.context.window.samples(roll_step)
        self.Ts, self.at, self.q, self.cost = nodes.Ts, nodes.at, nodes.q, nodes.cost
        self._keep_off(self.at, self.q, self.cost)
        self.known = np.full(self.cost.shape, UNKNOWN)
        self.expected_cost = np.zeros(self.cost.shape)
        self._most = np.inf  # work of the context at which it is given up

    @staticmethod
    def suits(bead: SearchedBead) -> bool:
        """Whether a bead is one for this search: two targets, and an arm with a closed form."""
        return bead.context.solver.form is not None and len(bead) > 1

    def run(self, most: float = np.inf) -> Stretch | None:
        """Search.

        Args:
            most: configurations that may be asked about, about, until it is given up.

        Returns:
            The whole bead, checked; None if that was not found.
        """
        self._most = self.context.work + most
        for _ in range(ROUNDS):
            path = self.cheapest_path()
            if path is None:
                break
            branch, roll, q = path
            start = np.arange(len(q) - 1)
            pair = np.stack([start, start + 1], axis=1)
            found = check_edges(self.bead, start, roll[pair], q[pair])
            bad = [i for i, cause in enumerate(found.causes) if cause is not None]
            if not bad:
                return found.whole()
            if any(cause.kind is not Kind.COLLISION for cause in found.causes if cause is not None):
                break
            ends = np.unique([*bad, *(i + 1 for i in bad)])
            if not self._add(ends):
                self._avoid(ends, branch, roll[ends])
        return None

    def cheapest_path(self) -> tuple[int, Floats, Floats] | None:
        """The cheapest path free at the stations: branch, rolls (t,) and configurations (t, j) of all targets."""
        found = self._through_stations()
        if found is None:
            return None
        branch, samples = found
        roll = self._rolls_between(samples)
        every = np.arange(len(self.bead))
        q, cost = self._nodes_of(every, roll, branch)
        cost += self._expected_cost_between(branch, roll)[:, None]
        cost[0] += self._arriving(q[:, 0])
        path = self._cheapest(q, roll, cost)
        if path is None:
            return None
        q_way = banded.with_whole_turns(self.chain, q[:, every, 0, path[1]].T, self.ends.q_before)
        return None if q_way is None else (branch, roll[every, path[1]], q_way)

    @property
    def shut(self) -> bool:
        """Whether nothing is left at some station: of a held roll, for which all is checked, no way is then whole."""
        left = np.isfinite(self.cost) & (self.known != HIT)
        return not left.any(axis=(1, 2)).all()

    @property
    def _samples_apart(self) -> int:
        """Samples that the roll may change between stations."""
        count = len(self.rolls)
        return ROLL_SAMPLES_APART if count > 2 * ROLL_SAMPLES_APART else min(count - 1, 1)

    def cut_between(self) -> list[tuple[int, int]]:
        """Pairs of neighbouring stations between which it found no way in a branch, those of most branches first."""
        most = self._samples_apart
        left = np.isfinite(self.cost) & (self.known != HIT)
        ends = []
        come = left[0]
        for s in range(1, len(self.at)):
            around = come.copy()
            for shift in range(1, most + 1):
                around[:, shift:] |= come[:, :-shift]
                around[:, :-shift] |= come[:, shift:]
                if self.context.window.is_full:
                    around[:, :shift] |= come[:, -shift:]
                    around[:, -shift:] |= come[:, :shift]
            on = around & left[s]
            ends += [s] * int((come.any(axis=1) & ~on.any(axis=1)).sum())
            come = on
        some, times = np.unique(ends, return_counts=True)
        return [(int(self.at[s - 1]), int(self.at[s])) for s in some[np.argsort(-times, kind="stable")].astype(int)]

    def _cheapest(self, q: Floats, roll: Floats, cost: Floats) -> tuple[int, Ints] | None:
        """The cheapest way through nodes (j, t, 1, b) at rolls (t, b): mostly one on which the roll stays as it is."""
        stay = banded.prices(self.chain, q, roll, self.bounds, STILL, circular=False)
        if roll.shape[1] == 1:
            return banded.cheapest(cost, stay, STILL)
        turns = [np.abs(wrap(roll[1:, a] - roll[:-1, b])) for a, b in ((LATER, EARLIER), (EARLIER, LATER))]
        path = banded.steadiest(cost, stay, self.bounds.roll_price * float(np.min(turns)))
        if path is not None:
            return path
        return banded.cheapest(cost, banded.prices(self.chain, q, roll, self.bounds, NEARBY, circular=False), NEARBY)

    def _rolls_between(self, samples: Ints) -> Floats:
        """Rolls to check for every target, (t, b), around those chosen at the stations, (s,) samples."""
        chosen, window = self.rolls[samples], self.context.window
        if window.is_fixed:
            return np.full((len(self.bead), 1), window.low)
        steady = chosen[0] + np.concatenate([[0.0], np.cumsum(wrap(np.diff(chosen)))])
        roll = np.interp(np.arange(len(self.bead)), self.at, steady)[:, None] + BESIDE * self.roll_step
        return roll if window.is_full else np.clip(roll, window.low, window.high)

    def _expected_cost_between(self, branch: int, roll: Floats) -> Floats:
        """Cost of rolls (t, b) between stations, from the costs at the stations beside them, s."""
        expected_cost = np.where(self.known[:, branch] == HIT, COLLISION_PENALTY, self.expected_cost[:, branch])
        if expected_cost.any():  # where something is near, what has not been checked may be nearer
            expected_cost = np.where(
                self.known[:, branch] == UNKNOWN, np.maximum(expected_cost, NEAR_COST), expected_cost
            )
        after = np.minimum(np.searchsorted(self.at, np.arange(len(roll))), len(self.at) - 1)
        before = np.maximum(after - (self.at[after] > np.arange(len(roll))), 0)
        return np.maximum.reduce([expected_cost[s[:, None], r] for s in (before, after) for r in self._beside(roll)])

    def _through_stations(self) -> tuple[int, Ints] | None:
        """Group and samples of the cheapest way that is free at the stations, (s,)."""
        # a branch in which some station cannot be reached at all has no way through
        branches = np.flatnonzero(np.isfinite(self.cost).any(axis=2).all(axis=0))
        if not len(branches):
            return None
        edges, shifts = self._edges(branches)
        arriving, weight = self._arriving(self.q[:, 0]), len(self.bead) / len(self.at)
        s = np.arange(len(self.at))

        def cheapest(usable: NDArray[np.bool_]) -> tuple[int, Ints] | None:
            cost = (self.cost + self.expected_cost) * weight
            cost[0] += arriving
            found = banded.cheapest(np.where(usable, cost, np.inf)[:, branches], edges, shifts)
            return None if found is None else (int(branches[found[0]]), found[1])

        free = 0
        for _ in range(PATHS_A_ROUND):
            if self.context.work > self._most:
                return None
            if free == FREE_PATHS:  # what else may be clearer is not worth looking at
                return cheapest(self.known == FREE)
            path = cheapest(self.known != HIT)
            if path is None:
                return None
            g, r = path
            new = self.known[s, g, r] == UNKNOWN
            hit = self._look(s[new], g, r[new])
            if hit.any():
                self._look_around(s[new][hit], g)
            elif not self.expected_cost[s[new], g, r[new]].any():
                return path
            else:
                free += 1
        return None

    def _edges(self, branches: Ints) -> tuple[Floats, Ints]:
        """Edges between stations in some branches, (s - 1, b, shifts, r), and by how many samples the roll changes."""
        bounds = self.bounds
        total, far = (np.concatenate([[0.0], np.cumsum(each)]) for each in (bounds.times, bounds.largest))
        steps = np.diff(self.at)
        wider = replace(
            bounds,
            times=np.diff(total[self.at]),
            largest=np.minimum(np.diff(far[self.at]), np.pi),
            roll_step=steps * self.roll_step,
        )
        most = self._samples_apart
        rolls = np.broadcast_to(self.rolls, (len(self.at), len(self.rolls)))
        shifts = np.arange(-most, most + 1)
        full = self.context.window.is_full
        return banded.prices(self.chain, self.q[:, :, branches], rolls, wider, shifts, circular=full), shifts

    def _look(self, s: Ints, g: int, r: Ints) -> NDArray[np.bool_]:
        """Check nodes of stations; which collide."""
        least = self.context.settings.clearance
        axes = self.bead.placed.axes(self.q[:, s, g, r].T, self.at[s])
        found, tools = with_blocked_rolls(self.context, axes, self.bead.deposits_before[self.at[s]])
        hit = found.distance < least
        self.known[s, g, r] = np.where(hit, HIT, FREE)
        self.expected_cost[s, g, r] = near_cost(found.distance, least)
        # the tool stands alike in every branch, and a turn of the roll frees it only after some angle
        tool = np.flatnonzero(tools.turn > 0)
        held = np.abs(self._turn(r[tool])) < tools.turn[tool, None]  # (m, r)
        at, rolls = np.nonzero(held)
        known = self.known[s[tool[at]], :, rolls]
        self.known[s[tool[at]], :, rolls] = np.where(known == FREE, FREE, HIT)
        return hit

    def _turn(self, r: Ints) -> Floats:
        """How far every roll is from some of them, (m, r), rad."""
        turn = self.rolls - self.rolls[r][:, None]
        return wrap(turn) if self.context.window.is_full else turn

    def _look_around(self, s: Ints, g: int) -> None:
        """Check every second roll at one of some stations where the way collides; expect the same at the others."""
        i = int(s[len(s) // 2])
        r = np.arange(0, len(self.rolls), 2)
        r = r[(self.known[i, g, r] == UNKNOWN) & np.isfinite(self.cost[i, g, r])]
        if len(r):
            self._look(np.full(len(r), i), g, r)
        hit = self.known[i, g] == HIT
        hit |= np.roll(hit, 1) | np.roll(hit, -1)
        for other in (g, g ^ 1):  # the wrist's other configuration has the same links in nearly the same places
            expected = np.ix_(s, np.array([other]), np.flatnonzero(hit))
            self.expected_cost[expected] = np.where(
                self.known[expected] == FREE, self.expected_cost[expected], COLLISION_PENALTY
            )

    def _avoid(self, targets: Ints, branch: int, roll: Floats) -> None:
        """Penalise rolls (t,) at targets that are stations: these are free, but the edges between them are not."""
        s, count = np.searchsorted(self.at, targets), len(self.rolls)
        low, high = self._beside(roll)
        for r in (low - 1, low, high, high + 1):  # those beside it are hardly better
            self.expected_cost[s, branch, r % count] += COLLISION_PENALTY

    def _beside(self, roll: Floats) -> tuple[Ints, Ints]:
        """The samples on either side of rolls; one and the same where a roll is a sample."""
        place = (roll - self.rolls[0]) / self.roll_step
        low, high = (np.round(x).astype(np.int64) % len(self.rolls) for x in (place - 0.499, place + 0.499))
        return low, high

    def _add(self, targets: Ints) -> bool:
        """Put stations at some of these targets; False if there is one at each of them."""
        new = np.setdiff1d(targets, self.at)
        if not len(new):
            return False
        some = new[np.unique(np.linspace(0, len(new) - 1, MORE + 2)[1:-1].round().astype(np.int64))]
        q, cost = self._nodes_of(some, np.broadcast_to(self.rolls, (len(some), len(self.rolls))))
        where = np.searchsorted(self.at, some)
        self.at = np.insert(self.at, where, some)
        self.q = np.insert(self.q, where, q, axis=1)
        self.cost = np.insert(self.cost, where, cost, axis=0)
        self.known = np.insert(self.known, where, UNKNOWN, axis=0)
        self.expected_cost = np.insert(self.expected_cost, where, 0.0, axis=0)
        return True

    def _nodes_of(self, at: Ints, rolls: Floats, branch: int | None = None) -> tuple[Floats, Floats]:
        """Nodes (j, t, g, r) of some targets at rolls (t, r), and what each costs, (t, g, r), s."""
        q, cost = nodes_of_poses(self.context, self.Ts[at], rolls, branch)
        self._keep_off(at, q, cost)
        return q, cost

    def _keep_off(self, at: Ints, q: Floats, cost: Floats) -> None:
        """Forbid nodes of the ends that are not well off what these are to be off, among those of some targets."""
        for end, off in ((0, self.ends.begin_off), (len(self.bead) - 1, self.ends.end_off)):
            for k in np.flatnonzero(at == end) if len(off) else ():
                for other in off:
                    cost[k][np.abs(wrap(q[:, k] - other[:, None, None])).max(axis=0) < ELSEWHERE] = np.inf

    def _arriving(self, q: Floats) -> Floats:
        """Cost of the motion to nodes of the first target, (j, g, r) -> (g, r), s."""
        if self.ends.q_before is None:
            return np.zeros(q.shape[1:])
        move = q - self.ends.q_before[:, None, None]
        turning = banded.several_turns(self.chain)
        move[turning] = wrap(move[turning])
        return np.nan_to_num((np.abs(move) / self.bounds.speed[:, None, None]).max(axis=0), nan=np.inf)
