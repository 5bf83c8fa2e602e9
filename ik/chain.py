"""Serial arms as arrays: forward kinematics and Jacobians of many configurations at once.

A :class:`Chain` is all the solvers know of a robot. It is made once from a compiled model
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
BLOCK = 256  # configurations worked on at a time: what fits a core's cache


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

    def frames(self, q: Floats) -> tuple[Floats, Floats]:
        """Poses of all joint frames.

        Args:
            q: configurations, (m, n), rad.

        Returns:
            Rotations (m, n, 3, 3) and positions (m, n, 3) of the joint frames in the base frame, m.
        """
        R, p = np.empty((*q.shape, 3, 3)), np.empty((*q.shape, 3))
        for first in range(0, len(q), BLOCK):
            self._put_frames(q[first : first + BLOCK], R[first : first + BLOCK], p[first : first + BLOCK])
        return R, p

    def _put_frames(self, q: Floats, R: Floats, p: Floats) -> None:
        """As :meth:`frames`, into given arrays."""
        A, B, C = self._rotation_terms
        s, v = np.sin(q), 1.0 - np.cos(q)
        local = A + s[..., None, None] * B + v[..., None, None] * C
        R[:, 0], p[:, 0] = local[:, 0], self.origins[0, :3, 3]
        for i in range(1, self.n):
            R[:, i] = R[:, i - 1] @ local[:, i]
            p[:, i] = p[:, i - 1] + R[:, i - 1] @ self.origins[i, :3, 3]

    def forward(self, q: Floats) -> Floats:
        """Pose of the TCP.

        Args:
            q: configurations, (m, n), rad.

        Returns:
            ``Ts_base_tcp``, (m, 4, 4), m.
        """
        return self._tcp(*self.frames(q))

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
