"""Checks a part's table poses in worker processes, if the part is large enough for these to be worth their start.

found = pool_for_poses(job).run(function, job, items)
"""

from __future__ import annotations

from ..job.job import Job
from ..processes.worker_pool import WorkerPool, pool

LARGE = 300  # targets from which on workers, whose start takes a second of each, save more than that


def pool_for_poses(job: Job) -> WorkerPool:
    """The pool of workers for a large part; for others this process alone.

    Args:
        job: the part.
    """
    return pool() if len(job.targets) >= LARGE else WorkerPool(1)
