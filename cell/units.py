"""Units: the slicer works in millimetres, the cell in metres.

Use:

    metres = millimetres * METRES_PER_MM
"""

from __future__ import annotations

import numpy as np

METRES_PER_MM = 1e-3

# of the singularity margins as they are written: the unit's name, and how many of it are in a radian or metre
MARGIN_UNITS = {
    "wrist": ("deg", 180 / np.pi),
    "elbow": ("deg", 180 / np.pi),
    "shoulder": ("mm", 1e3),
    "sigma": ("1", 1.0),
}
