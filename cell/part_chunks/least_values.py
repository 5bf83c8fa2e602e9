"""What comes least along what is followed: clearance and singularity margin, with where.

    least_clearance(context, samples_of(context, run), known)       # of samples, and of the way between them
    least_margin(context, stretches), least_sigma(context, stretches)

Radians and metres.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from ik.chain import Floats
from ik.singularity import KINDS, least_singular_value

from ..arrays import Ints
from ..collision.clearances import Clearances
from ..collision.proofs.between_samples import least_between_samples
from ..planning.assemble import RunBeads
from ..planning.context import Context
from ..planning.edges.edge_check import Stretch
from ..planning.travels.travel import TravelPath


@dataclass(frozen=True)
class LeastValue:
    """A least value and where it occurs."""

    value: float
    target: int
    what: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class RunSamples:
    """Samples of beads and of the ways to them.

    Attributes:
        axes: configurations, (m, j), rad.
        clearances: the nearest pairs where it was looked.
        kept: nothing is nearer from each to the next, (m,), m; -inf where that is not known.
        deposits_laid: deposits laid at each, (m,).
        target: that each leads to, (m,); of the way home the one that it comes from.
        run: bead or way that each belongs to, (m,).
    """

    axes: Floats
    clearances: Clearances
    kept: Floats
    deposits_laid: Ints
    target: Ints
    run: Ints


def samples_of(context: Context, run: RunBeads) -> RunSamples | None:
    """All samples of what is run: the beads, the travels to them, the ways from home and back.

    Args:
        context: what it was planned with.
        run: what is run.

    Returns:
        The samples; None where there are none.
    """
    runs: list[tuple[Floats, Clearances, Floats, Ints, Ints]] = [
        (s.axes, s.clearances, s.kept, context.deposits_before[s.edge], s.edge) for s in run.stretches
    ]

    def add(path: TravelPath, deposits_laid: int, target: int) -> None:
        m = len(path.q)
        runs.append((path.q, path.clearances, path.kept, np.full(m, deposits_laid), np.full(m, target)))

    for _, last, after, path in run.led_to:
        add(path, int(context.laid[last]), after.first)
    if run.home is not None and run.stretches:
        final = run.stretches[-1].stop - 1
        if run.home.out is not None:
            add(run.home.out, context.begun, run.stretches[0].first)
        if run.home.back is not None:
            add(run.home.back, int(context.laid[final]), final)
    if not runs:
        return None
    axes, kept, deposits_laid, target = (np.concatenate([run[i] for run in runs]) for i in (0, 2, 3, 4))
    apart = np.repeat(np.arange(len(runs)), [len(run[0]) for run in runs])
    return RunSamples(axes, Clearances.joined([run[1] for run in runs]), kept, deposits_laid, target, apart)


def nearest_sample(context: Context, samples: RunSamples | None) -> LeastValue | None:
    """The nearest that anything comes at samples."""
    if samples is None:
        return None
    at = int(np.argmin(samples.clearances.distance))
    return _named(context, samples, at, samples.clearances.rows(np.array([at])))


def least_clearance(context: Context, samples: RunSamples, known: float) -> LeastValue | None:
    """The nearest that anything comes, between samples too.

    Args:
        context: what the samples were planned with.
        samples: from :func:`samples_of`.
        known: a distance that is come to somewhere, m.
    """
    s = samples
    checker, radius = context.checker, context.radius
    at, nearest = least_between_samples(
        checker, radius, s.axes, s.deposits_laid, s.clearances, s.run, known=known, kept=s.kept
    )
    return _named(context, samples, at, nearest)


def _named(context: Context, samples: RunSamples, at: int, nearest: Clearances) -> LeastValue | None:
    if nearest.distance[0] > context.checker.reach:  # beyond it only what a proof came by is known
        return None
    pair = tuple(context.checker.scene.geom_name(int(g)) for g in nearest.pair[0])
    return LeastValue(float(nearest.distance[0]), int(samples.target[at]), pair)


def least_margin(context: Context, stretches: Sequence[Stretch]) -> LeastValue | None:
    """The least singularity margin as a multiple of its limit, with its kind."""
    if not stretches:
        return None
    limits = context.limits.values(context.solver.geometry is not None)
    margin = np.concatenate([s.margin for s in stretches])
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(limits > 0, margin / limits, np.inf)
    k, kind = np.unravel_index(int(np.argmin(share)), share.shape)
    if not np.isfinite(share[k, kind]):
        return None
    return LeastValue(float(margin[k, kind]), int(np.concatenate([s.edge for s in stretches])[k]), (KINDS[kind],))


def least_sigma(context: Context, stretches: Sequence[Stretch]) -> float | None:
    """The smallest singular value of the scaled Jacobian at the targets."""
    if not stretches:
        return None
    q = np.concatenate([s.q_targets for s in stretches])
    return least_singular_value(context.solver.chain, q)


def least_of(context: Context, margins: Iterable[LeastValue | None]) -> LeastValue | None:
    """The smallest of several margins, each as a multiple of its limit."""
    limits = context.limits.values(context.solver.geometry is not None)
    found = [least for least in margins if least is not None]
    return min(found, key=lambda least: least.value / limits[KINDS.index(least.what[0])]) if found else None
