"""What a whole interval of rolls cannot do: bounds on an arm's angles while a target turns about its wire.

``RollBounds`` holds the targets in the arm's own axes. ``judge`` says of intervals ``[centre - half, centre + half]``
which of them no branch can reach inside the joint limits and singularity margins, whatever the roll inside, and why::

    bounds = RollBounds.of(chain, form, Ts_base_target, limits)
    verdict = bounds.judge(target, centre, half)      # target (k,) int, centre (k,) rad, half rad
    verdict.open                                      # (k,): may hold a reachable roll; all others are proven not to

Every bound is an enclosure: it holds all values that a quantity takes on the interval, so an enclosure outside of what
is allowed is a proof. The steps, each with its inequality, are in the docstrings below; they start from the arc on
which the wrist centre moves and follow the closed form (``ik.closed_form``) joint by joint. Lengths are padded by
``PAD_LENGTH`` and angles by ``PAD_ANGLE`` on top: more than rounding and the closed form's own tolerances come to. An
arm that is a little off its class is padded by as much as it can be off (:attr:`RollBounds._off`).

Metres and radians; the arm's own axes (r, b, h) are forwards, along A2, along A1.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .angle_bounds import PAD_ANGLE, azimuth, from_forearm, into_forearm, lead, middle_and_half_width, sight, triangle
from .chain import Chain, Floats
from .closed_form import ROUNDING
from .roll import wrap
from .singularity import SingularityLimits
from .spherical_wrist import SphericalWristArm

PAD_LENGTH = 1e-9
POINT = 1e-4  # m; nearer to A2's axis rounding blurs the wrist centre's direction, so that it counts as any
# what became of a branch on an interval, from the least to the most that it could do
NO_REACH, OVER_LIMIT, TOO_NEAR, OPEN = range(4)

Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Verdict:
    """What k intervals came to.

    Attributes:
        rank: the most that any branch could do: NO_REACH (no branch exists), OVER_LIMIT (none is inside the joint
            limits), TOO_NEAR (none keeps the margins) or OPEN (not excluded), (k,).
        joint: the joint that keeps the nearest branch of an OVER_LIMIT interval out, (k,); -1 of other intervals.
    """

    rank: Ints
    joint: Ints

    @property
    def open(self) -> Bools:
        """(k,): intervals that are not proven out."""
        return self.rank == OPEN


@dataclass(frozen=True, eq=False)
class _WristInPlane:
    """The wrist centre in the arm's plane, for two shoulders on k intervals; angles as middle and half width.

    Attributes:
        q1: A1, (2, k) and (k,), rad.
        towards: direction from A2's axis, (2, k) twice, rad.
        s: least and largest distance from A2's axis, (2, k), m.
        rho_high: largest radius about A1, (k,), m.
        exists: where it may be outside the cylinder that the lateral offset keeps, (k,).
    """

    q1: tuple[Floats, Floats]
    towards: tuple[Floats, Floats]
    s: tuple[Floats, Floats]
    rho_high: Floats
    exists: Bools


@dataclass(frozen=True, eq=False)
class _Arms:
    """A1 to A3 of four branches (shoulder, elbow) on k intervals; angles as middle and half width.

    Attributes:
        rank: see :class:`Verdict`, (2, 2, k).
        gap: how far the worst joint stays outside its limits, (2, 2, k), rad; negative inside.
        joint: that joint, (2, 2, k).
        q1: A1, (2, k) and (k,).
        q23: A2 and A3 together, about A2's axis, (2, 2, k) and (2, k).
    """

    rank: Ints
    gap: Floats
    joint: Ints
    q1: tuple[Floats, Floats]
    q23: tuple[Floats, Floats]


@dataclass(frozen=True, eq=False)
class RollBounds:
    """Targets that turn about their wire, in an arm's own axes.

    Attributes:
        chain: the arm with its tool.
        form: its constants.
        limits: margins to keep.
        axes: the targets' axes at roll 0, (3, 3, m): component, axis, target.
        position: their positions from a point on A1, (3, m), m.
    """

    chain: Chain
    form: SphericalWristArm
    limits: SingularityLimits
    axes: Floats
    position: Floats

    @classmethod
    def of(cls, chain: Chain, form: SphericalWristArm, Ts_base_target: Floats, limits: SingularityLimits) -> RollBounds:
        """Bring targets, (m, 4, 4) in the base frame at roll 0, into the arm's own axes."""
        to_own = form.wrist.to_own
        return cls(
            chain=chain,
            form=form,
            limits=limits,
            axes=np.ascontiguousarray((to_own @ Ts_base_target[:, :3, :3]).transpose(1, 2, 0)),
            position=np.ascontiguousarray(((Ts_base_target[:, :3, 3] - form.origin) @ to_own.T).T),
        )

    @cached_property
    def _in_tcp(self) -> Floats:
        """A6's axis, the two directions across it that count its angle, and the wrist centre: (3, 4), TCP's frame."""
        T = np.zeros((3, 4))
        T[:, :3] = self.form.wrist.to_own.T
        return np.asarray(self.form.wrist.pose_map @ T.ravel()).reshape(3, 4)

    @cached_property
    def _off(self) -> tuple[float, float]:
        """How far the wrist centre (m) and the TCP's orientation (rad) may be off those of the arm as recognised.

        In one configuration the arm as recognised holds its TCP within ``off.length`` and ``off.angle`` of where the
        arm as it is has it. What the latter does at a target, the former does at a pose that near to it: bounds that
        hold for all such poses hold for the arm as it is. Margins are those of the arm as recognised in either case.
        """
        off = self.form.off
        if off is None:
            return 0.0, 0.0
        return off.length + off.angle * float(np.linalg.norm(self.form.wrist_in_tcp)), off.angle

    @cached_property
    def _windows(self) -> list[tuple[float, float]]:
        """Middle and half width of each joint's limits, rad."""
        low, high = self.chain.lower, self.chain.upper
        return [(float(m), float(h)) for m, h in zip((low + high) / 2, (high - low) / 2, strict=True)]

    def _turned(self, target: Ints, roll: Floats, v: Floats, share: float = 1.0) -> Floats:
        """A vector of the TCP's frame at a roll, its part across the wire scaled by ``share``, (3, k)."""
        c, s = np.cos(roll), np.sin(roll)
        x, y, z = self.axes[:, :, target].transpose(1, 0, 2)
        turned: Floats = x * (share * (v[0] * c - v[1] * s)) + y * (share * (v[0] * s + v[1] * c)) + z * v[2]
        return turned

    def judge(self, target: Ints, centre: Floats, half: float) -> Verdict:
        """Which intervals of rolls may hold a reachable one.

        Args:
            target: the target of each interval, (k,).
            centre: its middle, (k,), rad.
            half: half its width, rad, in [0, pi]; 0 judges single rolls (still padded).

        Returns:
            The verdict; an interval that is not open holds no roll with a configuration inside the joint limits that
            keeps the margins.

        Source: the wrist centre's circle cut into arcs, and the closed form's own steps with sets in place of numbers.
        """
        arms = self._arms(target, centre, half)
        shoulder, elbow, which = np.nonzero(arms.rank == OPEN)
        if len(which):
            at = (shoulder, elbow, which)
            (q1, half_1), (q23, half_23) = arms.q1, arms.q23
            forearm = q1[shoulder, which], q23[at], half_1[which] + half_23[shoulder, which]
            arms.rank[at], arms.gap[at], arms.joint[at] = self._wrists(target[which], centre[which], half, forearm)
        rank, gap, joint = (a.reshape(4, -1) for a in (arms.rank, arms.gap, arms.joint))
        best = rank.max(axis=0)
        nearest = np.argmin(np.where(rank == OVER_LIMIT, gap, np.inf), axis=0)
        return Verdict(best, np.where(best == OVER_LIMIT, joint[nearest, np.arange(len(nearest))], -1))

    def _ball(self, target: Ints, centre: Floats, half: float) -> tuple[Floats, float]:
        """A ball around the wrist centres of an interval: (3, k) and its radius, m.

        An arc of radius r and half angle h < pi/2 lies in the ball on its chord, of radius r sin h about the chord's
        middle (r cos h from the circle's centre); a longer arc lies in the ball of radius r about the circle's centre.
        """
        v = self._in_tcp[:, 3]
        size = float(np.hypot(v[0], v[1]))
        centres = self.position[:, target] + self._turned(target, centre, v, max(float(np.cos(half)), 0.0))
        return centres, size * float(np.sin(min(half, np.pi / 2))) + PAD_LENGTH + self._off[0]

    def _plane(self, target: Ints, centre: Floats, half: float) -> _WristInPlane:
        """Where the wrist centre is in the arm's plane, for both shoulders.

        *Distance d from A1*: that of the ball's centre +- the ball's radius. *Radius rho in the plane*:
        sqrt(d^2 - lateral^2) rises with d, so the ends of d give the ends of rho; none exists where all of d is below
        the lateral offset. *A1* is azimuth - phi or azimuth + phi - pi: the azimuth is within asin(ball/d) of the
        centre's (a ball seen from outside), and phi = atan(lateral / rho) is monotone in rho. *The point (height,
        +-rho)* stays in a disc, see :meth:`_spread`. *Its distance s from A2's axis* and *direction from there* are
        within R and asin(R/s) of those of the disc's centre, R the disc's radius.
        """
        form = self.form
        u, ball = self._ball(target, centre, half)
        d, offset = np.hypot(u[0], u[1]), abs(form.lateral)
        d_low, d_high = np.maximum(d - ball, 0.0), d + ball
        rho, rho_low, rho_high = (np.sqrt(np.maximum(x * x - offset**2, 0.0)) for x in (d, d_low, d_high))
        around, half_1 = np.arctan2(u[1], u[0]), sight(d, ball, d > ball) + PAD_ANGLE
        phi, half_phi = middle_and_half_width(np.arctan2(form.lateral, rho_low), np.arctan2(form.lateral, rho_high))
        disc = self._spread((d, d_low), (rho, rho_low, rho_high), ball)
        up, out = u[2] - form.zeta_2.real, np.stack([rho, -rho]) - form.zeta_2.imag
        s = np.hypot(up, out)
        s_low = np.maximum(s - disc, 0.0)
        return _WristInPlane(
            q1=(np.stack([around - phi, around + phi - np.pi]), half_1 + half_phi),
            towards=(np.arctan2(out, up), sight(s, disc, s_low > POINT) + PAD_ANGLE),
            s=(s_low, s + disc),
            rho_high=rho_high,
            exists=d_high >= offset,
        )

    def _spread(self, d: tuple[Floats, Floats], rho: tuple[Floats, Floats, Floats], ball: float) -> Floats | float:
        """Radius of a disc about (height, rho) at the ball's centre that holds the arc in the arm's plane, m.

        Without a lateral offset, rho is the distance from A1 and no projection moves a point further than the ball's
        radius. With one, d rho / d d = d / rho falls with d, so it is at most its value at the lower end, and scales
        the move; where that end has no radius, the ends of rho and the height's own move bound it instead.
        """
        if self.form.lateral == 0.0:
            return ball
        at, low, high = rho
        with np.errstate(divide="ignore", invalid="ignore"):
            steepest = np.where(low > 0, d[1] / low, np.inf)
        spread: Floats = np.minimum(steepest * ball, np.hypot(np.maximum(high - at, at - low), ball))
        return spread

    def _arms(self, target: Ints, centre: Floats, half: float) -> _Arms:
        """Bounds on A1, A2, A3 and on the shoulder's and elbow's margins.

        The cosine of the bend between upper arm and forearm rises with s^2, so the ends of s give the ends of the bend,
        hence of A3 and of the elbow's margin, and no triangle exists where all of it is beyond +-1. A2 is the direction
        of the wrist centre -+ the triangle's angle at A2; A2 and A3 together are that direction +- its angle at the
        wrist (:func:`~ik.angle_bounds.triangle`). The shoulder's margin is rho itself. Angles add up, so half widths
        do.
        """
        form, plane = self.form, self._plane(target, centre, half)
        la, lf = abs(form.upper_arm), abs(form.forearm)
        # from the far end of s, where the arm is straightest, to the near one
        high, low = ((s * s - la * la - lf * lf) / (2 * la * lf) for s in (plane.s[1], plane.s[0]))
        no_reach = (low > 1 + ROUNDING) | (high < -1 - ROUNDING) | ~plane.exists
        high, low = np.clip(high, -1.0, 1.0), np.clip(low, -1.0, 1.0)
        bend, half_3 = middle_and_half_width(np.arccos(high), np.arccos(low))
        (inner, half_i), (outer, half_o) = triangle(la, lf, high, low), triangle(lf, la, high, low)
        towards, half_t = plane.towards
        zero_2, zero_3 = float(np.angle(form.upper_arm)), float(np.angle(form.forearm))
        elbow = np.array([1.0, -1.0])[:, None]

        def both(a: NDArray[Any]) -> NDArray[Any]:
            return a[:, None]  # the same for both elbows

        gap, joint = _worst(
            [
                (0, both(self._gap(0, *plane.q1))),
                (1, self._gap(1, both(towards - zero_2) - elbow * both(inner), both(half_t + half_i))),
                (2, self._gap(2, form.sign_3 * (elbow * both(bend) + zero_2 - zero_3), both(half_3))),
            ],
            (2, 2, len(target)),
        )
        # the largest margin inside: that of the middle and, as no margin changes faster than its angle, half the width
        near = np.pi / 2 - np.abs(bend - np.pi / 2) + half_3 < self.limits.elbow - PAD_ANGLE
        near |= plane.rho_high < self.limits.shoulder - PAD_LENGTH
        rank = np.where(gap > 0, OVER_LIMIT, np.where(both(near), TOO_NEAR, OPEN))
        rank = np.where(both(no_reach), NO_REACH, rank)
        q23 = both(towards) + elbow * both(outer) - zero_3
        return _Arms(rank, gap, joint, plane.q1, (q23, half_t + half_o))

    def _wrists(
        self, target: Ints, centre: Floats, half: float, arms: tuple[Floats, Floats, Floats]
    ) -> tuple[Ints, Floats, Ints]:
        """Bounds on A4, A5, A6 and on the wrist's margin, over both wrists of k branches with their intervals.

        *A6's axis* turns about the wire by at most ``half`` from the interval's middle, which moves it on the sphere by
        at most 2 asin(sin(tilt) sin(half/2)), tilt its angle from the wire (half the chord, doubled). *The forearm's
        axis* is turned by A1 and by A2 with A3; each rotation moves a vector by at most its angle. *The angle gamma
        between the two* changes by at most the sum (triangle inequality on the sphere), and A5 is monotone in it. *A4*
        is the azimuth of A6's axis about the forearm's, seen from the forearm, less a lead that depends on A5 alone.
        *A6* is the azimuth of the forearm's axis about A6's, seen from the TCP (whose own turn adds ``half``), less a
        lead. Both azimuths are those of a vector in a cap about its middle, see :func:`~ik.angle_bounds.azimuth`.

        Args:
            target: (k,).
            centre: (k,), rad.
            half: rad.
            arms: middles of A1 and of A2 and A3 together, and the sum of their half widths, (k,) each, rad.

        Returns:
            Rank, gap and joint of the better of both wrists, (k,) each; see :class:`_Arms`.
        """
        wrist, in_tcp = self.form.wrist, self._in_tcp
        q1, q23, half_f = arms
        a6 = self._turned(target, centre, in_tcp[:, 0])
        tilt = np.hypot(in_tcp[0, 0], in_tcp[1, 0])
        cap = half_f + 2 * float(np.arcsin(min(tilt * np.sin(half / 2), 1.0))) + PAD_ANGLE + self._off[1]
        seen = into_forearm(a6, q1, q23)
        height, v_p, v_s = wrist.w4 @ seen, wrist.p @ seen, wrist.s @ seen
        gamma = np.arctan2(np.hypot(v_p, v_s), height)
        low, high, exists = self._delta(np.maximum(gamma - cap, 0.0), np.minimum(gamma + cap, np.pi))
        delta, half_5 = middle_and_half_width(low, high)
        side = np.array([1.0, -1.0])[:, None]
        gaps = [(4, self._gap(4, wrist.base + side * delta, half_5))]
        if self._binds(3):
            ahead, half_ahead = lead(wrist.lead_4, low, high)
            half_4 = azimuth(gamma, cap) + half_ahead
            gaps.append((3, self._gap(3, np.arctan2(v_s, v_p) - side * ahead, half_4)))
        if self._binds(5):
            forearm = from_forearm(wrist.w4, q1, q23)
            m, n = (np.einsum("ik,ik->k", forearm, self._turned(target, centre, in_tcp[:, i])) for i in (1, 2))
            ahead, half_ahead = lead(wrist.lead_6, low, high)
            half_6 = azimuth(gamma, half_f + half + PAD_ANGLE + self._off[1]) + half_ahead
            gaps.append((5, self._gap(5, -np.arctan2(n, m) - side * ahead, half_6)))
        gap, joint = _worst(gaps, (2, len(target)))
        near = np.pi / 2 - np.abs(delta - np.pi / 2) + half_5 < self.limits.wrist - PAD_ANGLE
        rank = np.where(gap > 0, OVER_LIMIT, np.where(near, TOO_NEAR, OPEN))
        better = (rank[1] > rank[0]) | ((rank[1] == rank[0]) & (gap[1] < gap[0]))
        rank, gap, joint = (np.where(better, a[1], a[0]) for a in (rank, gap, joint))
        return np.where(exists, rank, NO_REACH), gap, joint

    def _delta(self, low: Floats, high: Floats) -> tuple[Floats, Floats, Bools]:
        """A5's angle from ``base`` for angles between A4's and A6's axes from low to high: its ends, and if it exists.

        cos(angle) = k + r cos(delta) with r > 0: both fall together, so the ends give the ends.
        """
        wrist = self.form.wrist
        if wrist.low == wrist.high == 0.0:
            return low, high, np.ones(len(low), dtype=bool)  # A5 at right angles to both: the angle itself
        k = (wrist.high - wrist.low) / 2
        first, last = (np.cos(low) - k) / wrist.r, (np.cos(high) - k) / wrist.r
        tolerance = 2 * ROUNDING / wrist.r
        exists = (last <= 1 + tolerance) & (first >= -1 - tolerance)
        return np.arccos(np.clip(first, -1.0, 1.0)), np.arccos(np.clip(last, -1.0, 1.0)), exists

    def _binds(self, joint: int) -> bool:
        """Whether a joint's limits exclude any angle: those of a whole turn or more do not."""
        return self._windows[joint][1] < np.pi

    def _gap(self, joint: int, centre: Floats, half: Floats) -> Floats:
        """How far angles within ``half`` of ``centre`` all stay outside a joint's limits, at any whole turn, rad.

        Two arcs of a circle are apart where their middles are further apart, the short way, than their half widths
        together. Negative where they touch.
        """
        at, window = self._windows[joint]
        gap: Floats = np.abs(wrap(centre - at)) - (half + window)
        return gap


def _worst(gaps: list[tuple[int, Floats]], shape: tuple[int, ...]) -> tuple[Floats, Ints]:
    """The largest gap of several joints and which one has it, both of a shape they broadcast to."""
    worst, joint = np.full(shape, -np.inf), np.full(shape, -1)
    for j, gap in gaps:
        joint = np.where(gap > worst, j, joint)
        worst = np.maximum(worst, gap)
    return worst, joint
