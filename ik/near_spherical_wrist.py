"""Arms that nearly have a spherical wrist: their deviation from an arm that has one, and solutions refined from its.

    off = deviation(chain, axes, wrist)               # bounds over every configuration
    off.length, off.angle                             # m, rad: of the TCP's pose
    q = refined(off.chain, q_nominal, Ts)             # the chain's own solutions, NaN where there is none beside

Metres and radians.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .chain import Chain, Floats

NEWTON_STEPS = 4  # of Newton's method at most; each squares the error
REACHED = 1e-10  # m and rad; what a closed form itself is worth
NEXT_TO = 0.2  # rad; a solution further from where it began is another one
DAMPING = 1e-16  # keeps a step finite in a singularity
BLOCK = 2048  # configurations worked on at a time


@dataclass(frozen=True, eq=False)
class Deviation:
    """Deviation of a chain from the arm that it is taken for.

    Attributes:
        chain: the arm as it is.
        length: largest distance of the TCP in any one configuration, m.
        angle: largest angle of its orientation, rad.
    """

    chain: Chain
    length: float
    angle: float


def deviation(chain: Chain, axes: Floats, wrist: Floats) -> Deviation:
    """Bound the difference between a chain and one with joint axes nearby.

    A rotation about one axis and that by the same angle about another, off by a turn alpha and a shift d at a point on
    it, differ by at most 2 alpha in orientation, and at a distance r from that point by at most 2 (d + alpha r)
    (1 + alpha): the second is the first, seen through a rigid motion that moves points there by d + alpha r, once on
    the way in and once on the way out. The differences of all joints add up, the TCP being at most the sum of the
    links away.

    Args:
        chain: the arm as it is.
        axes: unit axes of the other one at zero, base frame, (6, 3): A1 to A3 through this one's own joints, A4 to A6
            through ``wrist``.
        wrist: that point, base frame, (3,), m.

    Returns:
        Bounds over every configuration.
    """
    R, p = (a[0] for a in chain.frames(np.zeros((1, 6))))
    own = np.einsum("nij,nj->ni", R, chain.axes)
    tcp = chain.forward(np.zeros((1, 6)))[0, :3, 3]
    points = np.array([p[0], p[1], p[2], wrist, wrist, wrist, tcp])
    beyond = np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1)[::-1])[::-1]
    alpha = np.arctan2(np.linalg.norm(np.cross(own, axes), axis=1), np.einsum("ni,ni->n", own, axes))
    off = points[:6] - p
    d = np.linalg.norm(np.cross(off, own), axis=1)
    length = float((2 * (d + alpha * beyond) * (1 + alpha)).sum())
    return Deviation(chain, length, float(2 * alpha.sum()))


def refined(chain: Chain, q: Floats, Ts_base_tcp: Floats) -> Floats:
    """Solutions of a chain beside those of an arm close to it.

    Args:
        chain: the arm as it is.
        q: solutions of the other one, (m, b, 6), rad, NaN where there is none.
        Ts_base_tcp: poses, (m, 4, 4), m.

    Returns:
        (m, b, 6) rad; NaN where none was found beside.

    Source: Newton's method with the geometric Jacobian.
    """
    out = np.full(q.shape, np.nan)
    pose, branch = np.nonzero(np.isfinite(q).all(axis=-1))
    for first in range(0, len(pose), BLOCK):
        at = pose[first : first + BLOCK], branch[first : first + BLOCK]
        out[at] = _newton(chain, q[at], Ts_base_tcp[at[0]])
    return out


def _newton(chain: Chain, q0: Floats, Ts: Floats) -> Floats:
    q, good = q0.copy(), np.zeros(len(q0), dtype=bool)
    open_ = np.arange(len(q0))
    for step in range(NEWTON_STEPS + 1):
        T, J = chain.forward_and_jacobian(q[open_])
        e = _twist(T, Ts[open_])
        size = np.maximum(np.linalg.norm(e[:, :3], axis=1), np.linalg.norm(e[:, 3:], axis=1))
        good[open_] = size < REACHED
        left = size >= REACHED
        if step == NEWTON_STEPS or not left.any():
            break
        open_, J, e = open_[left], J[left], e[left]
        Jt = np.swapaxes(J, 1, 2)
        q[open_] += (Jt @ np.linalg.solve(J @ Jt + DAMPING * np.eye(6), e[:, :, None]))[..., 0]
    good &= np.abs(q - q0).max(axis=1) < NEXT_TO
    return np.where(good[:, None], q, np.nan)


def _twist(T: Floats, wanted: Floats) -> Floats:
    """From poses to those wanted, base frame, (m, 6): translation, then rotation vector to first order."""
    e = np.empty((len(T), 6))
    e[:, :3] = wanted[:, :3, 3] - T[:, :3, 3]
    R = wanted[:, :3, :3] @ np.swapaxes(T[:, :3, :3], 1, 2)
    e[:, 3], e[:, 4], e[:, 5] = R[:, 2, 1] - R[:, 1, 2], R[:, 0, 2] - R[:, 2, 0], R[:, 1, 0] - R[:, 0, 1]
    e[:, 3:] /= 2
    return e
