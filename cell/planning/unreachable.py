"""Targets that no configuration reaches inside limits and margins at any allowed roll, proved.

    unreachable(context, range(first, stop))      # {i: TargetFailure}

A proof for many targets together costs little more than for a few. So targets are examined in blocks of neighbours,
each block once, and the result is kept as long as the context. Metres and radians.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from ik.reachability_proof import certify

from ..arrays import Ints
from .bead_outcome import TargetFailure
from .configurations import nodes_at_rolls
from .context import Context

BLOCK = 512  # neighbouring targets of which it is proved together
EVALUATED = 256  # targets evaluated together, to say what is wrong with them

_known: WeakKeyDictionary[Context, dict[int, NDArray[np.bool_]]] = WeakKeyDictionary()


def unreachable(context: Context, targets: Iterable[int]) -> dict[int, TargetFailure]:
    """The targets that are proved out of reach, with the reason.

    Args:
        context: the arm and the cell.
        targets: which.
    """
    solver, every = context.solver, np.array(list(targets), dtype=np.int64)
    if solver.form is None:
        return {}
    bad = _proved(context, every)
    out: dict[int, TargetFailure] = {}
    for k in range(0, len(bad), EVALUATED):
        some = bad[k : k + EVALUATED]
        nodes = nodes_at_rolls(
            solver, context.placed.rows(some), context.window, context.settings.roll_step, context.limits
        )
        for n, i in enumerate(some.tolist()):
            failure, attempt = nodes.why_not(n)
            out[i] = TargetFailure(replace(failure, proved=True), attempt)
    return out


def _proved(context: Context, every: Ints) -> Ints:
    """The targets of a block that are proved out of reach."""
    known = _known.setdefault(context, {})
    out = np.zeros(len(every), dtype=bool)
    for block in np.unique(every // BLOCK).tolist():
        first = block * BLOCK
        if block not in known:
            Ts = context.placed.rows(slice(first, first + BLOCK)).Ts_base_target
            known[block] = certify(
                context.solver.chain, Ts, context.window, context.limits, context.solver.form
            ).unreachable
        here = every // BLOCK == block
        out[here] = known[block][every[here] - first]
    return every[out]
