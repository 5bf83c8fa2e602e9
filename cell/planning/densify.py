"""Rows close enough that straight joint motion between them stays on the bead.

    dense, failures = densified(context, stretches)

What replays or runs a motion moves the joints on straight lines from row to row. Where that leaves the bead by more
than ``Closeness`` allows half-way, a row is put in between: exactly on the bead, checked like any other.
Metres and radians.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ik.chain import Floats
from ik.roll import apply_roll, roll_of, wrap
from ik.singularity import margins

from ..arrays import Ints
from ..collision.clearances import Clearances
from ..collision.proofs.kept_along import MotionSamples, kept_along
from ..collision.proofs.motion_bounds import joint_travel_bound
from ..failure import Failure, Kind, Place, Where
from ..rigid import frames, great_circle
from .context import CLOSE, Closeness, Context
from .edge_check import Stretch, between
from .edge_tracking import off_bead


def densified(
    context: Context, stretches: Sequence[Stretch], close: Closeness = CLOSE
) -> tuple[list[Stretch], dict[int, Failure]]:
    """Put rows between the samples of beads where they are needed.

    Args:
        context: what the search used.
        stretches: beads that were found free.
        close: how close to them.

    Returns:
        The beads with more samples, and targets on the way to which a new sample does not hold what the others do,
        with why.
    """
    beads = [_Bead.of(stretch) for stretch in stretches]
    for _ in range(close.halvings):
        _look(context, beads, close)
        _halve(context, [bead for bead in beads if len(bead.open)])
    _look(context, beads, close)
    failures: dict[int, Failure] = {}
    for bead in beads:
        # what is still off the bead after the last halving is not run along it
        for edge in bead.stretch.edge[bead.open].tolist():
            bead.failures[edge + 1] = Failure(Kind.JUMP, place=_on_edge(edge))
        if bead.new.any():
            bead.stretch, found = _checked(context, bead.stretch, bead.new)
            bead.failures.update(found)
        failures.update(bead.failures)
    return [bead.stretch for bead in beads], failures


@dataclass
class _Bead:
    """A bead into which rows are put.

    Attributes:
        stretch: as it is by now.
        new: rows that were put in, (m,).
        open: steps to be looked at, or, once they have been, those whose middle is off the bead.
        failures: targets on the way to which there is no new row, with why.
    """

    stretch: Stretch
    new: NDArray[np.bool_]
    open: Ints
    failures: dict[int, Failure]

    @classmethod
    def of(cls, stretch: Stretch) -> _Bead:
        """One into which none has been put."""
        return cls(stretch, np.zeros(len(stretch.q), dtype=bool), np.arange(len(stretch.q) - 1), {})

    def put(self, more: Stretch, found: NDArray[np.bool_]) -> None:
        """Put rows into the middles of the open steps; those beside the new rows are to be looked at next.

        Args:
            more: the rows.
            found: whether each holds what it is to hold.
        """
        lost = np.unique(more.edge[~found]).tolist()
        self.failures.update({e + 1: Failure(Kind.JOINT_LIMIT, place=_on_edge(e)) for e in lost})
        self.stretch = _merged(self.stretch, more, self.open)
        self.new = np.insert(self.new, self.open + 1, True)
        rows = self.open + 1 + np.arange(len(self.open))
        self.open = np.union1d(rows - 1, rows) if not self.failures else rows[:0]


def _halve(context: Context, beads: Sequence[_Bead]) -> None:
    """Put a row into the middle of every open step of beads, all together."""
    if not beads:
        return
    ends = _joined([_rows(bead.stretch, np.stack([bead.open, bead.open + 1], axis=1).ravel()) for bead in beads])
    more, found = _between(context, ends, 2 * np.arange(len(ends.q) // 2))
    stop = 0
    for bead in beads:
        mine = np.arange(stop, stop + len(bead.open))
        stop += len(bead.open)
        bead.put(_rows(more, mine), found[mine])


def _rows(stretch: Stretch, index: Ints) -> Stretch:
    """Some samples of a bead."""
    return replace(
        stretch,
        edge=stretch.edge[index],
        fraction=stretch.fraction[index],
        q=stretch.q[index],
        position=stretch.position[index],
        table=stretch.table[index],
        clearances=stretch.clearances.rows(index),
        low=stretch.low[index],
        kept=stretch.kept[index],
        margin=stretch.margin[index],
    )


def _joined(stretches: Sequence[Stretch]) -> Stretch:
    """Samples of several beads one after the other; its targets are those of the first."""

    def all_of(name: str) -> Any:
        return np.concatenate([getattr(stretch, name) for stretch in stretches])

    return replace(
        stretches[0],
        edge=all_of("edge"),
        fraction=all_of("fraction"),
        q=all_of("q"),
        position=all_of("position"),
        table=all_of("table"),
        clearances=Clearances.joined([stretch.clearances for stretch in stretches]),
        low=all_of("low"),
        kept=all_of("kept"),
        margin=all_of("margin"),
    )


def on_bead(context: Context, edge: Ints, fraction: Floats) -> tuple[Floats, Floats]:
    """Points and deposition directions on the way from targets to the next.

    Args:
        context: holds the targets.
        edge: targets, (m,).
        fraction: of the way, (m,).

    Returns:
        (m, 3), m, and (m, 3), where the beads stand still (see ``Placed.bead``).
    """
    p, n = context.placed.bead.position, context.placed.bead.normal
    position = p[edge] + fraction[:, None] * (p[edge + 1] - p[edge])
    return position, great_circle(n[edge], n[edge + 1], fraction)


def _on_edge(edge: int) -> Place:
    """The way from a target to the next."""
    return Place(Where.BEAD, from_target=edge)


def _look(context: Context, beads: Sequence[_Bead], close: Closeness) -> None:
    """Look at the middles of the open steps of beads, all together; those stay open that are off the bead."""
    some = [bead for bead in beads if len(bead.open)]
    if not some:
        return
    q, table, edge = (np.concatenate(each) for each in zip(*(_middles(b.stretch, b.open) for b in some), strict=True))
    placed = context.placed.bead
    T = _seen(context, q, table)
    a, b = placed.position[edge], placed.position[edge + 1]
    along = b - a
    s = np.clip(((T[:, :3, 3] - a) * along).sum(axis=1) / np.maximum((along**2).sum(axis=1), 1e-30), 0.0, 1.0)
    position, normal = on_bead(context, edge, s)
    off = off_bead(T, position, normal, close) > 1.0
    ends = np.cumsum([len(bead.open) for bead in some])[:-1]
    for bead, mine in zip(some, np.split(off, ends), strict=True):
        bead.open = bead.open[mine]


def _middles(stretch: Stretch, step: Ints) -> tuple[Floats, Floats, Ints]:
    """Configurations half-way along steps of straight joint motion, the table's angles there, and their edges."""
    q, table = stretch.q, stretch.table
    return (q[step] + q[step + 1]) / 2, (table[step] + table[step + 1]) / 2, stretch.edge[step]


def _seen(context: Context, q: Floats, table: Floats) -> Floats:
    """Poses of the TCP where the beads stand still, (m, 4, 4)."""
    return context.placed.seen(context.solver.chain.forward(q), table)


def _ends(stretch: Stretch) -> tuple[Ints, Floats, Floats]:
    """Edge of every step, and the fractions of it between which the step leads."""
    edge = stretch.edge[:-1]
    return edge, stretch.fraction[:-1], stretch.fraction[1:] + (stretch.edge[1:] - edge)


def _between(context: Context, stretch: Stretch, step: Ints) -> tuple[Stretch, NDArray[np.bool_]]:
    """Samples half-way along steps, and whether the arm gets there."""
    chain, placed = context.solver.chain, context.placed
    edges, starts, ends = _ends(stretch)
    edge, start, end = edges[step], starts[step], ends[step]
    fraction = (start + end) / 2
    reference, rolls = placed.bead.reference, []
    for row, at in ((step, start), (step + 1, end)):
        here = frames(*on_bead(context, edge, at), reference)
        rolls.append(roll_of(here, _seen(context, stretch.q[row], stretch.table[row])))
    position, normal = on_bead(context, edge, fraction)
    Ts = apply_roll(frames(position, normal, reference), rolls[0] + wrap(rolls[1] - rolls[0]) / 2)
    table = (stretch.table[step] + stretch.table[step + 1]) / 2
    Ts = placed.carried(Ts, table)
    q, ok = context.solver.next_to(Ts, (stretch.q[step] + stretch.q[step + 1]) / 2)
    more = replace(
        stretch,
        edge=edge,
        fraction=fraction,
        q=q,
        position=position,
        table=table,
        clearances=Clearances.none(len(q)),
        low=stretch.kept[step],
        kept=stretch.kept[step],
        margin=margins(chain, context.solver.geometry, q),
    )
    # the way by the new sample is off the straight one by as much as the sample at most
    axes = stretch.axes
    off = joint_travel_bound(context.radius, (axes[step] + axes[step + 1]) / 2, more.axes)
    return replace(more, low=more.low - off, kept=more.kept - off), ok


def _merged(stretch: Stretch, more: Stretch, step: Ints) -> Stretch:
    """A stretch with samples put after those of the given steps."""
    before = stretch.kept.copy()
    before[step] = more.kept
    stretch = replace(stretch, kept=before)

    def put(a: Any, b: Any) -> Any:
        return np.insert(a, step + 1, b, axis=0)

    return replace(
        stretch,
        edge=put(stretch.edge, more.edge),
        fraction=put(stretch.fraction, more.fraction),
        q=put(stretch.q, more.q),
        position=put(stretch.position, more.position),
        table=put(stretch.table, more.table),
        clearances=Clearances(
            put(stretch.clearances.distance, more.clearances.distance),
            put(stretch.clearances.pair, more.clearances.pair),
            put(stretch.clearances.position, more.clearances.position),
        ),
        low=put(stretch.low, more.low),
        kept=put(stretch.kept, more.kept),
        margin=put(stretch.margin, more.margin),
    )


def _checked(context: Context, stretch: Stretch, new: np.ndarray) -> tuple[Stretch, dict[int, Failure]]:
    """A stretch with what is known of new samples and the steps to and from them, and what is wrong with these."""
    failures: dict[int, Failure] = {}

    def blame(edge: int, failure: Failure) -> None:
        failures.setdefault(edge + 1, failure.at(_on_edge(edge)))

    least = context.limits.values(context.solver.geometry is not None)
    for k in np.flatnonzero(new & (stretch.margin < least).any(axis=1)):
        blame(int(stretch.edge[k]), Failure(Kind.SINGULAR))
    # what is not proved by the steps that the new ones are halves of
    wanted = (new[:-1] | new[1:]) & (stretch.kept[:-1] < context.settings.kept)
    if not wanted.any():
        return stretch, failures
    rows = np.flatnonzero(np.append(wanted, False) | np.insert(wanted, 0, False))
    part = np.cumsum((np.diff(rows, prepend=-2) > 1) | ~wanted[rows - 1])
    samples = MotionSamples(stretch.axes[rows], context.deposits_before[stretch.edge[rows]], part, part)
    found = kept_along(context.checker, context.radius, samples, context.settings.kept)
    for i in np.flatnonzero(found.seen.distance < context.settings.clearance).tolist():
        blame(int(stretch.edge[rows[i]]), context.describe(found.seen, i))
    for n, at in enumerate(rows[found.open].tolist()):
        blame(int(stretch.edge[at]), context.describe(found.nearest, n, seen=between(found.nearest, n, context)))
    clearances, low, kept = stretch.clearances.rows(np.arange(len(new))), stretch.low.copy(), stretch.kept.copy()
    clearances.nearer(rows, found.seen)
    low[rows], kept[rows] = np.maximum(low[rows], found.low), np.maximum(kept[rows], found.kept)
    return replace(stretch, clearances=clearances, low=low, kept=kept), failures
