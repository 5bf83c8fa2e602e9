"""How far a configuration is from a singularity.

``margins`` measures what a robot's controller trips over: the wrist (A4 and A6 in line), the elbow (arm stretched or
folded flat) and the shoulder (wrist centre over A1). The Jacobian is singular exactly where one of them is zero. Arms
without these features are judged by the smallest singular value of the scaled Jacobian alone::

    m = margins(chain, form, q)                       # (..., 4), in the order of KINDS
    (m >= limits.values(form is not None)).all(-1)    # which configurations keep SingularityLimits

Metres and radians.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .chain import Chain, Floats
from .spherical_wrist import SphericalWristArm

KINDS = ("wrist", "elbow", "shoulder", "sigma")
NEIGHBOURS = 4  # configurations of which one is examined first


@dataclass(frozen=True)
class SingularityLimits:
    """Least margins a configuration must keep.

    Attributes:
        wrist: angle of A5 from where the axes of A4, A5 and A6 lie in a plane (of common wrists: where A4 and A6 are
            in line), rad.
        elbow: angle of the elbow from stretched or folded flat, rad.
        shoulder: distance of the wrist centre from the line where A1 stops mattering, m.
        sigma: smallest singular value of the scaled Jacobian, for arms without a spherical wrist.
    """

    wrist: float = np.deg2rad(5.0)
    elbow: float = np.deg2rad(5.0)
    shoulder: float = 0.05
    sigma: float = 0.02

    def values(self, geometric: bool) -> Floats:
        """The limits of wrist, elbow, shoulder and sigma, (4,); those that do not apply are -inf.

        Args:
            geometric: whether the arm has a spherical wrist: its margins are angles and a length; else sigma counts.
        """
        none = -np.inf
        return np.array([self.wrist, self.elbow, self.shoulder, none] if geometric else [none, none, none, self.sigma])


def margins(chain: Chain, form: SphericalWristArm | None, q: Floats) -> Floats:
    """Distances from each kind of singularity.

    Args:
        chain: the arm with its tool.
        form: the arm's constants if it has a spherical wrist (``spherical_wrist.recognise``), else None.
        q: configurations, (..., n), rad.

    Returns:
        (..., 4) in the order of :data:`KINDS`: rad, rad, m, 1; infinite where a kind does not apply. NaN
        configurations give NaN.
    """
    out = np.full((*q.shape[:-1], len(KINDS)), np.inf)
    if form is None:
        flat = q.reshape(-1, q.shape[-1])
        good = np.isfinite(flat).all(axis=1)
        sigma = np.full(len(flat), np.nan)
        sigma[good] = smallest_singular_value(chain, flat[good])
        out[..., 3] = sigma.reshape(q.shape[:-1])
        return out
    q2, q3, q5 = q[..., 1], form.sign_3 * q[..., 2], q[..., 4]
    upper, forearm = np.angle(form.upper_arm), np.angle(form.forearm)
    out[..., 0] = _from_line(q5 - form.wrist.base)
    out[..., 1] = _from_line(q3 + (forearm - upper))
    radius = abs(form.upper_arm) * np.sin(q2 + upper) + abs(form.forearm) * np.sin(q2 + q3 + forearm)
    out[..., 2] = np.abs(form.zeta_2.imag + radius)
    return out


def sides(form: SphericalWristArm, q: Floats) -> NDArray[np.bool_]:
    """On which side of each singularity a configuration is: the arm's configuration (KUKA: status).

    Args:
        form: the arm's constants.
        q: configurations, (..., n), rad.

    Returns:
        (..., 3) for wrist, elbow and shoulder; one that changes along a motion has been crossed.
    """
    q2, q3, q5 = q[..., 1], form.sign_3 * q[..., 2], q[..., 4]
    upper, forearm = np.angle(form.upper_arm), np.angle(form.forearm)
    radius = abs(form.upper_arm) * np.sin(q2 + upper) + abs(form.forearm) * np.sin(q2 + q3 + forearm)
    signed = [np.sin(q5 - form.wrist.base), np.sin(q3 + (forearm - upper)), form.zeta_2.imag + radius]
    return np.stack(signed, axis=-1) >= 0


def _from_line(angle: Floats) -> Floats:
    """Distance of an angle from the nearest multiple of pi, rad."""
    distance: Floats = np.abs(angle - np.pi * np.round(angle / np.pi))
    return distance


def smallest_singular_value(chain: Chain, q: Floats) -> Floats:
    """Smallest singular value of the Jacobian with lengths scaled by the arm's reach.

    Args:
        chain: the arm with its tool.
        q: (m, n), rad.

    Returns:
        (m,); the linear rows are divided by the sum of the link lengths, so that the value has no unit.
    """
    return _smallest(_scaled_jacobians(chain, q))


def least_singular_value(chain: Chain, q: Floats) -> float:
    """The least of :func:`smallest_singular_value` along a way, of which most configurations are near one another.

    No singular value of a matrix differs from that of another by more than the norm of their difference (Weyl): where
    that tells that a neighbour's is no less than what is known, it is not worked out.

    Args:
        chain: the arm with its tool.
        q: (m, n), rad, one at least.
    """
    J, every = _scaled_jacobians(chain, q), np.arange(len(q))
    some = np.minimum(every[::NEIGHBOURS] + NEIGHBOURS // 2, len(q) - 1)
    known, of = _smallest(J[some]), every // NEIGHBOURS
    away = J - J[some][of]
    left = known[of] - np.sqrt(np.einsum("mij,mij->m", away, away)) <= known.min()
    return float(min(known.min(), _smallest(J[left]).min(initial=np.inf)))


def _scaled_jacobians(chain: Chain, q: Floats) -> Floats:
    J = chain.jacobian(q)
    J[:, :3] /= np.linalg.norm(chain.origins[1:, :3, 3], axis=1).sum()
    return J


def _smallest(J: Floats) -> Floats:
    return np.asarray(np.linalg.svd(J, compute_uv=False)[:, -1], dtype=np.float64)
