"""KUKA's A B C, rotations, and angles that run on without jumps.

Use:

    abc_of(rotation_of(abc))                  # the same orientation, B within +-90 degrees
    run_on(abc, before)                       # the same orientation, as near to the one before as it can be written

R = Rz(A) Ry(B) Rx(C): the axes are turned about z, then about the new y, then about the new x. Radians.
"""

from __future__ import annotations

from math import atan2, cos, pi, tau

import numpy as np
from scipy.spatial.transform import Rotation

from ik.chain import Floats

DEGENERATE = 2e-7  # rad from B = +-90 degrees, within which A and C turn about one axis
SAME_ORIENTATION = 1e-3  # rad: between orientations that are this near there is one way
LOOSE = np.deg2rad(15.0)  # by which an auxiliary point may be oriented beyond the way that it stands for
ROUNDING_ANGLE = 4e-7  # rad: angles are left as they are given where others are not nearer by more than rounding


def rotation_of(abc: Floats) -> Floats:
    """Rotations of angles.

    Args:
        abc: (..., 3), rad.

    Returns:
        (..., 3, 3).
    """
    (ca, cb, cc), (sa, sb, sc) = np.moveaxis(np.cos(abc), -1, 0), np.moveaxis(np.sin(abc), -1, 0)
    rows = (
        (ca * cb, ca * sb * sc - sa * cc, ca * sb * cc + sa * sc),
        (sa * cb, sa * sb * sc + ca * cc, sa * sb * cc - ca * sc),
        (-sb, cb * sc, cb * cc),
    )
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def abc_of(R: Floats) -> Floats:
    """Angles of rotations.

    Args:
        R: (..., 3, 3).

    Returns:
        (..., 3), rad; B within +-90 degrees, A and C within +-180; A = 0 where A and C turn about one axis.
    """
    level = np.hypot(R[..., 0, 0], R[..., 1, 0])
    b = np.arctan2(-R[..., 2, 0], level)
    upright = level < 1e-10
    a = np.where(upright, 0.0, np.arctan2(R[..., 1, 0], R[..., 0, 0]))
    c = np.where(upright, np.arctan2(-R[..., 1, 2], R[..., 1, 1]), np.arctan2(R[..., 2, 1], R[..., 2, 2]))
    return np.stack((a, b, c), axis=-1)


def frames_of_poses(pose: Floats) -> Floats:
    """Poses as matrices.

    Args:
        pose: X Y Z A B C, (..., 6), m and rad.

    Returns:
        (..., 4, 4), m.
    """
    T = np.zeros((*pose.shape[:-1], 4, 4))
    T[..., :3, :3] = rotation_of(pose[..., 3:])
    T[..., :3, 3] = pose[..., :3]
    T[..., 3, 3] = 1.0
    return T


def pose_of(T: Floats) -> Floats:
    """Matrices as poses: the inverse of :func:`frames_of_poses`, with the angles of :func:`abc_of`."""
    return np.concatenate((T[..., :3, 3], abc_of(T[..., :3, :3])), axis=-1)


def turns_the_longer_way(start: Floats, via: Floats, end: Floats) -> bool:
    """Whether an orientation on the way speaks for the longer of the two ways round from one to another.

    Args:
        start: (3, 3).
        via: (3, 3).
        end: (3, 3).

    Returns:
        Whether it lies beyond the shorter way by more than ``LOOSE``; False where start and end are the same.
    """
    way = Rotation.from_matrix(start.T @ end).as_rotvec()
    angle = float(np.linalg.norm(way))
    if angle < SAME_ORIENTATION:
        return False
    x, y, z, w = Rotation.from_matrix(start.T @ via).as_quat()
    nearest = 2 * atan2(float(np.array([x, y, z]) @ way) / angle, w)  # on the circle of both ways
    off = abs((nearest - angle / 2 + pi) % tau - pi)  # from the middle of the shorter one
    return off > angle / 2 + LOOSE


def run_on(abc: tuple[float, float, float], before: tuple[float, float, float]) -> tuple[float, float, float]:
    """Write an orientation as near to the one before as it can be written.

    Whole turns are added, and A+180, 180-B, C+180 is taken where it is nearer, so that a path through B = 90 degrees
    goes on to B = 91. At B = +-90 degrees only a sum or a difference of A and C means anything: both take half of its
    change.

    Args:
        abc: the angles, rad.
        before: the angles written before, rad.

    Returns:
        The angles, rad.
    """
    if abs(cos(abc[1])) < DEGENERATE:
        return _shared(abc, before)
    given, other = (_nearest(angles, before) for angles in (abc, (abc[0] + pi, pi - abc[1], abc[2] + pi)))
    return other if _apart(other, before) < _apart(given, before) - ROUNDING_ANGLE else given


def _shared(abc: tuple[float, float, float], before: tuple[float, float, float]) -> tuple[float, float, float]:
    """Angles at B = +-90 degrees."""
    quarter = round((abc[1] - pi / 2) / pi)  # B is 90 degrees and so many half turns
    b = pi / 2 + pi * quarter
    # R depends on A - C at B = 90 degrees and on A + C at B = -90; half a turn of B goes with half turns of A and C,
    # which the sum and the difference do not see
    sign = 1.0 if quarter % 2 == 0 else -1.0
    turn = abc[0] - sign * abc[2]
    b += tau * round((before[1] - b) / tau)
    change = turn - (before[0] - sign * before[2])
    change -= tau * round(change / tau)
    a, c = before[0] + change / 2, before[2] - sign * change / 2
    as_given = _nearest((abc[0], b, abc[2]), before)
    if abs(as_given[0] - a) < ROUNDING_ANGLE and abs(as_given[2] - c) < ROUNDING_ANGLE:
        return as_given
    return a, b, c


def _apart(abc: tuple[float, float, float], before: tuple[float, float, float]) -> float:
    """The largest difference of two angles."""
    return max(abs(x - y) for x, y in zip(abc, before, strict=True))


def _nearest(abc: tuple[float, float, float], before: tuple[float, float, float]) -> tuple[float, float, float]:
    """Angles with whole turns added."""
    a, b, c = (x + tau * round((y - x) / tau) for x, y in zip(abc, before, strict=True))
    return a, b, c
