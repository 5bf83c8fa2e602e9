"""Between two targets: the arm followed densely along the bead, so that nothing hides between them.

    track = follow(solver, placed, first, rolls, q, steps)
    track.q                          # (m, j) samples of all edges, ends included
    track.broken                     # (edges,) "", "jump", "joint_limit" or "singular"

Poses are interpolated in space, not joints: the position along the bead's chord, the wire's direction along the great
circle, the roll evenly; damped least squares brings the arm onto every one of them from the joint-linear guess.
Metres and radians.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ik import dls
from ik.candidates import Solver
from ik.chain import Floats
from ik.roll import RollWindow, apply_roll, wrap
from ik.singularity import SingularityLimits, margins

from .place import Placed, frames

Ints = NDArray[np.int64]
JUMP = np.deg2rad(15.0)  # more than this between samples is another configuration, not a motion


@dataclass(frozen=True)
class Steps:
    """How densely a motion is sampled.

    Attributes:
        position: m.
        angle: rad, of the wire's direction, of the roll and of every joint.
    """

    position: float = 1e-3
    angle: float = np.deg2rad(1.0)


@dataclass(frozen=True, eq=False)
class Track:
    """Samples of several edges, one after the other.

    Attributes:
        edge: edge of each sample, (m,).
        fraction: place on the edge, 0 to 1, (m,).
        q: configurations, (m, j), rad.
        position: TCP, (m, 3), base frame, m.
        margin: singularity margins, (m, 4).
        broken: what is wrong with each edge: "", "jump", "joint_limit" or "singular", (edges,).
    """

    edge: Ints
    fraction: Floats
    q: Floats
    position: Floats
    margin: Floats
    broken: NDArray[np.str_]


def follow(
    solver: Solver,
    placed: Placed,
    start: Ints,
    roll: Floats,
    q: Floats,
    limits: SingularityLimits,
    steps: Steps,
) -> Track:
    """Follow edges from target ``start`` to ``start + 1``.

    Args:
        solver: the arm.
        placed: the targets.
        start: first target of each edge, (e,).
        roll: roll at both ends, (e, 2), rad; the short way is taken.
        q: configurations at both ends, (e, 2, j), rad.
        limits: singularity margins to keep on the way.
        steps: density.

    Returns:
        The track; the edges' ends are samples of it, as given.
    """
    p = placed.position[np.stack([start, start + 1], axis=1)]
    n = placed.normal[np.stack([start, start + 1], axis=1)]
    swing = np.arccos(np.clip(np.einsum("ei,ei->e", n[:, 0], n[:, 1]), -1.0, 1.0))
    turn = wrap(roll[:, 1] - roll[:, 0])
    reach = np.abs(q[:, 1] - q[:, 0]).max(axis=1)
    count = np.maximum.reduce(
        [
            np.linalg.norm(p[:, 1] - p[:, 0], axis=1) / steps.position,
            np.maximum.reduce([swing, np.abs(turn), reach]) / steps.angle,
        ]
    )
    count = np.maximum(np.ceil(count - 1e-9), 1).astype(np.int64)
    edge = np.repeat(np.arange(len(start)), count + 1)
    first = np.concatenate([[0], np.cumsum(count + 1)[:-1]])
    t = (np.arange(len(edge)) - first[edge]) / count[edge]
    position = p[edge, 0] + t[:, None] * (p[edge, 1] - p[edge, 0])
    T0 = frames(position, _slerp(n[edge, 0], n[edge, 1], swing[edge], t), placed.reference)
    Ts = apply_roll(T0, roll[edge, 0] + t * turn[edge])
    guess = q[edge, 0] + t[:, None] * (q[edge, 1] - q[edge, 0])
    inner = (t > 0) & (t < 1)
    out = guess.copy()
    found = dls.follow(solver.chain, Ts[inner], guess[inner], RollWindow.fixed(0.0))
    out[inner] = found.q
    margin = margins(solver.chain, solver.geometry, out)
    broken = np.full(len(start), "", dtype="<U12")
    least = limits.values(solver.geometry is not None)
    # the ends have been judged as targets
    thin = inner & (margin < least).any(axis=1)
    broken[edge[thin]] = "singular"
    lost = np.flatnonzero(inner)[~found.ok]
    broken[edge[lost]] = "joint_limit"
    same = edge[1:] == edge[:-1]
    far = same & (np.abs(out[1:] - out[:-1]).max(axis=1) > JUMP)
    broken[edge[1:][far]] = "jump"
    return Track(edge, t, out, position, margin, broken)


def _slerp(a: Floats, b: Floats, angle: Floats, t: Floats) -> Floats:
    """Unit vectors on the great circle from a to b, (m, 3)."""
    sine = np.sin(angle)
    straight = sine < 1e-9
    s = np.where(straight, 1.0, sine)
    wa = np.where(straight, 1 - t, np.sin((1 - t) * angle) / s)
    wb = np.where(straight, t, np.sin(t * angle) / s)
    v = wa[:, None] * a + wb[:, None] * b
    return v / np.linalg.norm(v, axis=1)[:, None]
