"""For a target at any roll: a configuration that reaches it, a proof that none does, or "undecided".

Sampling rolls finds configurations, but finding none proves nothing. ``certify`` settles whole windows of the roll
about the wire, for arms with a closed form::

    proof = certify(chain, Ts_base_target, RollWindow.free())
    proof.state == UNREACHABLE          # (m,): no roll and no configuration, inside the limits with the margins
    proof.roll, proof.q                 # a witness for each REACHABLE one
    proof.cause, proof.axis             # what keeps the others out over most of the window

The roll window is cut into intervals, finer and finer. An interval in which bounds exclude all eight branches is dead
(``ik.roll_bounds``); the middle of one that is not is tried as a witness. A target whose intervals are all dead is
proven out; one that has intervals left at the greatest depth is undecided. Bounds may be loose, which costs depth; they
may never be wrong. All targets go down level by level together, their intervals in flat arrays.

Metres and radians.

Source: branch and bound over the one free parameter, as in interval analysis (Moore, Interval Analysis, 1966), with the
bounds from the arm's own geometry.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .chain import Chain, Floats
from .closed_form import solve
from .joint_turns import SLACK, excess
from .roll import RollWindow, apply_roll, wrap
from .roll_bounds import NO_REACH, OVER_LIMIT, TOO_NEAR, Bools, Ints, RollBounds
from .singularity import SingularityLimits, margins
from .spherical_wrist import SphericalWristArm, recognise

REACHABLE, UNREACHABLE, UNDECIDED = 0, 1, 2
CAUSES = ("unreachable", "joint_limit", "singular")  # by rank, see roll_interval
BLOCK = 8192  # targets that go down the levels together
EASY = 2  # levels at which a witness is looked for first, as most targets have one; then a proof comes first
CROWD = 512  # intervals of one target; one with more left at a level is given up as undecided
ENDLESS = 1e-6  # m or rad; nearer to some singularities, a pose has endlessly many configurations


@dataclass(frozen=True, eq=False)
class Certificates:
    """Certificates of m targets.

    Attributes:
        state: REACHABLE, UNREACHABLE (proven) or UNDECIDED, (m,) int8.
        roll: roll of the witness, (m,), rad, inside the window; NaN where there is none.
        q: configuration of the witness, inside the joint limits and with the margins kept, (m, n), rad; NaN likewise.
        cause: of proven targets what keeps them out over most of the window by angle, (m,): "unreachable" (no
            configuration exists), "joint_limit" (none is inside the limits) or "singular" (none keeps the margins);
            "" of others.
        axis: the joint that matters most where the cause is "joint_limit", (m,); -1 elsewhere.
    """

    state: NDArray[np.int8]
    roll: Floats
    q: Floats
    cause: NDArray[np.str_]
    axis: Ints

    @property
    def reachable(self) -> Bools:
        """(m,): targets with a witness."""
        return self.state == REACHABLE

    @property
    def unreachable(self) -> Bools:
        """(m,): targets proven out."""
        return self.state == UNREACHABLE

    @property
    def undecided(self) -> Bools:
        """(m,): targets with neither."""
        return self.state == UNDECIDED


def certify(
    chain: Chain,
    Ts_base_target: Floats,
    window: RollWindow,
    limits: SingularityLimits | None = None,
    form: SphericalWristArm | None = None,
    *,
    max_depth: int = 12,
    first_step: float = np.deg2rad(60.0),
    block: int = BLOCK,
) -> Certificates:
    """Decide which targets can be reached at some roll.

    Args:
        chain: the arm with its tool.
        Ts_base_target: targets at roll 0, (m, 4, 4), m, base frame.
        window: rolls allowed. A single roll is settled by its eight branches alone.
        limits: singularity margins a configuration must keep (the geometric ones); the defaults where left out.
        form: constants of the closed form of an arm with a spherical wrist; found where left out.
        max_depth: how often the first intervals are halved at most.
        first_step: greatest width of the first intervals, rad.
        block: targets that go down the levels together: bounds the memory.

    Returns:
        Certificates. ``unreachable`` is a proof for every roll of the window, not a search that found nothing.

    Raises:
        ValueError: an arm without a closed form, poses that are not (m, 4, 4) or not finite, a step that is not
            positive, or a negative depth.
    """
    if Ts_base_target.ndim != 3 or Ts_base_target.shape[1:] != (4, 4) or not np.isfinite(Ts_base_target).all():
        raise ValueError(f"targets must be finite poses (m, 4, 4), not of shape {Ts_base_target.shape}")
    if not first_step > 0 or max_depth < 0:
        raise ValueError(f"first_step must be positive and max_depth at least 0, not {first_step} and {max_depth}")
    form = recognise(chain) if form is None else form
    if form is None:
        raise ValueError("nothing can be proved of an arm without a closed form (A1 across A2, A2 along A3, a wrist)")
    limits = SingularityLimits() if limits is None else limits
    search = _IntervalSearch(chain, form, limits, window, max_depth, first_step)
    settle = search.one_roll if window.is_fixed else search.many_rolls
    blocks = [settle(Ts_base_target[i : i + block]) for i in range(0, max(len(Ts_base_target), 1), block)]
    names = ("state", "roll", "q", "cause", "axis")
    return Certificates(**{name: np.concatenate([getattr(b, name) for b in blocks]) for name in names})


@dataclass(frozen=True, eq=False)
class _IntervalSearch:
    """The search of :func:`certify`, whose arguments are the attributes."""

    chain: Chain
    form: SphericalWristArm
    limits: SingularityLimits
    window: RollWindow
    max_depth: int
    first_step: float

    def one_roll(self, Ts: Floats) -> Certificates:
        """Settle targets whose roll is fixed, (m, 4, 4): the closed form gives every configuration there is."""
        rolls = np.full(len(Ts), self.window.low)
        q, raw, inside = self._configurations(Ts, rolls)
        exists = np.isfinite(raw[..., 0])
        over = np.where(exists[..., None], excess(self.chain, raw), np.inf)
        worst = over.max(axis=-1)
        nearest = over[np.arange(len(Ts)), np.argmin(worst, axis=1)]
        joint = np.argmax(nearest, axis=1)
        spent = np.zeros((len(Ts), self.chain.n + 2))
        rank = np.where(inside, TOO_NEAR, np.where(exists.any(axis=1), OVER_LIMIT, NO_REACH))
        open_ = self._endless(raw)
        if self.form.off is not None:
            # the solutions of the arm next to it may have lost one of its own: bounds that hold for both decide
            judged = RollBounds.of(self.chain, self.form, Ts, self.limits).judge(np.arange(len(Ts)), rolls, 0.0)
            open_, rank, joint = judged.open, np.minimum(judged.rank, TOO_NEAR), np.maximum(judged.joint, 0)
        spent[np.arange(len(Ts)), self._column(rank, joint)] = 1.0
        return self._certificates(rolls, q, spent, open_)

    def many_rolls(self, Ts: Floats) -> Certificates:
        """Settle targets over an interval of rolls, (m, 4, 4), level by level."""
        bounds = RollBounds.of(self.chain, self.form, Ts, self.limits)
        low, width = self.window.low, min(self.window.high - self.window.low, 2 * np.pi)
        m = len(Ts)
        rolls, q = np.full(m, np.nan), np.full((m, self.chain.n), np.nan)
        spent = np.zeros((m, self.chain.n + 2))  # width of dead intervals by what excluded them
        undecided = np.zeros(m, dtype=bool)
        target, index, pieces = np.arange(m), np.zeros(m, dtype=np.int64), 1
        for level, split in enumerate(self._splits(width)):
            waiting = np.isnan(rolls[target]) & ~undecided[target]
            target = np.repeat(target[waiting], split)
            index = (index[waiting][:, None] * split + np.arange(split)).ravel()
            pieces *= split
            centre, half = low + width * (2 * index + 1) / (2 * pieces), width / (2 * pieces)
            if level < EASY:
                self._try(bounds, Ts, target, centre, rolls, q)
                waiting = np.isnan(rolls[target])
                target, index, centre = target[waiting], index[waiting], centre[waiting]
            if not len(target):
                break
            verdict = bounds.judge(target, centre, half)
            dead = ~verdict.open
            np.add.at(spent, (target[dead], self._column(verdict.rank[dead], verdict.joint[dead])), 2 * half)
            target, index, centre = target[~dead], index[~dead], centre[~dead]
            if level >= EASY:
                self._try(bounds, Ts, target, centre, rolls, q)
            undecided |= np.bincount(target, minlength=m) > CROWD
        undecided[target] = True
        return self._certificates(rolls, q, spent, undecided)

    def _splits(self, width: float) -> list[int]:
        """Into how many pieces each interval is cut at each level, for a window of some width (rad)."""
        # two halvings at once: about as many intervals to judge, at half the calls
        halvings = [4] * (self.max_depth // 2) + [2] * (self.max_depth % 2)
        return [1, max(int(np.ceil(width / self.first_step - 1e-9)), 1), *halvings]

    def _try(self, bounds: RollBounds, Ts: Floats, target: Ints, roll: Floats, rolls: Floats, q: Floats) -> None:
        """Look for witnesses at single rolls and enter what is found.

        The padded bounds at a single roll pick one roll a target at small cost; the closed form has the last word.

        Args:
            bounds: of the targets.
            Ts: the targets at roll 0, (m, 4, 4).
            target: target of each roll to try, (k,), ascending.
            roll: (k,), rad.
            rolls: witnesses' rolls, (m,), written to.
            q: witnesses' configurations, (m, n), written to.
        """
        if not len(target):
            return
        likely = bounds.judge(target, roll, 0.0).open
        which, first = np.unique(target[likely], return_index=True)
        roll = roll[likely][first]
        found = self._configurations(Ts[which], roll)[0]
        good = np.isfinite(found[:, 0])
        rolls[which[good]], q[which[good]] = roll[good], found[good]

    def _configurations(self, Ts: Floats, rolls: Floats) -> tuple[Floats, Floats, Bools]:
        """The allowed configuration of full poses that is furthest from its joint limits.

        Args:
            Ts: at roll 0, (m, 4, 4).
            rolls: (m,), rad.

        Returns:
            It, (m, n), NaN where none is allowed; all branches before the limits, (m, 8, n); and where one of them is
            inside the joint limits, (m,).
        """
        raw = solve(self.form, apply_roll(Ts, rolls))
        middle, half = (self.chain.lower + self.chain.upper) / 2, (self.chain.upper - self.chain.lower) / 2
        # of all turns of a joint the one nearest the middle is inside if any is
        off = wrap(raw - middle)
        room = _least(half - np.abs(off))
        q = middle + np.clip(off, -half, half)
        inside: Bools = room >= -SLACK
        allowed: Bools = inside & (_least(margins(self.chain, self.form, q) - self.limits.values(True)) >= 0)
        best, at = np.argmax(np.where(allowed, room, -np.inf), axis=1), np.arange(len(Ts))
        return np.where(allowed[at, best, None], q[at, best], np.nan), raw, np.any(inside, axis=1)

    def _endless(self, raw: Floats) -> Bools:
        """Poses of which the closed form shows one configuration out of endlessly many.

        So it is with A4 and A6 in line, with the wrist centre on A1, and with it on A2's axis where both links are of
        one length. Where a margin forbids that configuration, it forbids all the others as well.

        Args:
            raw: all branches, (m, 8, n), rad.

        Returns:
            (m,): where nothing is proven.
        """
        near: Bools = margins(self.chain, self.form, raw) < ENDLESS
        near[..., 1] &= self.form.reach[0] < ENDLESS
        return np.any(near & (self.limits.values(True) < ENDLESS), axis=(1, 2))

    def _column(self, rank: Ints, joint: Ints) -> Ints:
        """Column of a cause: NO_REACH, then the joints, then TOO_NEAR."""
        return np.where(rank == NO_REACH, 0, np.where(rank == OVER_LIMIT, joint + 1, self.chain.n + 1))

    def _certificates(self, rolls: Floats, q: Floats, spent: Floats, undecided: Bools) -> Certificates:
        """The certificates of a search; ``spent`` (m, n + 2) is the share of the window that each cause excluded."""
        found = np.isfinite(q[:, 0])
        state = np.where(found, REACHABLE, np.where(undecided, UNDECIDED, UNREACHABLE)).astype(np.int8)
        joints = spent[:, 1:-1]
        cause = np.argmax(np.stack([spent[:, 0], joints.sum(axis=1), spent[:, -1]], axis=1), axis=1)
        proven = state == UNREACHABLE
        return Certificates(
            state=state,
            roll=np.where(found, rolls, np.nan),
            q=q,
            cause=np.where(proven, np.array(CAUSES)[cause], ""),
            axis=np.where(proven & (cause == OVER_LIMIT), np.argmax(joints, axis=1), -1),
        )


def _least(values: Floats) -> Floats:
    """Minimum along the last, short axis, (..., n) -> (...); a fraction of the time of ``min``."""
    least: Floats = np.minimum.reduce([values[..., j] for j in range(values.shape[-1])])
    return least
