"""Beads and travels as a controller runs them, corners rounded, checked in the cell.

    failures = bead_corners(context, blend, stretches)          # by target: where a rounded corner comes too near
    failure = travel_corners(context, q, clearances, deposits_laid)     # None: the rounded travel is free

Metres and radians.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ik.chain import Floats

from ...arrays import Ints
from ...collision.blend_proofs import KnownRows
from ...collision.blended_corners import cut_corners, cut_corners_of
from ...collision.blended_paths import BlendedPath
from ...collision.checker import Checker
from ...collision.clearances import Clearances
from ...failure import ON_TRAVEL, CollisionPlace, Failure, FailurePlace, Where
from ...motion.motion import NO_MOVE
from ...timing.blending import TRAVEL_ZONE
from ...units import METRES_PER_MM
from ..context import Context
from .edge_check import Stretch

if TYPE_CHECKING:
    from numpy.typing import NDArray


def bead_path(stretch: Stretch, blend: float) -> BlendedPath:
    """A bead's rows with the length of the TCP's way to each, m; turns in one place count as hardly any."""
    way = np.linalg.norm(np.diff(stretch.position, axis=0), axis=1)
    return BlendedPath(stretch.axes, np.concatenate([[0.0], np.cumsum(np.maximum(way, NO_MOVE))]), blend)


def travel_path(q: Floats, zone: float = TRAVEL_ZONE) -> tuple[BlendedPath, Ints]:
    """A travel's rows without repetitions, with the joint travel up to each, rad; and the numbers of these rows."""
    moves = np.abs(np.diff(q, axis=0)).max(axis=1) > NO_MOVE
    rows = np.flatnonzero(np.concatenate([[True], moves]))
    way = np.linalg.norm(np.diff(q[rows], axis=0), axis=1)
    return BlendedPath(q[rows], np.concatenate([[0.0], np.cumsum(way)]), zone), rows


def bead_corners(context: Context, blend: float, stretches: Sequence[Stretch]) -> dict[int, Failure]:
    """Where beads come too near to something when their corners are rounded.

    Args:
        context: what the search used.
        blend: distance each way over which corners are rounded, m.
        stretches: beads that were found free, with all their rows.

    Returns:
        Why, by the target on the way to which it is.
    """
    failures: dict[int, Failure] = {}
    beads = [bead for bead in stretches if len(bead.q) > 2]
    found = cut_corners_of(context.checker, context.radius, [_known(context, blend, bead) for bead in beads])
    for bead, (step, nearest) in zip(beads, found, strict=True):
        for n in np.argsort(nearest.distance, kind="stable").tolist():
            at = int(bead.edge[step[n]])
            if at + 1 not in failures:
                place = FailurePlace(Where.BEAD, from_target=at)
                failures[at + 1] = context.describe(nearest, n, place, CollisionPlace.ROUNDED)
    return failures


def _known(context: Context, blend: float, bead: Stretch) -> tuple[BlendedPath, KnownRows]:
    """A bead's rows with their clearances."""
    found = Clearances(bead.low, bead.clearances.pair, bead.clearances.position)
    deposits_laid, every = context.deposits_before[bead.edge], np.ones(len(bead.q) - 1, dtype=bool)
    return bead_path(bead, blend), KnownRows(deposits_laid, found, context.settings.kept, every, bead.kept[:-1])


def travel_corners(
    context: Context,
    q: Floats,
    found: Clearances,
    deposits_laid: int,
    stops: Sequence[int] = (),
    zone: float = TRAVEL_ZONE,
) -> Failure | None:
    """The collision of a travel with rounded corners, or None.

    Args:
        context: what the search uses.
        q: rows, (m, j), rad, that are free themselves.
        found: their clearances.
        deposits_laid: deposits laid by then.
        stops: rows in which the arm stops on the way.
        zone: joint travel each way over which corners are rounded, rad.

    Returns:
        Why it is not free, or None.
    """
    for first, last in zip([0, *stops], [*stops, len(q) - 1], strict=True):
        path, rows = travel_path(q[first : last + 1], zone)
        hit = _met(context.checker, context, path, found.rows(first + rows), deposits_laid, context.settings.kept)
        if hit is not None:
            return hit
    return None


def free_travels(
    checker: Checker, context: Context, ways: Sequence[tuple[Floats, Clearances, Floats, int]], least: float
) -> list[bool]:
    """Whether travels are free when their corners are rounded: of many, which are checked together.

    Args:
        checker: collision detection, of the whole cell or of the wire.
        context: what the search uses.
        ways: rows, (m, j), rad, that are free themselves; their clearances at least; what is kept at least on the steps
            between them, (m,), m, -inf where a step is not checked; and deposits laid by then.
        least: clearance to be kept, m; 0: nothing is touched.

    Returns:
        For each of them.
    """
    paths = []
    for q, found, kept, deposits_laid in ways:
        path, rows = travel_path(q)
        on_step = np.minimum.reduceat(kept[:-1], rows[:-1]) if len(rows) > 1 else np.zeros(0)
        known = KnownRows(np.full(len(rows), deposits_laid), found.rows(rows), least, np.isfinite(on_step), on_step)
        paths.append((path, known))
    return [not len(step) for step, _ in cut_corners_of(checker, context.radius, paths)]


def wire_corners(
    wire: Checker, context: Context, q: Floats, across: tuple[int, Clearances], deposits_laid: int
) -> Failure | None:
    """What the wire touches on a travel with rounded corners, or None.

    Args:
        wire: from ``cell.collision.wire.wire_checker``.
        context: what the search uses.
        q: rows, (m, j), rad.
        across: first row of the way across, neither off a bead nor onto one, and the wire's clearances on it.
        deposits_laid: deposits laid by then.

    Returns:
        Why it is not free, or None.
    """
    path, rows = travel_path(q)
    first, seen = across
    mine = (rows >= first) & (rows < first + len(seen))
    found = Clearances.none(len(rows))
    found.distance[mine] = seen.distance[rows[mine] - first]
    return _met(wire, context, path, found, deposits_laid, 0.0, mine[:-1] & mine[1:])


def _met(
    checker: Checker,
    context: Context,
    path: BlendedPath,
    found: Clearances,
    deposits_laid: int,
    least: float,
    which: NDArray[np.bool_] | None = None,
) -> Failure | None:
    laid = np.full(len(path.s), deposits_laid)
    step, nearest = cut_corners(checker, context.radius, path, laid, found, least, which)
    if not len(step):
        return None
    return replace(
        context.describe(nearest, 0, ON_TRAVEL, CollisionPlace.ROUNDED), limit=round(least / METRES_PER_MM, 3)
    )
