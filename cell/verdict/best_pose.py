"""The best fixed pose of the table: found and checked.

result = check_best(prepare(case))
result.asked, result.feasible
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..job.job import Job
from ..job.table_groups import TableGroup
from ..processes.worker_pool import processor_time
from ..progress import Progress, phase
from ..scene.scene import table_angles
from ..table_poses.suited_poses import suited_poses, upright_poses
from .check import SpanVerdict, result_of
from .group_verdicts import GroupTrial, GroupVerdicts, place_of
from .indexed import unproved
from .result import Result

CHECKS = 6  # poses that are checked whole


@phase("checking", spins=False)
def check_best(job: Job, progress: Progress | None = None) -> Result:
    """Check a part at the best pose of the table for all of it.

    Args:
        job: from ``cell.job.job.prepare``.
        progress: called with how far it is.

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
    home, verdicts = place_of(job.scene.start), GroupVerdicts(job, progress)
    asked = [np.round(np.rad2deg(pose), 6).tolist() for pose in poses[:CHECKS]]
    trials = (GroupTrial(whole, table_angles(job.scene, *degrees), home, home) for degrees in asked)
    best: tuple[int, GroupTrial, SpanVerdict] | None = None
    for some in verdicts.first_alone(trials):
        for trial in some:
            found = verdicts.of(trial)
            assert found is not None
            lost = sum(row.reason is not None for row in found.rows)
            if best is None or lost < best[0]:
                best = lost, trial, found
        if best is not None and not best[0]:
            break
    assert best is not None
    _, trial, found = best
    E1_deg, E2_deg = np.round(np.rad2deg(trial.pose), 6).tolist()
    result = result_of(job, trial.context(job), (E1_deg, E2_deg), found)
    return replace(result, rows=tuple(map(unproved, found.rows)), mode="best", seconds=processor_time() - begun)
