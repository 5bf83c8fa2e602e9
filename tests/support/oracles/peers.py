"""Targets found by another library."""

from __future__ import annotations

import numpy as np
import pytest

from ik.chain import Floats
from ik.reachability_proof import certify
from ik.roll import RollWindow
from ik.singularity import SingularityLimits
from ik.spherical_wrist import recognise

from ..cells.arms import OPW, kr70, welder

FREE, ANY = RollWindow.free(), SingularityLimits(0.0, 0.0, 0.0)


T_FLANGE_TCP = np.linalg.inv(kr70().T_last_tcp) @ welder().T_last_tcp


opw = pytest.importorskip("py_opw_kinematics")


def found_by_opw(Ts: Floats) -> np.ndarray:
    """Which TCP poses, (m, 4, 4), have a configuration inside the limits by py-opw-kinematics, (m,)."""
    from scipy.spatial.transform import RigidTransform

    robot = opw.Robot(opw.KinematicModel(**OPW), degrees=True)
    low, high = np.rad2deg([kr70().lower, kr70().upper])
    # the tool is folded in here: its own ee_transform turns first and shifts then
    q = np.asarray(robot.reach(RigidTransform.from_matrix(Ts @ np.linalg.inv(T_FLANGE_TCP))).joints)
    # A6 has more than one turn: an angle is inside if it is so at any turn
    turns = [(q + 360.0 * k >= low - 1e-7) & (q + 360.0 * k <= high + 1e-7) for k in (-1, 0, 1)]
    return np.any(turns, axis=0).all(axis=-1).any(axis=-1)


def poses(rng, count):
    """TCP poses anywhere in and around the reach, (count, 4, 4)."""
    from ..cells.arms import random_rotation

    Ts = np.tile(np.eye(4), (count, 1, 1))
    Ts[:, :3, :3] = [random_rotation(rng) for _ in range(count)]
    out = rng.normal(size=(count, 3))
    Ts[:, :3, 3] = [0, 0, 0.575] + out / np.linalg.norm(out, axis=1)[:, None] * rng.uniform(0.1, 2.7, (count, 1))
    return Ts


def certified(Ts, window):
    chain = welder()
    form = recognise(chain)
    assert form is not None
    return certify(chain, Ts, window, ANY, form)
