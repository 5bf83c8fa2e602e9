"""What stands on a table that moves against the cell around it: no arm can help it.

    found = table_in_the_way(job, tables)      # by target: what is met there, or on the way to it

The table is taken from target to target on straight lines of its axes, from bead to bead as well; each way with what is
laid by its end. Radians, metres.
"""

from __future__ import annotations

import numpy as np

from ik.chain import Floats

from ..collision.clearances import CLEARANCE_REACH, Clearances
from ..collision.proofs.between_samples import unproven_steps
from ..collision.proofs.reach_radii import table_radii
from ..collision.table_clearances import TableChecker
from ..failure import Contact, Failure, Kind
from ..job.job import Job
from ..units import METRES_PER_MM


def table_in_the_way(job: Job, tables: Floats) -> dict[int, Failure]:
    """Targets at which, or on the way to which, the table or the workpiece meets something of the cell.

    Args:
        job: from ``cell.job.job.prepare``.
        tables: E1, E2 at each target, (n, 2), rad.

    Returns:
        What is met, by target.
    """
    checker = TableChecker(job.scene, CLEARANCE_REACH)
    clear = checker.clearances(tables, job.laid)
    found = {int(i): _met(job, clear, int(i)) for i in np.flatnonzero(clear.distance < 0.0)}
    step, nearest = unproven_steps(checker, table_radii(job.scene), tables, job.laid, clear)
    moves = (np.diff(tables, axis=0) != 0).any(axis=1)
    for n, at in enumerate(step.tolist()):
        if moves[at] and not {at, at + 1} & found.keys():
            found[at + 1] = _met(job, nearest, n)
    return found


def _met(job: Job, found: Clearances, k: int) -> Failure:
    contact = Contact(
        pair=tuple(job.scene.geom_name(int(g)) for g in found.pair[k] if g >= 0),
        world_xyz_mm=tuple(round(float(v) / METRES_PER_MM, 2) for v in found.position[k]),
        note="the table and what stands on it, in any pose of the arm",
    )
    distance = round(float(found.distance[k]) / METRES_PER_MM, 3)
    return Failure(Kind.COLLISION, measure=distance, limit=0.0, contact=contact)
