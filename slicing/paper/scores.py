"""The paper's normalised scores: strategies that slice the same sub-volume, weighed against each other.

    found = scores([22, 19, 21], [8.09, 25.37, 25.37], [211, 269, 242], [0.38, 0.30, 0.42])
    found.F, found.best                # (2.14, 2.48, 2.38), 1

    I1 = 1 - NL / sum NL       few layers
    I2 = A / sum A             much adhesion
    I3 = 1 - NV / sum NV       few targets
    I4 = 1 - R / sum R         a true top
    F  = I1 + I2 + I3 + I4

Each lies between 0 and 1, and more is better. A score compares what was sliced together: F of one sub-volume says
nothing of another's, and a strategy on its own gets I1 = I3 = 0 and I2 = 1, as the equations have it. Where a whole
column is zero there is nothing to share out, and every share is 0: flat tops met exactly by every strategy (R) give
I4 = 1 to each, adhesion that no strategy has (A) gives I2 = 0 to each.

Source: Lettori et al. 2024, section 5.1, equations 1 to 5.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..mesh.solid import Floats
from .indices import Indices

ZERO_RAD = 1e-6  # angles below are rounding: of a top met exactly, which must not be shared out


@dataclass(frozen=True, eq=False)
class Scores:
    """Scores of n strategies; see the module. All arrays (..., n), strategies last.

    Attributes:
        I1: of the layers.
        I2: of the adhesion area.
        I3: of the targets.
        I4: of the top.
    """

    I1: Floats
    I2: Floats
    I3: Floats
    I4: Floats

    @property
    def F(self) -> Floats:
        """The total, 0 to 4."""
        return self.I1 + self.I2 + self.I3 + self.I4

    @property
    def best(self) -> int | npt.NDArray[np.intp]:
        """Number of the strategy with the greatest F; the first of equals."""
        return np.argmax(self.F, axis=-1)

    def to_dict(self, strategy: int) -> dict[str, float]:
        """One strategy's scores as plain numbers, for a single sub-volume.

        Args:
            strategy: its row in the scores.
        """
        return {key: float(getattr(self, key)[strategy]) for key in ("I1", "I2", "I3", "I4", "F")}


def scores(NL: npt.ArrayLike, A: npt.ArrayLike, NV: npt.ArrayLike, R: npt.ArrayLike) -> Scores:
    """Scores of strategies from their indices.

    Args:
        NL: (..., n) layers; the last axis runs over the strategies that are compared.
        A: (..., n) adhesion areas, mm2.
        NV: (..., n) targets.
        R: (..., n) angles at the top, rad.

    Returns:
        The scores.

    Raises:
        ValueError: no strategy, shapes that differ, or an index that is negative or not finite.

    Source:
        Lettori et al. 2024, equations 1 to 5.
    """
    columns = {key: np.asarray(v, dtype=np.float64) for key, v in (("NL", NL), ("A", A), ("NV", NV), ("R", R))}
    shape = columns["NL"].shape
    for key, values in columns.items():
        if values.shape != shape:
            raise ValueError(f"{key}: shape {values.shape} differs from NL's {shape}")
        if values.ndim == 0 or values.size == 0:
            raise ValueError(f"{key}: at least one strategy is needed")
        if not (np.isfinite(values) & (values >= 0)).all():
            raise ValueError(f"{key}: {values.tolist()} is not allowed; finite numbers of at least 0 are needed")
    share = {key: _share(values) for key, values in columns.items()}
    return Scores(1.0 - share["NL"], share["A"], 1.0 - share["NV"], 1.0 - share["R"])


def scores_of(found: Sequence[Indices]) -> Scores:
    """Scores of strategies from the indices of one sub-volume.

    Args:
        found: its indices, one a strategy. An R below :data:`ZERO_RAD` counts as 0.

    Returns:
        The scores, (n,) each.

    Raises:
        ValueError: no strategy.
    """
    R = [i.R_rad if i.R_rad >= ZERO_RAD else 0.0 for i in found]
    return scores([i.NL for i in found], [i.A_mm2 for i in found], [i.NV for i in found], R)


def _share(values: Floats) -> Floats:
    """Of the sum over the last axis; 0 where the sum is 0."""
    total = values.sum(axis=-1, keepdims=True)
    return np.divide(values, total, out=np.zeros_like(values), where=total > 0)
