"""Infeasible targets that belong together: neighbours on a bead or on adjacent layers, with the same reason.

    for group in target_groups(job.targets, reasons):       # reasons: one a target, None where feasible
        group.reason, group.targets                  # ascending indices

A report names groups rather than thousands of targets, and what would help is searched for each of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from slicing import Targets

from ..arrays import Ints

NEIGHBOUR_REACH = 1.5  # neighbours on adjacent layers are this many times as far apart as those on a bead at most


@dataclass(frozen=True, eq=False)
class TargetGroup:
    """Neighbouring infeasible targets.

    Attributes:
        reason: what all of them are infeasible for.
        targets: their indices, ascending.
    """

    reason: str
    targets: Ints


def target_groups(targets: Targets, reasons: Sequence[str | None]) -> list[TargetGroup]:
    """The groups of a verdict.

    Args:
        targets: of the whole part.
        reasons: of each target, (n,); None where it is not infeasible.

    Returns:
        Groups, the largest first.
    """
    bad = np.array([i for i, reason in enumerate(reasons) if reason is not None], dtype=np.int64)
    if not len(bad):
        return []
    kind = np.array([str(reasons[i]) for i in bad])
    a, b = _neighbours(targets, bad)
    same = kind[a] == kind[b]
    graph = coo_array((np.ones(int(same.sum())), (a[same], b[same])), shape=(len(bad), len(bad)))
    count, label = connected_components(graph, directed=False)
    found = [TargetGroup(str(kind[label == k][0]), bad[label == k]) for k in range(count)]
    return sorted(found, key=lambda group: (-len(group.targets), int(group.targets[0])))


def _neighbours(targets: Targets, bad: Ints) -> tuple[Ints, Ints]:
    """Pairs of places in ``bad`` that are next to one another on a bead, or near on the same or the next layer."""
    along = np.flatnonzero((np.diff(bad) == 1) & (np.diff(targets.bead[bad]) == 0))
    steps = np.linalg.norm(np.diff(targets.position, axis=0), axis=1)[np.diff(targets.bead) == 0]
    reach = NEIGHBOUR_REACH * float(np.median(steps)) if len(steps) else 0.0
    reach = max(reach, NEIGHBOUR_REACH * float(np.max(targets.thickness_mm[bad], initial=0.0)))
    pairs = cKDTree(targets.position[bad]).query_pairs(reach, output_type="ndarray").reshape(-1, 2)
    i, j = bad[pairs[:, 0]], bad[pairs[:, 1]]
    near = (np.abs(targets.layer[i] - targets.layer[j]) <= 1) & (
        targets.sub_volume_index[i] == targets.sub_volume_index[j]
    )
    return np.concatenate([along, pairs[near, 0]]), np.concatenate([along + 1, pairs[near, 1]])
