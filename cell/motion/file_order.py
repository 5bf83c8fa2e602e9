"""A motion, and the job with its layers in the order in which the motion lays them.

    job, read = read_in_order("propeller.csv", job)      # from a file
    job, motion = in_one_order(job, motion)              # numbered for another order of the same part

Where the table indexes or moves along and the case gives no poses, the order is the motion's own to choose: each layer
comes when the motion first welds it. A sub-volume's layers still have to follow one another; what does not is found as
in any motion, by its beads.
"""

from __future__ import annotations

from dataclasses import replace
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
    job, motion = in_one_order(job, read.motion)
    return job, replace(read, motion=motion)


def in_motion_order(job: Job, motion: Motion) -> Job:
    """The job with its layers in the order in which a motion lays them, where that is the motion's to choose."""
    if job.case.table.mode not in CHOOSES or job.case.table.poses or not len(job.targets):
        return job
    if job.order is not None:
        return job  # it has one already, by which the motion was made or read
    return in_order(job, _runs(job, motion))


def in_one_order(job: Job, motion: Motion) -> tuple[Job, Motion]:
    """The job in the order of a motion where that is free, and the motion with the numbers of that job.

    Args:
        job: of the part that the motion builds, in this order or another.
        motion: numbered by an order of its own (``motion.order``).

    Returns:
        The job and the motion, of one order.
    """
    motion = renumbered(motion, job)
    again = in_motion_order(job, motion)
    return again, renumbered(motion, again)


def renumbered(motion: Motion, job: Job) -> Motion:
    """A motion with its beads and targets numbered as a job has them; its held speed, by targets, is left out."""
    if motion.order is job.order:
        return motion
    bead, target = motion.called
    if job.order is not None:
        bead, target = job.order.beads_of_file(bead), job.order.targets_of_file(target)
    return replace(motion, bead=bead, target=target, held_speed=None, order=job.order)


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
