"""Closed-form inverse kinematics of arms with parallel A2, A3 and a spherical wrist.

``recognise`` reads the class off the chain's own axes, never off a name; ``solve`` then gives all eight
configurations of every pose::

    form = recognise(chain)                # None where the arm is of another class
    q = solve(form, Ts_base_tcp)           # (..., 8, 6) rad, NaN where a branch does not exist

Branch b = 4 * shoulder + 2 * elbow + wrist, each 0 or 1. Away from a singularity a continuous motion keeps its branch.
Metres and radians.

Source: the arm by plane geometry (wrist centre on a circle about A1's axis, then two circles), the wrist by
Paden-Kahan subproblems; the class is that of Brandstoetter, Angerer, Hofbaur 2014 (ortho-parallel basis with a
spherical wrist), here without their restriction on the wrist's angles.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .chain import Chain, Floats, rotation_about

BRANCHES = 8


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

    @property
    def reach(self) -> tuple[float, float]:
        """Least and largest distance of the wrist centre from A2's axis, m."""
        a, d = abs(self.upper_arm), abs(self.forearm)
        return abs(a - d), a + d


def recognise(chain: Chain, tolerance: float = 1e-9) -> SphericalWristArm | None:
    """Read the class off a chain.

    Args:
        chain: any chain.
        tolerance: how exact parallels, right angles and crossings must be (m, or sine of an angle).

    Returns:
        The arm's constants, or None where the chain has not six joints, A2 is not parallel to A3, A1 not across A2, or
        A4, A5, A6 do not meet in one point.
    """
    if chain.n != 6:
        return None
    R, p = (a[0] for a in chain.frames(np.zeros((1, 6))))
    w = np.einsum("nij,nj->ni", R, chain.axes)
    wrist = _crossing(p[3], w[3], p[4], w[4], tolerance)
    if wrist is None or np.linalg.norm(np.cross(wrist - p[5], w[5])) > tolerance:
        return None
    if np.linalg.norm(np.cross(w[1], w[2])) > tolerance or abs(w[0] @ w[1]) > tolerance:
        return None
    if np.linalg.norm(np.cross(w[4], w[5])) < 1e-3:
        return None
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
    )


def _crossing(p: Floats, u: Floats, q: Floats, v: Floats, tolerance: float) -> Floats | None:
    """The point where two lines meet, or None where they are parallel or pass each other."""
    n = np.cross(u, v)
    size = np.linalg.norm(n)
    if size < 1e-3 or abs((q - p) @ n) / size > tolerance:
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
    h, rho = _plane_coordinates(form, wrist_centre(form, Ts_base_tcp))[:2]
    low, high = form.reach
    out = np.full((*np.shape(h), 2), np.inf)
    for i, sign in enumerate((1.0, -1.0)):
        s = np.hypot(h - form.zeta_2.real, sign * np.nan_to_num(rho) - form.zeta_2.imag)
        out[..., i] = np.maximum(s - high, 0.0) - np.maximum(low - s, 0.0)
    out[np.isnan(rho)] = -abs(form.lateral)  # inside the cylinder that the lateral offset keeps from A1
    best = np.argmin(np.abs(out), axis=-1)
    return np.take_along_axis(out, best[..., None], axis=-1)[..., 0]


def _plane_coordinates(form: SphericalWristArm, centre: Floats) -> tuple[Floats, Floats, Floats]:
    v = centre - form.origin
    h = v @ form.axes[0]
    u_r, u_b = v @ form.e_r, v @ form.axes[1]
    square = u_r**2 + u_b**2 - form.lateral**2
    # a rounding error below zero is a wrist centre exactly on the edge
    rho = np.sqrt(np.where(square < -1e-12, np.nan, np.maximum(square, 0.0)))
    return h, rho, np.arctan2(u_b, u_r)


def solve(form: SphericalWristArm, Ts_base_tcp: Floats) -> Floats:
    """All configurations of full poses.

    Args:
        form: the arm (with its tool) from :func:`recognise`.
        Ts_base_tcp: (..., 4, 4), m, base frame.

    Returns:
        (..., 8, 6) rad, each angle in [-pi, pi); NaN rows where a branch does not exist. Joint limits are not
        looked at.
    """
    shape = Ts_base_tcp.shape[:-2]
    Ts = Ts_base_tcp.reshape(-1, 4, 4)
    arm = _arm_angles(form, wrist_centre(form, Ts))
    S = _wrist_rotation(form, arm, Ts[:, None, :3, :3])
    q = np.concatenate([np.repeat(arm, 2, axis=1), _wrist_angles(form, S)], axis=-1)
    q[np.isnan(q).any(axis=-1)] = np.nan
    return ((q + np.pi) % (2 * np.pi) - np.pi).reshape(*shape, BRANCHES, 6)


def _arm_angles(form: SphericalWristArm, centre: Floats) -> Floats:
    """A1, A2, A3 of the four arm branches, (m, 4, 3)."""
    h, rho, azimuth = _plane_coordinates(form, centre)
    arm = np.empty((len(h), 4, 3))
    la, lf = abs(form.upper_arm), abs(form.forearm)
    bend = np.angle(form.forearm) - np.angle(form.upper_arm)
    for shoulder, sign in enumerate((1.0, -1.0)):
        q1 = azimuth - np.arctan2(form.lateral, sign * rho)
        t = h + 1j * sign * rho - form.zeta_2
        cosine = (np.abs(t) ** 2 - la**2 - lf**2) / (2 * la * lf)
        cosine = np.where(np.abs(cosine) > 1 + 1e-12, np.nan, np.clip(cosine, -1.0, 1.0))
        for elbow, side in enumerate((1.0, -1.0)):
            q3 = side * np.arccos(cosine) - bend  # as an angle about A2
            q2 = np.angle(t) - np.angle(form.upper_arm + np.exp(1j * q3) * form.forearm)
            arm[:, 2 * shoulder + elbow] = np.stack([q1, q2, form.sign_3 * q3], axis=-1)
    return arm


def _wrist_rotation(form: SphericalWristArm, arm: Floats, R_base_tcp: Floats) -> Floats:
    """What A4, A5, A6 have to turn, (m, 4, 3, 3), in the frame of the arm at zero."""
    E1 = rotation_about(form.axes[0], arm[..., 0])
    E23 = rotation_about(form.axes[1], arm[..., 1] + form.sign_3 * arm[..., 2])
    return np.swapaxes(E1 @ E23, -1, -2) @ R_base_tcp @ form.R_tcp_0.T


def _wrist_angles(form: SphericalWristArm, S: Floats) -> Floats:
    """A4, A5, A6 of both wrist branches, (m, 8, 3), wrist varying fastest."""
    w4, w5, w6 = form.axes[3:]
    v = S @ w6
    along = w5 * (w5 @ w6)
    a, b = w4 @ (w6 - along), w4 @ np.cross(w5, w6)
    ratio = (v @ w4 - w4 @ along) / np.hypot(a, b)
    ratio = np.where(np.abs(ratio) > 1 + 1e-9, np.nan, np.clip(ratio, -1.0, 1.0))
    n6 = np.cross(w6, np.eye(3)[np.argmin(np.abs(w6))])
    n6 /= np.linalg.norm(n6)
    out = np.empty((*v.shape[:-1], 2, 3))
    for wrist, side in enumerate((1.0, -1.0)):
        q5 = np.arctan2(b, a) + side * np.arccos(ratio)
        E5 = rotation_about(w5, q5)
        x = E5 @ w6
        x, y = x - w4 * (x @ w4)[..., None], v - w4 * (v @ w4)[..., None]
        # with A4 and A6 in line any split will do: A4 stays at zero
        q4 = np.arctan2(np.cross(x, y) @ w4, np.einsum("...i,...i->...", x, y))
        q4 = np.where(np.einsum("...i,...i->...", x, x) < 1e-24, 0.0, q4)
        E45 = rotation_about(w4, q4) @ E5
        turned = np.einsum("...ji,...j->...i", E45, S @ n6)
        q6 = np.arctan2(np.cross(n6, turned) @ w6, turned @ n6)
        out[..., wrist, :] = np.stack([q4, q5, q6], axis=-1)
    return out.reshape(v.shape[0], -1, 3)
