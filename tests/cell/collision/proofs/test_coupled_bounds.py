"""The bound on steps of all eight axes: no point of the arm comes nearer to the cell or to the table than it says."""

from __future__ import annotations

import numpy as np
import pytest
from support.cells.skew_tables import skew_job

from cell.collision.proofs.motion_bounds import CoupledBounds, joint_travel_bound
from cell.collision.proofs.reach_radii import all_radii, table_radii
from cell.job.job import Job
from cell.rigid import inverse
from cell.scene.table_kinematics import TableKinematics
from ik import dls
from ik.roll import RollWindow


@pytest.fixture(scope="module")
def job(tmp_path_factory: pytest.TempPathFactory) -> Job:
    return skew_job(tmp_path_factory.mktemp("skew"))


def approach(job: Job, a: np.ndarray, b: np.ndarray) -> float:
    """The most by which any two points come nearer to one another on a step than they are at its ends, both added up.

    Points of the arm against points of the cell, of the tilting part and of the table. Tried out are points of the
    table in all directions as far from its axes as it reaches, and those that the arm's own points meet half-way.
    """
    n, chain = job.scene.chain.n, job.scene.chain
    table = TableKinematics.of(job.scene)
    t = np.linspace(0, 1, 41)[:, None]
    q = a + t * (b - a)
    R, p = chain.frames(q[:, :n])
    Ts = chain.forward(q[:, :n])
    points = np.concatenate([p[:, 2:], (p[:, 3:] + 0.05 * R[:, 3:, :, 0]), Ts[:, None, :3, 3]], axis=1)
    rng = np.random.default_rng(7)
    far = rng.normal(size=(40, 3))
    far *= table_radii(job.scene)[1] / np.linalg.norm(far, axis=1)[:, None]
    on_table = table.anchor[1] + far
    at_zero = inverse(table.poses(np.zeros((1, 2))))[0]
    others = [np.repeat((points[20] + rng.normal(size=points[20].shape) * 0.1)[None], len(q), axis=0)]
    for carried in ([1.0, 0.0], [1.0, 1.0]):
        motion = table.poses(q[:, n:] * np.array(carried)) @ at_zero
        met = (points[20] - motion[20, :3, 3]) @ motion[20, :3, :3]
        for there in (on_table, met):
            others.append(there @ np.swapaxes(motion[:, :3, :3], 1, 2) + motion[:, None, :3, 3])
    most = 0.0
    for other in others:
        apart = np.linalg.norm(points[:, :, None] - other[:, None], axis=3)
        most = max(most, float((apart[:1] + apart[-1:] - 2 * apart).max()))
    return most


def test_no_point_gets_further_than_the_bound(job: Job) -> None:
    rng, radius, n = np.random.default_rng(0), all_radii(job.scene), job.scene.chain.n
    radius[n:] = 4.0  # the points that the arm meets count as points of the table, wherever they are
    bounds = CoupledBounds(job.scene, radius)
    middle = np.concatenate([(job.scene.chain.lower + job.scene.chain.upper) / 2, [0.2, 0.3]])
    for size in (0.002, 0.02, 0.2):
        a = middle + rng.uniform(-0.8, 0.8, (60, n + 2))
        b = a + rng.uniform(-size, size, a.shape)
        found = bounds.bound(a, b)
        assert (found <= joint_travel_bound(radius, a, b) + 1e-12).all()
        true = np.array([approach(job, *each) for each in zip(a, b, strict=True)])
        assert (true <= found + 1e-12).all()


def test_a_torch_that_stays_on_the_part_is_bounded_by_its_way_there(job: Job) -> None:
    """Along a bead the arm makes good what the table turns; the joints' arcs alone say many times as much."""
    radius, n, chain = all_radii(job.scene), job.scene.chain.n, job.scene.chain
    bounds, table = CoupledBounds(job.scene, radius), TableKinematics.of(job.scene)
    q = (chain.lower + chain.upper) / 2
    q[4] = np.deg2rad(60.0)
    a = np.concatenate([q, [0.1, 0.2]])[None]
    turned = a[:, n:] + np.deg2rad([0.5, 0.5])
    T = table.poses(turned) @ inverse(table.poses(a[:, n:])) @ chain.forward(a[:, :n])
    found = dls.track_one(chain, T, a[:, :n], RollWindow.fixed(0.0))
    assert found.ok.all()
    b = np.concatenate([found.q, turned], axis=1)
    still = bounds.bound(a, b)[0]
    assert still < 0.7 * joint_travel_bound(radius, a, b)[0]
    assert approach(job, a[0], b[0]) <= still
