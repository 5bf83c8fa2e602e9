"""The arm's axes along poses that a controller goes through in one configuration.

    tracker = ConfigurationTracker(solver)
    q = tracker.along(Ts_base_tcp, q_start)    # (m, n), NaN where the pose is out of reach

From the axes at the start on, the configuration stays: a branch of the closed form, its angles unwound from row to row;
of an arm without one, the solution that damped least squares reach from the row before. Where a branch has no
continuation its angles jump, which the caller sees. Metres and radians.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ik import closed_form, dls
from ik.chain import Floats
from ik.roll import RollWindow, wrap
from ik.singularity import sides
from ik.solver import Solver

ARM_AXES = 3  # the first axes, which a wrist in line does not leave open
SAME_CONFIGURATION = 1e-4  # rad: configurations that differ by less are one
FIXED = RollWindow.fixed(0.0)
OVERHEAD, ELBOW, FLIPPED = 1, 2, 4  # bits of KUKA's S
# of the configuration of S 2: in the basic area, A3 and A5 above 0
BASIC = np.deg2rad([0.0, -90.0, 90.0, 0.0, 30.0, 0.0])


@dataclass(frozen=True)
class ConfigurationTracker:
    """Follows poses.

    Attributes:
        solver: of the arm with the cell's own TCP.
    """

    solver: Solver

    def along(self, Ts_base_tcp: Floats, q_start: Floats) -> Floats:
        """Axes at poses that are processed one after the other.

        Args:
            Ts_base_tcp: (m, 4, 4), m.
            q_start: where the arm comes from, (n,), rad.

        Returns:
            (m, n), rad; NaN where the configuration does not reach the pose.
        """
        if self.solver.form is None:
            return self._tracked(Ts_base_tcp, q_start)
        start = self.solver.chain.forward(q_start[None])
        raw = closed_form.solve(self.solver.form, np.concatenate([start, Ts_base_tcp]))
        q = raw[1:, _branch(raw[0], q_start)]
        return _unwound(q, q_start)

    def _tracked(self, Ts: Floats, q_start: Floats) -> Floats:
        out = np.full((len(Ts), len(q_start)), np.nan)
        q = q_start
        for i in range(len(Ts)):
            found = dls.track_one(self.solver.chain, Ts[i : i + 1], q[None], FIXED)
            if found.ok[0]:
                q = out[i] = q + wrap(found.q[0] - q)
        return out

    def nearest(self, T_base_tcp: Floats, q: Floats, turn: int = -1) -> Floats | None:
        """The configuration of a pose (4, 4) whose axes are nearest to others, or None where there is none.

        Args:
            T_base_tcp: (4, 4), m.
            q: the others, (n,), rad.
            turn: KUKA's T: bit i is set where axis i + 1 is below 0; -1 where it is not given.
        """
        found = self._configurations(T_base_tcp, turn)
        if not len(found):
            return None
        best: Floats = found[int(np.argmin(np.abs(found - q).max(axis=1)))]
        return best

    def keeps(self, T_base_tcp: Floats, q_start: Floats, q: Floats) -> bool:
        """Whether axes (n,) at a pose (4, 4), m, are in the configuration of a start (n,), but for whole turns."""
        kept = self.along(T_base_tcp[None], q_start)[0]
        return bool(np.isfinite(kept).all() and (np.abs(wrap(kept - q)) < SAME_CONFIGURATION).all())

    def is_sole(self, T_base_tcp: Floats, turn: int) -> bool:
        """Whether a pose (4, 4), m, has at most one configuration with the signs of T, but for whole turns."""
        found = self._configurations(T_base_tcp, turn)
        return not len(found) or bool((np.abs(wrap(found - found[0])) < SAME_CONFIGURATION).all())

    def status(self, q: Floats) -> int | None:
        """KUKA's S of axes (n,), rad; None of an arm without a spherical wrist, of which it is not known.

        Bit 0: the wrist is behind axis 1. Bit 1: A3 is beyond the arm's stretched pose, above it. Bit 2: A5 is below 0.
        """
        form = self.solver.geometry
        if form is None or len(q) != len(BASIC):
            return None
        wrist, elbow, shoulder = (sides(form, q) == sides(form, BASIC)).tolist()
        return (0 if shoulder else OVERHEAD) | (ELBOW if elbow else 0) | (0 if wrist else FLIPPED)

    def _configurations(self, T_base_tcp: Floats, turn: int) -> Floats:
        """Those of a pose (4, 4), m, with the signs of T (m, n), rad."""
        found = self.solver.candidates(T_base_tcp[None]).q
        found = found.reshape(-1, found.shape[-1])
        found = found[np.isfinite(found[:, 0])]
        if turn >= 0:
            below = (turn >> np.arange(found.shape[1])) & 1 == 1
            found = found[((found < 0) == below).all(axis=1)]
        return found


def _branch(raw: Floats, q: Floats) -> int:
    """Which of the configurations (g, n) at a pose is the one that the axes q (n,) are in."""
    gap = np.abs(wrap(raw - q))
    whole = np.where(np.isfinite(gap), gap, np.inf).max(axis=1)
    if whole.min() < SAME_CONFIGURATION:
        return int(np.argmin(whole))
    # with the wrist in line A4 and A6 share their turn as they like
    arm = np.where(np.isfinite(gap[:, :ARM_AXES]), gap[:, :ARM_AXES], np.inf).max(axis=1)
    return int(np.argmin(np.where(arm < SAME_CONFIGURATION, 0.0, np.pi) + np.minimum(whole, np.pi)))


def _unwound(q: Floats, before: Floats) -> Floats:
    """Angles (m, n) in the turns that are nearest to the row before; rows of NaN are passed over."""
    out = q.copy()
    there = np.flatnonzero(np.isfinite(q).all(axis=1))
    out[there] = np.unwrap(np.concatenate([before[None], q[there]]), axis=0)[1:]
    return out
