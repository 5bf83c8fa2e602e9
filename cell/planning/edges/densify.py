"""Rows close enough that straight joint motion between them stays on the bead.

    dense, failures = densified(context, stretches)

Between rows the joints move on straight lines. Where the TCP is off the bead half-way by more than ``BeadTolerance``
allows, a row is inserted: exactly on the bead, and checked like any other. Metres and radians.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ik.chain import Floats
from ik.roll import apply_roll, roll_of, wrap
from ik.singularity import margins

from ...arrays import Ints
from ...collision.clearances import Clearances
from ...collision.proofs.motion_bounds import joint_travel_bound
from ...collision.proofs.motion_clearance import MotionSamples, clearance_along
from ...failure import Failure, FailurePlace, Kind, Where
from ...rigid import frames, great_circle
from ..context import CLOSE, BeadTolerance, Context
from .edge_check import Stretch, collision_place
from .edge_tracking import off_bead

# of a stretch, all that its rows have but for their clearances
BY_ROW = ("edge", "fraction", "q", "position", "table", "low", "kept", "margin")


def densified(
    context: Context, stretches: Sequence[Stretch], close: BeadTolerance = CLOSE
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
    some = [k for k, stretch in enumerate(stretches) if len(stretch.q) > 1]
    out = list(stretches)
    if not some:
        return out, {}
    rows, of, failures = _densified(context, *_joined([stretches[k] for k in some]), close)
    ends = np.searchsorted(of, np.arange(len(some) + 1))
    for n, k in enumerate(some):
        mine = _rows(rows, slice(ends[n], ends[n + 1]))
        own = stretches[k]
        out[k] = replace(mine, first=own.first, q_targets=own.q_targets, roll=own.roll)
    return out, failures


def _joined(stretches: Sequence[Stretch]) -> tuple[Stretch, Ints]:
    """Rows of stretches one after the other, as those of one, and which stretch each is of, (m,)."""
    clearances = Clearances.joined([stretch.clearances for stretch in stretches])
    each: dict[str, Any] = {name: np.concatenate([getattr(stretch, name) for stretch in stretches]) for name in BY_ROW}
    of = np.repeat(np.arange(len(stretches)), [len(stretch.q) for stretch in stretches])
    return replace(stretches[0], clearances=clearances, **each), of


def _rows(stretch: Stretch, mine: slice) -> Stretch:
    """Some rows of a stretch."""
    found = stretch.clearances
    some: dict[str, Any] = {name: getattr(stretch, name)[mine] for name in BY_ROW}
    return replace(stretch, clearances=Clearances(found.distance[mine], found.pair[mine], found.position[mine]), **some)


def on_bead(context: Context, edge: Ints, fraction: Floats) -> tuple[Floats, Floats]:
    """Points and deposition directions on the way from targets to the next.

    Args:
        context: holds the targets.
        edge: targets, (m,).
        fraction: of the way, (m,).

    Returns:
        (m, 3), m, and (m, 3), where the beads stand still (see ``PlacedTargets.bead``).
    """
    p, n = context.placed.bead.position, context.placed.bead.normal
    position = p[edge] + fraction[:, None] * (p[edge + 1] - p[edge])
    return position, great_circle(n[edge], n[edge + 1], fraction)


def _densified(
    context: Context, stretch: Stretch, of: Ints, close: BeadTolerance
) -> tuple[Stretch, Ints, dict[int, Failure]]:
    """Rows of several beads with those put in that they need, of which bead each is, and what is wrong with them."""
    failures: dict[int, Failure] = {}
    new, lost = np.zeros(len(stretch.q), dtype=bool), np.zeros(int(of[-1]) + 1, dtype=bool)
    asked = np.flatnonzero(np.diff(of) == 0)  # from one bead to the next there is no step
    for _ in range(close.halvings):
        step = _open(context, stretch, asked, close)
        step = step[~lost[of[step]]]  # a bead in which something is wrong is left as it is
        if not len(step):
            break
        more, unreached = _between(context, stretch, step)
        lost[of[step[np.isin(more.edge, unreached)]]] = True
        failures.update({int(e) + 1: Failure(Kind.JOINT_LIMIT, place=_on_edge(int(e))) for e in unreached})
        stretch = _merged(stretch, more, step)
        new, of = np.insert(new, step + 1, True), np.insert(of, step + 1, of[step])
        halves = step + np.arange(len(step))
        asked = np.stack([halves, halves + 1], axis=1).ravel()  # all others have been found close
    else:
        # what is still off the bead after the last halving is not run along it
        step = _open(context, stretch, asked, close)
        for k in step[~lost[of[step]]].tolist():
            edge = int(stretch.edge[k])
            failures[edge + 1] = Failure(Kind.JUMP, place=_on_edge(edge))
    if new.any():
        stretch, found = _checked(context, stretch, new)
        failures.update(found)
    return stretch, of, failures


def _on_edge(edge: int) -> FailurePlace:
    """The way from a target to the next."""
    return FailurePlace(Where.BEAD, from_target=edge)


def _open(context: Context, stretch: Stretch, asked: Ints, close: BeadTolerance) -> Ints:
    """Those of some steps whose middle is off the bead."""
    edge, placed = stretch.edge[asked], context.placed.bead
    q, table = ((each[asked] + each[asked + 1]) / 2 for each in (stretch.q, stretch.table))
    T = _seen(context, q, table)
    a, b = placed.position[edge], placed.position[edge + 1]
    along = b - a
    s = np.clip(((T[:, :3, 3] - a) * along).sum(axis=1) / np.maximum((along**2).sum(axis=1), 1e-30), 0.0, 1.0)
    position, normal = on_bead(context, edge, s)
    return asked[off_bead(T, position, normal, close) > 1.0]


def _seen(context: Context, q: Floats, table: Floats) -> Floats:
    """Poses of the TCP where the beads stand still, (m, 4, 4)."""
    return context.placed.seen(context.solver.chain.forward(q), table)


def _ends(stretch: Stretch) -> tuple[Ints, Floats, Floats]:
    """Edge of every step, and the fractions of it between which the step leads."""
    edge = stretch.edge[:-1]
    return edge, stretch.fraction[:-1], stretch.fraction[1:] + (stretch.edge[1:] - edge)


def _between(context: Context, stretch: Stretch, step: Ints) -> tuple[Stretch, Ints]:
    """Samples half-way along steps, and the edges on which no such sample exists."""
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
    return replace(more, low=more.low - off, kept=more.kept - off), np.unique(edge[~ok])


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
    found = clearance_along(context.checker, context.radius, samples, context.settings.kept)
    for i in np.flatnonzero(found.seen.distance < context.settings.clearance).tolist():
        blame(int(stretch.edge[rows[i]]), context.describe(found.seen, i))
    for n, at in enumerate(rows[found.open].tolist()):
        blame(
            int(stretch.edge[at]), context.describe(found.nearest, n, seen=collision_place(found.nearest, n, context))
        )
    clearances, low, kept = stretch.clearances.rows(np.arange(len(new))), stretch.low.copy(), stretch.kept.copy()
    clearances.nearer(rows, found.seen)
    low[rows], kept[rows] = np.maximum(low[rows], found.low), np.maximum(kept[rows], found.kept)
    return replace(stretch, clearances=clearances, low=low, kept=kept), failures
