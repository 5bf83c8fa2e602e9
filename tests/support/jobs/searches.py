"""What a search for the way along a bead starts from."""

from __future__ import annotations

from cell.planning.context import Context
from cell.scene.scene import table_angles

from .boss_motion import job_of


def setup_of(path):
    job = job_of(path)
    table = table_angles(job.scene, job.case.table.E1_deg, job.case.table.E2_deg)
    return job, Context.of(job, table)
