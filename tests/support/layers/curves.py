"""Whether curves are the same."""

from __future__ import annotations

import numpy as np
import pytest


def same(many, one):
    """Same loops, wherever they begin."""
    assert len(many) == len(one)
    for a in many:
        b = min(one, key=lambda b: ((b.points - a.points[0]) ** 2).sum(axis=1).min())
        first = int(((b.points - a.points[0]) ** 2).sum(axis=1).argmin())
        assert len(a.points) == len(b.points)
        assert np.abs(np.roll(b.points, -first, axis=0) - a.points).max() < 1e-9
        assert (a.hole, a.winding) == (b.hole, b.winding)
        assert a.area_mm2 == pytest.approx(b.area_mm2, rel=1e-9, abs=1e-9)
