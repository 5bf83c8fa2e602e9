"""Targets that are laid over nothing, and targets that are laid past the horizontal.

    unsupported_targets(job)                  # {target: Failure}, by the case's limit checks.overhang_mm
    targets_over_nothing(job)                 # {target: Hanging}, whether the case sets a limit or not
    past_horizontal(job.case, gravity)        # a warning where the case sets no limit

Where a layer overhangs: `slicing.beads.overhang`; where a bead of another slicer does: `cell.job.bead_support`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ik.chain import Floats
from slicing import Code, Warning

from ..case.sections import Case
from ..failure import Failure, Kind, OverhangArea
from .job import Job


class Hanging(NamedTuple):
    """The overhang at a target: how far it stands out (None: nothing lies below), and the area beyond the limit."""

    out_mm: float | None
    area: OverhangArea


HORIZONTAL_DEG = 90.5  # off upright: with rounding no more than level


def past_horizontal(case: Case, gravity: Floats) -> tuple[str, ...]:
    """A warning where material is laid past the horizontal and the case sets no limit.

    Args:
        case: the case.
        gravity: angles between the deposition direction and up, rad.
    """
    beyond = gravity > np.deg2rad(HORIZONTAL_DEG)
    if case.checks.gravity_max_deg is not None or not beyond.any():
        return ()
    text = (
        f"{int(beyond.sum())} of {len(gravity)} targets are laid past the horizontal, up to"
        f" {np.rad2deg(gravity.max()):.0f} deg off upright; checks.gravity_max_deg sets a limit"
    )
    return (Warning(Code.PAST_HORIZONTAL, text),)


def unsupported_targets(job: Job) -> dict[int, Failure]:
    """Targets that overhang, by the case's limit, with what hangs there; none where it has none.

    Args:
        job: from ``cell.job.job.prepare``.
    """
    limit = job.case.checks.overhang_mm
    if limit is None:
        return {}
    return {
        i: Failure(Kind.OVERHANG, one.out_mm, limit, cause=one.area, proved=True)
        for i, one in targets_over_nothing(job).items()
    }


def targets_over_nothing(job: Job) -> dict[int, Hanging]:
    """Targets that overhang, with what of their layer does, or of their bead where it is another slicer's.

    Args:
        job: from ``cell.job.job.prepare``.
    """
    t = job.targets
    found: dict[int, Hanging] = {}
    for k, one in enumerate(job.beads):
        for layer in one.overhangs:
            if layer.place_mm is None or layer.area_mm2 <= 0.0:
                continue
            rows = np.flatnonzero((t.sub_volume_index == k) & (t.layer == layer.layer))
            over = rows[layer.holds(t.position[rows])]
            if not len(over) and len(rows):  # no target there: the nearest one stands for it
                over = rows[[int(np.argmin(((t.position[rows] - layer.place_mm) ** 2).sum(axis=1)))]]
            document = layer.to_dict()
            area = OverhangArea(document["area_mm2"], document["begins_mm2"], tuple(document["place_mm"]))
            found.update((i, Hanging(document["out_mm"], area)) for i in over.tolist())
    for bead in job.overhanging_beads:
        hangs = round(bead.hanging_mm * bead.width_mm, 3)
        area = OverhangArea(hangs, hangs if bead.all_of_it else 0.0, bead.place_mm)
        found.update((i, Hanging(bead.out_mm, area)) for i in bead.targets)
    return found
