"""Beads and travels as a controller runs them, corners rounded, held against the cell.

    spoilt = bead_corners(setup, blend, stretches)            # by target: where a rounded corner comes too near
    why = travel_corners(setup, q, clearances, stage)         # None: the rounded travel is free

Metres and radians.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ik.chain import Floats

from .collision import Checker, Clearances, Ints
from .corners import Path, cut_corners
from .examine import Stretch
from .place import METRES_PER_MM
from .setup import Setup
from .timing import TRAVEL_ZONE

if TYPE_CHECKING:
    from numpy.typing import NDArray

STANDING = 1e-9  # m or rad: less is no way


def bead_path(stretch: Stretch, blend: float) -> Path:
    """A bead's rows with the length of the TCP's way to each, m; turns in one place count as hardly any."""
    way = np.linalg.norm(np.diff(stretch.position, axis=0), axis=1)
    return Path(stretch.q, np.concatenate([[0.0], np.cumsum(np.maximum(way, STANDING))]), blend)


def travel_path(q: Floats) -> tuple[Path, Ints]:
    """A travel's rows with the length of the joints' way to each, rad; and which rows these are: none that repeats."""
    moves = np.abs(np.diff(q, axis=0)).max(axis=1) > STANDING
    rows = np.flatnonzero(np.concatenate([[True], moves]))
    way = np.linalg.norm(np.diff(q[rows], axis=0), axis=1)
    return Path(q[rows], np.concatenate([[0.0], np.cumsum(way)]), TRAVEL_ZONE), rows


def bead_corners(setup: Setup, blend: float, stretches: Sequence[Stretch]) -> dict[int, dict[str, Any]]:
    """Where beads come too near to something when their corners are rounded.

    Args:
        setup: what the search used.
        blend: distance each way over which corners are rounded, m.
        stretches: beads that were found free, with all their rows.

    Returns:
        Why, by the target on the way to which it is.
    """
    spoilt: dict[int, dict[str, Any]] = {}
    for bead in stretches:
        if len(bead.q) < 3:
            continue
        stage = setup.stage[bead.edge]
        path, least = bead_path(bead, blend), setup.settings.kept
        step, nearest = cut_corners(setup.checker, setup.radius, path, stage, bead.clearances, least)
        for n in np.argsort(nearest.distance, kind="stable").tolist():
            at = int(bead.edge[step[n]])
            why = {"from_target": at, "on_the_way": "collision", **setup.describe(nearest, n), "rounded": True}
            spoilt.setdefault(at + 1, why)
    return spoilt


def travel_corners(
    setup: Setup, q: Floats, found: Clearances, stage: int, stops: Sequence[int] = ()
) -> dict[str, Any] | None:
    """What a travel comes too near to when its corners are rounded, if anything.

    Args:
        setup: what the search uses.
        q: rows, (m, j), rad, that are free themselves.
        found: their clearances.
        stage: deposits laid by then.
        stops: rows in which the arm stops on the way.

    Returns:
        Why it is not free, or None.
    """
    for first, last in zip([0, *stops], [*stops, len(q) - 1], strict=True):
        mine = slice(first, last + 1)
        path, rows = travel_path(q[mine])
        hit = _met(setup.checker, setup, path, found.rows(first + rows), stage, setup.settings.kept)
        if hit is not None:
            return hit
    return None


def wire_corners(
    wire: Checker, setup: Setup, q: Floats, across: tuple[int, Clearances], stage: int
) -> dict[str, Any] | None:
    """What the wire is drawn through where a travel's corners are rounded, if anything.

    Args:
        wire: from ``cell.wire.wire_checker``.
        setup: what the search uses.
        q: rows, (m, j), rad.
        across: first row of the way across, neither off a bead nor onto one, and the wire's clearances on it.
        stage: deposits laid by then.

    Returns:
        Why it is not free, or None.
    """
    path, rows = travel_path(q)
    first, seen = across
    mine = (rows >= first) & (rows < first + len(seen))
    found = Clearances.none(len(rows))
    found.distance[mine] = seen.distance[rows[mine] - first]
    return _met(wire, setup, path, found, stage, 0.0, mine[:-1] & mine[1:])


def _met(
    checker: Checker,
    setup: Setup,
    path: Path,
    found: Clearances,
    stage: int,
    least: float,
    which: NDArray[np.bool_] | None = None,
) -> dict[str, Any] | None:
    laid = np.full(len(path.s), stage)
    step, nearest = cut_corners(checker, setup.radius, path, laid, found, least, which)
    if not len(step):
        return None
    hit = {**setup.describe(nearest, 0), "required_mm": round(least / METRES_PER_MM, 3)}
    return {"on_the_way": "collision", **hit, "rounded": True}
