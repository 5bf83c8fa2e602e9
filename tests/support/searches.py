"""What a search for the way along a bead starts from."""

from __future__ import annotations

from cell.collision.checker import Checker
from cell.collision.clearances import CLEARANCE_REACH
from cell.planning.context import Context, settings_of
from cell.scene.placement import place
from cell.scene.scene import table_angles
from support.boss_motion import job_of


def setup_of(path):
    job = job_of(path)
    table = table_angles(job.scene, job.case.table.E1_deg, job.case.table.E2_deg)
    settings = settings_of(job)
    checker = Checker(job.scene, table, max(CLEARANCE_REACH, 2 * settings.clearance))
    placed = place(job.targets, job.scene.T_base_part(*table))
    limits = job.singularity_limits
    return job, Context.of(job.solver, placed, job.stage, job.laid, job.window, limits, checker, settings)
