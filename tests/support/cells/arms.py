"""Arms to test inverse kinematics on: the shipped one, random ones of its class, and ones outside of it."""

from functools import cache

import mujoco
import numpy as np

from cell.mjcf.chain_from_model import chain_of
from ik.chain import Chain, rotation_about

from ..paths import ROOT

MODEL = ROOT / "models" / "kr70_r2100" / "kr70_r2100.xml"
JOINTS = [f"A{i}" for i in range(1, 7)]
# py-opw-kinematics' parameters of the same arm
OPW = {"a1": 0.175, "a2": -0.050, "b": 0.0, "c1": 0.575, "c2": 0.890, "c3": 1.035, "c4": 0.185}
OPW |= {"offsets": (0, -90, 0, 0, 0, 0), "flip_axes": (True, False, False, True, False, True)}


@cache
def kr70_model() -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_path(str(MODEL))


@cache
def kr70() -> Chain:
    """The shipped arm with its flange as TCP."""
    return chain_of(kr70_model(), JOINTS, tcp="flange", base="base_link")


@cache
def welder() -> Chain:
    """The shipped arm with a bent torch."""
    T = np.eye(4)
    T[:3, :3] = rotation_about(np.array([0.0, 1.0, 0.0]), np.deg2rad(40.0))
    T[:3, 3] = [0.09, 0.01, 0.35]
    return with_tool(kr70(), T)


def with_tool(chain: Chain, T: np.ndarray) -> Chain:
    return replaced(chain, T_last_tcp=chain.T_last_tcp @ T)


def replaced(chain: Chain, **changes) -> Chain:
    names = ("origins", "axes", "T_last_tcp", "lower", "upper", "max_speed", "names")
    return Chain(**{name: changes.get(name, getattr(chain, name)) for name in names})


def random_rotation(rng: np.random.Generator) -> np.ndarray:
    Q, R = np.linalg.qr(rng.normal(size=(3, 3)))
    Q = Q * np.sign(np.diag(R))
    return Q if np.linalg.det(Q) > 0 else -Q


def random_pose(rng: np.random.Generator, size: float = 0.3) -> np.ndarray:
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = random_rotation(rng), rng.uniform(-size, size, 3)
    return T


def chain_from_lines(w: np.ndarray, p: np.ndarray, rng: np.random.Generator, half: float = np.pi) -> Chain:
    """A chain with axes w through points p at zero, in a base and in joint frames that are turned at random."""
    n = len(w)
    base = random_pose(rng)
    R = [random_rotation(rng) for _ in range(n)]
    origins = np.tile(np.eye(4), (n, 1, 1))
    before, at = np.eye(3), np.zeros(3)
    for i in range(n):
        here = base[:3, :3] @ p[i] + base[:3, 3]
        origins[i, :3, :3] = before.T @ R[i]
        origins[i, :3, 3] = before.T @ (here - at)
        before, at = R[i], here
    axes = np.array([R[i].T @ base[:3, :3] @ w[i] for i in range(n)])
    limits = np.full(n, half)
    return Chain(origins, axes, random_pose(rng), -limits, limits, np.ones(n), tuple(f"J{i}" for i in range(n)))


def random_class_arm(rng: np.random.Generator, *, bent_wrist: bool = False) -> Chain:
    """An arm with A1 across A2, A2 along A3 (or against it) and a spherical wrist, everything else random.

    Args:
        rng: source of randomness.
        bent_wrist: whether A5 stands at other than right angles to A4 and A6.
    """
    x, y, z = np.eye(3)
    sign = rng.choice([-1.0, 1.0], 6)
    p2 = np.array([rng.uniform(0, 0.4), rng.uniform(-0.2, 0.2), rng.uniform(0.2, 0.7)])
    p3 = p2 + rng.uniform([-0.1, -0.2, 0.4], [0.1, 0.2, 1.0])
    wrist = p3 + rng.uniform([0.4, -0.1, -0.1], [1.0, 0.1, 0.1])
    w4, w5, w6 = x, y, x
    if bent_wrist:
        w5 = rotation_about(z, rng.uniform(0.5, 1.2)) @ x
        w6 = rotation_about(rng.normal(size=3) * 0 + y, rng.uniform(0.3, 1.0)) @ w5
    w = sign[:, None] * np.array([z, y, y, w4, w5, w6])
    p = np.array([rng.uniform(-0.5, 0.5) * z, p2, p3, wrist, wrist, wrist])
    p[3:] += rng.uniform(-0.3, 0.3, (3, 1)) * w[3:]  # joint frames may stand anywhere on their axes
    return chain_from_lines(w, p, rng)


def offset_wrist_arm() -> Chain:
    """Six joints like a UR5e: A2, A3, A4 parallel, no two wrist axes through one point."""
    x, y, z = np.eye(3)
    w = np.array([z, y, y, y, -z, y])
    p = np.array(
        [0 * x, [0, 0, 0.163], [0.425, 0, 0.163], [0.817, 0.134, 0.163], [0.817, 0.134, 0.063], [0.817, 0.234, 0.063]]
    )
    return chain_from_lines(w, p, np.random.default_rng(5))


def seven_joint_arm() -> Chain:
    """Shoulder, elbow and wrist of three, one and three joints."""
    x, y, z = np.eye(3)
    w = np.array([z, y, z, y, z, y, z])
    p = np.array([0 * x, 0.36 * z, 0.36 * z, 0.78 * z, 0.78 * z, 1.18 * z, 1.18 * z])
    chain = chain_from_lines(w, p, np.random.default_rng(6))
    return replaced(
        chain,
        lower=-np.deg2rad([170, 120, 170, 120, 170, 120, 175]),
        upper=np.deg2rad([170, 120, 170, 120, 170, 120, 175.0]),
    )


def sampled(chain: Chain, count: int, seed: int = 0, inside: float = 0.0) -> np.ndarray:
    """Configurations inside the limits, (count, n), at least ``inside`` rad from each."""
    rng = np.random.default_rng(seed)
    low, high = chain.lower + inside, chain.upper - inside
    return low + rng.random((count, chain.n)) * (high - low)
