"""Rigid motions: poses, their inverses, frames about the wire, directions between two directions and off a third.

Use:

    T = pose(position, matrix)                # (4, 4)
    inverse(T) @ T                            # the identity
    frames(position, normal, reference)       # (n, 4, 4), z against the normal, roll 0
    is_beyond(off_upright, limit)             # angles that are greater by more than rounding
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ik.chain import Floats


def great_circle(a: Floats, b: Floats, fraction: Floats, angle: Floats | None = None) -> Floats:
    """Unit vectors between unit vectors, (m, 3); the angle between them, (m,), rad, is worked out if not given."""
    angle = np.arccos(np.clip((a * b).sum(axis=1), -1.0, 1.0)) if angle is None else angle
    sine = np.sin(angle)
    straight = sine < 1e-9
    s = np.where(straight, 1.0, sine)
    wa = np.where(straight, 1 - fraction, np.sin((1 - fraction) * angle) / s)
    wb = np.where(straight, fraction, np.sin(fraction * angle) / s)
    v = wa[:, None] * a + wb[:, None] * b
    out: Floats = v / np.linalg.norm(v, axis=1)[:, None]
    return out


ROUNDING = 1e-8  # rad: how exactly the angle between two directions is known, at the least


def is_beyond(angle: Floats, limit: float) -> NDArray[np.bool_]:
    """Whether angles between directions are greater than a limit, by more than rounding.

    Limits are round numbers, such as 90 degrees, which directions of a part may have exactly.

    Args:
        angle: (n,), rad.
        limit: rad.

    Returns:
        (n,) booleans.
    """
    return np.asarray(angle > limit + ROUNDING)


PARALLEL = 1e-6  # sine below which the wire counts as parallel to the part's z axis


def frames(position: Floats, normal: Floats, reference: tuple[Floats, Floats]) -> Floats:
    """Target frames at roll 0.

    Args:
        position: (n, 3), m.
        normal: unit deposition directions, (n, 3).
        reference: the direction x is to follow, and the one it follows where the wire is parallel to that.

    Returns:
        (n, 4, 4), m: z = -normal, x = the reference projected across z.
    """
    z = -normal
    x = reference[0] - z * (z @ reference[0])[:, None]
    size = np.linalg.norm(x, axis=1)
    other = reference[1] - z * (z @ reference[1])[:, None]
    x = np.where((size < PARALLEL)[:, None], other, x)
    x /= np.linalg.norm(x, axis=1)[:, None]
    T = np.zeros((len(z), 4, 4))
    T[:, :3, 0], T[:, :3, 1], T[:, :3, 2] = x, np.cross(z, x), z
    T[:, :3, 3] = position
    T[:, 3, 3] = 1.0
    return T


def pose(position: Floats, matrix: Floats) -> Floats:
    """A (4, 4) pose from a position (3,) and a rotation in nine numbers."""
    T = np.eye(4)
    T[:3, :3] = np.asarray(matrix).reshape(3, 3)
    T[:3, 3] = position
    return T


def inverse(T: Floats) -> Floats:
    """Inverse of rigid poses, (..., 4, 4)."""
    out = np.zeros_like(T)
    Rt = np.swapaxes(T[..., :3, :3], -1, -2)
    out[..., :3, :3] = Rt
    out[..., :3, 3] = -(Rt @ T[..., :3, 3:])[..., 0]
    out[..., 3, 3] = 1.0
    return out
