"""Parameters of three strategies, and the height of the layers in their tests, mm."""

from __future__ import annotations

from slicing.parameters import SlicingParameters

PLANAR, ROUND, MIXED = (SlicingParameters(s) for s in ("planar", "cylindrical", "nonuniform"))


H = 1.73
