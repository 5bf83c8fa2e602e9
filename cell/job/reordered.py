"""A job whose layers are built in another order.

    job = in_order(job, [(0, 0, 7), (1, 0, 7), (0, 8, 20), (1, 8, 20)])

Each run is (sub-volume, first layer, last layer), counted from 0.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ..scene.compose import compose
from .build_order import LayerRun, in_build_order, ordered_shape
from .job import Job


def in_order(job: Job, runs: Sequence[LayerRun]) -> Job:
    """Build the layers of a job in another order.

    Args:
        job: from ``cell.job.job.prepare``, with its sub-volumes one after the other.
        runs: every layer once, each sub-volume's in their order.

    Returns:
        The job, with its targets, beads and deposits numbered as they are built now.
    """
    layers = job.layers
    if list(runs) == [(k, 0, count - 1) for k, count in enumerate(layers)]:
        return job
    targets, order = in_build_order(job.targets, layers, runs)
    shape = ordered_shape(job.shape, order.deposit)
    return replace(job, shape=shape, targets=targets, scene=compose(job.case, shape), order=order)
