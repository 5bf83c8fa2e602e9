"""A path between two configurations where the straight one is not free: bidirectional trees in joint space.

    space = Space(lower, upper, radius, speed)
    found = connect(space, TreeRoots(starts, goals, hints), free, attempts=1000, seed=0)
    found.path                     # (k, n) corners from one of the starts to one of the goals, or None

``free(a, b)`` gives for many edges at once how far each is free; nothing here depends on arms or cells. The same
questions give the same answers: the random numbers are seeded, and no clock is read. Radians.

Source: Kuffner, LaValle, RRT-Connect: an efficient approach to single-query path planning, ICRA 2000; shortcuts after
Geraerts, Overmars, Creating high-quality paths for motion planning, IJRR 2007.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ik.chain import Floats

from ...arrays import Ints

BATCH = 12  # samples a round: enough that asking costs little beside looking
SPREADS = np.array([0.1, 0.3, 1.0])  # of the joints' ranges, about the line between the ends
ANYWHERE = 4  # every so many samples is anywhere
REACHED = 1.0 - 1e-9
STRIDE = 0.4  # m, weighed: further apart than this nodes are not, so that near ones can be found
LEAST = 0.02  # m, weighed: shorter ways are not worth a node
CORNER = 0.4  # of the shorter side at a corner, cut off on both sides of it at most
CORNER_PIECES = 6  # pieces of a rounded corner

Free = Callable[[Floats, Floats], Floats]


@dataclass(frozen=True, eq=False)
class Space:
    """Joint space.

    Attributes:
        lower: (n,), rad.
        upper: (n,), rad.
        radius: how far a turn of each joint moves the arm, (n,), m: distances are weighed by it.
        speed: (n,), rad/s: what shortcuts make shorter is time.
    """

    lower: Floats
    upper: Floats
    radius: Floats
    speed: Floats

    def distance(self, a: Floats, b: Floats) -> Floats:
        """Weighed distance, (...,), m."""
        return np.linalg.norm((b - a) * self.radius, axis=-1)

    def time(self, a: Floats, b: Floats) -> Floats:
        """Time of the slowest joint, (...,), s."""
        return (np.abs(b - a) / self.speed).max(axis=-1)


@dataclass(frozen=True, eq=False)
class TreeRoots:
    """Where the trees of a search begin.

    Attributes:
        starts: (s, n), rad.
        goals: (g, n), rad.
        hints: configurations worth a try before random ones, (h, n), rad.
    """

    starts: Floats
    goals: Floats
    hints: Floats


@dataclass(frozen=True, eq=False)
class TreeSearchResult:
    """What a search ended with.

    Attributes:
        path: corners, (k, n), or None.
        sizes: nodes of the tree of the starts and of that of the goals: the smaller is the one shut in.
    """

    path: Floats | None
    sizes: tuple[int, int]


class _Tree:
    """Configurations reached, each from another."""

    def __init__(self, roots: Floats) -> None:
        self.q = roots
        self.parent = np.full(len(roots), -1)

    def chain(self, q: Floats, parent: int) -> int:
        """Add nodes (k, n), each the next one's parent; the number of the last."""
        first = len(self.q)
        self.q = np.concatenate([self.q, q])
        self.parent = np.concatenate([self.parent, [parent], np.arange(first, first + len(q) - 1)])
        return len(self.q) - 1

    def nearest(self, space: Space, q: Floats) -> Ints:
        """The node nearest to each configuration, (e,)."""
        return np.array([int(np.argmin(space.distance(self.q, x))) for x in q], dtype=np.int64)

    def back(self, i: int) -> Floats:
        """The way from a node to its root, (k, n)."""
        out = [i]
        while self.parent[out[-1]] >= 0:
            out.append(int(self.parent[out[-1]]))
        return self.q[out]


def connect(space: Space, trees: TreeRoots, free: Free, attempts: int, seed: int) -> TreeSearchResult:
    """Search a path from any start to any goal.

    Args:
        space: joint space.
        trees: where from, where to.
        free: how far each of the edges a, b (e, n) can be gone, (e,), 0 to 1.
        attempts: configurations tried before the search gives up.
        seed: of the random numbers.

    Returns:
        What was found; the way's edges have all been checked by ``free``.
    """
    rng = np.random.default_rng(seed)
    a, b = _Tree(trees.starts), _Tree(trees.goals)
    turned = False
    pending = trees.hints
    for _ in range(-(-attempts // BATCH)):
        samples = np.concatenate([pending, _samples(rng, space, trees, BATCH)])
        pending = pending[:0]
        met = _round(space, a, b, samples, free)
        if met is not None:
            path = np.concatenate([a.back(met[0])[::-1], b.back(met[1])[1:]])
            return TreeSearchResult(path[::-1] if turned else path, _sizes(a, b, turned))
        a, b, turned = b, a, not turned
    return TreeSearchResult(None, _sizes(a, b, turned))


def _sizes(a: _Tree, b: _Tree, turned: bool) -> tuple[int, int]:
    return (len(b.q), len(a.q)) if turned else (len(a.q), len(b.q))


def _samples(rng: np.random.Generator, space: Space, trees: TreeRoots, count: int) -> Floats:
    """Configurations about the lines between starts and goals, near ones and far ones, and some anywhere.

    Far ones end on joint limits more often than not: a folded arm is what gets past things.
    """
    start = trees.starts[rng.integers(len(trees.starts), size=count)]
    goal = trees.goals[rng.integers(len(trees.goals), size=count)]
    about = start + rng.random((count, 1)) * (goal - start)
    spread = SPREADS[rng.integers(len(SPREADS), size=count)][:, None]
    near = about + rng.uniform(-1, 1, about.shape) * spread * (space.upper - space.lower) / 2
    anywhere = rng.uniform(space.lower, space.upper, about.shape)
    return np.where(np.arange(count)[:, None] % ANYWHERE, np.clip(near, space.lower, space.upper), anywhere)


def _round(space: Space, a: _Tree, b: _Tree, samples: Floats, free: Free) -> tuple[int, int] | None:
    """Grow one tree towards samples and the other towards what it reached; the nodes where they met, or None."""
    new, _ = _grown(a, space, samples, free)
    new = new[new >= 0]
    if not len(new):
        return None
    grown, met = _grown(b, space, a.q[new], free)
    done = np.flatnonzero(met)
    return (int(new[done[0]]), int(grown[done[0]])) if len(done) else None


def _grown(tree: _Tree, space: Space, towards: Floats, free: Free) -> tuple[Ints, NDArray[np.bool_]]:
    """Go from the nearest nodes towards configurations as far as is free.

    Returns:
        The node that each ended in, (e,), -1 for none; whether it is the configuration itself, (e,).
    """
    near = tree.nearest(space, towards)
    start = tree.q[near]
    share = free(start, towards)
    length = space.distance(start, towards)
    ended = np.full(len(towards), -1)
    for k in np.flatnonzero((share * length > LEAST) | (share >= REACHED)):
        count = max(int(np.ceil(share[k] * length[k] / STRIDE)), 1)
        steps = np.linspace(0, share[k], count + 1)[1:, None]
        nodes = start[k] + steps * (towards[k] - start[k])
        if share[k] >= REACHED:
            nodes[-1] = towards[k]
        ended[k] = tree.chain(nodes, int(near[k]))
    return ended, share >= REACHED


def with_shortcuts(space: Space, path: Floats, free: Free, attempts: int, seed: int) -> Floats:
    """The same path with shortcuts: past corners first, then between random places on it.

    Args:
        space: joint space.
        path: corners, (k, n).
        free: as for :func:`connect`.
        attempts: random shortcuts tried.
        seed: of the random numbers.

    Returns:
        Corners, (k, n), with the same ends.
    """
    rng = np.random.default_rng(seed)
    path = _skipped(path, free)
    for _ in range(attempts):
        if len(path) < 3:
            break
        reach = np.concatenate([[0.0], np.cumsum(space.time(path[:-1], path[1:]))])
        low, high = np.sort(rng.random(2)) * reach[-1]
        i, j = (int(np.searchsorted(reach, t, side="right")) - 1 for t in (low, high))
        j = min(j, len(path) - 2)
        if i >= j:
            continue
        ends = [
            path[k] + (t - reach[k]) / (reach[k + 1] - reach[k]) * (path[k + 1] - path[k])
            for k, t in ((i, low), (j, high))
        ]
        now = np.concatenate([[ends[0]], path[i + 1 : j + 1], [ends[1]]])
        if space.time(ends[0], ends[1]) >= 0.999 * space.time(now[:-1], now[1:]).sum():
            continue
        if free(ends[0][None], ends[1][None])[0] >= REACHED:
            path = np.concatenate([path[: i + 1], ends, path[j + 1 :]])
    return _without_repeats(_skipped(path, free))


def _skipped(path: Floats, free: Free) -> Floats:
    """From each corner straight to the last that can be reached from it."""
    kept, i = [0], 0
    while i < len(path) - 1:
        ahead = np.arange(len(path) - 1, i + 1, -1)
        here = np.repeat(path[i : i + 1], len(ahead), axis=0)
        hit = free(here, path[ahead]) >= REACHED if len(ahead) else np.zeros(0)
        i = int(ahead[np.argmax(hit)]) if hit.any() else i + 1
        kept.append(i)
    return path[kept]


def _without_repeats(path: Floats) -> Floats:
    return path[np.concatenate([[True], (np.diff(path, axis=0) != 0).any(axis=1)])]


def with_round_corners(path: Floats, free: Free) -> Floats:
    """The same way with its corners rounded by parabolas, as far as they are free.

    Args:
        path: corners, (k, n).
        free: as for :func:`connect`.

    Returns:
        Corners, (k', n), with the same ends.
    """
    out = [path[:1]]
    for before, corner, after in zip(path[:-2], path[1:-1], path[2:], strict=True):
        out.append(corner[None])
        for cut in (CORNER, CORNER / 4):
            p, r = corner + cut * (before - corner), corner + cut * (after - corner)
            t = np.linspace(0, 1, CORNER_PIECES + 1)[:, None]
            bend = (1 - t) ** 2 * p + 2 * t * (1 - t) * corner + t**2 * r
            if (free(bend[:-1], bend[1:]) >= REACHED).all():
                out[-1] = bend
                break
    return np.concatenate([*out, path[-1:]])


def sampled(path: Floats, step: float) -> Floats:
    """Samples of a way, no joint moving further than a step (rad) between them, (m, n); its corners are among them."""
    pieces = [path[:1]]
    for a, b in pairwise(path):
        count = max(int(np.ceil(np.abs(b - a).max() / step - 1e-9)), 1)
        pieces.append(a + np.linspace(0, 1, count + 1)[1:, None] * (b - a))
    return np.concatenate(pieces)
