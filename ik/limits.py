"""Joint limits of angles that come in turns.

A closed form gives an angle in one turn; the arm may stand at that angle plus or minus whole turns. ``with_turns`` lists
every standing inside the limits, ``excess`` says how far the nearest one is outside::

    q = with_turns(chain, closed_form.solve(form, Ts))     # (..., k, n), NaN where a standing is outside
    over = excess(chain, q_raw)                            # (..., n) rad, 0 inside
"""

from __future__ import annotations

from itertools import product

import numpy as np

from .chain import Chain, Floats
from .roll import wrap

TURN = 2 * np.pi


def excess(chain: Chain, q: Floats) -> Floats:
    """How far each joint, at its best turn, is outside its limits.

    Args:
        chain: the arm.
        q: (..., n), rad, any turn.

    Returns:
        (..., n) rad, 0 inside; NaN stays NaN.
    """
    middle, half = (chain.lower + chain.upper) / 2, (chain.upper - chain.lower) / 2
    return np.maximum(np.abs(wrap(q - middle)) - half, 0.0)


def with_turns(chain: Chain, q: Floats, slack: float = 1e-9) -> Floats:
    """Every standing of the joints inside the limits.

    Args:
        chain: the arm.
        q: (..., n), rad.
        slack: tolerance at the limits, rad; a standing outside by less is put on the limit.

    Returns:
        (..., k, n) rad; k is the product over the joints of the whole turns that fit into their range (1 for most).
        Standings outside the limits are NaN.
    """
    counts = [int((u - lo - 1e-6) // TURN) + 1 for lo, u in zip(chain.lower, chain.upper, strict=True)]
    first = q + TURN * np.ceil((chain.lower - slack - q) / TURN)
    shifts = TURN * np.array(list(product(*(range(c) for c in counts))), dtype=float)
    out = first[..., None, :] + shifts
    inside = np.all(out <= chain.upper + slack, axis=-1)
    out = np.clip(out, chain.lower, chain.upper)
    out[~inside] = np.nan
    return out
