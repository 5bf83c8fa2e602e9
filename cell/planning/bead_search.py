"""The full search of one bead: paths through its nodes are checked one by one, until one is free or none is left.

    plan = BeadSearch(bead, nodes).run(q_before)
    plan.whole, plan.stretches, plan.edge_failures, plan.target_failures    # what failed, by target

Metres, radians, seconds.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np

from ik.bead_path import ROLL_COST, Allowance, Edge, KnownMoves, Run, best_runs
from ik.chain import Floats
from ik.reachability_proof import certify
from ik.roll import wrap

from ..arrays import Ints, distinct
from ..collision.clearances import Clearances
from ..failure import Failure, FailurePlace, Kind, SearchEffort, Where
from .bead_outcome import BeadPlan, TargetFailure
from .blocked_rolls import with_blocked_rolls
from .collision_free_rolls import roll_between_samples
from .configurations import Nodes, near_cost
from .edges.edge_check import SearchedBead, Stretch, check_edges
from .edges.next_target import true_edges, why_none_leads_on

MOST_SEARCHES = 400  # searches a bead before it is given up; each blocks something, so that few beads need ten
FREE_PATHS = 3  # paths that are free, but near something, before one is taken
FURTHEST = 2 * np.pi  # most that a joint turns from target to target: what a way does is found by following it
FREE_TURN = np.pi / 2  # most that a free roll turns from target to target, where the joints are fast enough
SAME_ANGLE = 1e-5  # rad; angles closer than this, whole turns aside, are one
DEEP_MM = -30.0  # a few degrees of roll do not get the arm out of more


class BeadSearch:
    """Holds what a search has learned about its nodes and edges. Targets count from the bead's first."""

    def __init__(
        self,
        bead: SearchedBead,
        nodes: Nodes,
        *,
        turns_freely: bool = False,
        rounds: int = MOST_SEARCHES,
        most: float = np.inf,
    ) -> None:
        """Prepare.

        Args:
            bead: what to search a way along.
            nodes: candidates of the bead's targets.
            turns_freely: whether the roll may change by more than a sample from target to target.
            rounds: searches until it is given up.
            most: configurations that it may ask about before it is cut off.
        """
        self._most = bead.context.work + most
        self.bead, self.nodes, self.rounds = bead, nodes, rounds
        self.allowance = Allowance(bead.largest, bead.times)
        if turns_freely:
            price = ROLL_COST / bead.context.settings.roll_step
            self.allowance = replace(self.allowance, rolls=nodes.rolls, turn=FREE_TURN, turn_price=price)
        self.context, self.placed, self.deposits_laid, self.first = (
            bead.context,
            bead.placed,
            bead.deposits_before,
            bead.first,
        )
        self.cost = nodes.cost.copy()
        self._judged = np.zeros(len(bead), dtype=bool)  # targets whose every node has been checked
        self._patience = FREE_PATHS
        self._free = np.zeros(self.cost.shape, dtype=bool)  # nodes known to be free
        self._least_bad: dict[int, tuple[float, Clearances, tuple[int, ...]]] = {}  # of the nodes that collide
        self._blocked: dict[int, set[Edge]] = {}
        self._causes: dict[int, list[Failure]] = {}
        self._known_moves: KnownMoves | None = None  # from the second search on: few beads need many
        self._done: dict[tuple[int, Edge], Stretch] = {}
        self._followed: set[int] = set()  # targets from which all expensive edges have been followed
        self._gave_up = False

    def run(self, q_before: Floats | None) -> BeadPlan:
        """Search until the way found is free, or there is none.

        Args:
            q_before: where the arm comes from, (j,), rad, or None.

        Returns:
            The plan, its targets counted in the whole part; all of them open where it was cut off.
        """
        stop = self.first + len(self.deposits_laid)
        for _ in range(self.rounds):
            if self.context.work > self._most:
                return BeadPlan(self.first, stop, (), {}, {}, frozenset(range(self.first, stop)))
            runs = self._runs(q_before)
            if not self._block_colliding_nodes(runs) and not self._block_broken_edges(runs):
                break
        else:
            self._gave_up = True
            runs = self._given_up()
        reached = {run.start + i for run in runs for i in range(len(run.nodes))}
        lost = [i for i in range(len(self.deposits_laid)) if i not in reached]
        target_failures = {self.first + i: m for i, m in self._target_failures(lost).items()}
        return BeadPlan(
            self.first, stop, tuple(self._stretch(run) for run in runs), self._edge_failures(runs), target_failures
        )

    def first_path(self, q_before: Floats | None) -> tuple[Floats, Floats] | None:
        """The way that :meth:`run` follows first, if it leads through the whole bead.

        Args:
            q_before: where the arm comes from, (j,), rad, or None.

        Returns:
            Rolls and configurations of its targets, (t,) and (t, j), rad, free at each; None where there is none.
        """
        for _ in range(self.rounds):
            runs = self._runs(q_before)
            if len(runs) != 1 or len(runs[0].nodes) != len(self.deposits_laid):
                return None
            if not self._block_colliding_nodes(runs):
                nodes = runs[0].nodes
                return self.nodes.rolls[nodes[:, 0]], self.nodes.q[(np.arange(len(nodes)), *nodes.T)]
        return None

    def _runs(self, q_before: Floats | None) -> list[Run]:
        start = None
        if q_before is not None:
            time = (np.abs(self.nodes.q[0] - q_before) / self.bead.speed).max(axis=-1)
            start = np.nan_to_num(time, nan=np.inf)
        known, self._known_moves = self._known_moves, self._known_moves or KnownMoves()
        return best_runs(
            self.nodes.q,
            self.cost,
            self.bead.slowest,
            self.bead.speed,
            largest_step=FURTHEST,
            circular=self.nodes.window.is_full,
            blocked=self._blocked,
            start_cost=start,
            allowance=self.allowance,
            known=known,
        )

    def _given_up(self) -> list[Run]:
        """Every target by itself, in a configuration known to be free; the motion between them is not checked."""
        self._judge_targets(np.arange(len(self.deposits_laid)))
        best = self.cost.reshape(len(self.deposits_laid), -1).argmin(axis=1)
        nodes = np.stack(np.unravel_index(best, self.cost.shape[1:]), axis=1)
        return [Run(i, nodes[i : i + 1], 0.0) for i in range(len(nodes)) if np.isfinite(self.cost[i]).any()]

    def _block_colliding_nodes(self, runs: list[Run]) -> bool:
        """Check the nodes the runs lead over; where one collides, judge all of that target's.

        Returns:
            Whether to search again: one collides, or is near to something, so that another way may be better.
        """
        path = [(run.start + i, *node) for run in runs for i, node in enumerate(run.nodes.tolist())]
        index = np.array(path, dtype=np.int64).reshape(-1, 4)
        index = index[~self._free[tuple(index.T)]]
        before = self.cost[tuple(index.T)]
        hit = self._check(index)
        self._judge_targets(np.unique(index[hit, 0]))
        if not hit.any() and self._patience and (self.cost[tuple(index.T)] > before).any() and self._may_be_whole():
            self._patience -= 1
            return True
        return bool(hit.any())

    def _may_be_whole(self) -> bool:
        """Whether each target still has a node; if not, the path is not used, so any will do."""
        return bool(np.isfinite(self.cost).any(axis=(1, 2, 3)).all())

    def _check(self, index: Ints) -> np.ndarray:
        """Check nodes (m, 4); marks them free or forbidden and says which collide."""
        # configurations that differ by whole turns of a joint are checked once; a branch may have several others
        angle = np.round(wrap(self.nodes.q[tuple(index.T)] + SAME_ANGLE / 3) / SAME_ANGLE).astype(np.int64)
        first, same = distinct(*index[:, :3].T, *angle.T)
        some = index[first]
        axes = self.placed.axes(self.nodes.q[tuple(some.T)], some[:, 0])
        seen, tools = with_blocked_rolls(self.context, axes, self.deposits_laid[some[:, 0]])
        found, of_tool = seen.rows(same), (tools.turn > 0)[same]
        hit = found.distance < self.context.settings.clearance
        self._free[tuple(index[~hit].T)] = True
        self.cost[tuple(index.T)] += near_cost(found.distance, self.context.settings.clearance)
        self.cost[tuple(index[hit].T)] = np.inf
        # the tool stands alike in every configuration of a roll
        tool = index[of_tool]
        self.cost[tool[:, 0], tool[:, 1]] = np.inf
        for k in np.flatnonzero(hit):
            i, distance = int(index[k, 0]), float(found.distance[k])
            if i not in self._least_bad or distance > self._least_bad[i][0]:
                self._least_bad[i] = distance, found.rows(np.array([k])), tuple(index[k, 1:].tolist())
        return hit

    def _judge_targets(self, targets: Ints, *, whole: bool = True) -> None:
        """Check every node of some targets; not as a whole: no more of those that are free."""
        todo = targets[~self._judged[targets]]
        for one_a_roll in (True, False):
            if not whole:
                todo = todo[~self._free[todo].any(axis=(1, 2, 3))]
            nodes = np.argwhere(np.isfinite(self.cost[todo]) & ~self._free[todo])
            if one_a_roll:
                nodes = nodes[distinct(*nodes[:, :2].T)[0]]
            if len(nodes):
                self._check(np.column_stack([todo[nodes[:, 0]], nodes[:, 1:]]))
        self._judged[todo] = True

    def lost_alone(self) -> dict[int, TargetFailure]:
        """Targets without a free node, each checked by itself, with the reason; by number in the whole part."""
        every = np.arange(len(self.deposits_laid))
        self._judge_targets(every, whole=False)
        lost = every[~np.isfinite(self.cost).any(axis=(1, 2, 3))].tolist()
        return {self.first + i: lost for i, lost in self._target_failures(lost).items()}

    def _block_broken_edges(self, runs: list[Run]) -> bool:
        """Check the edges of the runs that are not checked yet; block those that fail. True if there are any."""
        todo: list[tuple[int, Edge]] = []
        for run in runs:
            nodes = [tuple(node) for node in run.nodes.tolist()]
            keys = [(run.start + i, (nodes[i], nodes[i + 1])) for i in range(len(nodes) - 1)]
            todo += [key for key in keys if key not in self._done]
        if not todo:
            return False
        start = np.array([i for i, _ in todo])
        ends = np.array([edge for _, edge in todo])  # (e, 2, 3)
        target = np.stack([start, start + 1], axis=1)
        q = self.nodes.q[target, ends[..., 0], ends[..., 1], ends[..., 2]]
        roll = self.nodes.rolls[ends[..., 0]]
        found = check_edges(self.bead, start, roll, q)
        move = np.abs(q[:, 1] - q[:, 0]).max(axis=1)
        for e, ((i, edge), cause) in enumerate(zip(todo, found.causes, strict=True)):
            if cause is None:
                self._done[i, edge] = found.stretch(e)
                continue
            self._blocked.setdefault(i, set()).add(edge)
            if cause.kind is Kind.COLLISION or move[e] <= self.bead.largest[i]:
                self._causes.setdefault(i, []).append(cause)
            elif i not in self._followed:
                # it was none; of those like it most are none either
                self._followed.add(i)
                self._blocked[i] |= self._costly(i) - true_edges(self.bead, self.nodes, i, self._costly(i))
        return any(cause is not None for cause in found.causes)

    def _costly(self, i: int) -> set[Edge]:
        """Edges from a target to the next in which a joint turns further than usual, and that are still open."""
        known = self._blocked.get(i, set()) | {edge for k, edge in self._done if k == i}
        shifts, price = self.allowance.shifts()
        rolls = len(self.nodes.rolls)
        out = set()
        for shift, cost in zip(shifts.tolist(), price, strict=True):
            r0 = np.arange(rolls)
            r1 = (r0 + shift) % rolls
            inside = np.isfinite(np.broadcast_to(cost, rolls))[r1]
            if not self.nodes.window.is_full:
                inside &= (r0 + shift >= 0) & (r0 + shift < rolls)
            a, b = self.nodes.q[i][r0], self.nodes.q[i + 1][r1]  # (r, g, k, j)
            move = np.abs(b[:, :, None] - a[:, :, :, None])  # (r, g, k0, k1, j)
            open_ = np.isfinite(self.cost[i])[r0][..., None] & np.isfinite(self.cost[i + 1])[r1][:, :, None]
            open_ &= (move.max(axis=-1) > self.bead.largest[i]) & (move.max(axis=-1) <= FURTHEST)
            open_ &= ((move / self.bead.speed).max(axis=-1) <= self.bead.slowest[i]) & inside[:, None, None, None]
            at = np.argwhere(open_).tolist()
            out |= {((r, g, k0), (int(r1[r]), g, k1)) for r, g, k0, k1 in at}
        return out - known

    def _stretch(self, run: Run) -> Stretch:
        """The samples of a run, put together from its edges."""
        nodes = [tuple(node) for node in run.nodes.tolist()]
        target = run.start + np.arange(len(nodes))
        where = (target, *run.nodes.T)
        q, roll = self.nodes.q[where], self.nodes.rolls[run.nodes[:, 0]]
        if len(nodes) == 1:
            alone = self.context.checker.clearances(self.placed.axes(q, target), self.deposits_laid[target])
            position, table = self.placed.bead.position[target], self.placed.tables(target)
            first, margin = self.first + run.start, self.nodes.margin[where]
            low, kept = np.minimum(alone.distance, self.context.checker.reach), np.full(1, -np.inf)
            edge = self.first + target
            return Stretch(first, q, roll, edge, np.zeros(1), q, position, table, alone, low, kept, margin)
        pieces = [self._done[run.start + i, (nodes[i], nodes[i + 1])] for i in range(len(nodes) - 1)]

        def joined(of: Callable[[Stretch], Any]) -> Any:
            # an edge's last sample is the next edge's first
            return np.concatenate([*(of(piece)[:-1] for piece in pieces[:-1]), of(pieces[-1])])

        return Stretch(
            first=self.first + run.start,
            q_targets=q,
            roll=roll,
            edge=joined(lambda s: s.edge),
            fraction=joined(lambda s: s.fraction),
            q=joined(lambda s: s.q),
            position=joined(lambda s: s.position),
            table=joined(lambda s: s.table),
            clearances=Clearances(
                joined(lambda s: s.clearances.distance),
                joined(lambda s: s.clearances.pair),
                joined(lambda s: s.clearances.position),
            ),
            low=joined(lambda s: s.low),
            kept=joined(lambda s: s.kept),
            margin=joined(lambda s: s.margin),
        )

    def _edge_failures(self, runs: list[Run]) -> dict[int, Failure]:
        edge_failures = {}
        for before, after in pairwise(runs):
            if before.stop != after.start:
                continue  # a target without configurations lies between, and says why itself
            i = after.start
            known = self._causes.get(i - 1)
            failure = known[-1] if known else self._without_edge(i - 1)
            failure = failure.at(FailurePlace(Where.BEAD, from_target=self.first + i - 1))
            edge_failures[self.first + i] = (
                replace(failure, effort=SearchEffort(searches=self.rounds)) if self._gave_up else failure
            )
        return edge_failures

    def _without_edge(self, i: int) -> Failure:
        """Why no edge joins two targets: a joint is too slow, or none of their configurations leads on to another."""
        pair = slice(i, i + 2)
        q, cost = self.nodes.q[pair], np.where(np.isfinite(self.cost[pair]), 0.0, np.inf)
        circular, blocked = self.nodes.window.is_full, {0: self._blocked.get(i, set())}
        wide = replace(self.allowance, usual_step=np.full(1, np.inf), usual_time=np.full(1, np.inf))
        slow, fast = (
            best_runs(
                q,
                cost,
                np.array([time]),
                self.bead.speed,
                largest_step=largest,
                circular=circular,
                blocked=blocked,
                allowance=wide,
            )
            for time, largest in ((np.inf, float(self.bead.largest[i])), (self.bead.slowest[i], FURTHEST))
        )
        if len(slow) != 1 or len(fast) == 1:
            # even where two of their configurations are joined: not those that the bead arrives in
            return Failure(Kind.CONFIGURATION_CHANGE, because=why_none_leads_on(self.bead, self.nodes, i, self.cost))
        a, b = (q[k][tuple(node)] for k, node in enumerate(slow[0].nodes.tolist()))
        needed = np.abs(b - a) / self.bead.slowest[i]
        j = int(np.argmax(needed / self.bead.speed))
        return Failure(
            Kind.JOINT_SPEED,
            measure=round(float(np.rad2deg(needed[j])), 3),
            limit=round(float(np.rad2deg(self.bead.speed[j])), 3),
            axis=self.nodes.solver.chain.names[j],
        )

    def _target_failures(self, lost: list[int]) -> dict[int, TargetFailure]:
        """Why targets have no allowed node."""
        bare = [i for i in lost if not np.isfinite(self.nodes.cost[i]).any()]
        out = {i: self._colliding(i) for i in lost if i not in bare}
        proofs = self._proofs(bare)
        for i in bare:
            failure, attempt = self.nodes.why_not(i)
            proved, roll = proofs.get(i, (False, None))
            between = None
            if roll is not None:
                T, table = self.placed.Ts_base_target[i], self.placed.tables(np.array([i]))[0]
                between = roll_between_samples(self.context, self.nodes, T, int(self.deposits_laid[i]), roll, table)
            out[i] = TargetFailure(replace(failure, between=between, proved=proved), attempt)
        return out

    def _colliding(self, i: int) -> TargetFailure:
        """The least bad of a target's configurations, all of which collide."""
        _, found, node = self._least_bad[i]
        roll = round(float(np.rad2deg(self.nodes.rolls[node[0]])), 3)
        # one roll alone and all configurations of it, none of them one of endlessly many: nothing is left to check
        limits = self.context.limits
        counted = min(limits.wrist, limits.elbow, limits.shoulder) > 0
        exhaustive = bool(self.nodes.exhaustive and self.nodes.window.is_fixed and counted)
        failure = replace(self.context.describe(found, 0), roll_deg=roll, proved=exhaustive)
        return TargetFailure(failure, self.nodes.q[i][node].copy())  # not all candidates of the bead with it

    def _proofs(self, targets: list[int]) -> dict[int, tuple[bool, float | None]]:
        """Whether targets are proved out at every allowed roll; else, a roll between the samples that reaches, rad."""
        form = self.context.solver.form
        if form is None or not targets:
            return {}
        Ts, limits = self.placed.Ts_base_target[targets], self.context.limits
        found = certify(self.context.solver.chain, Ts, self.nodes.window, limits, form)
        return {
            i: (bool(found.unreachable[k]), float(found.roll[k]) if found.reachable[k] else None)
            for k, i in enumerate(targets)
        }
