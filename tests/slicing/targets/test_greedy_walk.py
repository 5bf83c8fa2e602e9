"""Walks along many stretches in step: each as if it were alone, and as plain doubling and halving has it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.layers.beads import break_points, open_break_points

from slicing.targets.break_points import BeadLine, chosen_points
from slicing.targets.chord_error import error, errors_through
from slicing.targets.greedy_walk import PolylineStretches, greedy_points


def wobbly(seed: int, n: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    t = np.linspace(0, 2 * np.pi, n, endpoint=False)
    r = rng.uniform(4, 40) * (1 + 0.2 * np.cos(rng.integers(2, 6) * t + rng.uniform(0, 6)))
    loop = np.stack([r * np.cos(t), r * np.sin(t), rng.uniform(0, 5) * np.sin(2 * t)], axis=1)
    if seed % 3 == 0:  # with corners, and points given twice
        loop[:: max(n // 7, 1)] *= 1.05
        loop[n // 3] = loop[n // 3 - 1]
    return loop


def alone(line: np.ndarray, tolerance: float, least: float) -> list[int]:
    """One greedy walk, every distance exact."""

    def fits(i: int, j: int) -> bool:
        return error(line[i : j + 1]) <= tolerance

    end, chosen = len(line) - 1, [0]
    while True:
        i, reach = chosen[-1], 2
        good = i + 1
        while i + reach < end and fits(i, i + reach):
            good, reach = i + reach, 2 * reach
        bad = min(i + reach, end)
        if bad == end and fits(i, end):
            return chosen
        while bad - good > 1:
            middle = (good + bad) // 2
            good, bad = (middle, bad) if fits(i, middle) else (good, middle)
        away = np.sqrt(((line[good:] - line[i]) ** 2).sum(axis=1))
        if good < end and away[0] <= least * (1 + 5e-10):
            far = np.flatnonzero(away[:-1] ** 2 >= least**2)
            good = good + int(far[0]) if len(far) else end
        if good >= end:
            return chosen
        chosen.append(good)


def stretches(lines, tolerances) -> PolylineStretches:
    first = np.cumsum([0, *(len(line) for line in lines)])
    return PolylineStretches(
        np.ascontiguousarray(np.concatenate(lines).T),
        first[:-1],
        first[1:] - 1,
        np.asarray(tolerances, dtype=np.float64),
        np.array([(np.ptp(line, axis=0) ** 2).sum() for line in lines]),
    )


@pytest.mark.slow
@settings(max_examples=25, deadline=None)
@given(st.lists(st.tuples(st.integers(0, 10_000), st.integers(3, 300), st.floats(0.01, 2.0)), min_size=1, max_size=8),
       st.floats(0.5, 6.0))  # fmt: skip
def test_every_stretch_is_walked_as_if_it_were_alone(given_lines, least):
    lines = [wobbly(seed, n) for seed, n, _ in given_lines]
    tolerances = [tolerance for _, _, tolerance in given_lines]
    first = np.cumsum([0, *(len(line) for line in lines)])
    for own, line, tolerance, base in zip(
        greedy_points(stretches(lines, tolerances), least), lines, tolerances, first, strict=False
    ):
        assert [k - base for k in own] == alone(line, tolerance, least)


def test_distances_that_rounding_decides_are_those_of_error():
    # teeth exactly as high as the tolerance, far from the origin: sums of squares differ in their last digits
    for tolerance in (0.3, 0.1, 0.7):
        k = np.arange(400.0)
        line = np.stack([k, tolerance * (k % 2), 0 * k], axis=1) @ np.linalg.qr(np.arange(9.0).reshape(3, 3) ** 1.3)[0]
        line += [1234.5, -77.7, 3.3]
        (own,) = greedy_points(stretches([line], [tolerance]), 0.5)
        assert own == alone(line, tolerance, 0.5)


def test_looking_at_few_points_at_a_time_changes_nothing():
    lines = [wobbly(seed, 60 + 37 * seed) for seed in range(12)]
    whole = greedy_points(stretches(lines, [0.2] * 12), 2.0)
    few = replace(stretches(lines, [0.2] * 12), at_once=50)
    assert greedy_points(few, 2.0) == whole


def test_beads_chosen_together_are_those_chosen_alone():
    rng = np.random.default_rng(4)
    lines = []
    for seed in range(24):
        points = wobbly(seed, int(rng.integers(4, 400)))
        stops = tuple(sorted(rng.integers(0, len(points), int(rng.integers(0, 5))).tolist())) if seed % 2 else ()
        lines.append(BeadLine(points, bool(seed % 4 < 2), float(rng.uniform(0.05, 0.5)), stops))
    for line, together in zip(lines, chosen_points(lines, 3.0), strict=True):
        if not line.closed:
            own = open_break_points(line.points, line.tolerance_mm, 3.0, line.stops)
        elif line.stops:
            loop = np.concatenate([line.points, line.points[:1]])
            own = open_break_points(loop, line.tolerance_mm, 3.0, line.stops)[:-1]
        else:
            own = break_points(line.points, 0, line.tolerance_mm, 3.0)
        assert np.array_equal(together, own)
        assert together[0] == 0
        assert set(line.stops) <= set(together.tolist())
    assert chosen_points([], 3.0) == []


def test_errors_by_search():
    line = wobbly(5, 90)
    dense = np.linspace(0, 1, 20001)[:, None]
    for i, j in ((0, 30), (10, 12), (40, 89)):
        segment = line[i] + dense * (line[j] - line[i])
        away = np.sqrt(((line[i : j + 1, None] - segment[None]) ** 2).sum(axis=2)).min(axis=1).max()
        assert error(line[i : j + 1]) == pytest.approx(away, abs=1e-4)
    middles = np.array([20, 41, 60])
    both = [max(error(line[5 : k + 1]), error(line[k:81])) for k in middles.tolist()]
    assert errors_through(line, 5, middles, 80) == pytest.approx(both, abs=1e-9)
