"""The order of layers in which the table turns least, of those in which no layer locks the torch out of another.

    runs = shortest_order(layers, seconds, needs)    # [(0, 0, 7), (1, 0, 7), (0, 8, 20), ..]; None: there is none

``needs[b][m, a]`` is the first layer of sub-volume a that may not be there before layer m of sub-volume b is laid.
A sub-volume is built as far as the others allow; then comes the one to which the table turns in the shortest time.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise, permutations

import numpy as np

from ik.chain import Floats

from ..arrays import Ints
from ..job.build_order import LayerRun

MOST_TRIED = 7  # sub-volumes of which every order is checked where none locks out another
NEVER = np.iinfo(np.int64).max  # as a first layer: none of them is in the way
SAME_TIME = 1e-6  # s


def shortest_order(
    layers: Sequence[int], seconds: Floats, needs: Sequence[Ints], fixed: int = 0
) -> list[LayerRun] | None:
    """The order with the shortest turns of those checked; of alike ones the one nearest to the order given.

    Args:
        layers: how many each sub-volume has.
        seconds: of the table's turn from each sub-volume's pose to each other's, (g, g), s.
        needs: of each sub-volume, (its layers, g); see the module.
        fixed: how many of the first come first, whole.

    Returns:
        Runs of layers; None where every order checked comes to an end before all is built.
    """
    count = len(layers)
    starts: Sequence[Sequence[int]] = [(k,) for k in range(fixed, count)] or [()]
    free = all((need == NEVER).all() for need in needs)
    if free and count - fixed <= MOST_TRIED:
        starts = list(permutations(range(fixed, count)))
    best: tuple[float, list[LayerRun]] | None = None
    for start in starts:
        runs = _walk(layers, seconds, needs, [*range(fixed), *start])
        if runs is None:
            continue
        cost = float(sum(seconds[a[0], b[0]] for a, b in pairwise(runs)))
        if best is None or cost < best[0] - SAME_TIME:
            best = cost, runs
    return None if best is None else best[1]


def _walk(layers: Sequence[int], seconds: Floats, needs: Sequence[Ints], first: Sequence[int]) -> list[LayerRun] | None:
    """Runs that begin with some sub-volumes; None where nothing can be built any further."""
    following = [0] * len(layers)
    runs: list[LayerRun] = []
    left = list(first)
    while any(done < count for done, count in zip(following, layers, strict=True)):
        stops = [_stop(a, layers, needs, following) for a in range(len(layers))]
        open_ = [a for a, stop in enumerate(stops) if stop > following[a]]
        if not open_:
            return None
        if left:
            at = left.pop(0)
            if at not in open_:
                return None
        else:
            came = runs[-1][0] if runs else open_[0]
            at = min(open_, key=lambda a: (seconds[came, a], a))
        runs.append((at, following[at], stops[at] - 1))
        following[at] = stops[at]
    return runs


def _stop(a: int, layers: Sequence[int], needs: Sequence[Ints], following: Sequence[int]) -> int:
    """The first layer of a sub-volume that has to wait for others; one past its last where none has."""
    stop = layers[a]
    for b, need in enumerate(needs):
        waiting = need[following[b] :, a]
        if b != a and len(waiting):
            stop = min(stop, int(waiting.min()))
    return stop
