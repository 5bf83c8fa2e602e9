"""The way of the arm through every bead.

    planner = Planner(nodes, placed, path, stage, checker, settings)
    plan = planner.bead(0, 14, None)  # BeadPlan: what can be run through, what cuts it, clearances
    # cell.travel.travel(planner, ...): from the end of one bead to the start of the next

A bead is searched on its nodes first and checked for collisions where the way leads (and where it fails, everywhere at
that target); then followed densely between its targets. What turns out impossible is blocked and the search goes on.
Metres, radians, seconds.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np

from ik.chain import Floats
from ik.path import Edge, Run, best_runs

from .between import radii, unproved
from .collision import Checker, Clearances, Ints
from .follow import Steps, follow
from .nodes import Nodes
from .place import METRES_PER_MM, Placed

ROUNDS = 400  # searches a bead before it is given up; each blocks something, so that few beads need ten


@dataclass(frozen=True)
class Settings:
    """What a plan keeps to.

    Attributes:
        clearance: least distance of everything from everything, m.
        speed: deposition speed, m/s.
        travel_speed: TCP speed of retracting and approaching, m/s.
        retract: way out along the normal before travelling, m.
        steps: density of the checks.
    """

    clearance: float
    speed: float
    travel_speed: float
    retract: float
    steps: Steps = field(default_factory=Steps)


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
        position: TCP, (m, 3), base frame, m.
        clearances: of the samples.
        margin: singularity margins of the samples, (m, 4).
    """

    first: int
    q_targets: Floats
    roll: Floats
    edge: Ints
    fraction: Floats
    q: Floats
    position: Floats
    clearances: Clearances
    margin: Floats

    @property
    def stop(self) -> int:
        """One past the last target."""
        return self.first + len(self.q_targets)


@dataclass(frozen=True, eq=False)
class BeadPlan:
    """What became of a bead.

    Attributes:
        stretches: what can be run through.
        cuts: targets that cannot be reached from the one before, with why.
        collisions: best clearance of the targets that have configurations but none without collision: row of
            ``Clearances``, its configuration, its roll.
    """

    stretches: tuple[Stretch, ...]
    cuts: dict[int, dict[str, Any]]
    collisions: dict[int, tuple[Clearances, Floats, float]]


class Planner:
    """Searches beads one after the other; holds what it has learned about nodes and edges."""

    def __init__(
        self,
        nodes: Nodes,
        placed: Placed,
        path: Ints,
        stage: Ints,
        checker: Checker,
        settings: Settings,
    ) -> None:
        """Prepare.

        Args:
            nodes: candidates of the targets.
            placed: the targets.
            path: bead of each target, (n,), ascending.
            stage: deposits already laid when a target is welded, (n,).
            checker: collision detection at the table pose.
            settings: what to keep to.
        """
        self.nodes, self.placed, self.path, self.stage = nodes, placed, path, stage
        self.checker, self.settings = checker, settings
        self.cost = nodes.cost.copy()
        self.radius = radii(checker.scene)
        self._searched = np.zeros(len(path), dtype=bool)  # targets whose every node has been checked
        self._free = np.zeros(self.cost.shape, dtype=bool)  # nodes known to be free
        length = np.linalg.norm(np.diff(placed.position, axis=0), axis=1)
        self._times = np.where(length > 0, length / settings.speed, np.inf)

    def bead(self, first: int, stop: int, q_before: Floats | None) -> BeadPlan:
        """Plan one bead.

        Args:
            first: its first target.
            stop: one past its last.
            q_before: where the arm comes from, (j,), rad, or None.

        Returns:
            The plan.
        """
        blocked: dict[int, set[Edge]] = {}
        causes: dict[int, list[dict[str, Any]]] = {}
        done: dict[tuple[int, Edge], Stretch] = {}
        for _ in range(ROUNDS):
            runs = self._runs(first, stop, q_before, blocked)
            if self._block_colliding_nodes(first, runs):
                continue
            if self._block_broken_edges(first, runs, blocked, causes, done):
                continue
            break
        else:
            # the last search may lead over what has not been checked: nothing of it is claimed
            runs = [Run(r.start + i, r.nodes[i : i + 1], 0.0) for r in runs for i in range(len(r.nodes))]
        stretches = tuple(self._stretch(first, run, done) for run in runs)
        return BeadPlan(stretches, self._cuts(first, runs, causes), self._collisions(first, stop, runs))

    def _runs(self, first: int, stop: int, q_before: Floats | None, blocked: dict[int, set[Edge]]) -> list[Run]:
        here = slice(first, stop)
        q = self.nodes.q[here]
        start = None
        speed = self.nodes.solver.chain.max_speed
        if q_before is not None:
            way = (np.abs(q[0] - q_before) / np.where(np.isfinite(speed), speed, 1.0)).max(axis=-1)
            start = np.nan_to_num(way, nan=np.inf)
        return best_runs(
            q,
            self.cost[here],
            self._times[first : stop - 1],
            np.where(np.isfinite(speed), speed, 1e3),
            circular=self.nodes.window.is_full and len(self.nodes.rolls) > 2,
            blocked=blocked,
            start_cost=start,
        )

    def _block_colliding_nodes(self, first: int, runs: list[Run]) -> bool:
        """Check the nodes the runs lead over; where one collides, judge all of that target's. True if any does."""
        way = [(first + run.start + i, *node) for run in runs for i, node in enumerate(run.nodes.tolist())]
        index = np.array(way, dtype=np.int64).reshape(-1, 4)
        index = index[~self._free[tuple(index.T)]]
        hit = self._check(index)
        for i in np.unique(index[hit, 0]):
            self.judge_target(int(i))
        return bool(hit.any())

    def _check(self, index: Ints) -> np.ndarray:
        """Check nodes (m, 4); marks them free or forbidden and tells which collide."""
        where = tuple(index.T)
        found = self.checker.clearances(self.nodes.q[where], self.stage[index[:, 0]])
        hit = found.distance < self.settings.clearance
        self._free[tuple(index[~hit].T)] = True
        self.cost[tuple(index[hit].T)] = np.inf
        return hit

    def judge_target(self, i: int) -> None:
        """Check every node of a target."""
        if self._searched[i]:
            return
        self._searched[i] = True
        open_nodes = np.argwhere(np.isfinite(self.cost[i]) & ~self._free[i])
        self._check(np.column_stack([np.full(len(open_nodes), i), open_nodes]))

    def _block_broken_edges(
        self,
        first: int,
        runs: list[Run],
        blocked: dict[int, set[Edge]],
        causes: dict[int, list[dict[str, Any]]],
        done: dict[tuple[int, Edge], Stretch],
    ) -> bool:
        """Follow the edges of the runs that have not been followed; block those that do not hold."""
        todo: list[tuple[int, Edge]] = []
        for run in runs:
            nodes = [tuple(node) for node in run.nodes.tolist()]
            keys = [(run.start + i, (nodes[i], nodes[i + 1])) for i in range(len(nodes) - 1)]
            todo += [key for key in keys if key not in done]
        if not todo:
            return False
        start = np.array([first + i for i, _ in todo])
        ends = np.array([edge for _, edge in todo])  # (e, 2, 3)
        target = np.stack([start, start + 1], axis=1)
        q = self.nodes.q[target, ends[..., 0], ends[..., 1], ends[..., 2]]
        roll = self.nodes.rolls[ends[..., 0]]
        track = follow(self.nodes.solver, self.placed, start, roll, q, self.nodes.limits, self.settings.steps)
        stage = self.stage[start[track.edge]]
        clear = self.checker.clearances(track.q, stage)
        step, nearest = unproved(self.checker, self.radius, track.q, stage, clear, track.edge)
        unsafe = dict(zip(track.edge[step].tolist(), range(len(step)), strict=True))
        failed = False
        for e, (i, edge) in enumerate(todo):
            mine = track.edge == e
            near = clear.distance[mine]
            cause: dict[str, Any] | None = None
            if track.broken[e]:
                cause = {"on_the_way": str(track.broken[e])}
            elif near.min() < self.settings.clearance:
                k = np.flatnonzero(mine)[int(np.argmin(near))]
                cause = {"on_the_way": "collision", **self.describe(clear, int(k))}
            elif e in unsafe:
                cause = {"on_the_way": "collision", **self.describe(nearest, unsafe[e])}
            if cause is not None:
                blocked.setdefault(i, set()).add(edge)
                causes.setdefault(i, []).append(cause)
                failed = True
                continue
            rows = Clearances(near, clear.pair[mine], clear.position[mine])
            done[i, edge] = Stretch(
                int(start[e]),
                q[e],
                roll[e],
                np.full(mine.sum(), start[e]),
                track.fraction[mine],
                track.q[mine],
                track.position[mine],
                rows,
                track.margin[mine],
            )
        return failed

    def _stretch(self, first: int, run: Run, done: dict[tuple[int, Edge], Stretch]) -> Stretch:
        """The samples of a run, put together from its edges."""
        nodes = [tuple(node) for node in run.nodes.tolist()]
        target = first + run.start + np.arange(len(nodes))
        where = (target, *run.nodes.T)
        q, roll = self.nodes.q[where], self.nodes.rolls[run.nodes[:, 0]]
        if len(nodes) == 1:
            one = self.checker.clearances(q, self.stage[target])
            position = self.placed.position[target]
            return Stretch(int(target[0]), q, roll, target, np.zeros(1), q, position, one, self.nodes.margin[where])
        pieces = [done[run.start + i, (nodes[i], nodes[i + 1])] for i in range(len(nodes) - 1)]
        # an edge's last sample is the next edge's first
        keep = [slice(None) if i == len(pieces) - 1 else slice(None, -1) for i in range(len(pieces))]

        def joined(of: Any) -> Any:
            return np.concatenate([of(piece)[k] for piece, k in zip(pieces, keep, strict=True)])

        return Stretch(
            first=int(target[0]),
            q_targets=q,
            roll=roll,
            edge=joined(lambda s: s.edge),
            fraction=joined(lambda s: s.fraction),
            q=joined(lambda s: s.q),
            position=joined(lambda s: s.position),
            clearances=Clearances(
                joined(lambda s: s.clearances.distance),
                joined(lambda s: s.clearances.pair),
                joined(lambda s: s.clearances.position),
            ),
            margin=joined(lambda s: s.margin),
        )

    def _cuts(self, first: int, runs: list[Run], causes: dict[int, list[dict[str, Any]]]) -> dict[int, dict[str, Any]]:
        cuts = {}
        for before, after in pairwise(runs):
            if before.stop != after.start:
                continue  # a target without configurations lies between, and says why itself
            i = after.start
            known = causes.get(i - 1, [])
            detail: dict[str, Any] = {"from_target": first + i - 1}
            detail.update(known[-1] if known else {"on_the_way": self._without_edge(first + i - 1)})
            cuts[first + i] = detail
        return cuts

    def _without_edge(self, i: int) -> str:
        """Why no edge joins two targets: they share no configuration, or the joints are too slow."""
        pair = slice(i, i + 2)
        unlimited = np.array([np.inf])
        slow = best_runs(
            self.nodes.q[pair],
            self.cost[pair],
            unlimited,
            np.ones(self.nodes.solver.chain.n),
            circular=self.nodes.window.is_full,
        )
        return "speed" if len(slow) == 1 else "configuration change"

    def _collisions(self, first: int, stop: int, runs: list[Run]) -> dict[int, tuple[Clearances, Floats, float]]:
        """The least bad node of targets all of whose allowed nodes collide."""
        reached = {first + run.start + i for run in runs for i in range(len(run.nodes))}
        out = {}
        for i in sorted(set(range(first, stop)) - reached):
            tried = np.argwhere(np.isfinite(self.nodes.cost[i]))
            if not len(tried):
                continue
            q = self.nodes.q[i][tuple(tried.T)]
            found = self.checker.clearances(q, np.full(len(q), self.stage[i]))
            k = int(np.argmax(found.distance))
            row = Clearances(found.distance[k : k + 1], found.pair[k : k + 1], found.position[k : k + 1])
            out[i] = row, q[k], float(self.nodes.rolls[tried[k, 0]])
        return out

    def describe(self, found: Clearances, k: int) -> dict[str, Any]:
        """A collision in words and figures."""
        scene = self.checker.scene
        pair = [scene.geom_name(int(g)) for g in found.pair[k] if g >= 0]
        return {
            "pair": pair,
            "distance_mm": round(float(found.distance[k]) / METRES_PER_MM, 3),
            "required_mm": round(self.settings.clearance / METRES_PER_MM, 3),
            "world_xyz_mm": [round(float(v) / METRES_PER_MM, 2) for v in found.position[k]],
        }
