"""Beads of another slicer that lie over or under their own metal: a helix right up a wall, as one bead.

    over = first_over_itself(targets, width_mm=5.0)       # {bead: target}

The metal of a bead is there once its layer is done. What a bead of several turns has laid of itself is not: it is no
obstacle to its own later turns, nor to the wire where it runs back below itself, which a warning says.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats
from ..targets.targets import Targets
from ..warning import Code, Warning

ENDS = 2.0  # bead widths over itself: more than a closed turn's end
SPACED = 0.5  # bead widths between the points that are compared
ABOVE_MM = 25.0  # along the wire, up to which a bead's own earlier metal is looked for
LOW, HIGH = 0.5, 1.5  # of a bead's thickness: between these below a target the turn before lies


def first_over_itself(targets: Targets, width_mm: float) -> dict[int, int]:
    """The beads that lie over or under themselves, with the first target that does.

    Args:
        targets: the beads.
        width_mm: of a bead.

    Returns:
        Targets by beads.
    """
    found = {}
    for bead in range(len(targets.closed)):
        first, stop = np.searchsorted(targets.bead, [bead, bead + 1]).tolist()
        mine = slice(first, stop)
        over = _over_itself(targets.position[mine], targets.normal[mine], targets.thickness_mm[mine], width_mm)
        if over is not None:
            found[bead] = first + over
    return found


def _over_itself(p: Floats, n: Floats, thickness: Floats, width: float) -> int | None:
    """The first point of a bead that lies over or under an earlier part of it; None where none does."""
    from scipy.spatial import cKDTree  # heavy: only for another slicer's beads

    if len(p) < 3:
        return None
    target, p, n, thickness = _evenly(p, n, thickness, width * SPACED)
    steps = np.linalg.norm(np.diff(p, axis=0), axis=1)
    beside = width * (1 + SPACED) / 2
    pairs = cKDTree(p).query_pairs(float(np.hypot(HIGH * thickness.max(), beside)), output_type="ndarray")
    early, late = pairs.min(axis=1), pairs.max(axis=1)
    away = p[late] - p[early]
    up = (away * n[late]).sum(axis=1)
    across = np.linalg.norm(away - up[:, None] * n[late], axis=1)
    over = (up > LOW * thickness[late]) & (up < HIGH * thickness[late]) & (across <= beside)
    of = np.unique(late[over])
    of = np.union1d(of, _under_itself(p, n, thickness, beside))
    # where a turn ends over its own beginning a little of it does
    return int(target[of[0]]) if steps[of - 1].sum() > ENDS * width else None


def _evenly(
    p: Floats, n: Floats, thickness: Floats, spacing: float
) -> tuple[NDArray[np.int64], Floats, Floats, Floats]:
    """A bead's points (k, 3), normals and thicknesses at even distances, each with the target at or behind it.

    Targets may be microns apart, or half a metre: neither says how many points there are to be compared.
    """
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(p, axis=0), axis=1))])
    at = np.linspace(0.0, length[-1], max(int(np.ceil(length[-1] / spacing)), 1) + 1)
    target = np.searchsorted(length, at - 1e-9 * length[-1])
    even = [np.column_stack([np.interp(at, length, column) for column in each.T]) for each in (p, n)]
    return target, even[0], even[1], np.interp(at, length, thickness)


def _under_itself(p: Floats, n: Floats, thickness: Floats, beside: float) -> NDArray[np.int64]:
    """Points of a bead above which an earlier part of it is in the way of the wire."""
    from scipy.spatial import cKDTree

    tree, found = cKDTree(p), np.zeros(len(p), dtype=bool)
    for up in np.arange(HIGH * float(thickness.max()) + beside, ABOVE_MM, beside):
        away, which = tree.query(p + up * n, distance_upper_bound=beside)
        found |= np.isfinite(away) & (which < np.arange(len(p)))
    return np.flatnonzero(found)


def own_metal_warnings(targets: Targets, width_mm: float) -> tuple[Warning, ...]:
    """A warning where beads lie over themselves.

    Args:
        targets: the beads.
        width_mm: of a bead.
    """
    found = first_over_itself(targets, width_mm)
    if not found:
        return ()
    bead, target = next(iter(found.items()))
    more = f" and {len(found) - 1} more" if len(found) > 1 else ""
    text = (
        f"part.toolpath: bead {bead}{more} lies over or under its own metal from target {target} on. That metal "
        "joins the cell only "
        "when the bead is done, so collisions with it are not checked; make each turn a bead and a layer of its own"
    )
    return (Warning(Code.BEAD_OVER_ITSELF, text),)
