"""Copies of a model in which what collides is switched, used again once nobody uses them any more.

    model = borrowed(scene.model, checker)               # a copy for this checker alone, then for the next
    model = borrowed(scene.model, checker, away=(3, 7))  # one in which these shapes are far from everything

The copy of a cell with a thousand deposits takes as long as hundreds of configurations, and checkers are made by the
dozen. What a borrower changes stays changed: it may change only what every borrower sets before it looks.
"""

from __future__ import annotations

import copy
import weakref
from collections import defaultdict, deque

import mujoco

AWAY = 1e4  # m
MOST_SPARE = 4  # copies of a kind that are kept for the next

_Spare = defaultdict[tuple[int, ...], deque[mujoco.MjModel]]
_spare: weakref.WeakKeyDictionary[mujoco.MjModel, _Spare] = weakref.WeakKeyDictionary()


def borrowed(model: mujoco.MjModel, by: object, away: tuple[int, ...] = ()) -> mujoco.MjModel:
    """A copy of a model for one borrower alone, until that is gone.

    Args:
        model: what is copied; stays as it is.
        by: who uses the copy.
        away: ids of shapes that are moved away in it, each to a place of its own.

    Returns:
        The copy: a new one, or one that somebody has used before.
    """
    spare = _spare.setdefault(model, defaultdict(_few))[away]
    try:
        mine = spare.pop()
    except IndexError:
        mine = copy.copy(model)
        for geom in away:
            # MuJoCo leaves the place of a shape that stands in its body's own frame unread
            mine.geom_sameframe[geom] = mujoco.mjtSameFrame.mjSAMEFRAME_NONE
            mine.geom_pos[geom, 2] = AWAY * (1 + geom)
    weakref.finalize(by, spare.append, mine).atexit = False
    return mine


def _few() -> deque[mujoco.MjModel]:
    return deque(maxlen=MOST_SPARE)
