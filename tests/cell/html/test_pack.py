"""Numbers packed for pages: half a step off at most, in a few bits each."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cell.html.pack import LARGEST_STEPS, Pack, unpack


def there_and_back(values: np.ndarray, per_unit: float) -> np.ndarray:
    pack = Pack()
    # neighbours, so that a place is not by chance the first or the last
    document = {"a": pack.put([1.5, np.nan], "f4"), "b": pack.steps(values, per_unit), "c": pack.put([7], "u2")}
    out = unpack(pack.text(document))
    np.testing.assert_array_equal(out["a"], [1.5, np.nan])
    assert out["c"].tolist() == [7]
    return np.asarray(out["b"])


@given(
    seed=st.integers(0, 2**32 - 1),
    rows=st.integers(0, 40),
    columns=st.integers(0, 3),
    per_unit=st.sampled_from([1.0, 100.0, 1e6, 32767.0]),
    size=st.sampled_from([1e-6, 1.0, 1e5]),
    gaps=st.sampled_from([0.0, 0.3, 1.0]),
)
def test_numbers_come_out_half_a_step_off_at_most(
    seed: int, rows: int, columns: int, per_unit: float, size: float, gaps: float
) -> None:
    rng = np.random.default_rng(seed)
    values = rng.normal(size=(rows, columns) if columns else (rows,)) * size
    values[rng.random(values.shape) < gaps] = np.nan
    out = there_and_back(values, per_unit)
    np.testing.assert_array_equal(np.isnan(out), np.isnan(values.ravel()))
    known = ~np.isnan(out)
    off = np.abs(out - values.ravel())[known]
    assert (off <= 0.5 / per_unit + 1e-15 * np.abs(out[known])).all()


@pytest.mark.parametrize("largest", [LARGEST_STEPS - 1, -(LARGEST_STEPS - 1)])
def test_whole_numbers_are_kept_up_to_the_most_and_more_are_refused(largest: int) -> None:
    values = np.array([largest, -largest, 0, largest, 1], dtype=np.float64)
    assert there_and_back(values, 1.0).tolist() == values.tolist()
    # what the page adds up in floating point is whole numbers all along
    assert 8 * LARGEST_STEPS <= 2**53
    for bad in (2.0 * largest, np.inf):
        with pytest.raises(ValueError, match="too many"):
            Pack().steps([bad])


def test_what_changes_little_takes_a_few_bits() -> None:
    t = np.linspace(0, 600, 50_000)
    smooth = np.stack([np.sin(t + k) for k in range(6)], axis=1)
    pack, plain = Pack(), Pack()
    packed = len(pack.text({"q": pack.steps(smooth, 1e5)}))
    assert packed < 0.15 * len(plain.text({"q": plain.put(np.round(smooth, 5), "f4")}))
