"""Types of arrays.

Use:

    def rows(index: Ints) -> Floats: ...
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Ints = NDArray[np.int64]
