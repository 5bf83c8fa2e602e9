"""What is built at one pose of the table: sub-volumes, or runs of their layers, in the order in which they are built.

    groups = table_groups(job)                # one a sub-volume, or one a run of layers in the job's order
    groups[0].first, groups[0].stop           # its targets

Degrees, since poses are asked for in degrees.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .build_order import LayerRun
from .job import Job


@dataclass(frozen=True)
class TableGroup:
    """Layers that are built at one pose of the table.

    Attributes:
        sub_volume: name of the sub-volume.
        layers: its first and last layer of the group.
        first: first target.
        stop: one past the last target.
        pose: E1, E2 as asked for, deg; None where it is to be found.
    """

    sub_volume: str
    layers: tuple[int, int]
    first: int
    stop: int
    pose: tuple[float, float] | None = None


def table_groups(job: Job) -> tuple[TableGroup, ...]:
    """What is built at one pose each, in order.

    Args:
        job: from ``cell.job.job.prepare``.

    Returns:
        One group a run of layers in the job's order, with the pose that the case gives it; else one a sub-volume.
        Those without targets are left out.
    """
    t = job.targets
    runs: Sequence[LayerRun] = [(k, 0, count - 1) for k, count in enumerate(job.layers)]
    poses = [(p.E1_deg, p.E2_deg) for p in job.case.table.poses]
    if job.order is not None:
        runs = job.order.runs
    groups = []
    for i, (at, low, high) in enumerate(runs):
        mine = np.flatnonzero((t.sub_volume_index == at) & (t.layer >= low) & (t.layer <= high))
        if len(mine):
            pose = poses[i] if poses else None
            groups.append(TableGroup(t.sub_volume[at], (low, high), int(mine[0]), int(mine[-1]) + 1, pose))
    return tuple(groups)
