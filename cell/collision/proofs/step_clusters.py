"""Steps of a motion gathered into clusters that lie close together, each to be proved from one sample of it.

    clusters, of = gather_steps(places, step, laid, spacing)  # places (m, f) m: of some of the arm's shapes at samples
    clusters.at                                                  # (c,) the sample of each cluster that is checked
    clusters.sample[of], clusters.sample[of + 1]                    # both ends of each step

Neighbouring lines, such as those of a zigzag, share clusters: steps are gathered by position, not by time. Metres.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ik.chain import Floats

from ...arrays import Ints, repeat_with_index

WIDER = 1 + 1e-9  # of a cluster: rounding alone divides none


@dataclass(frozen=True, eq=False)
class StepClusters:
    """Steps that lie close together.

    Attributes:
        at: the sample of each that is checked, (c,).
        laid: deposits laid there, (c,).
        cluster: cluster of each sample of the steps, ascending, (t,).
        sample: likewise, (t,): the ends of a step follow one another.
    """

    at: Ints
    laid: Ints
    cluster: Ints
    sample: Ints

    def samples_of(self, cluster: Ints) -> tuple[Ints, Ints]:
        """All samples of some clusters (k,): which of these each is of, and its place among ``sample``, (c,) each."""
        first = np.searchsorted(self.cluster, np.arange(len(self.at) + 1))
        count = np.diff(first)[cluster]
        which, place = repeat_with_index(count)
        return which, first[cluster][which] + place


def gather_steps(places: Floats, step: Ints, laid: Ints, spacing: float) -> tuple[StepClusters, Ints]:
    """Gather steps.

    Args:
        places: where some points of the arm are at the samples of a motion, (m, f), m.
        step: the steps by their first samples, ascending, (k,).
        laid: deposits laid on each, (k,): steps of a cluster have the same.
        spacing: how far the middles of a cluster's steps are apart at most, in each of f, m; 0: each by itself.

    Returns:
        The clusters, and where among their samples the first end of each step stands, (k,).
    """
    middle = (places[step] + places[step + 1]) / 2
    order, begins, nearest = cluster_order(middle, laid, spacing)
    count = np.diff(np.append(begins, len(order)))
    cluster = np.repeat(np.arange(len(begins)), count)
    sorted_step = step[order]
    # the end of a step is the beginning of the next one, where that is of the same cluster
    goes_on = (np.diff(cluster) == 0) & (np.diff(sorted_step) == 1)
    alone = np.append(True, ~goes_on)[: len(order)]
    second = np.arange(len(order)) + np.cumsum(alone)
    of = np.empty(len(order), dtype=np.int64)
    of[order] = second - 1
    sample, of_cluster = np.empty((2, len(order) + int(alone.sum())), dtype=np.int64)
    sample[second - 1], of_cluster[second - 1] = sorted_step, cluster
    sample[second], of_cluster[second] = sorted_step + 1, cluster
    return StepClusters(step[nearest], laid[nearest], of_cluster, sample), of


def cluster_order(place: Floats, laid: Ints, spacing: float) -> tuple[Ints, Ints, Ints]:
    """Places (k, f) in clusters that are no wider than a spacing.

    Returns:
        Their order, cluster by cluster, ascending in each, (k,); where in it each begins, (c,); and the place of each
        cluster that is nearest to its middle, (c,).
    """
    every = np.arange(len(place))
    if spacing <= 0:
        return every, every, every
    order = np.argsort(laid, kind="stable")
    begins = np.append(0, np.flatnonzero(np.diff(laid[order])) + 1)[: len(order)]
    while True:
        there = place[order]
        low, high = np.minimum.reduceat(there, begins), np.maximum.reduceat(there, begins)
        axis = np.argmax(high - low, axis=1)
        one = np.arange(len(begins)), axis
        wide = (high - low)[one]
        parts = np.where(wide > spacing * WIDER, np.ceil(wide / spacing), 1.0)
        cluster = np.repeat(np.arange(len(begins)), np.diff(np.append(begins, len(order))))
        if (parts == 1).all():
            break
        along = there[np.arange(len(order)), axis[cluster]] - low[one][cluster]
        part = np.minimum(np.floor(along * (parts / np.where(wide > 0, wide, 1.0))[cluster]), (parts - 1)[cluster])
        key = (np.cumsum(parts) - parts)[cluster] + part
        again = np.argsort(key, kind="stable")
        order, key = order[again], key[again]
        begins = np.append(0, np.flatnonzero(np.diff(key)) + 1)
    off = np.abs(there - ((low + high) / 2)[cluster]).max(axis=1)
    least = np.flatnonzero(off == np.minimum.reduceat(off, begins)[cluster])
    _, first = np.unique(cluster[least], return_index=True)
    return order, begins, order[least[first]]
