"""The best fixed pose of the table: found and checked.

result = check_best(prepare(case))
result.asked, result.feasible
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..job.job import Job
from ..job.table_groups import TableGroup
from ..processes import processor_time
from ..progress import Progress
from ..table_poses.suited_poses import suited_poses, upright_poses
from .check import Result, check
from .indexed import unproved

CHECKS = 6  # poses that are checked whole


def check_best(job: Job, progress: Progress | None = None) -> Result:
    """Check a part at the best pose of the table for all of it.

    Args:
        job: from ``cell.job.job.prepare``.
        progress: told how far it is.

    Returns:
        The verdict at the first pose that holds, of those that suit the part best; else at the one of those checked
        that loses fewest targets, with nothing proved.
    """
    begun = processor_time()
    whole = TableGroup("", (0, 0), 0, len(job.targets))
    poses = [one.pose for one in suited_poses(job, whole)]
    if not poses:
        first = upright_poses(job, whole)[0][0]
        poses = [(float(first[0]), float(first[1]))]
    best: Result | None = None
    for pose in poses[:CHECKS]:
        E1_deg, E2_deg = np.round(np.rad2deg(pose), 6).tolist()
        found = check(job, E1_deg, E2_deg, progress)
        if best is None or found.infeasible + found.not_looked_at < best.infeasible + best.not_looked_at:
            best = found
        if found.feasible:
            break
    assert best is not None
    return replace(best, rows=tuple(map(unproved, best.rows)), mode="best", seconds=processor_time() - begun)
