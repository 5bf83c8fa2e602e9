"""Poses as KUKA writes them: X Y Z A B C, with R = Rz(A) Ry(B) Rx(C).

Use:

    T = pose_matrices(xyzabc)                 # (m, 6), m and rad -> (m, 4, 4)
    xyzabc = pose_rows(T)                     # and back: A B C run on continuously from row to row

At B = +-90 deg A and C turn about one axis: there the pair is taken that is nearest to the row before. Everywhere a
pose has two triples, A B C and A + 180, 180 - B, C + 180, and each angle has its whole turns: the one nearest to the
row before is taken, so that what a person reads in a program does not jump.
"""

from __future__ import annotations

import numpy as np

from ik.chain import Floats

LOCK = 1e-9  # sine of the angle between the x axis and +-z below which A and C are about one axis
TURN = 2 * np.pi


def pose_matrices(rows: Floats) -> Floats:
    """Poses (m, 4, 4) of rows X Y Z A B C (m, 6), m and rad."""
    rows = np.asarray(rows, dtype=float)
    (ca, cb, cc), (sa, sb, sc) = np.cos(rows[:, 3:]).T, np.sin(rows[:, 3:]).T
    T = np.zeros((len(rows), 4, 4))
    T[:, 0, :3] = np.stack([ca * cb, ca * sb * sc - sa * cc, ca * sb * cc + sa * sc], axis=1)
    T[:, 1, :3] = np.stack([sa * cb, sa * sb * sc + ca * cc, sa * sb * cc - ca * sc], axis=1)
    T[:, 2, :3] = np.stack([-sb, cb * sc, cb * cc], axis=1)
    T[:, :3, 3] = rows[:, :3]
    T[:, 3, 3] = 1.0
    return T


def pose_rows(T: Floats, before: Floats | None = None) -> Floats:
    """Rows X Y Z A B C of poses, each row's angles nearest to those of the row before.

    Args:
        T: (m, 4, 4), m.
        before: A B C of the row before the first, (3,), rad; the first row's are within half a turn where left out.

    Returns:
        (m, 6), m and rad.
    """
    T = np.asarray(T, dtype=float)
    R = T[:, :3, :3]
    flat = np.hypot(R[:, 0, 0], R[:, 1, 0])
    a = np.arctan2(R[:, 1, 0], R[:, 0, 0])
    b = np.arctan2(-R[:, 2, 0], flat)
    c = np.arctan2(R[:, 2, 1], R[:, 2, 2])
    angles = np.stack([a, b, c], axis=1)
    last = before
    for i in range(len(T)):
        angles[i] = _nearest(angles[i], R[i], bool(flat[i] < LOCK), last)
        last = angles[i]
    return np.concatenate([T[:, :3, 3], angles], axis=1)


def _nearest(abc: Floats, R: Floats, locked: bool, before: Floats | None) -> Floats:
    if locked:
        # A - C (B = 90) or A + C (B = -90) is all that is known: the change is shared by both
        sign = 1.0 if R[2, 0] < 0 else -1.0
        total = np.arctan2(-R[0, 1], R[1, 1])  # A - sign C
        a, c = (0.0, 0.0) if before is None else (float(before[0]), float(before[2]))
        off = total - (a - sign * c)
        off -= TURN * np.round(off / TURN)
        abc = np.array([a + off / 2, sign * np.pi / 2, c - sign * off / 2])
        return abc if before is None else _unwound(abc, before)
    if before is None:
        return abc
    other = np.array([abc[0] + np.pi, np.pi - abc[1], abc[2] + np.pi])
    one, two = _unwound(abc, before), _unwound(other, before)
    return one if np.abs(one - before).sum() <= np.abs(two - before).sum() + 1e-12 else two


def _unwound(abc: Floats, before: Floats) -> Floats:
    out: Floats = abc - TURN * np.round((abc - before) / TURN)
    return out
