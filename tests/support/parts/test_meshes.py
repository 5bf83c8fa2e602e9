"""The solids of ``meshes`` are what they say."""

from __future__ import annotations

import numpy as np
import pytest

from support.parts.meshes import blade, box, sector, subdivided


def test_subdividing_keeps_the_solid():
    plain, fine = box(), subdivided(box(), 3)
    assert len(fine.faces) == 64 * len(plain.faces)
    assert fine.volume == pytest.approx(30 * 12 * 16)
    assert np.allclose(fine.bounds, plain.bounds)


def test_blocks_are_closed_and_look_outward():
    assert blade().warnings == ()
    assert sector(0.5, 20, 40, -5, 5).warnings == ()
    exact = 0.5 * (40**2 - 20**2) * np.sin(2 * 0.5 / 12) * 12 * 10
    assert sector(0.5, 20, 40, -5, 5).volume == pytest.approx(exact)
