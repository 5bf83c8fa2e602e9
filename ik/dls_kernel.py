"""A chain with configurations as columns: the same kinematics as :mod:`ik.chain`, laid out for thousands at a time.

Every quantity is an array whose last axis runs over the configurations, so that each numpy call is one pass over
contiguous memory. A column's result never depends on its neighbours, down to the last bit::

    arm = ColumnChain.of(chain)
    tool, axes, points = arm.frames(q)      # q (n, m) rad

Frames are re-chosen as in Denavit-Hartenberg tables: z along each joint's axis, turned about it until the step to the
next frame is one rotation about x. That leaves a rotation in a plane per joint and, for right angles, a swap of axes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .chain import Chain, Floats

SNAP = 1e-14  # sines and cosines below this are zero; rounding in a model's quaternions is larger than what it costs


@dataclass(frozen=True, eq=False)
class Tool:
    """TCP frames as columns.

    Attributes:
        x: across the wire, (3, m); off the TCP's own x axis by :attr:`ColumnChain.tool_roll`.
        y: z cross x, (3, m).
        z: the TCP's z axis, (3, m).
        p: the TCP's position, (3, m), in units of the chain's ``unit``.
    """

    x: Floats
    y: Floats
    z: Floats
    p: Floats


@dataclass(frozen=True, eq=False)
class ColumnChain:
    """A chain's constants for the column layout.

    Attributes:
        base: axes (columns) of the first joint's frame at its zero, (3, 3), base frame.
        first: a point on the first joint's axis, (3,).
        zero: angle added to each joint's, (n,), rad.
        twist: cosine and sine of the rotation about x after each joint, (n, 2).
        step: from each joint's frame, as turned, to the next one's origin, (n, 3).
        tool_roll: roll of the TCP's x axis against :attr:`Tool.x`, rad.
        lower: lower joint limits, (n, 1), rad.
        upper: upper joint limits, (n, 1), rad.
        unit: metres that all lengths here are counted in.
    """

    base: Floats
    first: Floats
    zero: Floats
    twist: Floats
    step: Floats
    tool_roll: float
    lower: Floats
    upper: Floats
    unit: float

    @classmethod
    def of(cls, chain: Chain, unit: float = 1.0) -> ColumnChain:
        """Re-choose a chain's frames.

        Args:
            chain: the arm with its tool.
            unit: length that becomes 1, m.
        """
        n = chain.n
        own = [_frame_along(a) for a in chain.axes]
        moves = [*chain.origins, chain.T_last_tcp]
        zero, twist, step = np.zeros(n + 1), np.empty((n, 2)), np.empty((n, 3))
        for i in range(n):
            T = moves[i + 1]
            after = own[i + 1] if i + 1 < n else np.eye(3)
            a, cosine, sine, b = _zxz(own[i].T @ T[:3, :3] @ after)
            zero[i] += a
            zero[i + 1] = b
            twist[i] = cosine, sine
            step[i] = _about_z(-a) @ own[i].T @ T[:3, 3]
        step[np.abs(step) < SNAP] = 0.0
        first = chain.origins[0]
        return cls(
            base=first[:3, :3] @ own[0],
            first=first[:3, 3] / unit,
            zero=zero[:n],
            twist=twist,
            step=step / unit,
            tool_roll=float(zero[n]),
            lower=chain.lower[:, None],
            upper=chain.upper[:, None],
            unit=unit,
        )

    def frames(self, q: Floats) -> tuple[Tool, Floats, Floats]:
        """TCP frames, joint axes and joint origins.

        Args:
            q: configurations, (n, m), rad.

        Returns:
            The TCP frames; axes (3, n, m), unit vectors; points on them (3, n, m), in ``unit``. Base frame.
        """
        n, m = q.shape
        turned = q + self.zero[:, None]
        cosines, sines = np.cos(turned), np.sin(turned)
        axes, points = np.empty((3, n, m)), np.empty((3, n, m))
        x, y, z = (np.ascontiguousarray(self.base[:, j : j + 1]) for j in range(3))
        p = self.first[:, None]
        for i in range(n):
            axes[:, i], points[:, i] = z, p
            c, s = cosines[i], sines[i]
            x, y = c * x + s * y, c * y - s * x
            for length, direction in zip(self.step[i], (x, y, z), strict=True):
                if length:
                    p = p + length * direction
            c, s = self.twist[i]
            if c == 0.0:
                y, z = z, -y
            elif s == 0.0:
                y, z = (y, z) if c > 0 else (-y, -z)
            else:
                y, z = c * y + s * z, c * z - s * y
        return Tool(x, y, z, np.broadcast_to(p, (3, m))), axes, points


def jacobian(tool: Tool, axes: Floats, points: Floats, rows: int) -> Floats:
    """Jacobian with position rows along the base's axes and rotation rows along the tool's x, y and z.

    Args:
        tool: the TCP frames.
        axes: (3, n, m).
        points: (3, n, m).
        rows: 6, or 5 to leave out the rotation about z.

    Returns:
        (rows, n, m).
    """
    J = np.empty((rows, *axes.shape[1:]))
    w0, w1, w2 = axes
    d0, d1, d2 = tool.p[:, None] - points
    np.subtract(w1 * d2, w2 * d1, out=J[0])
    np.subtract(w2 * d0, w0 * d2, out=J[1])
    np.subtract(w0 * d1, w1 * d0, out=J[2])
    for row, direction in zip(range(3, rows), (tool.x, tool.y, tool.z), strict=False):
        np.multiply(w0, direction[0], out=J[row])
        J[row] += w1 * direction[1]
        J[row] += w2 * direction[2]
    return J


def solve_damped(A: Floats, b: Floats, damping: Floats) -> Floats:
    """Least-squares steps of many small systems.

    Args:
        A: (r, n, m).
        b: (r, m).
        damping: (m,), added to the diagonal; positive.

    Returns:
        ``A^T (A A^T + damping)^-1 b``, (n, m): the minimiser of |A x - b|^2 + damping |x|^2.
    """
    r, _, m = A.shape
    if m == 1:  # einsum sums a lone column in another order than one among many
        return solve_damped(np.repeat(A, 2, axis=2), np.repeat(b, 2, axis=1), np.repeat(damping, 2))[:, :1]
    M = np.empty((r, r + 1, m))  # the lower part is never read
    for i in range(r):
        np.einsum("nm,knm->km", A[i], A[i:], out=M[i, i:r])
        M[i, i] += damping
    M[:, r] = b
    pivots = []
    for i in range(r):
        pivots.append(1.0 / M[i, i])
        factor = M[i, i + 1 : r] * pivots[i]
        for k in range(i + 1, r):
            M[k, k:] -= factor[k - i - 1] * M[i, k:]
    y = np.empty((r, m))
    for i in reversed(range(r)):
        rest = M[i, r]
        for k in range(i + 1, r):
            rest = rest - M[i, k] * y[k]
        np.multiply(rest, pivots[i], out=y[i])
    return np.einsum("rnm,rm->nm", A, y)


def _frame_along(axis: Floats) -> Floats:
    """A rotation whose z axis is the given unit vector, (3, 3)."""
    x = np.cross(np.eye(3)[int(np.argmin(np.abs(axis)))], axis)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(axis, x), axis])


def _about_z(angle: float) -> Floats:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def _zxz(R: Floats) -> tuple[float, float, float, float]:
    """R as Rz(a) Rx(t) Rz(b): a, cos t, sin t, b."""
    sine, cosine = float(np.hypot(R[0, 2], R[1, 2])), float(R[2, 2])
    if sine < SNAP:
        flip = float(np.sign(cosine))
        return float(np.arctan2(R[1, 0], R[0, 0])), flip, 0.0, 0.0
    a, b = float(np.arctan2(R[0, 2], -R[1, 2])), float(np.arctan2(R[2, 0], R[2, 1]))
    return (a, 0.0, 1.0, b) if abs(cosine) < SNAP else (a, cosine, sine, b)
