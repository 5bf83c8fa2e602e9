"""Closed-form inverse kinematics of arms with parallel A2, A3 and a spherical wrist.

``solve`` gives all eight configurations of every pose of an arm of the class::

    form = recognise(chain)                # of ik.spherical_wrist; None where the arm is of another class
    q = solve(form, Ts_base_tcp)           # (..., 8, 6) rad, NaN where a branch does not exist

Branch b = 4 * shoulder + 2 * elbow + wrist, each 0 or 1. Away from a singularity a continuous motion keeps its branch.
Metres and radians.

Source: the arm by plane geometry (wrist centre on a circle about A1's axis, then two circles), the wrist by
Paden-Kahan subproblems, worked out for both its signs at once.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .chain import Floats, rotation_about
from .near_spherical_wrist import refined
from .spherical_wrist import SphericalWristArm, WristConstants

BRANCHES = 8
BLOCK = 1024  # poses worked on at a time: what fits a core's cache
TURN = 2 * np.pi
ROUNDING = 1e-10  # how far out of reach (m, or a cosine) still counts as on the edge
NEAR_STRAIGHT = 1e-3  # sine between A4 and A6 below which only the sum of their angles is sharp


def wrist_centre(form: SphericalWristArm, Ts_base_tcp: Floats) -> Floats:
    """Wrist centres of TCP poses, (..., 4, 4) -> (..., 3), m, base frame."""
    return Ts_base_tcp[..., :3, 3] + Ts_base_tcp[..., :3, :3] @ form.wrist_in_tcp


def reach_excess(form: SphericalWristArm, Ts_base_tcp: Floats) -> Floats:
    """Distance of the wrist centre beyond the arm's reach, or within its inner limit.

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


def solve(form: SphericalWristArm, Ts_base_tcp: Floats) -> Floats:
    """All configurations of full poses.

    Args:
        form: the arm (with its tool) from :func:`recognise`.
        Ts_base_tcp: (..., 4, 4), m, base frame.

    Returns:
        (..., 8, 6) rad, each angle in [-pi, pi]; NaN rows where a branch does not exist. With A4 and A6 in line, A4
        stands at zero and A6 does the turning. Joint limits are not examined. Of an arm that is a little off its
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
    """The configurations of one branch, bit-identical to those of :func:`solve`.

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


def _wrist_angles(wrist: WristConstants, turned: tuple[Floats, Floats, Floats], out: Floats) -> NDArray[np.bool_]:
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
