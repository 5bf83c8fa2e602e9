"""Steps of a motion whose clearance is not decided yet.

    steps = OpenSteps(step, a, b, da, db, laid)
    steps.rows(steps.beyond(limit) <= way)                  # those that remain
    steps.halves(middle, dm)                                # twice as many, half as long

Metres, radians.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from ik.chain import Floats

from ...arrays import Ints


@dataclass(frozen=True, eq=False)
class OpenSteps:
    """Steps, or parts of them, whose clearance is not decided yet.

    Attributes:
        step: first sample, (k,).
        a: configuration at the beginning, (k, n), rad.
        b: at the end, (k, n), rad.
        da: clearance at the beginning, at least, (k,), m.
        db: at the end, likewise, (k,), m.
        laid: deposits laid, (k,).
    """

    step: Ints
    a: Floats
    b: Floats
    da: Floats
    db: Floats
    laid: Ints

    def rows(self, index: Ints | NDArray[np.bool_]) -> OpenSteps:
        """Some of them."""
        return OpenSteps(*(getattr(self, one.name)[index] for one in fields(self)))

    def beyond(self, limit: float) -> Floats:
        """Excess of the clearances at both ends over a limit, added up, (k,), m."""
        return self.da + self.db - 2 * limit

    def halves(self, middle: Floats, dm: Floats) -> OpenSteps:
        """Both halves of each, with the clearances in their middles."""
        step, laid = np.concatenate([self.step, self.step]), np.concatenate([self.laid, self.laid])
        a, b = np.concatenate([self.a, middle]), np.concatenate([middle, self.b])
        return OpenSteps(step, a, b, np.concatenate([self.da, dm]), np.concatenate([dm, self.db]), laid)
