"""Time laws against closed forms, and against what a law may not depend on."""

from types import SimpleNamespace

import numpy as np
import pytest

from cell.job.job import speeds
from cell.motion.deposition_speed import HeldSpeed, speed_document, too_slow
from cell.timing.blending import blended
from cell.timing.time_law import TOGETHER, PathRows, TravelRows, time_path, time_paths, time_travel, time_travels

V, A = np.array([2.0]), np.array([5.0])
ZONE = 1e-3


def trapezoid(way: float, v: float, a: float) -> float:
    """Time from rest to rest."""
    return 2 * np.sqrt(way / a) if way < v**2 / a else way / v + v / a


@pytest.mark.parametrize("way", [0.01, 0.3, 0.799, 0.801, 5.0])
@pytest.mark.parametrize("samples", [2, 3, 50, 501])
def test_one_joint_takes_the_time_of_its_trapezoid(way: float, samples: int) -> None:
    q = np.linspace(0, way, samples)[:, None]
    assert time_travel(q, V, A).sum() == pytest.approx(trapezoid(way, 2.0, 5.0), rel=1e-4)


def test_the_samples_times_are_the_trapezoids() -> None:
    q = np.linspace(0, 5.0, 501)[:, None]
    t = np.concatenate([[0], np.cumsum(time_travel(q, V, A))])
    end = trapezoid(5.0, 2.0, 5.0)
    ramp = 2.0 / 5.0
    expected = np.select(
        [t < ramp, t > end - ramp], [2.5 * t**2, 5.0 - 2.5 * (end - t) ** 2], default=0.4 + 2.0 * (t - ramp)
    )
    assert np.abs(expected - q[:, 0]).max() < 1e-4


def test_of_two_joints_the_slower_one_sets_the_time() -> None:
    s = np.linspace(0, 1, 40)[:, None]
    q = s * [3.0, 1.0]
    v, a = np.array([2.0, 1.0]), np.array([5.0, 1.0])
    # along the line, in the first joint's angle, the second may do three times its own
    assert time_travel(q, v, a).sum() == pytest.approx(trapezoid(3.0, 2.0, 3.0), rel=1e-4)
    v, a = np.array([2.0, 9.0]), np.array([50.0, 1.5])
    assert time_travel(q, v, a).sum() == pytest.approx(trapezoid(3.0, 2.0, 4.5), rel=1e-4)


def corner(samples: int, angle: float = np.pi / 2) -> tuple[np.ndarray, np.ndarray]:
    """Two joints as a plane, a path with a corner in its middle, 1 long each way."""
    s = np.linspace(0, 2, 2 * samples + 1)
    way = np.array([np.cos(angle), np.sin(angle)])
    q = np.where(s[:, None] <= 1, s[:, None] * [1.0, 0.0], [1.0, 0.0] + (s[:, None] - 1) * way)
    return q, s


@pytest.mark.parametrize("zone", [0.01, 0.05])
@pytest.mark.parametrize("angle", [0.2, np.pi / 2, 2.5])
def test_a_corner_is_passed_at_the_speed_of_its_rounding(zone: float, angle: float) -> None:
    q, s = corner(100, angle)
    acceleration = np.array([3.0, 3.0])
    law = time_path(q, s, np.full(2, 50.0), acceleration, cap=1e3, zone=zone)
    # on the parabola the acceleration is the change of slope over its length, times the speed's square
    change = np.abs([np.cos(angle) - 1, np.sin(angle)])
    expected = np.sqrt((acceleration / (change / (2 * zone))).min())
    assert law.speed[100] == pytest.approx(expected, rel=1e-3)
    assert law.cause(1 - 2 * zone, 1 + 2 * zone)[1] == "acceleration"


def test_rounding_leaves_a_corner_by_a_quarter_of_the_zone_and_the_rest_as_it_was() -> None:
    q, s = corner(100)
    round_ = blended(q, s, 0.1)
    away = np.linalg.norm(round_ - q, axis=1)
    assert away[100] == pytest.approx(0.1 * np.sqrt(2) / 4)
    assert away[np.abs(s - 1) > 0.1 + 1e-9].max() < 1e-12
    np.testing.assert_allclose(round_[[0, -1]], q[[0, -1]], atol=1e-12)


def wave(samples: int) -> tuple[np.ndarray, np.ndarray]:
    s = np.linspace(0, 1, samples)
    return np.stack([np.sin(3 * s), np.cos(5 * s), 0.3 * s], axis=1), s


def test_other_samples_of_the_same_path_give_the_same_law() -> None:
    limits = np.array([2.0, 3.0, 4.0]), np.array([4.0, 6.0, 5.0])
    coarse, fine = (time_path(*wave(m), *limits, cap=0.9, zone=0.02) for m in (101, 1001))
    assert fine.t[-1] == pytest.approx(coarse.t[-1], rel=2e-3)
    np.testing.assert_allclose(fine.t[::10], coarse.t, atol=3e-3)
    # a corner counts where it is, however densely it is sampled
    ends = [time_path(*corner(m), np.full(2, 9.0), np.full(2, 3.0), cap=1e3, zone=0.05).t[-1] for m in (20, 333)]
    assert ends[0] == pytest.approx(ends[1], rel=2e-3)


def test_backwards_takes_as_long() -> None:
    q, s = wave(300)
    limits = np.array([2.0, 3.0, 4.0]), np.array([4.0, 6.0, 5.0])
    there = time_path(q, s, *limits, cap=0.9, zone=0.02).t[-1]
    back = time_path(q[::-1], s, *limits, cap=0.9, zone=0.02).t[-1]
    assert there == pytest.approx(back, rel=1e-3)


@pytest.mark.parametrize("seed", range(6))
def test_random_polylines_keep_every_limit_by_an_independent_measure(seed: int) -> None:
    rng = np.random.default_rng(seed)
    knots = np.cumsum(rng.uniform(-1, 1, (9, 4)), axis=0)
    at = np.linspace(0, 8, 8 * 37 + 1)
    q = np.stack([np.interp(at, np.arange(9), column) for column in knots.T], axis=1)
    s = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(q, axis=0), axis=1))])
    v, a = rng.uniform(0.5, 2, 4), rng.uniform(0.5, 4, 4)
    law = time_path(q, s, v, a, cap=1.5, zone=0.05)
    dt = np.diff(law.t)[:, None]
    assert (np.abs(np.diff(q, axis=0)) / dt <= v * (1 + 1e-9)).all()
    assert (np.diff(s) / dt[:, 0] <= 1.5 * (1 + 1e-9)).all()
    # second differences of the rounded path are means of its accelerations
    speed = np.diff(blended(q, s, 0.05), axis=0) / dt
    mean = np.diff(speed, axis=0) / ((dt[1:] + dt[:-1]) / 2)
    share = np.abs(mean / a).max(axis=0)
    assert share.max() <= 1.01
    assert share.max() > 0.98  # and the law is no slower than it has to be


def test_a_cap_by_step_is_kept_and_reached() -> None:
    s = np.linspace(0, 4, 401)
    cap = np.where(s[:-1] < 2, 1.0, 0.25)
    law = time_path(s[:, None], s, np.array([9.0]), np.array([20.0]), cap=cap, zone=1e-3)
    held = np.diff(s) / np.diff(law.t)
    assert (held <= cap * (1 + 1e-9)).all()
    assert held[100] == pytest.approx(1.0)
    assert held[300] == pytest.approx(0.25)


def test_unknown_accelerations_leave_the_speeds() -> None:
    q = np.linspace(0, 3, 100)[:, None]
    assert time_travel(q, V, np.array([np.inf])).sum() == pytest.approx(1.5, rel=1e-3)


def test_a_travel_may_stand_still_but_a_bead_moves_on() -> None:
    q = np.array([[0.0], [0.0], [1.0], [1.0]])
    dt = time_travel(q, V, A)
    assert dt[0] == dt[2] == 0
    assert dt[1] == pytest.approx(trapezoid(1.0, 2.0, 5.0), rel=1e-4)
    assert (time_travel(q[:2], V, A) == 0).all()
    with pytest.raises(ValueError, match="moves on"):
        time_path(q, np.array([0.0, 0.0, 1.0, 2.0]), V, A, cap=1.0, zone=ZONE)


def test_how_far_a_speed_is_held_is_data() -> None:
    held_speed = HeldSpeed.unknown(4)
    held_speed.asked_s[:3], held_speed.taken_s[:3] = 1.0, [1.0, 4.0, 1.25]
    held_speed.axis[1], held_speed.by[1] = "A2", "acceleration"
    slow = too_slow(held_speed, 0.5)
    assert list(slow) == [2]
    assert slow[2].from_target == 1
    assert (slow[2].measure, slow[2].axis, slow[2].reason) == (0.25, "A2", "speed")
    document = speed_document(held_speed, np.zeros(4, dtype=np.int64))
    assert document["least_share"] == 0.25
    assert document["axis"] == "A2"
    assert document["slowed_s"] == 5.25
    assert document["lost_s"] == 3.25
    assert [row["from_target"] for row in document["slowed"]] == [1, 2]


class Targets(SimpleNamespace):
    def __len__(self) -> int:
        return 3


def test_targets_with_a_speed_of_their_own_win_over_the_cases() -> None:
    case = SimpleNamespace(process=SimpleNamespace(deposition_speed_mm_s=8.0))
    np.testing.assert_allclose(speeds(SimpleNamespace(targets=Targets(), case=case)), 8e-3)
    own = Targets(speed_mm_s=np.array([4.0, 5.0, 6.0]))
    np.testing.assert_allclose(speeds(SimpleNamespace(targets=own, case=case)), [4e-3, 5e-3, 6e-3])


def bent_path(rng):
    """Rows of a path with corners of all sizes, a sharp one among them, unevenly spaced; and its length at each."""
    step = np.exp(rng.uniform(-2, 1, int(rng.integers(4, 60)))) * 1e-3
    slope = np.cumsum(rng.normal(size=(len(step), 2)), axis=0) * rng.uniform(1, 20) + rng.normal(size=2) * 5
    slope[rng.integers(1, len(step)) :] += rng.normal(size=2) * 60
    s, q = np.cumsum(step), np.cumsum(slope * step[:, None], axis=0)
    return np.concatenate([np.zeros((1, 2)), q]), np.concatenate([[0.0], s])


def mirrored_slopes(q, s, zone):
    """Of a path mirrored at its ends: path lengths, the slope of its moving average at places, and its own slopes."""
    at = np.concatenate([-s[:0:-1], s, 2 * s[-1] - s[-2::-1]])
    far = np.concatenate([2 * q[0] - q[:0:-1], q, 2 * q[-1] - q[-2::-1]])

    def slope(u):
        return np.stack([np.interp(u + zone, at, f) - np.interp(u - zone, at, f) for f in far.T], axis=1) / (2 * zone)

    return at, slope, np.diff(far, axis=0) / np.diff(at)[:, None]


def squares(law, slope, fastest):
    """Squares of the path's speed on a law's grid, from the shares of the joints' speeds."""
    here = np.abs(slope(law.grid))
    joint = here.argmax(axis=1)
    k = np.arange(len(joint))
    return (law.use[k, 0, joint] * fastest[joint] / here[k, joint]) ** 2


@pytest.mark.parametrize("great", [1.0, 300.0, np.inf])
@pytest.mark.parametrize("seed", range(8))
def test_no_joint_is_faster_than_it_may_be_anywhere_between_the_points_of_the_grid(seed, great):
    rng = np.random.default_rng(seed)
    (q, s), most = bent_path(rng), rng.uniform(1, 5, 2) * great
    fastest, zone = rng.uniform(0.3, 3.0, 2), min(float(rng.choice([5e-4, 1e-3, 2e-3])), s[-1] / 2)
    law = time_path(q, s, fastest, most, cap=rng.uniform(0.01, 0.3, len(s) - 1), zone=zone)
    at, slope, _ = mirrored_slopes(q, s, zone)
    between = law.grid[:-1, None] + np.diff(law.grid)[:, None] * np.linspace(0, 1, 12)
    u = np.concatenate([between.ravel(), *(at + way for way in (-zone, zone))])  # where slopes begin to change, too
    u = u[(u >= 0) & (u <= s[-1])]
    speed = np.sqrt(np.interp(u, law.grid, squares(law, slope, fastest)))[:, None] * np.abs(slope(u))
    assert (speed <= fastest * 1.001).all()
    assert great == 1.0 or (speed >= fastest * 0.98).any()  # and the law is no slower than it has to be


@pytest.mark.parametrize("seed", range(30))
def test_no_piece_of_the_rounded_path_asks_for_more_than_the_accelerations(seed):
    """Between corners +- zone, those of the path mirrored at its ends too, the second derivative is constant."""
    rng = np.random.default_rng(seed)
    (q, s), most = bent_path(rng), rng.uniform(1, 5, 2)
    fastest, zone = np.full(2, 3.0), min(float(rng.choice([5e-4, 1e-3, 2e-3])), s[-1] / 2)
    law = time_path(q, s, fastest, most, cap=0.02, zone=zone)
    at, slope, raw = mirrored_slopes(q, s, zone)
    square = squares(law, slope, fastest)
    ends = np.unique(np.concatenate([at - zone, at + zone, law.grid]))
    ends = ends[(ends >= 0) & (ends <= s[-1])]
    low, high = ends[:-1], ends[1:]
    pieces = high - low > 1e-9 * s[-1]
    low, high = low[pieces], high[pieces]
    middle = (low + high) / 2
    bend = (raw[np.searchsorted(at, middle + zone) - 1] - raw[np.searchsorted(at, middle - zone) - 1]) / (2 * zone)
    step = np.searchsorted(law.grid, middle) - 1
    along = (np.diff(square) / (2 * np.diff(law.grid)))[step, None]
    for u in (low, high):
        needed = np.abs(slope(u) * along + bend * np.interp(u, law.grid, square)[:, None])
        assert (needed <= most * 1.01).all()


@pytest.mark.slow
def test_paths_timed_together_take_as_long_as_each_by_itself():
    rng = np.random.default_rng(41)
    fastest, most = np.array([3.0, 2.0]), np.array([4.0, 1.5])
    paths, travels = [], []
    for _ in range(30):
        q, s = bent_path(rng)
        zone = float(rng.choice([1e-5, 1e-3, 2e-3, 0.0]))
        paths.append(PathRows(q, s + rng.normal(), rng.uniform(0.005, 0.05, len(s) - 1), zone))
        cap = np.where(rng.random(len(s) - 1) < 0.5, np.inf, rng.uniform(0.1, 2.0, len(s) - 1))
        travels.append(TravelRows(np.repeat(q, rng.integers(1, 3, len(q)), axis=0)[: len(q)] * 20, cap))
    laws = time_paths(paths, fastest, most)
    assert sum(len(law.grid) for law in laws) > 2 * TOGETHER  # in a few blocks
    for one, law in zip(paths, laws, strict=True):
        alone = time_path(one.q, one.s, fastest, most, cap=one.cap, zone=one.zone)
        for name in ("t", "speed", "grid", "use"):
            np.testing.assert_array_equal(getattr(law, name), getattr(alone, name))
    for one, dt in zip(travels, time_travels(travels, fastest, most), strict=True):
        np.testing.assert_array_equal(dt, time_travel(one.q, fastest, most, cap=one.cap))
    assert time_travels([], fastest, most) == []
