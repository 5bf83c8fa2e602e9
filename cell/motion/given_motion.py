"""A motion as it is given to a check: from memory or from a file, of this order of layers or another.

    job, read = given(job, result.motion)
    job, read = given(job, read_motion("theirs.csv", job))

A motion from memory goes the way of its npz file: it is refused for the same faults and judged alike.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..arrays import Ints
from ..errors import InputError
from ..job.job import Job
from .file_order import in_one_order
from .motion import Motion, required
from .motion_file import WHOLE_COLUMNS, ReadMotion, read_columns


def given(job: Job, motion: Motion | ReadMotion | None) -> tuple[Job, ReadMotion]:
    """A motion to be judged, and the job in the order in which it lays the layers.

    Args:
        job: from ``cell.prepare``, or of a result.
        motion: of any source.

    Returns:
        The job and the motion, of one order.

    Raises:
        InputError: there is no motion, or one from memory could not be read from a file; one line.
    """
    read = motion if isinstance(motion, ReadMotion) else _read(job, required(motion))
    job, mine = in_one_order(job, read.motion)
    return job, read if mine is read.motion else replace(read, motion=mine)


def _read(job: Job, motion: Motion) -> ReadMotion:
    """A motion from memory, read as a file is."""
    m = len(motion.t_s)
    shapes = {"t_s": (m,), "q": (m, len(motion.names)), "table": (m, 2), **dict.fromkeys(WHOLE_COLUMNS, (m,))}
    for name, shape in shapes.items():
        found = np.shape(getattr(motion, name))
        if found != shape:
            raise InputError(f"motion: {name} has the shape {found}; {shape} is needed")
    if motion.order is not None:
        bead = _numbers("bead", motion.bead, len(motion.order.bead))
        target = _numbers("target", motion.target, len(motion.order.target))
        motion = replace(motion, bead=bead, target=target)
    return read_columns("motion", motion.to_frame(), job)


def _numbers(name: str, values: Ints, count: int) -> Ints:
    """Numbers of beads or targets, which are to be looked up.

    Raises:
        InputError: one is none of them.
    """
    wrong = np.setdiff1d(values, np.arange(count))
    if len(wrong):
        raise InputError(f"motion: {name} {wrong[0]:g} does not exist; there are 0 to {count - 1}")
    return np.asarray(values, dtype=np.int64)
