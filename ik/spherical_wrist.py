"""Arms with parallel A2, A3 and a spherical wrist: the class whose inverse kinematics has a closed form.

``recognise`` reads the class off the chain's own axes, never off a name::

    form = recognise(chain)                # None where the arm is of another class
    misfits(chain)                         # [("A1 and A2 are off a right angle by", 0.4, "deg")]

Metres and radians.

Source: the class is that of Brandstoetter, Angerer, Hofbaur 2014 (ortho-parallel basis with a spherical wrist), here
without their restriction on the wrist's angles.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .chain import Chain, Floats
from .near_spherical_wrist import Deviation, deviation

TOLERANCE = 5e-4  # m, or sine of an angle: what an arm may be off its class and still be taken for one of it
NEAR_CLASS = 5e-3  # the same: what an arm may be off and still have the margins of one of its class
ROUND_OFF = 1e-9  # the same: what is rounding alone
PARALLEL = 1e-3  # sine below which two axes of the wrist count as parallel


@dataclass(frozen=True, eq=False)
class SphericalWristArm:
    """An arm of the class, in the base frame with all axes at zero.

    Attributes:
        axes: unit joint axes, (6, 3).
        origin: a point on A1's axis, (3,), m.
        e_r: unit vector across A1 and A2, (3,): the arm's forward direction.
        wrist_in_tcp: the wrist centre in the TCP's frame, (3,), m.
        R_tcp_0: the TCP's orientation, (3, 3).
        lateral: offset of the wrist centre along A2, m.
        zeta_2: A2 in the arm's plane as height + i * radius, m.
        upper_arm: A2 to A3, likewise.
        forearm: A3 to the wrist centre, likewise.
        sign_3: +1 where A3 turns like A2, -1 where it turns the other way.
        off: how far the chain is off this arm; None where by no more than rounding.
    """

    axes: Floats
    origin: Floats
    e_r: Floats
    wrist_in_tcp: Floats
    R_tcp_0: Floats
    lateral: float
    zeta_2: complex
    upper_arm: complex
    forearm: complex
    sign_3: float
    off: Deviation | None = None

    @cached_property
    def wrist(self) -> WristConstants:
        """Constants of the last three joints."""
        return _wrist_of(self)

    @property
    def reach(self) -> tuple[float, float]:
        """Least and largest distance of the wrist centre from A2's axis, m."""
        a, d = abs(self.upper_arm), abs(self.forearm)
        return abs(a - d), a + d


def recognise(chain: Chain, tolerance: float = ROUND_OFF) -> SphericalWristArm | None:
    """Read the class off a chain.

    Args:
        chain: any chain.
        tolerance: how far parallels, right angles and crossings may be off (m, or sine of an angle), e.g.
            :data:`TOLERANCE`. An arm that is off by more than rounding is taken for the one of the class next to it,
            and carries how far that is.

    Returns:
        The arm's constants, or None where the chain has not six joints, A2 is not parallel to A3, A1 not across A2, or
        A4, A5, A6 do not meet in one point.
    """
    if chain.n != 6:
        return None
    R, p = (a[0] for a in chain.frames(np.zeros((1, 6))))
    w = np.einsum("nij,nj->ni", R, chain.axes)
    exact = _fits(p, w, ROUND_OFF)
    if not exact and not _fits(p, w, tolerance):
        return None
    crossing = _crossing(p[3], w[3], p[4], w[4], ROUND_OFF) if exact else None
    wrist = _meeting(p[3:], w[3:]) if crossing is None else crossing
    off = None
    if not exact:
        w = w.copy()
        w[1] -= w[0] * (w[0] @ w[1])
        w[1] /= np.linalg.norm(w[1])
        w[2] = np.sign(w[1] @ w[2]) * w[1]
        off = deviation(chain, w, wrist)
    T = chain.forward(np.zeros((1, 6)))[0]
    e_r = np.cross(w[1], w[0])

    def planar(point: Floats) -> complex:
        v = point - p[0]
        return complex(v @ w[0], v @ e_r)

    zeta_2, zeta_3, zeta_w = planar(p[1]), planar(p[2]), planar(wrist)
    if min(abs(zeta_3 - zeta_2), abs(zeta_w - zeta_3)) < 1e-6:
        return None
    return SphericalWristArm(
        axes=w,
        origin=p[0],
        e_r=e_r,
        wrist_in_tcp=T[:3, :3].T @ (wrist - T[:3, 3]),
        R_tcp_0=T[:3, :3],
        lateral=float((wrist - p[0]) @ w[1]),
        zeta_2=zeta_2,
        upper_arm=zeta_3 - zeta_2,
        forearm=zeta_w - zeta_3,
        sign_3=float(np.sign(w[1] @ w[2])),
        off=off,
    )


def misfits(chain: Chain) -> list[tuple[str, float, str]]:
    """What keeps a chain of six joints from the class, in words, by how much, and in mm or deg.

    Args:
        chain: six joints.

    Returns:
        One row for each condition of the class that is off by more than :data:`TOLERANCE`.
    """
    R, p = (a[0] for a in chain.frames(np.zeros((1, 6))))
    w = np.einsum("nij,nj->ni", R, chain.axes)
    degrees = [
        ("A1 and A2 are off a right angle by", abs(w[0] @ w[1])),
        ("A2 and A3 are off parallel by", np.linalg.norm(np.cross(w[1], w[2]))),
    ]
    out = [(text, float(np.rad2deg(np.arcsin(min(s, 1.0)))), "deg") for text, s in degrees if s > TOLERANCE]
    for text, i, j in (("A4 and A5", 3, 4), ("A5 and A6", 4, 5)):
        if np.linalg.norm(np.cross(w[i], w[j])) < PARALLEL:
            out.append((f"{text} are parallel, by", 0.0, "deg"))
            return out
    apart = _apart(_meeting(p[3:], w[3:]), p[3:], w[3:])
    if apart > TOLERANCE:
        out.append(("A4, A5, A6 pass the point nearest to all three at", 1e3 * apart, "mm"))
    return out


def _fits(p: Floats, w: Floats, tolerance: float) -> bool:
    """Whether joint axes (points (6, 3) and directions) are those of the class."""
    if min(np.linalg.norm(np.cross(w[3], w[4])), np.linalg.norm(np.cross(w[4], w[5]))) < PARALLEL:
        return False
    if np.linalg.norm(np.cross(w[1], w[2])) > tolerance or abs(w[0] @ w[1]) > tolerance:
        return False
    if tolerance > ROUND_OFF:
        return _apart(_meeting(p[3:], w[3:]), p[3:], w[3:]) <= tolerance
    wrist = _crossing(p[3], w[3], p[4], w[4], tolerance)
    return wrist is not None and bool(np.linalg.norm(np.cross(wrist - p[5], w[5])) <= tolerance)


def _meeting(p: Floats, w: Floats) -> Floats:
    """The point nearest to some lines, (k, 3) and unit directions (k, 3), by least squares."""
    across = np.eye(3) - w[:, :, None] * w[:, None, :]
    return np.asarray(np.linalg.solve(across.sum(axis=0), np.einsum("kij,kj->i", across, p)))


def _apart(point: Floats, p: Floats, w: Floats) -> float:
    """Largest distance of a point from some lines, m."""
    return float(np.linalg.norm(np.cross(point - p, w), axis=1).max())


def _crossing(p: Floats, u: Floats, q: Floats, v: Floats, tolerance: float) -> Floats | None:
    """The point where two lines meet, or None where they are parallel or pass each other."""
    n = np.cross(u, v)
    size = np.linalg.norm(n)
    if size < PARALLEL or abs((q - p) @ n) / size > tolerance:
        return None
    return p + u * (np.cross(q - p, v) @ n) / size**2


@dataclass(frozen=True, eq=False)
class WristConstants:
    """What A4, A5, A6 need, with vectors in the arm's own axes (r, b, h): forwards, along A2, along A1.

    A5 turns A6's axis round a circle whose height along A4 is ``k + r cos(delta)``, delta counted from ``base``.

    Attributes:
        to_own: the arm's axes as rows, (3, 3), base frame.
        pose_map: maps the upper three rows of a TCP pose, flattened, to A6's axis, ``n``, ``n x`` and the wrist
            centre, in the arm's axes, (12, 12).
        w4: A4's axis, (3,).
        p: across A4, where A6's axis lies at delta = 0, (3,).
        s: w4 cross p, (3,).
        base: A5 at delta = 0, rad.
        low: 1 - (k + r), high: 1 + (k - r); both 0 where A5 is at right angles to A4 and A6.
        r: see above.
        lead_4: A6's axis against A4 as it turns: constant, cosine and sine parts along p, p, s.
        lead_6: A4's axis against A6, likewise.
    """

    to_own: Floats
    pose_map: Floats
    w4: Floats
    p: Floats
    s: Floats
    base: float
    low: float
    high: float
    r: float
    lead_4: tuple[float, float, float]
    lead_6: tuple[float, float, float]


def _wrist_of(form: SphericalWristArm) -> WristConstants:
    w4, w5, w6 = form.axes[3:]
    flat_6, across_6, side_6 = w5 * (w5 @ w6), w6 - w5 * (w5 @ w6), np.cross(w5, w6)
    flat_4, across_4, side_4 = w5 * (w5 @ w4), w4 - w5 * (w5 @ w4), np.cross(w5, w4)
    a, b = float(w4 @ across_6), float(w4 @ side_6)
    base, r, k = float(np.arctan2(b, a)), float(np.hypot(a, b)), float(w4 @ flat_6)
    c, s = np.cos(base), np.sin(base)
    turn_6, swing_6 = c * across_6 + s * side_6, c * side_6 - s * across_6
    turn_4, swing_4 = c * across_4 - s * side_4, c * side_4 + s * across_4
    axis_s, axis_n = swing_6 / np.linalg.norm(swing_6), swing_4 / np.linalg.norm(swing_4)
    axis_p, axis_m = np.cross(axis_s, w4), np.cross(axis_n, w6)
    to_own = np.array([form.e_r, form.axes[1], form.axes[0]])
    K = np.zeros((4, 4))
    K[:3, :3] = form.R_tcp_0.T @ np.column_stack([w6, axis_m, axis_n])
    K[:3, 3], K[3, 3] = form.wrist_in_tcp, 1.0
    low, high = 1 - (k + r), 1 + (k - r)
    return WristConstants(
        to_own=to_own,
        pose_map=np.kron(to_own, K.T),
        w4=to_own @ w4,
        p=to_own @ axis_p,
        s=to_own @ axis_s,
        base=base,
        low=low if abs(low) > 1e-12 else 0.0,
        high=high if abs(high) > 1e-12 else 0.0,
        r=r,
        lead_4=_cleaned(flat_6 @ axis_p, turn_6 @ axis_p, float(np.linalg.norm(swing_6))),
        lead_6=_cleaned(flat_4 @ axis_m, turn_4 @ axis_m, float(np.linalg.norm(swing_4))),
    )


def _cleaned(*values: float) -> tuple[float, float, float]:
    a, b, c = (0.0 if abs(v) < 1e-14 else float(v) for v in values)
    return a, b, c
