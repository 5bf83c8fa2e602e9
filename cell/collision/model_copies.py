"""Copies of a model whose collision bits can be changed: lent for one query, then used again for the next.

    with lent(scene.model) as switched:       # nothing else uses it meanwhile, in this thread or another
        switched.geom_contype[:] = 0
        mujoco.mj_collision(switched.model, data)

Copying a cell with two thousand deposits takes as long as hundreds of queries and as much memory as the rest of a
check, and a check makes dozens of checkers. So there is one copy for each query that runs at the same time, that is for
each thread. Changes stay in the copy: a borrower may change only what every borrower sets before its query.
"""

from __future__ import annotations

import copy
import weakref
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager

import mujoco

MOST_SPARE = 4  # copies that are kept for the next


class Switched:
    """A copy of a model with its collision arrays at hand: asking the model for one takes as long as writing to it.

    Attributes:
        model: the copy.
    """

    def __init__(self, model: mujoco.MjModel) -> None:
        """Copy a model; it stays as it is."""
        self.model: mujoco.MjModel = copy.copy(model)
        mine = self.model
        self.geom_contype, self.geom_conaffinity = mine.geom_contype, mine.geom_conaffinity
        self.body_contype, self.body_conaffinity = mine.body_contype, mine.body_conaffinity
        self.geom_gap, self.body_margin, self.pair_gap = mine.geom_gap, mine.body_margin, mine.pair_gap


_spare: weakref.WeakKeyDictionary[mujoco.MjModel, deque[Switched]] = weakref.WeakKeyDictionary()


@contextmanager
def lent(model: mujoco.MjModel) -> Iterator[Switched]:
    """A copy of a model for one borrower alone, as long as the block lasts.

    Args:
        model: what is copied; stays as it is.

    Yields:
        The copy: a new one, or one that was used before.
    """
    spare = _spare.setdefault(model, deque(maxlen=MOST_SPARE))
    try:
        mine = spare.pop()
    except IndexError:
        mine = Switched(model)
    try:
        yield mine
    finally:
        spare.append(mine)


def discard_spare(model: mujoco.MjModel) -> None:
    """Free the copies of a model that are not lent."""
    _spare.pop(model, None)
