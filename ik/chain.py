"""Serial arms as arrays: forward kinematics and Jacobians of many configurations at once.

A :class:`Chain` is everything that the solvers know about a robot. It is made once from a compiled model
(``cell.mjcf.chain_from_model.chain_of``) or by hand, and every function takes configurations as rows::

    chain = Chain(origins=..., axes=..., T_last_tcp=..., lower=..., upper=..., max_speed=..., names=...)
    Ts_base_tcp = chain.forward(q)          # q (m, n) rad -> (m, 4, 4)
    J = chain.jacobian(q)                   # (m, 6, n), base frame, linear rows first

Frames: ``base`` is the chain's root; joint frame ``i`` moves with link ``i``. Lengths in metres, angles in radians.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
BLOCK = 4096  # configurations worked on at a time: what fits a core's cache, and costs few calls
MANY = 150  # configurations, from which on a joint's turn of all of them costs less than a product of each


def skew(v: Floats) -> Floats:
    """Cross-product matrices.

    Args:
        v: vectors, (..., 3).

    Returns:
        Matrices K with ``K @ u == cross(v, u)``, (..., 3, 3).
    """
    K = np.zeros((*v.shape[:-1], 3, 3))
    K[..., 0, 1], K[..., 0, 2] = -v[..., 2], v[..., 1]
    K[..., 1, 0], K[..., 1, 2] = v[..., 2], -v[..., 0]
    K[..., 2, 0], K[..., 2, 1] = -v[..., 1], v[..., 0]
    return K


def rotation_about(axis: Floats, angle: Floats) -> Floats:
    """Rotation matrices about one fixed axis.

    Args:
        axis: unit vector, (3,).
        angle: radians, (...).

    Returns:
        Rotations, (..., 3, 3).

    Source: Rodrigues' formula.
    """
    K = skew(axis)
    s, c = np.sin(angle)[..., None, None], np.cos(angle)[..., None, None]
    return np.eye(3) + s * K + (1.0 - c) * (K @ K)


def _turned(columns: Floats, axis: Floats, turn: tuple[Floats, Floats], out: Floats) -> None:
    """Frames turned about an axis of their own.

    Args:
        columns: of their rotations, (3, 3, m), column by column.
        axis: unit, in the frames, (3,).
        turn: sine and cosine of the angles, (m,) each.
        out: where the columns are put, (3, 3, m).
    """
    s, c = turn
    z = int(np.abs(axis).argmax())
    x, y = (z + 1) % 3, (z + 2) % 3
    if axis[x] or axis[y]:
        K = skew(axis)
        M = np.eye(3)[..., None] + K[..., None] * s + (K @ K)[..., None] * (1.0 - c)
        np.einsum("kcm,kxm->cxm", M, columns, out=out)
        return
    s = s * axis[z]
    np.multiply(c, columns[x], out=out[x])
    out[x] += s * columns[y]
    np.multiply(c, columns[y], out=out[y])
    out[y] -= s * columns[x]
    out[z] = columns[z]


@dataclass(frozen=True, eq=False)
class Chain:
    """A serial chain of revolute joints.

    Attributes:
        origins: pose of joint frame i in joint frame i-1 (the base for i = 0) with all angles zero, (n, 4, 4), m.
        axes: unit rotation axis of joint i in joint frame i, (n, 3).
        T_last_tcp: pose of the TCP in the last joint's frame, (4, 4), m.
        lower: lower joint limits, (n,), rad.
        upper: upper joint limits, (n,), rad.
        max_speed: joint speed limits, (n,), rad/s; infinite where unknown.
        names: joint names, n.
    """

    origins: Floats
    axes: Floats
    T_last_tcp: Floats
    lower: Floats
    upper: Floats
    max_speed: Floats
    names: tuple[str, ...]

    def __post_init__(self) -> None:
        n = len(self.origins)
        if self.axes.shape != (n, 3) or not np.allclose(np.linalg.norm(self.axes, axis=1), 1.0, atol=1e-9):
            raise ValueError("a chain needs one unit axis per joint")
        if not np.all(np.isfinite(self.upper - self.lower) & (self.lower < self.upper)):
            raise ValueError("a chain needs finite joint limits with lower < upper")

    @property
    def n(self) -> int:
        """Number of joints."""
        return len(self.origins)

    @cached_property
    def _rotation_terms(self) -> tuple[Floats, Floats, Floats]:
        # R_i(q) = A + sin(q) B + (1 - cos(q)) C: three constants a joint instead of a Rodrigues formula a call
        K = skew(self.axes)
        A = self.origins[:, :3, :3]
        return A, A @ K, A @ K @ K

    @cached_property
    def _offsets(self) -> list[list[tuple[int, float]]]:
        # of each joint's origin the coordinates that are not 0
        return [[(k, float(p[k])) for k in np.flatnonzero(p).tolist()] for p in self.origins[:, :3, 3]]

    @cached_property
    def _turns(self) -> list[Floats | None]:
        # of each joint's origin the turn, if there is one
        turns = self.origins[:, :3, :3]
        return [turn if (turn != np.eye(3)).any() else None for turn in turns]

    def frames(self, q: Floats) -> tuple[Floats, Floats]:
        """Poses of all joint frames.

        Args:
            q: configurations, (m, n), rad.

        Returns:
            Rotations (m, n, 3, 3) and positions (m, n, 3) of the joint frames in the base frame, m.
        """
        R, p = np.empty((*q.shape, 3, 3)), np.empty((*q.shape, 3))
        if len(q) < MANY:
            self._put_frames(q, R, p)
            return R, p
        for first in range(0, len(q), BLOCK):
            some = slice(first, first + BLOCK)
            axes, place = self.frame_axes(q[some])
            R[some], p[some] = axes.transpose(3, 2, 1, 0), place.transpose(2, 1, 0)
        return R, p

    def frame_axes(self, q: Floats) -> tuple[Floats, Floats]:
        """Poses of all joint frames, with the configurations on the last axis, for vectorised computations.

        Args:
            q: configurations, (m, n), rad.

        Returns:
            Components of the frames' axes in the base frame, (3, 3, n, m): axis, component, joint, configuration; and
            positions, (3, n, m), m.
        """
        axes, place = np.empty((3, 3, self.n, len(q))), np.empty((3, self.n, len(q)))
        for first in range(0, len(q), BLOCK):
            some = slice(first, first + BLOCK)
            self._put_axes(q[some], axes[..., some], place[..., some])
        return axes, place

    def _put_frames(self, q: Floats, R: Floats, p: Floats) -> None:
        """As :meth:`frames`, into given arrays."""
        A, B, C = self._rotation_terms
        s, v = np.sin(q), 1.0 - np.cos(q)
        local = A + s[..., None, None] * B + v[..., None, None] * C
        R[:, 0], p[:, 0] = local[:, 0], self.origins[0, :3, 3]
        for i in range(1, self.n):
            R[:, i] = R[:, i - 1] @ local[:, i]
            p[:, i] = p[:, i - 1] + R[:, i - 1] @ self.origins[i, :3, 3]

    def _put_axes(self, q: Floats, axes: Floats, place: Floats) -> None:
        """As :meth:`frame_axes`, into given arrays: frames turned about an axis, one of their own or any."""
        turned = np.ascontiguousarray(q.T)
        s, c = np.sin(turned), np.cos(turned)
        before = np.broadcast_to(np.eye(3)[..., None], (3, 3, len(q)))
        at = np.zeros((3, len(q)))
        for i in range(self.n):
            place[:, i] = at
            for k, length in self._offsets[i]:
                place[:, i] += length * before[k]
            turn = self._turns[i]
            if turn is not None:
                before = np.einsum("kc,kxm->cxm", turn, before)
            _turned(before, self.axes[i], (s[i], c[i]), axes[:, :, i])
            before, at = axes[:, :, i], place[:, i]

    def forward(self, q: Floats) -> Floats:
        """Pose of the TCP.

        Args:
            q: configurations, (m, n), rad.

        Returns:
            ``Ts_base_tcp``, (m, 4, 4), m.
        """
        if len(q) < MANY:
            return self._tcp(*self.frames(q))
        T = np.empty((len(q), 4, 4))
        for first in range(0, len(q), BLOCK):
            some = slice(first, first + BLOCK)
            axes, place = self.frame_axes(q[some])
            # of the last frame alone
            T[some] = self._tcp(axes[:, :, -1:].transpose(3, 2, 1, 0), place[:, -1:].transpose(2, 1, 0))
        return T

    def _tcp(self, R: Floats, p: Floats) -> Floats:
        T = np.zeros((len(R), 4, 4))
        T[:, :3, :3] = R[:, -1] @ self.T_last_tcp[:3, :3]
        T[:, :3, 3] = p[:, -1] + R[:, -1] @ self.T_last_tcp[:3, 3]
        T[:, 3, 3] = 1.0
        return T

    def jacobian(self, q: Floats) -> Floats:
        """Geometric Jacobian of the TCP in the base frame.

        Args:
            q: configurations, (m, n), rad.

        Returns:
            (m, 6, n): linear velocity (m/rad) in rows 0-2, angular velocity (rad/rad) in rows 3-5.
        """
        return self.forward_and_jacobian(q)[1]

    def forward_and_jacobian(self, q: Floats) -> tuple[Floats, Floats]:
        """Pose and Jacobian of the TCP from one pass (see :meth:`forward`, :meth:`jacobian`).

        Args:
            q: configurations, (m, n), rad.

        Returns:
            Poses in the base frame, (m, 4, 4), m, and Jacobians, (m, 6, n).
        """
        R, p = self.frames(q)
        T = self._tcp(R, p)
        w = np.einsum("mnij,nj->mni", R, self.axes)
        J = np.empty((len(q), 6, self.n))
        J[:, :3] = np.cross(w, T[:, None, :3, 3] - p).transpose(0, 2, 1)
        J[:, 3:] = w.transpose(0, 2, 1)
        return T, J

    def within(self, q: Floats, tolerance: float = 1e-9) -> NDArray[np.bool_]:
        """Which joints are inside their limits.

        Args:
            q: configurations, (..., n), rad.
            tolerance: slack, rad.

        Returns:
            (..., n) booleans; NaN is outside.
        """
        return (q >= self.lower - tolerance) & (q <= self.upper + tolerance)
