"""Where the table is along a bead: inside the cone and the ranges, at rest where it can be, slow where it must move."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.cells.lathes import lathe_job
from support.jobs.boss_motion import boss_case, job_of

from cell.coordination.table_schedule import Schedule
from cell.job.job import Job
from cell.scene.table_freedom import NAMES, TableFreedom

CONE = np.deg2rad(10.0)
SPEED = np.deg2rad([100.0, 150.0])


@pytest.fixture(scope="module")
def job(tmp_path_factory: pytest.TempPathFactory) -> Job:
    return job_of(boss_case(tmp_path_factory.mktemp("boss")))


def schedule(job: Job, cone: float = CONE) -> Schedule:
    return Schedule(TableFreedom.of(job.scene, NAMES, (0.0, 0.0)), cone, SPEED)


def tilted(tilt_deg: np.ndarray, turn_deg: np.ndarray) -> np.ndarray:
    tilt, turn = np.deg2rad(tilt_deg), np.deg2rad(turn_deg)
    return np.stack([np.sin(tilt) * np.cos(turn), np.sin(tilt) * np.sin(turn), np.cos(tilt)], axis=1)


def along(job: Job, normals: np.ndarray, **more: object) -> tuple[np.ndarray, np.ndarray]:
    n = len(normals)
    way = schedule(job).along(normals, np.zeros(n, dtype=np.int64), np.full(n - 1, 2e-3), **more)
    return way.tables, way.off


def test_directions_that_fit_into_one_cone_leave_the_table_at_rest(job: Job) -> None:
    angle = np.linspace(0, 2 * np.pi, 60)
    tables, off = along(job, tilted(40 + 6 * np.cos(angle), 30 + 6 * np.sin(angle)))
    assert off.max() <= CONE
    assert np.abs(np.diff(tables, axis=0)).sum() < np.deg2rad(2.0)


def test_what_does_not_fit_turns_no_further_than_it_must(job: Job) -> None:
    # to and fro across 60 degrees about the turning axis: 10 degrees at either end are the cone's
    turn = 30 * np.sin(np.linspace(0, 4 * np.pi, 120))
    tables, off = along(job, tilted(np.full(120, 90.0), turn))
    assert off.max() <= CONE
    swing = np.rad2deg(np.ptp(tables[:, 1]))
    assert 40 - 1e-6 <= swing <= 43
    # exactly upright it would be 60
    assert np.rad2deg(np.ptp(schedule(job).freedom.exact(tilted(np.full(120, 90.0), turn))[0, :, 1])) > 59


def test_straight_across_the_turning_axis_the_table_does_not_spin(job: Job) -> None:
    tilt = np.linspace(-40, 40, 81)
    tables, off = along(job, tilted(np.abs(tilt), np.where(tilt < 0, 200.0, 20.0)))
    assert off.max() <= CONE
    assert np.rad2deg(np.ptp(tables[:, 1])) < 5
    assert np.rad2deg(np.ptp(tables[:, 0])) > 55


def test_close_past_the_turning_axis_the_spin_is_slowed(job: Job) -> None:
    x = np.linspace(-0.6, 0.6, 121)
    v = np.stack([x, np.full(121, 0.03), np.ones(121)], axis=1)
    v /= np.linalg.norm(v, axis=1)[:, None]
    tables, off = along(job, v)
    assert off.max() <= CONE
    exact = schedule(job).freedom.exact(v)[0]
    race = np.abs(np.diff(np.unwrap(exact[:, 1]))).max()
    assert np.abs(np.diff(tables[:, 1])).max() < 0.3 * race


def test_ranges_hold_and_what_cannot_be_kept_is_told(job: Job) -> None:
    # right round takes 360 degrees: E2 has 320 and the cone at both ends
    v = tilted(np.full(73, 90.0), np.arange(73) * 5.0)
    tables, off = along(job, v)
    free = schedule(job).freedom
    assert (tables >= free.low - 1e-12).all()
    assert (tables <= free.high + 1e-12).all()
    assert off.max() > CONE


def furthest_off(job: Job, normals: np.ndarray, tables: np.ndarray) -> float:
    """Greatest angle from up at targets and between them, closely sampled, rad."""
    k = schedule(job).freedom.kinematics
    worst = 0.0
    for i in range(len(normals) - 1):
        angle = np.arccos(normals[i] @ normals[i + 1])
        for t in np.linspace(0, 1, 41):
            v = (np.sin((1 - t) * angle) * normals[i] + np.sin(t * angle) * normals[i + 1]) / np.sin(angle)
            worst = max(worst, k.off((tables[i] + t * (tables[i + 1] - tables[i]))[None], v[None])[0])
    return worst


def test_what_lies_between_targets_is_inside_the_cone(job: Job) -> None:
    """Two directions far apart: the great circle between them leaves a cone that both ends are in."""
    normals = tilted(np.full(6, 50.0), np.arange(6) * 25.0)
    tables, off = along(job, normals)
    worst = furthest_off(job, normals, tables)
    assert worst <= CONE
    assert worst == pytest.approx(off.max(), abs=np.deg2rad(0.1))


def test_what_leaves_the_cone_between_targets_alone_is_told(job: Job) -> None:
    """A table that turns instead of tilting to the other side is upright at both ends and nowhere between."""
    normals = tilted(np.full(2, 50.0), np.array([0.0, 170.0]))
    one = schedule(job)
    exact = one.freedom.exact(normals)  # both solutions: E1 to one side, and to the other
    tables = next(some for some in exact if some[0, 0] * some[1, 0] > 0)
    worst = furthest_off(job, normals, tables)
    assert worst > 2 * CONE
    off = one._off(normals, np.zeros(2, dtype=np.int64), tables)
    assert off.max() == pytest.approx(worst, abs=np.deg2rad(1.0))


def test_aims_lean_the_way(job: Job) -> None:
    v = tilted(np.full(40, 80.0), np.linspace(0, 90, 40))
    up = schedule(job).freedom.kinematics.up
    aim = up + np.sin(np.deg2rad(5)) * np.array([1.0, 0, 0])
    aim /= np.linalg.norm(aim)
    tables, off = along(job, v, aim=aim)
    assert off.max() <= CONE
    straight, _ = along(job, v)
    assert np.abs(tables - straight).max() > np.deg2rad(1)


@pytest.mark.parametrize("turn", ["", 'range="-345 345"'])
def test_one_axis_takes_a_ring_round_in_one_way(turn: str, tmp_path: Path) -> None:
    """Level, as a rotator's: angles do not jump where half a turn is reached, and stay where the axis has them."""
    scene = lathe_job(tmp_path, turn).scene
    freedom = TableFreedom.of(scene, ("E1",), (0.0, 0.0))
    around = np.linspace(50.0, 410.0, 61)
    way = Schedule(freedom, CONE, SPEED).along(
        tilted(np.full(61, 90.0), around), np.zeros(61, dtype=np.int64), np.full(60, 2e-3)
    )
    assert way.off.max() <= CONE
    step = np.rad2deg(np.diff(way.tables[:, 0]))
    assert 0 < np.abs(step).max() < 9
    assert len(set(np.sign(step[np.abs(step) > 1e-6]))) == 1
    assert np.abs(way.tables[:, 0]).max() <= np.deg2rad(345) or not turn
    assert not way.tables[:, 1].any()


def with_ranges(job: Job, E1_deg: tuple[float, float], E2_deg: tuple[float, float], cone: float = CONE) -> Schedule:
    """A table of the same axes with other ranges."""
    whole = schedule(job, cone)
    low, high = np.deg2rad([E1_deg, E2_deg]).T
    return replace(whole, freedom=replace(whole.freedom, low=low, high=high))


@pytest.mark.parametrize("side", [0, 1])
@pytest.mark.parametrize("E2_deg", [(-1100.0, -330.0), (1500.0, 2260.0)])
def test_a_table_whose_ranges_are_on_one_side_of_0_uses_the_solution_that_it_has(
    job: Job, side: int, E2_deg: tuple[float, float]
) -> None:
    """Of the two solutions, tilted to either side, this table has one; and E2 several turns away from 0."""
    own = with_ranges(job, (30.0, 160.0), E2_deg)
    ring = tilted(np.full(60, 90.0), np.linspace(0.0, 340.0, 60))
    way = own.along(ring, np.zeros(60, dtype=np.int64), np.full(59, 2e-3), side=side)
    assert way.off.max() <= CONE
    assert (way.tables >= own.freedom.low - 1e-9).all()
    assert (way.tables <= own.freedom.high + 1e-9).all()


@pytest.mark.parametrize("E1_deg", [(100.0, 260.0), (-90.0, 360.0), (-np.inf, np.inf)])
def test_a_tilt_goes_on_beyond_half_a_turn(job: Job, E1_deg: tuple[float, float]) -> None:
    tilt = np.linspace(150.0, 210.0, 61)  # over the place opposite of the turning axis
    own = with_ranges(job, E1_deg, (-185.0, 135.0), np.deg2rad(2.0))
    normals = tilted(tilt, np.full(61, 20.0))
    for side in (0, 1):
        way = own.along(normals, np.zeros(61, dtype=np.int64), np.full(60, 2e-3), side=side)
        if way.off.max() <= own.upright:
            break
    assert way.off.max() <= own.upright
    assert np.ptp(way.tables[:, 0]) < np.deg2rad(65.0)


def test_an_endless_turn_goes_on_from_bead_to_bead(job: Job) -> None:
    """A ring on a ring: nothing is turned back between them, however often the table has turned."""
    own = with_ranges(job, (-135.0, 135.0), (-np.inf, np.inf))
    rings, count = 8, 40
    normals = np.concatenate([tilted(np.full(count, 90.0), np.linspace(0.0, 360.0, count))] * rings)
    bead = np.repeat(np.arange(rings), count)
    way = own.along(normals, bead, np.full(rings * count - 1, 2e-3))
    assert way.off.max() <= CONE
    assert np.abs(np.diff(way.tables[:, 1])).max() < np.deg2rad(25.0)
