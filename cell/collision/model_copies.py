"""Copies of a model in which what collides is switched: lent for one look, then used again for the next.

    with lent(scene.model) as switched:       # nothing else uses it meanwhile, in this thread or another
        switched.geom_contype[:] = 0
        mujoco.mj_collision(switched.model, data)

The copy of a cell with two thousand deposits takes as long as hundreds of configurations and as much memory as the rest
of a check, and checkers are made by the dozen. So there are as many copies as looks at once: one in each thread. What a
borrower changes stays changed: it may change only what every borrower sets before it looks.
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
    """A copy of a model, and those of its arrays that are switched: to ask a model for one costs as much as to write.

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
    """Free the copies of a model that are not lent: after a check the memory is needed for other things."""
    _spare.pop(model, None)
