"""Configurations in which the real arm's surface is inside torch or table: the model must see every one of them.

Found by ``python -m bench.soundness.collision`` on the vendor's meshes: link, shape, depth (mm), A1 .. A6, E1, E2
(deg).
"""

import mujoco
import numpy as np
import pytest

from cell.case.read import load_case
from cell.collision.checker import Checker
from cell.job.job import prepare
from cell.shipped import MODELS_DIR

HITS = [
    ("link_4", "turn_unit", 42.7, [3.8, -47.6, 105.0, -132.6, -50.4, 205.4, -86.9, -123.9]),
    ("link_5", "turn_unit", 44.9, [1.7, -30.9, 87.2, 104.4, -124.9, -84.8, -112.9, 24.0]),
    ("link_4", "faceplate", 12.5, [-9.6, -10.7, 75.6, 125.7, 107.4, -81.5, 75.7, 63.1]),
    ("link_6", "faceplate", 12.5, [-168.9, -141.9, -77.1, 59.4, 61.1, 85.7, 6.4, -13.8]),
    ("link_5", "faceplate", 12.4, [-173.2, -173.4, -41.1, -71.3, 110.4, -0.6, -98.1, 57.4]),
    ("link_4", "tilt_arm", 49.9, [0.0, -15.8, 55.1, -120.8, -56.5, 145.0, -108.6, -137.2]),
    ("link_5", "tilt_arm", 49.9, [1.6, 36.2, -50.4, 10.0, -99.0, -173.4, -20.0, -96.6]),
    ("link_5", "pedestal_bearing", 61.2, [-0.3, -13.6, 35.7, -164.0, -106.5, 182.4, 92.7, 121.6]),
    ("link_1", "torch_mount_block", 19.3, [151.3, 51.4, 162.3, -47.7, -111.4, -56.0, -81.5, -156.2]),
    ("link_1", "torch_body", 39.3, [91.0, -14.0, 164.1, -172.0, -104.5, 219.5, 117.4, -47.6]),
    ("link_1", "torch_barrel", 15.9, [122.2, -46.1, 154.3, -28.1, 86.2, -191.6, 46.1, -76.9]),
]


@pytest.fixture(scope="module")
def scene():
    return prepare(load_case(MODELS_DIR / "cases" / "propeller.case.yaml")).scene


@pytest.mark.parametrize(("link", "shape", "depth_mm", "angles"), HITS, ids=[f"{h[0]} {h[1]}" for h in HITS])
def test_a_true_hit_is_seen(link, shape, depth_mm, angles, scene):
    q = np.deg2rad(angles)
    found = Checker(scene, (q[6], q[7]), 0.005).clearances(q[None, :6], np.array([0]))
    assert found.distance[0] < 0
    # and by that link on that side, not by luck elsewhere
    data = mujoco.MjData(scene.model)
    data.qpos[:] = q
    mujoco.mj_kinematics(scene.model, data)
    side = [g for g in range(scene.model.ngeom) if scene.contact_bits[:, g].any()]
    own = [g for g in side if scene.model.body(scene.model.geom_bodyid[g]).name == link]
    torch = shape.startswith("torch_")
    other = [g for g in side if scene.geom_name(g).startswith("torch_") == torch and (torch or not scene.arm_geom[g])]
    gap = min(mujoco.mj_geomDistance(scene.model, data, a, b, 0.1, np.zeros(6)) for a in own for b in other)
    assert gap < 0
