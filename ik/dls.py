"""Damped least squares: inverse kinematics of any arm, many targets and seeds at once.

``solve`` runs every target from several seeds; ``follow`` refines one guess per target, which is how a path is tracked
from a neighbour's solution. Both keep the joints inside their limits and treat the roll about z_tcp as free, limited
or fixed::

    found = solve(chain, Ts_base_target, RollWindow.free(), seeds=16)
    found.q[found.ok]                     # configurations that reach their target

The step minimises |J dq - e|^2 + lambda |dq|^2 with lambda growing with the error that is left, so that it is bold
near the target and careful far away; joints that push against a limit are held there for the step. A miss means *not
found*, never *not reachable*.

Source: Sugihara, Solvability-unconcerned inverse kinematics by the Levenberg-Marquardt method, IEEE T-RO 2011.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .chain import Chain, Floats
from .roll import RollWindow, roll_of

POSITION_TOLERANCE = 1e-7  # m
ANGLE_TOLERANCE = 1e-7  # rad
LENGTH_SCALE = 0.5  # m that count as much as one radian in the error


@dataclass(frozen=True, eq=False)
class Found:
    """What a solver found.

    Attributes:
        q: configurations, (m, s, n), rad; the best iterate where nothing was found.
        ok: whether the configuration reaches its target inside the joint limits, (m, s).
        position_error: (m, s), m.
        angle_error: (m, s), rad (wire direction and, outside the window, roll).
    """

    q: Floats
    ok: NDArray[np.bool_]
    position_error: Floats
    angle_error: Floats


def task_error(Ts_target: Floats, Ts_tcp: Floats, window: RollWindow) -> Floats:
    """Twist from the TCP to its target, in the TCP's frame.

    Args:
        Ts_target: targets at roll 0, (m, 4, 4).
        Ts_tcp: (m, 4, 4).
        window: allowed roll; inside it the roll is no error.

    Returns:
        (m, 6): translation (m), then rotation vector (rad) whose z part is the roll's excess.
    """
    R = Ts_tcp[:, :3, :3]
    e = np.empty((len(R), 6))
    e[:, :3] = np.einsum("mji,mj->mi", R, Ts_target[:, :3, 3] - Ts_tcp[:, :3, 3])
    z = np.einsum("mji,mj->mi", R, Ts_target[:, :3, 2])  # the wanted wire direction seen from the TCP
    sine = np.hypot(z[:, 0], z[:, 1])
    angle = np.arctan2(sine, z[:, 2])
    scale = np.where(sine > 1e-12, angle / np.maximum(sine, 1e-12), 1.0)
    # the axis e_z x z; exactly opposed directions have none, and any will do
    opposed = (sine <= 1e-12) & (z[:, 2] < 0)
    e[:, 3] = np.where(opposed, np.pi, -z[:, 1] * scale)
    e[:, 4] = z[:, 0] * scale
    if window.is_full:
        e[:, 5] = 0.0
    else:
        # the roll once the wire is brought into line by the shortest turn
        e[:, 5] = -window.excess(roll_of(Ts_target, _aligned(Ts_tcp, e[:, 3:5])))
    return e


def _aligned(Ts_tcp: Floats, turn_xy: Floats) -> Floats:
    angle = np.linalg.norm(turn_xy, axis=1)
    axis = np.zeros((len(angle), 3))
    axis[:, :2] = turn_xy / np.maximum(angle, 1e-300)[:, None]
    x = np.array([1.0, 0.0, 0.0])
    s, c = np.sin(angle)[:, None], np.cos(angle)[:, None]
    turned = c * x + s * np.cross(axis, x) + (1 - c) * axis * axis[:, :1]
    out = Ts_tcp.copy()
    out[:, :3, 0] = np.einsum("mij,mj->mi", Ts_tcp[:, :3, :3], turned)
    return out


def solve(
    chain: Chain,
    Ts_base_target: Floats,
    window: RollWindow,
    *,
    seeds: int = 16,
    rng_seed: int = 0,
    max_iterations: int = 80,
) -> Found:
    """Search configurations for targets from several seeds each.

    Args:
        chain: the arm with its tool.
        Ts_base_target: targets at roll 0, (m, 4, 4), m.
        window: allowed roll about z_tcp.
        seeds: starts per target: the middle of the limits, then a low-discrepancy spread over them.
        rng_seed: shifts the spread; equal seeds give equal results.
        max_iterations: steps per start.

    Returns:
        Found, with s = seeds.
    """
    m = len(Ts_base_target)
    start = np.broadcast_to(spread(chain, seeds, rng_seed), (m, seeds, chain.n))
    Ts = np.repeat(Ts_base_target, seeds, axis=0)
    found = follow(chain, Ts, start.reshape(-1, chain.n), window, max_iterations=max_iterations)
    return Found(
        found.q.reshape(m, seeds, chain.n),
        found.ok.reshape(m, seeds),
        found.position_error.reshape(m, seeds),
        found.angle_error.reshape(m, seeds),
    )


def spread(chain: Chain, count: int, rng_seed: int = 0) -> Floats:
    """Configurations spread evenly over the joint limits.

    Args:
        chain: the arm.
        count: how many.
        rng_seed: shifts the sequence.

    Returns:
        (count, n) rad; the first is the middle of the limits.

    Source: the R-sequence (Roberts 2018), a Kronecker sequence on the generalised golden ratio.
    """
    n = chain.n
    phi = 2.0
    for _ in range(60):
        phi = (1 + phi) ** (1 / (n + 1))
    alpha = phi ** -np.arange(1.0, n + 1)
    u = (0.5 + np.arange(count)[:, None] * alpha + rng_seed * 0.7548776662) % 1.0
    u[0] = 0.5
    return chain.lower + u * (chain.upper - chain.lower)


def follow(
    chain: Chain, Ts_base_target: Floats, q0: Floats, window: RollWindow, *, max_iterations: int = 30
) -> Found:
    """Bring one guess per target onto its target.

    Args:
        chain: the arm with its tool.
        Ts_base_target: targets at roll 0, (m, 4, 4), m.
        q0: guesses, (m, n), rad.
        window: allowed roll.
        max_iterations: steps.

    Returns:
        Found, with s = 1 squeezed away: q (m, n), ok (m,).
    """
    q = np.clip(np.array(q0, dtype=float), chain.lower, chain.upper)
    m = len(q)
    best = np.full(m, np.inf)
    best_q, best_e = q.copy(), np.full((m, 6), np.inf)
    stale = np.zeros(m, dtype=int)
    active = np.arange(m)
    weight = np.array([1 / LENGTH_SCALE] * 3 + [1.0] * 3)
    for _ in range(max_iterations + 1):
        T, J = chain.forward_and_jacobian(q[active])
        e = task_error(Ts_base_target[active], T, window)
        size = np.einsum("mi,mi->m", e * weight, e * weight)
        better = size < best[active]
        improved = size < 0.99 * best[active]
        best_q[active[better]], best_e[active[better]] = q[active[better]], e[better]
        best[active[better]] = size[better]
        stale[active] = np.where(improved, 0, stale[active] + 1)
        # finished to rounding, or going nowhere for several steps
        keep = (size > 1e-18) & (stale[active] < 12)
        active, J, T, e, size = active[keep], J[keep], T[keep], e[keep], size[keep]
        if not len(active):
            break
        q[active] = _step(chain, q[active], T, J, e, size, weight, window)
    position, angle = _errors(best_e)
    ok = (position <= POSITION_TOLERANCE) & (angle <= ANGLE_TOLERANCE)
    return Found(best_q, ok, position, angle)


def _step(
    chain: Chain, q: Floats, T: Floats, J: Floats, e: Floats, size: Floats, weight: Floats, window: RollWindow
) -> Floats:
    Rt = T[:, :3, :3].transpose(0, 2, 1)
    A = np.concatenate([Rt @ J[:, :3], Rt @ J[:, 3:]], axis=1) * weight[:, None]
    # a roll inside the window is no task: its row must not hold the arm back
    if not window.is_fixed:
        A[e[:, 5] == 0.0, 5] = 0.0
    b = e * weight
    damping = 0.05 * np.minimum(size, 1.0) + 1e-12
    eye = np.eye(chain.n)
    for _ in range(2):
        H = A.transpose(0, 2, 1) @ A + damping[:, None, None] * eye
        dq = np.linalg.solve(H, np.einsum("mij,mi->mj", A, b)[..., None])[..., 0]
        pushed = ((q <= chain.lower) & (dq < 0)) | ((q >= chain.upper) & (dq > 0))
        if not pushed.any():
            break
        A = np.where(pushed[:, None, :], 0.0, A)
    dq = np.where(pushed, 0.0, dq)
    # no joint turns more than 0.6 rad a step: the linear model is not worth more
    dq *= np.minimum(1.0, 0.6 / np.maximum(np.abs(dq).max(axis=1), 1e-12))[:, None]
    return np.clip(q + dq, chain.lower, chain.upper)


def _errors(e: Floats) -> tuple[Floats, Floats]:
    return np.linalg.norm(e[:, :3], axis=1), np.linalg.norm(e[:, 3:], axis=1)
