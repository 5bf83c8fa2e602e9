"""Joint limits of angles that are known up to whole turns.

A closed form gives an angle within one turn; the joint may stand whole turns away from it. ``with_turns``
lists every such angle inside the limits, ``excess`` says how far the nearest one is outside::

    q = with_turns(chain, closed_form.solve(form, Ts))     # (..., k, n), NaN outside the limits
    over = excess(chain, q_raw)                            # (..., n) rad, 0 inside
"""

from __future__ import annotations

from itertools import product

import numpy as np
from numpy.typing import NDArray

from .chain import Chain, Floats
from .roll import wrap

TURN = 2 * np.pi
SLACK = 1e-9  # rad; rounding at a limit


def excess(chain: Chain, q: Floats) -> Floats:
    """Distance of each joint outside its limits, at its best turn; 0 inside.

    Args:
        chain: the arm.
        q: (..., n), rad, any turn.

    Returns:
        (..., n) rad, 0 inside; NaN stays NaN.
    """
    middle, half = (chain.lower + chain.upper) / 2, (chain.upper - chain.lower) / 2
    return np.maximum(np.abs(wrap(q - middle)) - half, 0.0)


def turn_combinations(chain: Chain, slack: float = SLACK) -> NDArray[np.int64]:
    """Whole turns above its lowest that each joint can stand at, in every combination.

    Args:
        chain: the arm.
        slack: tolerance at the limits, rad.

    Returns:
        (k, n); the first row is zero, and the last joint's turns vary fastest.
    """
    # in a range of exactly one turn an angle can occur twice: at its two ends
    most = ((chain.upper - chain.lower + 2 * slack) // TURN).astype(int)
    return np.array(list(product(*(range(c + 1) for c in most))), dtype=np.int64).reshape(-1, chain.n)


def with_turns(chain: Chain, q: Floats, slack: float = SLACK, *, packed: bool = False) -> Floats:
    """Configurations in every combination of whole turns inside the limits.

    Args:
        chain: the arm.
        q: (..., n), rad.
        slack: tolerance at the limits, rad; a joint outside by less is put on the limit.
        packed: leave out what no row needs: each row's configurations come first, and k is the most that any row has.

    Returns:
        (..., k, n) rad; k is the number of :func:`turn_combinations` (1 for most arms). Those outside the limits are
        NaN.
    """
    turns = turn_combinations(chain, slack)
    rows = q.reshape(-1, chain.n)
    lowest = rows + TURN * np.ceil((chain.lower - slack - rows) / TURN)
    inside = _inside(chain, np.ascontiguousarray(lowest.T), turns, slack)
    row, k = np.nonzero(inside)
    if packed:
        count = inside.sum(axis=1)
        width = max(int(count.max(initial=0)), 1)
        # place in its row: how many came before, less those of the rows before
        slot = np.arange(len(row)) - np.repeat(np.cumsum(count) - count, count)
    else:
        width, slot = len(turns), k
    out = np.full((len(rows), width, chain.n), np.nan)
    out[row, slot] = np.clip(lowest[row] + TURN * turns[k], chain.lower, chain.upper)
    return out.reshape(*q.shape[:-1], width, chain.n)


def _inside(chain: Chain, lowest: Floats, turns: NDArray[np.int64], slack: float) -> NDArray[np.bool_]:
    """Which combinations of turns are inside every limit, (n, m) -> (m, k)."""
    high = chain.upper[:, None] + slack
    # each joint at each of its turns once, then combined
    fits = [lowest + TURN * c <= high for c in range(int(turns.max(initial=0)) + 1)]
    out = np.empty((len(turns), lowest.shape[1]), dtype=bool)
    for k, row in enumerate(turns):
        out[k] = np.logical_and.reduce([fits[c][j] for j, c in enumerate(row)])
    return np.ascontiguousarray(out.T)
