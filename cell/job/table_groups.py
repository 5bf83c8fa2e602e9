"""What is built at one pose of the table: sub-volumes, or runs of their layers, in the order in which they are built.

    groups = table_groups(job)                # one a sub-volume, or one an entry of the case's table.poses
    groups[0].first, groups[0].stop           # its targets

Degrees, since poses are asked for in degrees.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

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
        One group an entry of the case's ``table.poses``, or else one a sub-volume; those without targets left out.
    """
    counts = {one.name: len(one.layers) for one in job.sliced}
    table = job.case.table
    runs: list[tuple[str, tuple[int, int], tuple[float, float] | None]] = [
        (name, (0, count - 1), None) for name, count in counts.items()
    ]
    if table.poses:
        runs = [(p.sub_volume, p.layers or (0, counts[p.sub_volume] - 1), (p.E1_deg, p.E2_deg)) for p in table.poses]
    t = job.targets
    names = np.array(t.sub_volume)[t.sub_volume_index]
    groups = []
    for name, (low, high), pose in runs:
        mine = np.flatnonzero((names == name) & (t.layer >= low) & (t.layer <= high))
        if len(mine):
            groups.append(TableGroup(name, (low, high), int(mine[0]), int(mine[-1]) + 1, pose))
    return tuple(groups)
