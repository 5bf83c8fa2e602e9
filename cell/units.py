"""Units: the slicer works in millimetres, the cell in metres.

Use:

    metres = millimetres * METRES_PER_MM
"""

from __future__ import annotations

METRES_PER_MM = 1e-3
