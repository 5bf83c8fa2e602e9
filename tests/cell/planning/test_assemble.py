"""A motion put together: its time rises at every row, by as much as a file's digits show."""

from __future__ import annotations

import numpy as np

from cell.planning.assemble import _times


def test_the_time_rises_at_every_row_even_where_a_row_takes_none() -> None:
    t = _times(np.array([0.5, 0.1, 0.0, 1e-9, 0.2]))
    assert (np.diff(np.round(t, 6)) > 0).all()
    np.testing.assert_allclose(t, [0.5, 0.6, 0.6, 0.6, 0.8], atol=1e-5)
