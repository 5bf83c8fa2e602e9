"""The roll certificate measured against sampling the roll, in one run on one thread: microseconds a target.

    python -m bench.speed.certificate                   # under half a minute
    python -m bench.speed.certificate --targets 4000 --rolls 72

The arm is the shipped KUKA KR 70 R2100 with the shipped torch, the roll about the wire is free, and the targets are
hard: the TCP lies where the reach ends, the wire points anywhere. Sampling finds configurations or it does not; the
certificate also proves that there is none. Each row is the fastest of its repeats, and the rows take turns, so that a
busy machine slows all of them alike.
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

from cell import load_case, prepare
from cell.mjcf.chain_from_model import chain_of
from cell.rigid import inverse
from ik import Chain, RollWindow, SingularityLimits, certify, closed_form, dls, spherical_wrist
from ik.chain import Floats
from ik.joint_turns import excess
from ik.roll import apply_roll
from ik.singularity import margins
from tests.support.oracles.toolbox import links_of

from ..bench_arguments import parsed

MODELS = Path(__file__).resolve().parents[2] / "models"
JOINTS = [f"A{i}" for i in range(1, 7)]
OPW = {"a1": 0.175, "a2": -0.050, "b": 0.0, "c1": 0.575, "c2": 0.890, "c3": 1.035, "c4": 0.185}
SHOULDER = np.array([0.0, 0.0, 0.575])  # of the arm, m
BORDER = (1.5, 2.7)  # distance of hard targets from there, m


@dataclass
class Row:
    """One line of the table: a way to settle targets, and what it makes of them."""

    name: str
    count: int  # targets it is given
    run: Callable[[], tuple[float, float]]  # -> shares found and proven out
    best: float = np.inf
    found: float = np.nan
    proven: float = np.nan

    def measure(self) -> None:
        start = time.perf_counter()
        self.found, self.proven = self.run()
        self.best = min(self.best, time.perf_counter() - start)


def hard_targets(count: int, seed: int) -> Floats:
    """Poses around the border of the workspace, (count, 4, 4), m."""
    rng = np.random.default_rng(seed)
    Ts = np.tile(np.eye(4), (count, 1, 1))
    z, x = rng.normal(size=(2, count, 3))
    z /= np.linalg.norm(z, axis=1)[:, None]
    x -= z * np.einsum("ij,ij->i", x, z)[:, None]
    x /= np.linalg.norm(x, axis=1)[:, None]
    Ts[:, :3, 0], Ts[:, :3, 1], Ts[:, :3, 2] = x, np.cross(z, x), z
    out = rng.normal(size=(count, 3))
    out /= np.linalg.norm(out, axis=1)[:, None]
    Ts[:, :3, 3] = SHOULDER + out * rng.uniform(*BORDER, (count, 1))
    return Ts


def ours(chain: Chain, limits: SingularityLimits, Ts: Floats, rolls: Floats) -> list[Row]:
    form = spherical_wrist.recognise(chain)
    assert form is not None

    def certificate() -> tuple[float, float]:
        result = certify(chain, Ts, RollWindow.free(), limits, form)
        return float(result.reachable.mean()), float(result.unreachable.mean())

    def sampled(*, keep_margins: bool) -> tuple[float, float]:
        q = closed_form.solve(form, apply_roll(Ts[:, None], rolls))
        good = (excess(chain, q) <= 0).all(axis=-1)
        if keep_margins:
            good &= (margins(chain, form, q) >= limits.values(True)).all(axis=-1)
        return float(good.any(axis=(1, 2)).mean()), 0.0

    n = len(rolls)
    return [
        Row("certificate: any roll, limits, margins", len(Ts), certificate),
        Row(f"closed form at {n} rolls, limits, margins", len(Ts), lambda: sampled(keep_margins=True)),
        Row(f"closed form at {n} rolls, limits", len(Ts), lambda: sampled(keep_margins=False)),
    ]


def opw_rows(chain: Chain, flange: Chain, Ts: Floats, rolls: Floats) -> list[Row]:
    try:
        import py_opw_kinematics as opw
        from scipy.spatial.transform import RigidTransform
    except ImportError:
        print("py-opw-kinematics is not installed: left out", file=sys.stderr)
        return []
    model = opw.KinematicModel(**OPW, offsets=(0, -90, 0, 0, 0, 0), flip_axes=(True, False, False, True, False, True))
    robot = opw.Robot(model, degrees=True)
    T_tcp_flange = inverse(inverse(flange.T_last_tcp) @ chain.T_last_tcp)
    # not timed: making poses of matrices
    poses = RigidTransform.from_matrix((apply_roll(Ts[:, None], rolls) @ T_tcp_flange).reshape(-1, 4, 4))
    # its angles are within a turn, so of A6's more than one turn every angle is inside
    limits = np.clip(np.rad2deg(np.stack([chain.lower, chain.upper], axis=1)), -360, 360)
    limits[5] = -360, 360

    def reach() -> tuple[float, float]:
        result = robot.reach(poses, joint_limits=limits)
        inside = np.asarray(result.limit_margin).reshape(len(Ts), -1) >= 0
        return float(inside.any(axis=1).mean()), 0.0

    return [Row(f"py-opw-kinematics reach at {len(rolls)} rolls, limits (Rust)", len(Ts), reach)]


def roboticstoolbox_rows(chain: Chain, Ts: Floats) -> list[Row]:
    """Its LM on the arm with one joint more: the roll about the wire."""
    try:
        import roboticstoolbox as rtb
    except ImportError:
        print("roboticstoolbox-python is not installed: left out", file=sys.stderr)
        return []
    links = links_of(chain) * rtb.ET.Rz(jindex=chain.n, qlim=[-np.pi, np.pi])
    links = links.compile()  # fixed frames in a row become one

    def levenberg_marquardt() -> tuple[float, float]:
        return float(np.mean([bool(links.ik_LM(T, slimit=16).success) for T in Ts])), 0.0

    return [
        Row("roboticstoolbox ik_LM with the roll as a joint, 16 starts (C++), limits", len(Ts), levenberg_marquardt)
    ]


def mujoco_rows(chain: Chain, model: mujoco.MjModel, T_flange_tcp: Floats, Ts: Floats) -> list[Row]:
    """A loop as one writes it: damped least squares of position and wire direction on MuJoCo's Jacobian."""
    data = mujoco.MjData(model)
    site, seeds = model.site("flange").id, dls.seeds_within_limits(chain, 16)
    jp, jr = np.zeros((3, model.nv)), np.zeros((3, model.nv))

    def descend(T: Floats, q: Floats) -> bool:
        for _ in range(80):
            data.qpos[:6] = q
            mujoco.mj_kinematics(model, data)
            mujoco.mj_comPos(model, data)
            R = data.site_xmat[site].reshape(3, 3)
            tcp, z = data.site_xpos[site] + R @ T_flange_tcp[:3, 3], R @ T_flange_tcp[:3, 2]
            e = np.concatenate([T[:3, 3] - tcp, np.cross(z, T[:3, 2])])
            if np.abs(e).max() < 1e-7 and z @ T[:3, 2] > 0:
                return True
            mujoco.mj_jac(model, data, jp, jr, tcp, model.site_bodyid[site])
            # the turn about the wire is free
            J = np.vstack([jp[:, :6], jr[:, :6] - np.outer(z, z @ jr[:, :6])])
            damping = 0.025 * min(float(e @ e), 1.0) + 1e-12
            q = np.clip(q + J.T @ np.linalg.solve(J @ J.T + damping * np.eye(6), e), chain.lower, chain.upper)
        return False

    def loop() -> tuple[float, float]:
        return float(np.mean([any(descend(T, q) for q in seeds) for T in Ts])), 0.0

    return [Row("Python loop of DLS on MuJoCo's Jacobian, 16 seeds, first found, limits", len(Ts), loop)]


def table(rows: list[Row]) -> str:
    """The rows as Markdown, with the time of each as a multiple of the first."""
    lines = ["| way | us a target | ratio | found | proven out |", "|---|--:|--:|--:|--:|"]
    each = [row.best / row.count for row in rows]
    lines += [
        f"| {r.name} | {t * 1e6:.1f} | {t / each[0]:.1f} | {r.found:.1%} | {r.proven:.1%} |"
        for r, t in zip(rows, each, strict=True)
    ]
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--targets", type=int, default=2000, help="hard targets (default 2000)")
    parser.add_argument("--few", type=int, default=60, help="of them for the slow ways (default 60)")
    parser.add_argument("--rolls", type=int, default=36, help="rolls that sampling tries (default 36)")
    parser.add_argument("--repeat", type=int, default=5, help="rounds; the fastest counts (default 5)")
    parser.add_argument("--seed", type=int, default=0, help="of the targets (default 0)")
    args = parsed(parser, targets=60, few=5, rolls=6, repeat=1)
    job = prepare(load_case(MODELS / "cases" / "propeller.case.yaml"))
    arm = mujoco.MjModel.from_xml_path(str(MODELS / "kr70_r2100" / "kr70_r2100.xml"))
    chain, flange = job.solver.chain, chain_of(arm, JOINTS, tcp="flange", base="base_link")
    Ts = hard_targets(args.targets, args.seed)
    rolls = RollWindow.free().samples(2 * np.pi / args.rolls)
    rows = ours(chain, job.singularity_limits, Ts, rolls) + opw_rows(chain, flange, Ts, rolls)
    T_flange_tcp = inverse(flange.T_last_tcp) @ chain.T_last_tcp
    rows += roboticstoolbox_rows(chain, Ts[: args.few]) + mujoco_rows(chain, arm, T_flange_tcp, Ts[: args.few])
    for _ in range(args.repeat):
        for row in rows:
            row.measure()
    print(table(rows))


if __name__ == "__main__":
    main()
