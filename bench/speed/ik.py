"""Inverse kinematics measured against peers, in one run on one thread: microseconds a target.

    python -m bench.speed.ik                   # about a minute
    python -m bench.speed.ik --targets 500 --repeat 5

The arm is the shipped KUKA KR 70 R2100 with its flange as TCP; the targets are poses of configurations drawn evenly
from its joint limits, so every one of them can be reached. Slow solvers get fewer targets; each row is the fastest of
its repeats, and the rows take turns, so that a busy machine slows all of them alike.
"""

from __future__ import annotations

import os

os.environ["OMP_NUM_THREADS"] = "1"  # before numpy is loaded
os.environ["OPENBLAS_NUM_THREADS"] = "1"
os.environ["MKL_NUM_THREADS"] = "1"

import argparse
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np

from cell.mjcf.chain_from_model import chain_of
from ik import Chain, RollWindow, Solver, closed_form, dls, spherical_wrist
from ik.chain import Floats
from ik.joint_turns import excess
from tests.support.oracles.toolbox import links_of

from ..bench_arguments import parsed

MODEL = Path(__file__).resolve().parents[2] / "models" / "kr70_r2100" / "kr70_r2100.xml"
JOINTS = [f"A{i}" for i in range(1, 7)]
OPW = {"a1": 0.175, "a2": -0.050, "b": 0.0, "c1": 0.575, "c2": 0.890, "c3": 1.035, "c4": 0.185}


@dataclass
class Row:
    """One line of the table: a solver, how many targets it gets, and what it makes of them."""

    name: str
    targets: int
    run: Callable[[Floats], float]  # targets -> share found inside the limits
    best: float = np.inf
    found: float = np.nan

    def measure(self, Ts: Floats) -> None:
        start = time.perf_counter()
        self.found = self.run(Ts[: self.targets])
        self.best = min(self.best, (time.perf_counter() - start) / self.targets)


def ours(chain: Chain, count: int) -> list[Row]:
    form = spherical_wrist.recognise(chain)
    assert form is not None
    solver = Solver.for_chain(chain)
    free, full = RollWindow.free(), RollWindow.fixed(0.0)

    def inside(q: Floats) -> float:
        return float((excess(chain, q) <= 0).all(axis=-1).any(axis=1).mean())

    def least_squares(window: RollWindow, enough: int | None) -> Callable[[Floats], float]:
        return lambda Ts: float(dls.solve(chain, Ts, window, seeds=16, enough=enough).ok.any(axis=1).mean())

    few = max(count // 2, 50)
    return [
        Row("closed form, 8 branches", count, lambda Ts: inside(closed_form.solve(form, Ts))),
        Row(
            "closed form, limits and whole turns",
            count,
            lambda Ts: float(solver.candidates(Ts).valid.any(axis=(1, 2)).mean()),
        ),
        Row("DLS free roll, 16 seeds, first found", few, least_squares(free, 1)),
        Row("DLS free roll, 16 seeds, all", few, least_squares(free, None)),
        Row("DLS full pose, 16 seeds, first found", few, least_squares(full, 1)),
        Row("DLS full pose, 16 seeds, all", few, least_squares(full, None)),
    ]


def opw_rows(chain: Chain, Ts_all: Floats) -> list[Row]:
    try:
        import py_opw_kinematics as opw
        from scipy.spatial.transform import RigidTransform
    except ImportError:
        print("py-opw-kinematics is not installed: left out", file=sys.stderr)
        return []
    model = opw.KinematicModel(**OPW, offsets=(0, -90, 0, 0, 0, 0), flip_axes=(True, False, False, True, False, True))
    robot = opw.Robot(model, degrees=True)
    poses = RigidTransform.from_matrix(Ts_all)  # not timed: it makes every matrix orthogonal first

    def reach(_: Floats) -> float:
        q = np.deg2rad(robot.reach(poses).joints)
        return float((excess(chain, q) <= 0).all(axis=-1).any(axis=1).mean())

    return [Row("py-opw-kinematics reach, 8 branches (Rust)", len(Ts_all), reach)]


def roboticstoolbox_rows(chain: Chain, count: int) -> list[Row]:
    try:
        links = links_of(chain).compile()  # fixed frames in a row become one
    except ImportError:
        print("roboticstoolbox-python is not installed: left out", file=sys.stderr)
        return []

    def levenberg_marquardt(Ts: Floats) -> float:
        return float(np.mean([bool(links.ik_LM(T, slimit=16).success) for T in Ts]))

    return [Row("roboticstoolbox ik_LM, 16 starts (C++)", count, levenberg_marquardt)]


def mujoco_rows(chain: Chain, model: mujoco.MjModel, count: int) -> list[Row]:
    data = mujoco.MjData(model)
    site = model.site("flange").id
    seeds = dls.seeds_within_limits(chain, 16)
    jacobian = np.zeros((6, model.nv))
    wanted, now, turn = np.empty(4), np.empty(4), np.empty(3)

    def descend(T: Floats, q: Floats) -> bool:
        mujoco.mju_mat2Quat(wanted, T[:3, :3].flatten())
        for _ in range(80):
            data.qpos[:6] = q
            mujoco.mj_kinematics(model, data)
            mujoco.mj_comPos(model, data)
            mujoco.mju_mat2Quat(now, data.site_xmat[site])
            mujoco.mju_negQuat(now, now)
            relative = np.empty(4)
            mujoco.mju_mulQuat(relative, wanted, now)
            mujoco.mju_quat2Vel(turn, relative, 1.0)
            e = np.concatenate([T[:3, 3] - data.site_xpos[site], turn])
            if np.abs(e).max() < 1e-7:
                return True
            mujoco.mj_jacSite(model, data, jacobian[:3], jacobian[3:], site)
            J = jacobian[:, :6]
            damping = 0.025 * min(float(e @ e), 1.0) + 1e-12
            q = np.clip(q + J.T @ np.linalg.solve(J @ J.T + damping * np.eye(6), e), chain.lower, chain.upper)
        return False

    def loop(Ts: Floats) -> float:
        return float(np.mean([any(descend(T, q) for q in seeds) for T in Ts]))

    return [Row("Python loop of DLS on mj_jacSite, 16 seeds, first found", count, loop)]


def table(rows: list[Row]) -> str:
    """The rows as Markdown, with the time of each as a multiple of the first."""
    lines = ["| solver | us a target | ratio | found |", "|---|--:|--:|--:|"]
    lines += [
        f"| {row.name} | {row.best * 1e6:.1f} | {row.best / rows[0].best:.1f} | {row.found:.1%} |" for row in rows
    ]
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--targets", type=int, default=2000, help="poses for the fast solvers (default 2000)")
    parser.add_argument("--repeat", type=int, default=3, help="rounds; the fastest counts (default 3)")
    parser.add_argument("--seed", type=int, default=0, help="of the targets (default 0)")
    args = parsed(parser, targets=40, repeat=1)
    model = mujoco.MjModel.from_xml_path(str(MODEL))
    chain = chain_of(model, JOINTS, tcp="flange", base="base_link")
    rng = np.random.default_rng(args.seed)
    Ts = chain.forward(chain.lower + rng.random((args.targets, 6)) * (chain.upper - chain.lower))
    few = max(args.targets // 20, 20)
    rows = ours(chain, args.targets) + opw_rows(chain, Ts)
    rows += roboticstoolbox_rows(chain, few) + mujoco_rows(chain, model, few)
    for _ in range(args.repeat):
        for row in rows:
            row.measure(Ts)
    print(table(rows))


if __name__ == "__main__":
    main()
