"""A motion from a file, and the job with its layers in the order in which the motion lays them.

    job, read = read_in_order("propeller.csv", job)

Where the table indexes or moves along and the case gives no poses, the order is the motion's own to choose: each layer
comes when the motion first welds it. A sub-volume's layers still have to follow one another; what does not is found as
in any motion, by its beads.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..job.build_order import LayerRun
from ..job.job import Job
from ..job.reordered import in_order
from .motion import Motion
from .motion_file import ReadMotion, read_motion

CHOOSES = ("indexed", "coordinated")  # modes of the table in which a motion chooses its order


def read_in_order(path: str | Path, job: Job) -> tuple[Job, ReadMotion]:
    """Read a motion, and put the job's layers into its order where the order is free.

    Args:
        path: ends in .csv or .npz.
        job: from ``cell.job.job.prepare``.

    Returns:
        The job and the motion.

    Raises:
        InputError: as of ``cell.motion.motion_file.read_motion``.
    """
    read = read_motion(path, job)
    again = in_motion_order(job, read.motion)
    return (job, read) if again is job else (again, read_motion(path, again))


def in_motion_order(job: Job, motion: Motion) -> Job:
    """The job with its layers in the order in which a motion lays them, where that is the motion's to choose."""
    if job.case.table.mode not in CHOOSES or job.case.table.poses or not len(job.targets):
        return job
    if job.order is not None:
        return job  # it has one already, by which the motion was made or read
    return in_order(job, _runs(job, motion))


def _runs(job: Job, motion: Motion) -> list[LayerRun]:
    """Runs of layers in the order in which a motion first welds them; layers it leaves out follow those below them."""
    t = job.targets
    welded = motion.target[motion.arc == 1]
    following = [0] * len(job.layers)
    runs: list[LayerRun] = []

    def lay(sub_volume: int, layer: int) -> None:
        first = following[sub_volume]
        if layer < first:
            return
        following[sub_volume] = layer + 1
        if runs and runs[-1][0] == sub_volume:
            runs[-1] = (sub_volume, runs[-1][1], layer)
        else:
            runs.append((sub_volume, first, layer))

    layers = np.column_stack([t.sub_volume_index[welded], t.layer[welded]])
    changes = np.flatnonzero((np.diff(layers, axis=0, prepend=-1) != 0).any(axis=1))
    for sub_volume, layer in layers[changes].tolist():
        lay(sub_volume, layer)
    for sub_volume, count in enumerate(job.layers):
        lay(sub_volume, count - 1)
    return runs
