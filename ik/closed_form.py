"""Closed-form inverse kinematics of arms with parallel A2, A3 and a spherical wrist.

``recognise`` reads the class off the chain's own axes, never off a name; ``solve`` then gives all eight
configurations of every pose::

    form = recognise(chain)                # None where the arm is of another class
    q = solve(form, Ts_base_tcp)           # (..., 8, 6) rad, NaN where a branch does not exist

Branch b = 4 * shoulder + 2 * elbow + wrist, each 0 or 1. Away from a singularity a continuous motion keeps its branch.
Metres and radians.

Source: the arm by plane geometry (wrist centre on a circle about A1's axis, then two circles), the wrist by
Paden-Kahan subproblems, worked out for both its signs at once; the class is that of Brandstoetter, Angerer, Hofbaur
2014 (ortho-parallel basis with a spherical wrist), here without their restriction on the wrist's angles.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from .chain import Chain, Floats, rotation_about
from .deviation import Deviation, deviation, refined

BRANCHES = 8
BLOCK = 1024  # poses worked on at a time: what fits a core's cache
TURN = 2 * np.pi
ROUNDING = 1e-10  # how far out of reach (m, or a cosine) still counts as on the edge
TOLERANCE = 5e-4  # m, or sine of an angle: what an arm may be off its class and still be taken for one of it
NEAR_CLASS = 5e-3  # the same: what an arm may be off and still have the margins of one of its class
ROUND_OFF = 1e-9  # the same: what is rounding alone
PARALLEL = 1e-3  # sine below which two axes of the wrist count as parallel
NEAR_STRAIGHT = 1e-3  # sine between A4 and A6 below which only the sum of their angles is sharp


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
    def wrist(self) -> _Wrist:
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


def wrist_centre(form: SphericalWristArm, Ts_base_tcp: Floats) -> Floats:
    """Wrist centres of TCP poses, (..., 4, 4) -> (..., 3), m, base frame."""
    return Ts_base_tcp[..., :3, 3] + Ts_base_tcp[..., :3, :3] @ form.wrist_in_tcp


def reach_excess(form: SphericalWristArm, Ts_base_tcp: Floats) -> Floats:
    """How far the wrist centre lies out of the arm's reach.

    Args:
        form: the arm.
        Ts_base_tcp: (..., 4, 4), m.

    Returns:
        (...) m: positive beyond the reach, negative where the arm cannot fold up enough, 0 where it gets there (over
        the better of facing forwards and backwards).
    """
    v = (wrist_centre(form, Ts_base_tcp) - form.origin) @ form.wrist.to_own.T
    rho = _radius(form, v[..., 0], v[..., 1])[0]
    low, high = form.reach
    out = np.empty((*rho.shape, 2))
    for i, sign in enumerate((1.0, -1.0)):
        s = np.hypot(v[..., 2] - form.zeta_2.real, sign * rho - form.zeta_2.imag)
        out[..., i] = np.maximum(s - high, 0.0) - np.maximum(low - s, 0.0)
    best = np.argmin(np.abs(out), axis=-1)
    out = np.take_along_axis(out, best[..., None], axis=-1)[..., 0]
    # inside the cylinder that the lateral offset keeps from A1
    return np.where(np.isnan(rho), np.hypot(v[..., 0], v[..., 1]) - abs(form.lateral), out)


@dataclass(frozen=True, eq=False)
class _Wrist:
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


def _wrist_of(form: SphericalWristArm) -> _Wrist:
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
    return _Wrist(
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


def solve(form: SphericalWristArm, Ts_base_tcp: Floats) -> Floats:
    """All configurations of full poses.

    Args:
        form: the arm (with its tool) from :func:`recognise`.
        Ts_base_tcp: (..., 4, 4), m, base frame.

    Returns:
        (..., 8, 6) rad, each angle in [-pi, pi]; NaN rows where a branch does not exist. With A4 and A6 in line, A4
        stands at zero and A6 does the turning. Joint limits are not looked at. Of an arm that is a little off its
        class they are the true chain's, refined from those of the class; in a singularity some may be missing.
    """
    shape = Ts_base_tcp.shape[:-2]
    Ts = Ts_base_tcp.reshape(-1, 4, 4)
    out = np.empty((len(Ts), BRANCHES, 6))
    for first in range(0, len(Ts), BLOCK):
        block = slice(first, first + BLOCK)
        out[block] = _solve_block(form, Ts[block])
    if form.off is not None:
        out = refined(form.off.chain, out, Ts)
        out -= TURN * np.floor((out + np.pi) / TURN)
    return out.reshape(*shape, BRANCHES, 6)


def solve_branch(form: SphericalWristArm, Ts_base_tcp: Floats, branch: int) -> Floats:
    """One branch's configurations of full poses, the same to the bit as :func:`solve` has them.

    Args:
        form: the arm (with its tool) from :func:`recognise`.
        Ts_base_tcp: (..., 4, 4), m, base frame.
        branch: its number, 0 to 7.

    Returns:
        (..., 6) rad; NaN rows where it does not exist.
    """
    if form.off is not None:  # which branch one becomes that is refined depends on the others
        return np.asarray(solve(form, Ts_base_tcp)[..., branch, :])
    Ts = Ts_base_tcp.reshape(-1, 4, 4)
    out = np.empty((len(Ts), 6))
    for first in range(0, len(Ts), BLOCK):
        block = slice(first, first + BLOCK)
        out[block] = _solve_block(form, Ts[block], (branch // 2,))[:, branch % 2]
    return out.reshape(*Ts_base_tcp.shape[:-2], 6)


def _solve_block(form: SphericalWristArm, Ts: Floats, arms: tuple[int, ...] = (0, 1, 2, 3)) -> Floats:
    """As :func:`solve`, (m, 4, 4) -> (m, 8, 6); poses run along the last axis inside.

    Of some arms, which are branches but for the wrist, two branches each: 2 shoulder + elbow.
    """
    wrist = form.wrist
    m = len(Ts)
    vectors = (wrist.pose_map @ Ts[:, :3].reshape(m, 12).T).reshape(3, 4, m)
    vectors[:, 3] -= (wrist.to_own @ form.origin)[:, None]
    u_r, u_b, h = vectors[:, 3]
    rho, phi = _radius(form, u_r, u_b)
    azimuth = np.arctan2(u_b, u_r)
    q = np.empty((len(arms), 2, 6, m))  # arm, wrist, joint
    straight = np.empty((len(arms), m), dtype=bool)
    for shoulder in sorted({arm // 2 for arm in arms}):
        q1 = azimuth - phi if shoulder == 0 else azimuth + phi - np.pi
        c, s = np.cos(q1), np.sin(q1)
        x, y, z = vectors[:, :3]
        x, y = c * x + s * y, c * y - s * x
        for elbow, (q2, q3) in enumerate(_elbows(form, h, rho if shoulder == 0 else -rho)):
            if 2 * shoulder + elbow not in arms:
                continue
            k = arms.index(2 * shoulder + elbow)
            here = q[k]
            here[:, 0], here[:, 1], here[:, 2] = q1, q2, form.sign_3 * q3
            c, s = np.cos(q2 + q3), np.sin(q2 + q3)
            straight[k] = _wrist_angles(wrist, (c * x - s * z, y, c * z + s * x), here)
    q -= TURN * np.floor((q + np.pi) / TURN)
    out = np.ascontiguousarray(q.reshape(-1, 6, m).transpose(2, 0, 1))
    out[np.isnan(out[..., 3:5]).any(axis=-1)] = np.nan  # what has no arm has no wrist either
    at = np.argwhere(np.repeat(straight, 2, axis=0).T)
    if len(at):
        pose, branch = at.T
        out[pose, branch, 5] = _last_angle(form, out[pose, branch], Ts[pose, :3, :3])
    return out


def _radius(form: SphericalWristArm, u_r: Floats, u_b: Floats) -> tuple[Floats, Floats]:
    """The wrist centre's radius in the arm's plane, and that plane's angle against it."""
    distance, offset = np.sqrt(u_r * u_r + u_b * u_b), abs(form.lateral)
    # a rounding error inside is a wrist centre exactly on the edge
    square = np.maximum(distance - offset, 0.0) * (distance + offset)
    rho = np.sqrt(np.where(distance < offset - ROUNDING, np.nan, square))
    return rho, np.arctan2(form.lateral, rho)


def _elbows(form: SphericalWristArm, h: Floats, rho: Floats) -> list[tuple[Floats, Floats]]:
    """A2 and A3 (as an angle about A2's axis) of both elbows, each (m,)."""
    la, lf = abs(form.upper_arm), abs(form.forearm)
    zero_2, zero_3 = float(np.angle(form.upper_arm)), float(np.angle(form.forearm))
    up, out = h - form.zeta_2.real, rho - form.zeta_2.imag
    cosine = (up * up + out * out - (la * la + lf * lf)) / (2 * la * lf)
    cosine = np.where(np.abs(cosine) > 1 + ROUNDING, np.nan, np.clip(cosine, -1.0, 1.0))
    bend = np.arccos(cosine)
    inner = np.arctan2(lf * np.sqrt((1 - cosine) * (1 + cosine)), la + lf * cosine)
    towards = np.arctan2(out, up) - zero_2
    return [(towards - inner, bend + zero_2 - zero_3), (towards + inner, zero_2 - zero_3 - bend)]


def _wrist_angles(wrist: _Wrist, turned: tuple[Floats, Floats, Floats], out: Floats) -> NDArray[np.bool_]:
    """A4, A5, A6 of both wrists.

    Args:
        wrist: the constants.
        turned: r, b and h components of A6's axis and the two directions across it, with A1 to A3 taken out,
            (3, m) each.
        out: where the angles go, (2, 6, m).

    Returns:
        (m,): where A4 and A6 are so close to a line that A6 needs working out from A4.
    """
    height, along_m, along_n = wrist.w4[0] * turned[0] + wrist.w4[1] * turned[1] + wrist.w4[2] * turned[2]
    x, y, z = turned[0][0], turned[1][0], turned[2][0]
    v_p = wrist.p[0] * x + wrist.p[1] * y + wrist.p[2] * z
    v_s = wrist.s[0] * x + wrist.s[1] * y + wrist.s[2] * z
    across = v_p * v_p + v_s * v_s
    # 1 - height and 1 + height; the smaller one from the part across, where nothing cancels
    far = 1 + np.abs(height)
    near, up = across / far, height > 0
    low = np.where(up, near, far) - wrist.low
    high = np.where(up, far, near) - wrist.high
    outside = np.minimum(low, high) < -ROUNDING
    low, high = np.maximum(low, 0.0), np.where(outside, np.nan, np.maximum(high, 0.0))
    root = np.sqrt(low * high)
    delta = np.arctan2(root, (high - low) / 2)
    c, s = (high - low) / (2 * wrist.r), root / wrist.r
    lead_4 = np.arctan2(wrist.lead_4[2] * s, wrist.lead_4[0] + wrist.lead_4[1] * c)
    lead_6 = np.arctan2(wrist.lead_6[2] * s, wrist.lead_6[0] + wrist.lead_6[1] * c)
    a4, a6 = np.arctan2(v_s, v_p), -np.arctan2(along_n, along_m)
    aligned = across < 1e-24  # any split will do: A4 stays at zero
    for side, angles in zip((1.0, -1.0), out, strict=True):
        angles[3] = np.where(aligned, 0.0, a4 - side * lead_4)
        angles[4] = wrist.base + side * delta
        angles[5] = a6 - side * lead_6
    return across < NEAR_STRAIGHT**2


def _last_angle(form: SphericalWristArm, q: Floats, R_base_tcp: Floats) -> Floats:
    """A6 that completes A1 to A5, (m, 6) and (m, 3, 3) -> (m,) rad."""
    w = form.axes
    R = rotation_about(w[0], q[:, 0]) @ rotation_about(w[1], q[:, 1] + form.sign_3 * q[:, 2])
    R = R @ rotation_about(w[3], q[:, 3]) @ rotation_about(w[4], q[:, 4])
    left = np.swapaxes(R, 1, 2) @ R_base_tcp @ form.R_tcp_0.T
    x = np.cross(w[5], np.eye(3)[int(np.argmin(np.abs(w[5])))])
    x /= np.linalg.norm(x)
    turned = left @ x
    return np.arctan2(turned @ np.cross(w[5], x), turned @ x)
