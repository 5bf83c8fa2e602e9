"""How the arc starts and ends: run-in before a bead's start, run-on past its end, along the bead itself.

    bead = with_leads(sliced, bead, parameters)

A closed bead starts lead_in before its seam and ends lead_out past it, so that start and end crater lie in material
that is welded over. An open bead has no part before its start or past its end to run on to; its arc starts lead_in
within the bead, runs back to the bead's start and then forward, and at the end runs back by lead_out: the start is
welded over and the end crater filled, and nothing stands out of the layer. A lead is at most as long as the bead.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..layers.layer import SlicedSubVolume
from ..parameters import BeadParameters
from .bead import Bead
from .exact_points import point_between


def with_leads(sliced: SlicedSubVolume, bead: Bead, parameters: BeadParameters) -> Bead:
    """A bead with its leads.

    Args:
        sliced: its sub-volume.
        bead: from its seam on.
        parameters: how long they are.

    Returns:
        The bead as the arc runs, open; as it is where there are no leads.
    """
    into, out = parameters.lead_in_mm, parameters.lead_out_mm
    if (into == 0.0 and out == 0.0) or bead.length_mm == 0.0:
        return bead
    plain = _opened(bead) if bead.closed else bead
    n = len(plain.points)
    back = first_stretch(sliced, plain, into)  # the bead's first stretch
    on = first_stretch(sliced, plain.reversed(), out).reversed()  # its last one
    if bead.closed:
        # what comes before the start is the end, and past the end comes the start
        before, after = first_stretch(sliced, plain.reversed(), into).reversed(), first_stretch(sliced, plain, out)
    else:
        before, after = back.reversed(), on.reversed()
    parts = [before] * (into > 0) + [plain] + [after] * (out > 0)
    points = [part.points if k == 0 else part.points[1:] for k, part in enumerate(parts)]
    gained = [part.gained_mm if k == 0 else part.gained_mm[1:] for k, part in enumerate(parts)]
    first = len(before.points) - 1 if into > 0 else 0
    stops = {first, first + n - 1, *(first + k for k in plain.stops)}
    return replace(
        plain,
        points=np.concatenate(points),
        gained_mm=np.concatenate(gained),
        stops=tuple(sorted(stops)),
    )


def _opened(bead: Bead) -> Bead:
    """A closed bead as an open one that ends on its first point."""
    points, gained = np.concatenate([bead.points, bead.points[:1]]), np.append(bead.gained_mm, bead.gained_mm[:1])
    return replace(bead, points=points, gained_mm=gained, closed=False)


def first_stretch(sliced: SlicedSubVolume, bead: Bead, length_mm: float) -> Bead:
    """The first stretch of an open bead.

    Args:
        sliced: its sub-volume.
        bead: open.
        length_mm: of the stretch; the whole bead where that is shorter.

    Returns:
        The stretch, its end on the exact curve.
    """
    step = np.sqrt((np.diff(bead.points, axis=0) ** 2).sum(axis=1))
    length = np.append(0.0, np.cumsum(step))
    if length_mm >= length[-1]:
        return bead
    k = int(np.searchsorted(length, length_mm, side="right")) - 1
    share = (length_mm - length[k]) / step[k]
    if share < 1e-9:
        points, gained = bead.points[: max(k, 1) + 1], bead.gained_mm[: max(k, 1) + 1]
    else:
        end = point_between(sliced, bead.layer, bead.points[k], bead.points[k + 1])(np.array([share]))
        points = np.concatenate([bead.points[: k + 1], end])
        mean = (1 - share) * bead.gained_mm[k] + share * bead.gained_mm[k + 1]
        gained = np.append(bead.gained_mm[: k + 1], mean)
    return replace(bead, points=points, gained_mm=gained, stops=tuple(s for s in bead.stops if s < len(points)))
