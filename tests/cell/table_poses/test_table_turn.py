"""The table's way from one pose to another: free of everything, or refused with what is in the way."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import Any

import mujoco
import numpy as np
import pytest
from support.jobs.indexed import three_bosses, with_table

from cell.case.read import load_case
from cell.collision.checker import Checker
from cell.failure import Failure
from cell.job.job import Job, prepare
from cell.planning.configurations import nodes_at_rolls
from cell.scene.placement import place_targets
from cell.table_poses.table_turn import STILL_S, TableTurn, TurnSearch, nearest_turn, turn_time


@pytest.fixture(scope="module")
def job(tmp_path_factory: pytest.TempPathFactory) -> Job:
    return prepare(load_case(three_bosses(tmp_path_factory.mktemp("three"))))


def deg(*angles: float) -> tuple[float, float]:
    a, b = np.deg2rad(angles).tolist()
    return a, b


def box(size: tuple[float, float, float], at: tuple[float, float, float]) -> list[dict[str, Any]]:
    return [{"name": "post", "box": {"size_mm": list(size)}, "position_mm": list(at)}]


def fenced(job: Job, fixtures: list[dict[str, Any]]) -> Job:
    return prepare(with_table(job.case, {"mode": "indexed"}, fixtures=fixtures))


def part_at(job: Job, table: tuple[float, float]) -> np.ndarray:
    """Where the middle of the part is, world, mm."""
    T = job.scene.T_world_base() @ job.scene.T_base_part(*table)
    return (T[:3, :3] @ [0.0, 0.0, 0.04] + T[:3, 3]) * 1e3


def touches(job: Job, rows: np.ndarray, q: np.ndarray) -> bool:
    """Whether plain MuJoCo finds a contact of anything on the way, in steps of 0.1 degrees."""
    scene = job.scene
    model = scene.model
    data = mujoco.MjData(model)
    for a, b in pairwise(rows):
        for f in np.linspace(0, 1, max(int(np.ceil(np.rad2deg(np.abs(b - a).max()) / 0.1)), 1) + 1):
            data.qpos[scene.arm_qpos], data.qpos[scene.table_qpos] = q, a + f * (b - a)
            mujoco.mj_kinematics(model, data)
            mujoco.mj_collision(model, data)
            if data.ncon and (data.contact.dist < 0).any():
                return True
    return False


def test_a_straight_turn_moves_both_axes_at_once(job: Job) -> None:
    a, b = deg(-90, 0), deg(-60, 90)
    turn = TurnSearch(job).search(job.scene.home, a, b, 0)
    assert isinstance(turn, TableTurn)
    assert np.allclose(turn.rows[[0, -1]], [a, b])
    share = (turn.rows - a) / np.subtract(b, a)
    assert np.allclose(share[:, 0], share[:, 1])
    assert turn.dt_s.sum() == pytest.approx(turn_time(job, a, b))
    # E2 alone: 150 deg/s and 300 deg/s2 from rest to rest over 90 deg, half of it to speed up and half to slow down
    alone = 2 * np.sqrt(90 / 300) if 90 < 150**2 / 300 else 90 / 150 + 150 / 300
    assert alone * 0.99 < turn.dt_s.sum() < alone * 1.1


def test_the_part_is_not_swept_through_a_fixture(job: Job) -> None:
    a, b = deg(-60, 0), deg(60, 0)
    middle = part_at(job, (0.0, 0.0))
    # a post over the table, where the part passes upright on every way from one side to the other
    walled = fenced(job, box((60, 60, 60), (middle[0], middle[1], middle[2] + 60)))
    search = TurnSearch(walled)
    home = walled.scene.home
    assert not touches(walled, np.array([a]).repeat(2, 0), home)
    assert not touches(walled, np.array([b]).repeat(2, 0), home)
    why = search.search(home, a, b, 0)
    assert isinstance(why, Failure)
    assert "post" in why.pair
    assert touches(walled, np.array([a, b]), home)
    assert isinstance(TurnSearch(job).search(home, a, b, 0), TableTurn)


def bladed(job: Job, middle: tuple[float, float]) -> tuple[Job, Job]:
    """A thin blade on the table, alone, and with a peg where the blade passes at a pose."""
    blade = {"name": "blade", "box": {"size_mm": [1, 1, 40]}, "position_mm": [120, 0, 260], "on": "table"}
    alone = fenced(job, [blade])
    model, data = alone.scene.model, mujoco.MjData(alone.scene.model)
    data.qpos[alone.scene.table_qpos] = middle
    mujoco.mj_kinematics(model, data)
    geom = next(g for g in range(model.ngeom) if "blade" in model.body(model.geom_bodyid[g]).name)
    peg = {"name": "peg", "box": {"size_mm": [1, 1, 1]}, "position_mm": (data.geom_xpos[geom] * 1e3).tolist()}
    return alone, fenced(job, [blade, peg])


def test_what_meets_between_two_samples_is_seen(job: Job) -> None:
    a, b = deg(-30, 0), deg(-29, 0)  # one step of the samples, on which the blade moves some millimetres
    alone, pegged = bladed(job, deg(-29.5, 0))
    home = job.scene.home
    assert isinstance(TurnSearch(alone).search(home, a, b, 0), TableTurn)
    for end in (a, b):
        assert not touches(pegged, np.array([end, end]), home)
    why = TurnSearch(pegged).search(home, a, b, 0)
    assert isinstance(why, Failure)
    assert set(why.pair) == {"blade", "peg"}


def test_another_way_is_taken_where_the_straight_one_is_not_free(job: Job) -> None:
    a, b = deg(-90, 0), deg(0, 90)
    alone, pegged = bladed(job, deg(-45, 45))
    home = job.scene.home
    straight = TurnSearch(alone).search(home, a, b, 0)
    assert isinstance(straight, TableTurn)
    assert touches(pegged, straight.rows, home)
    found = TurnSearch(pegged).search(home, a, b, 0)
    assert isinstance(found, TableTurn)
    assert not touches(pegged, found.rows, home)
    # one axis after the other, and it stands in the corner between
    assert (np.abs(np.diff(found.rows, axis=0)) > 0).sum(axis=1).max() == 1
    still = np.flatnonzero(~np.diff(found.rows, axis=0).any(axis=1))
    assert len(still) == 1
    assert found.dt_s[still[0]] == STILL_S


def test_an_arm_that_stands_in_the_way_is_kept_clear_of(job: Job) -> None:
    scene, a = job.scene, deg(-90, 0)
    placed = place_targets(job.targets, scene.T_base_part(*a))
    upright = int(np.argmax(placed.normal[:, 2]))
    nodes = nodes_at_rolls(job.solver, placed.rows([upright]), job.window, 0.3, job.singularity_limits)
    q = nodes.q[0][np.isfinite(nodes.cost[0])]
    laid = int(job.deposits_before[upright])
    clear = Checker(scene, a, 0.05).clearances(q, np.full(len(q), laid))
    welding = q[int(np.argmax(clear.distance))]
    search = TurnSearch(job)
    # the wire touches what it welds, which is no place to let the table go from
    touching = search.search(welding, a, a, laid)
    assert isinstance(touching, Failure)
    assert set(touching.pair) & set(job.case.tool.wire)
    assert touching.limit == 0
    # the torch stands over a boss, and the table turns the post away under it
    why = search.search(welding, a, deg(-30, 0), laid)
    assert isinstance(why, Failure)
    assert why.measure is not None
    assert why.limit == job.case.checks.clearance_mm
    assert why.measure < why.limit
    assert any(scene.arm_geom[scene.model.geom(name).id] for name in why.pair)


def test_whole_turns_are_added_within_the_range_alone(job: Job) -> None:
    scene = job.scene  # E2 from -185 to 135 deg
    assert np.allclose(np.rad2deg(nearest_turn(scene, deg(0, 130), deg(0, -180))), (0, 130))
    assert np.allclose(np.rad2deg(nearest_turn(scene, deg(0, 178), deg(0, -170))), (0, -182))
    endless = replace(scene, table_range=np.array([[-np.inf, np.inf], [-np.inf, np.inf]]))
    assert np.allclose(np.rad2deg(nearest_turn(endless, deg(0, 10), deg(0, 350))), (0, 370))
    assert np.allclose(np.rad2deg(nearest_turn(endless, deg(-170, 10), deg(170, -700))), (190, -710))
    fixed = replace(endless, has_axis=np.array([True, False]), table_range=np.array([[-1.0, 1.0], [0.0, 0.0]]))
    assert np.allclose(nearest_turn(fixed, (0.5, 0.0), (-0.5, 0.0)), (0.5, 0.0))
