"""The verdict where the table moves along the beads: a way of the table first, then the arm on it, then the whole judged.

    result = check_coordinated(prepare(case))
    result.motion.table                       # (m, 2) rad, row by row

Radians and metres.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

import numpy as np

from ik.chain import Floats

from ..job.job import Job
from ..planning.context import Context
from ..planning.table_schedule import Schedule, TableWay
from ..progress import Progress, stage
from ..scene.scene import table_angles
from ..scene.table_freedom import NAMES, TableFreedom
from ..units import METRES_PER_MM
from .check import Result, check_span, off_upright

UPRIGHT_DEG = 10.0  # where the case does not say how far off up the deposition direction may be


@stage("checking", spins=False)
def check_coordinated(job: Job, progress: Progress | None = None) -> Result:
    """Check every target, every bead and the way between them, the table moving along.

    Args:
        job: from ``cell.job.job.prepare``.
        progress: told how far it is.

    Returns:
        The verdict.

    Raises:
        InputError: the positioner has no such angles.
    """
    begun = time.process_time()
    table = job.case.table
    asked = (table.E1_deg, table.E2_deg)
    held = table_angles(job.scene, *asked)
    freedom = TableFreedom.of(job.scene, table.axes or NAMES, held)
    upright = float(np.deg2rad(UPRIGHT_DEG if table.upright_deg is None else table.upright_deg))
    schedule = Schedule(freedom, upright, job.drives.speed[-2:])
    t = job.targets
    length = np.linalg.norm(np.diff(t.position, axis=0), axis=1) * METRES_PER_MM
    way = schedule.along(t.normal, t.path, length)
    context = Context.along(job, way.tables)
    gravity = off_upright(job, context.placed)
    found = check_span(job, context, gravity, progress)
    return Result(
        job=replace(job, warnings=(*job.warnings, *found.warnings)),
        asked=asked,
        table=(float(way.tables[0, 0]), float(way.tables[0, 1])),
        placed=context.placed,
        rows=found.rows,
        clearance=found.clearance,
        singularity=found.singularity,
        sigma=found.sigma,
        gravity=gravity,
        motion=found.motion,
        seconds=time.process_time() - begun,
    )
