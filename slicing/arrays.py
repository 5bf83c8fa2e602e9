"""What every module of the package is written in: arrays of numbers, and the error of bad input.

Other modules have these from `slicing.mesh.solid`, but for those that it builds on.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from .errors import PartError

__all__ = ["Bools", "Floats", "Ints", "PartError"]

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]
