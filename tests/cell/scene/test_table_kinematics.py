"""A table in closed form: MuJoCo's kinematics, whatever its axes, and what brings a direction upright."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
from support.cells.skew_tables import skew_job

from cell.job.job import Job
from cell.scene.table_freedom import NAMES, TableFreedom
from cell.scene.table_kinematics import TableKinematics


@pytest.fixture(scope="module")
def job(tmp_path_factory: pytest.TempPathFactory) -> Job:
    return skew_job(tmp_path_factory.mktemp("skew"))


def directions(count: int, seed: int = 0) -> np.ndarray:
    v = np.random.default_rng(seed).normal(size=(count, 3))
    return v / np.linalg.norm(v, axis=1)[:, None]


def up_of_part(job: Job, table: np.ndarray, v: np.ndarray) -> float:
    """Angle of a direction of the part off the world's z, by MuJoCo alone, rad."""
    data = mujoco.MjData(job.scene.model)
    data.qpos[job.scene.table_qpos] = table
    mujoco.mj_kinematics(job.scene.model, data)
    R = data.site_xmat[job.scene.sites["part"]].reshape(3, 3)
    return float(np.arccos(np.clip((R @ v)[2], -1, 1)))


def test_poses_are_mujocos(job: Job) -> None:
    tables = np.random.default_rng(1).uniform(-2.0, 2.0, (20, 2))
    expected = np.array([job.scene.T_base_part(*row) for row in tables])
    assert TableKinematics.of(job.scene).poses(tables) == pytest.approx(expected, abs=1e-12)


def test_directions_pull_and_off_are_mujocos(job: Job) -> None:
    table, v = TableKinematics.of(job.scene), directions(15)
    tables = np.random.default_rng(2).uniform(-2.0, 2.0, (15, 2))
    assert table.off(tables, v) == pytest.approx([up_of_part(job, *each) for each in zip(tables, v, strict=True)])
    for axis in range(2):
        step = np.eye(2)[axis] * 1e-6
        slope = (table.directions(tables + step, v) - table.directions(tables - step, v)) / 2e-6
        assert table.pull(tables, v)[:, axis] == pytest.approx(slope, abs=1e-8)


def test_both_solutions_are_upright_where_the_axes_can(job: Job) -> None:
    table, v = TableKinematics.of(job.scene), directions(200, 3)
    one, other = table.upright(v)
    grid = np.deg2rad(np.arange(-180, 180, 2.0))
    E1, E2 = (x.ravel() for x in np.meshgrid(grid, grid))
    for k in range(200):
        least = table.off(np.stack([E1, E2], axis=1), np.tile(v[k], (len(E1), 1))).min() if k < 12 else 0.0
        off = [table.off(s[k : k + 1], v[k : k + 1])[0] for s in (one, other)]
        if k < 12:  # no table pose of a fine grid is nearer than a grid's step
            assert off[0] <= least + 1e-9
        exact = min(off) < 1e-9
        assert max(off) < 1e-7 or not exact
    # nearly square axes bring nearly everything upright
    assert (table.off(one, v) < 1e-9).mean() > 0.8
    lean = np.array([0.1, 0.0, np.sqrt(0.99)])
    assert table.off(table.upright(v, lean)[0], v, lean)[table.off(one, v) < 1e-9].min() < 1e-9


def test_one_axis_turns_as_near_as_it_can(job: Job) -> None:
    table, v = TableKinematics.of(job.scene), directions(20, 4)
    grid = np.deg2rad(np.arange(-180, 180, 0.5))
    for axis in range(2):
        angle = table.nearest(v, np.full(20, 0.3), axis)
        tables = np.full((20, 2), 0.3)
        tables[:, axis] = angle
        every = np.full((len(grid), 2), 0.3)
        every[:, axis] = grid
        for k in range(20):
            least = table.off(every, np.tile(v[k], (len(grid), 1))).min()
            assert table.off(tables, v)[k] <= least + 1e-9
            assert table.off(tables, v)[k] >= least - np.deg2rad(0.5)


def test_the_least_angle_off_up_is_that_of_a_search_over_all_angles(job: Job) -> None:
    v = np.concatenate([directions(25, 5), [[0, 0, -1.0], [0, 0, 1.0], [0.05, 0, -1.0]]])
    v /= np.linalg.norm(v, axis=1)[:, None]
    for axes in (NAMES, ("E1",), ("E2",)):
        free = TableFreedom.of(job.scene, axes, (0.4, -0.2))
        found = free.least_off(v)
        grid = [np.linspace(free.low[k], free.high[k], 200 if free.moves[k] else 1) for k in range(2)]
        E = np.stack(np.meshgrid(*grid, indexing="ij"), axis=-1).reshape(-1, 2)
        least = np.array([free.kinematics.off(E, np.tile(x, (len(E), 1))).min() for x in v])
        assert (found <= least + 1e-9).all()
        assert (found >= least - np.deg2rad(2.0)).all()


def test_how_far_E2_may_turn_is_that_of_a_search(job: Job) -> None:
    free, v = TableFreedom.of(job.scene, NAMES, (0.0, 0.0)), directions(30, 6)
    exact = free.exact(v)[0]
    inside = (exact[:, 0] > np.deg2rad(-95)) & (exact[:, 0] < np.deg2rad(95)) & (free.kinematics.off(exact, v) < 1e-9)
    v, exact = v[inside], exact[inside]
    cone = np.deg2rad(10.0)
    width = free.turns(v, exact, cone)
    assert len(v) > 5
    for k in range(len(v)):
        for side, end in ((-1, width[k, 0]), (1, width[k, 1])):
            near = free.off_at_turn(v[k : k + 1], exact[k : k + 1, 1] + side * (end - 1e-4), exact[k : k + 1, 0])
            assert near[0] <= cone + 1e-6
            if end < np.pi / 2:
                beyond = free.off_at_turn(v[k : k + 1], exact[k : k + 1, 1] + side * (end + 1e-3), exact[k : k + 1, 0])
                assert beyond[0] > cone
