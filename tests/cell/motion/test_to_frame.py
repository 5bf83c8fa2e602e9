"""A motion as columns: what its file has, as numbers."""

from __future__ import annotations

import numpy as np

from cell.motion.motion import Motion


def test_columns_are_those_of_the_rows_of_a_file() -> None:
    rng = np.random.default_rng(0)
    m = 5
    whole = [rng.integers(0, 3, m) for _ in range(3)]
    motion = Motion(
        np.arange(m) * 0.25,
        rng.uniform(-3, 3, (m, 6)),
        rng.uniform(-3, 3, (m, 2)),
        np.array([0, 1, 1, 1, 0]),
        *whole,
        ("A1", "A2", "A3", "A4", "A5", "A6"),
    )
    frame = motion.to_frame()
    assert list(frame) == motion.columns()
    rows = np.array([[float(cell) for cell in row] for row in motion.rows_deg()])
    np.testing.assert_allclose(np.array(list(frame.values())).T, rows, atol=1e-6)
