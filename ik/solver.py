"""Every configuration an arm has for a set of poses, by the closed form or by damped least squares.

One interface over both solvers, so that nothing downstream asks which arm it has::

    solver = Solver.for_chain(chain, "auto")
    c = solver.candidates(Ts_base_tcp)       # (m, 4, 4) full poses
    c.q                                      # (m, g, k, n) inside the joint limits, NaN where there is none
    c.raw                                    # (m, g, n) before the limits, for reasons

``g`` are branches that a continuous motion cannot leave (eight of the closed form; damped least squares knows none, and
its results count as one), ``k`` the combinations of whole turns in a branch.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from . import closed_form, dls, spherical_wrist
from .chain import Chain, Floats
from .joint_turns import SLACK, excess, turn_combinations, with_turns
from .roll import RollWindow, wrap

SOLVERS = ("auto", "closed_form", "dls")
DLS_KEPT = 8  # distinct solutions kept of a pose, not counting whole turns
MOST_STANDINGS = 12  # of one configuration, that all combinations of turns are listed for
WINDOW = 1.25 * np.pi  # half of what a joint of several turns stands in where there are more
SAME_SOLUTION = 1e-4  # rad; solutions closer than this are one
NEXT = 0.1  # rad that a joint is off a guess of which the closed form says the configuration
ALONE_TIMES = 4.0  # times as far off has any other configuration to be


@dataclass(frozen=True, eq=False)
class Candidates:
    """Configurations of m poses.

    Attributes:
        q: configurations inside the limits, (m, g, k, n), rad: of m poses, in g branches (the closed form's eight
            branches), in up to k whole turns, n joints; NaN where there are fewer.
        raw: one configuration of each branch before the limits, (m, g, n), rad, NaN where there is none.
        over: how far ``raw`` is outside each limit, (m, g, n), rad.
        reach_excess: how far the wrist centre is out of reach, (m,), m; NaN where the solver cannot tell.
        exhaustive: whether no further configurations exist.
    """

    q: Floats
    raw: Floats
    over: Floats
    reach_excess: Floats
    exhaustive: bool

    @property
    def valid(self) -> NDArray[np.bool_]:
        """Which configurations exist inside the limits, (m, g, k)."""
        return np.isfinite(self.q[..., 0])


@dataclass(frozen=True, eq=False)
class Solver:
    """An arm and the method that finds its configurations.

    Attributes:
        chain: the arm with its tool.
        form: its closed form, or None for damped least squares.
        geometry: the closed form's constants even where damped least squares solves (margins use them), or None.
        seeds: starts of damped least squares a pose.
    """

    chain: Chain
    form: spherical_wrist.SphericalWristArm | None
    geometry: spherical_wrist.SphericalWristArm | None
    seeds: int = 16

    @classmethod
    def for_chain(cls, chain: Chain, kind: str = "auto") -> Solver:
        """Choose the solver.

        Args:
            chain: the arm with its tool.
            kind: "auto" takes the closed form if the arm has one, "closed_form" needs one, "dls" never uses it.

        Raises:
            ValueError: an unknown kind, or a closed form asked of an arm that has none.
        """
        if kind not in SOLVERS:
            raise ValueError(f"solver {kind!r}: allowed are {', '.join(SOLVERS)}")
        form = spherical_wrist.recognise(chain, spherical_wrist.TOLERANCE)
        if kind == "closed_form" and form is None:
            raise ValueError("solver closed_form: this arm has none (it needs A2 parallel to A3 and a spherical wrist)")
        # an arm too far off for proofs still has the margins of the one next to it
        geometry = form or spherical_wrist.recognise(chain, spherical_wrist.NEAR_CLASS)
        return cls(chain, None if kind == "dls" else form, geometry)

    @property
    def name(self) -> str:
        """Name of the method: "closed form" or "damped least squares"."""
        return "damped least squares" if self.form is None else "closed form"

    @cached_property
    def _standing(self) -> Chain:
        """The arm with the limits that turns are listed inside.

        Turns matter to the way between targets alone. Where several joints can stand at any angle in two turns or more,
        listing every combination costs more than it brings: such joints stand within :data:`WINDOW` of the middle of
        their limits, some angles in two turns, so that a way can go on through any of them.
        """
        half = (self.chain.upper - self.chain.lower) / 2
        if len(turn_combinations(self.chain)) <= MOST_STANDINGS:
            return self.chain
        middle = (self.chain.upper + self.chain.lower) / 2
        half = np.where(half >= 2 * np.pi - SLACK, np.minimum(half, WINDOW), half)
        return replace(self.chain, lower=middle - half, upper=middle + half)

    def candidates(self, Ts_base_tcp: Floats) -> Candidates:
        """All configurations of full poses.

        Args:
            Ts_base_tcp: (m, 4, 4), m, base frame.

        Returns:
            The configurations.
        """
        if self.form is None:
            return self._by_least_squares(Ts_base_tcp)
        raw = closed_form.solve(self.form, Ts_base_tcp)
        return Candidates(
            q=with_turns(self._standing, raw, packed=True),
            raw=raw,
            over=excess(self.chain, raw),
            reach_excess=closed_form.reach_excess(self.form, Ts_base_tcp),
            exhaustive=self.form.off is None,
        )

    def next_to(self, Ts_base_tcp: Floats, guess: Floats) -> tuple[Floats, NDArray[np.bool_]]:
        """The configurations that guesses lead to, one for each pose.

        The closed form's, where one of them is next to the guess and no other is: it costs a fraction of the steps of
        damped least squares, which the others are left to.

        Args:
            Ts_base_tcp: (m, 4, 4), m, base frame.
            guess: (m, n), rad.

        Returns:
            (m, n) rad, inside the limits, and whether the pose is reached there, (m,).
        """
        if self.form is None or self.form.off is not None or not len(guess):
            found = dls.track_one(self.chain, Ts_base_tcp, guess, RollWindow.fixed(0.0))
            return found.q, found.ok
        raw = closed_form.solve(self.form, Ts_base_tcp)
        move = wrap(raw - guess[:, None])
        off = np.abs(move).max(axis=-1)
        off[np.isnan(off)] = np.inf
        row, best = np.arange(len(off)), np.argmin(off, axis=1)
        least = off[row, best]
        off[row, best] = np.inf
        q = guess + np.where(np.isfinite(least)[:, None], move[row, best], 0.0)
        ok = (least <= NEXT) & (off.min(axis=1) > ALONE_TIMES * least)
        ok &= ((q >= self.chain.lower) & (q <= self.chain.upper)).all(axis=1)
        left = np.flatnonzero(~ok)
        if len(left):
            found = dls.track_one(self.chain, Ts_base_tcp[left], guess[left], RollWindow.fixed(0.0))
            q[left], ok[left] = found.q, found.ok
        return q, ok

    def _by_least_squares(self, Ts: Floats) -> Candidates:
        found = dls.solve(self.chain, Ts, RollWindow.fixed(0.0), seeds=self.seeds)
        q = np.where(found.ok[..., None], found.q, np.nan)
        # what an earlier seed found already, perhaps a whole turn away, is no new configuration
        gap = np.abs(wrap(q[:, :, None] - q[:, None])).max(axis=-1)
        twin = np.tril(gap < SAME_SOLUTION, k=-1).any(axis=2)
        order = np.argsort(twin | ~found.ok, axis=1, kind="stable")[:, :DLS_KEPT]
        q[twin] = np.nan
        q = with_turns(self._standing, np.take_along_axis(q, order[..., None], axis=1))
        q = q.reshape(len(Ts), -1, self.chain.n)
        most = max(int(np.isfinite(q[..., 0]).sum(axis=1).max(initial=0)), 1)
        order = np.argsort(np.isnan(q[..., 0]), axis=1, kind="stable")[:, :most]
        q = np.take_along_axis(q, order[..., None], axis=1)[:, None]
        nothing = np.full((len(Ts), 1, self.chain.n), np.nan)
        return Candidates(q, nothing, nothing, np.full(len(Ts), np.nan), exhaustive=False)
