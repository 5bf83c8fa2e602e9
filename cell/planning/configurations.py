"""All candidates of a target: each roll, each configuration, and why it is not allowed.

    nodes = nodes_at_rolls(solver, placed, window, roll_step, limits)
    nodes.q, nodes.cost              # (n, r, g, k, 6), (n, r, g, k); infinite cost = not allowed
    nodes.why_not(i)                 # the failure of a target without an allowed node
    reasons(solver, Ts, window, step)  # of many such targets, in a fraction of the time

Radians and metres.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ik.chain import Floats
from ik.roll import RollWindow, apply_roll
from ik.singularity import KINDS, SingularityLimits, margins, smallest_singular_value
from ik.solver import Solver

from ..failure import Failure, Kind, SearchEffort
from ..scene.placement import PlacedTargets
from ..units import MARGIN_UNITS

NEAR_LIMIT = np.deg2rad(10.0)  # joints closer to a limit than this cost extra
NEAR_COST = 0.3  # s that a node is worth avoiding at the clearance itself; nothing at twice as much
CHUNK = 4096  # poses a pass, to keep memory flat
BRANCHES = 8  # configurations of a target at a roll, in closed form


@dataclass(frozen=True, eq=False)
class Nodes:
    """Candidates of n targets.

    Attributes:
        solver: the arm.
        limits: singularity margins asked for.
        rolls: samples of the roll, (r,), rad.
        window: allowed roll.
        q: configurations inside the joint limits, (n, r, g, k, j), rad, NaN where there is none.
        raw: configurations before the limits, (n, r, g, j), rad.
        over: how far those are outside, (n, r, g, j), rad.
        reach_excess: (n, r), m, see ``closed_form.reach_excess``.
        margin: singularity margins of q, (n, r, g, k, 4).
        cost: cost of a node, (n, r, g, k), s; infinite where a margin is too small.
        exhaustive: whether q holds every configuration of its rolls.
    """

    solver: Solver
    limits: SingularityLimits
    rolls: Floats
    window: RollWindow
    q: Floats
    raw: Floats
    over: Floats
    reach_excess: Floats
    margin: Floats
    cost: Floats
    exhaustive: bool

    def within_limits(self, i: int) -> NDArray[np.bool_]:
        """Which configurations of a target are inside the joint limits, (r, g, k)."""
        return np.isfinite(self.q[i, ..., 0])

    def why_not(self, i: int) -> tuple[Failure, Floats | None]:
        """Why a target has no allowed node, by its best candidate.

        Args:
            i: the target; none of its costs is finite.

        Returns:
            What is wrong (singular, joint limit or unreachable), and the best attempt (j,) or None.
        """
        inside = self.within_limits(i)
        if inside.any():
            return self.singular(i, inside)
        outside = np.isfinite(self.over[i]).all(axis=-1)
        if outside.any():
            return self.joint_limit(i, outside)
        return self.reach(i, np.ones(len(self.rolls), dtype=bool)), None

    def reach(self, i: int, among: NDArray[np.bool_]) -> Failure:
        """How far a target is out of reach at the best of some rolls (r,)."""
        known = np.isfinite(self.reach_excess[i])
        if not known.any():
            return Failure(Kind.UNREACHABLE, effort=SearchEffort(seeds=self.solver.seeds, rolls=len(self.rolls)))
        best = int(np.argmin(np.where(among & known, np.abs(self.reach_excess[i]), np.inf)))
        beyond = float(self.reach_excess[i, best])
        far = round(abs(beyond) * 1e3, 3)
        # -0.0 says "too close" of what rounds to nothing
        return Failure(Kind.UNREACHABLE, measure=far if beyond > 0 else -far, roll_deg=_deg(self.rolls[best]))

    def singular(self, i: int, among: NDArray[np.bool_]) -> tuple[Failure, Floats]:
        """The margin of a target's best node.

        Args:
            i: the target.
            among: which of its nodes, (r, g, k).

        Returns:
            The failure, and the configuration (j,).
        """
        limits = self.limits.values(self.solver.geometry is not None)
        with np.errstate(divide="ignore", invalid="ignore"):
            short = np.where(limits > 0, self.margin[i] / limits, np.inf)
        share = np.where(among, short.min(axis=-1), -1.0)
        node = np.unravel_index(int(np.argmax(share)), share.shape)
        kind = int(np.argmin(short[node]))
        q = self.q[i][node].copy()  # kept with the failure: not all candidates of the bead with it
        _, factor = MARGIN_UNITS[KINDS[kind]]
        failure = Failure(
            Kind.SINGULAR,
            measure=round(float(self.margin[i][node][kind]) * factor, 3),
            limit=round(float(limits[kind]) * factor, 3),
            singularity=KINDS[kind],
            sigma=round(float(smallest_singular_value(self.solver.chain, q[None])[0]), 5),
            roll_deg=_deg(self.rolls[node[0]]),
        )
        return failure, q

    def joint_limit(self, i: int, among: NDArray[np.bool_]) -> tuple[Failure, Floats]:
        """How far a target's best configuration is outside the joint limits.

        Args:
            i: the target.
            among: which of its rolls and branches, (r, g).

        Returns:
            The failure, and the configuration (j,).
        """
        total = np.where(among, self.over[i].max(axis=-1), np.inf)
        node = np.unravel_index(int(np.argmin(total)), total.shape)
        joint = int(np.argmax(self.over[i][node]))
        failure = Failure(
            Kind.JOINT_LIMIT,
            measure=round(float(np.rad2deg(self.over[i][node][joint])), 3),
            axis=self.solver.chain.names[joint],
            roll_deg=_deg(self.rolls[node[0]]),
        )
        return failure, self.raw[i][node].copy()


def _deg(angle: float) -> float:
    return round(float(np.rad2deg(angle)), 3)


def reasons(solver: Solver, Ts: Floats, window: RollWindow, roll_step: float) -> list[str]:
    """The reasons of targets without an allowed node, as :meth:`Nodes.why_not` gives them, without measures.

    Args:
        solver: the arm.
        Ts: targets at roll 0, (n, 4, 4), m, base frame.
        window: allowed roll.
        roll_step: distance of roll samples, rad.

    Returns:
        A reason a target.
    """
    rolls, found = window.samples(roll_step), []
    per_pass = max(CHUNK // len(rolls), 1)
    for i in range(0, len(Ts), per_pass):
        some = Ts[i : i + per_pass]
        c = solver.candidates(apply_roll(some[:, None], rolls).reshape(-1, 4, 4))
        inside = np.isfinite(c.q[..., 0]).reshape(len(some), -1).any(axis=1)
        outside = np.isfinite(c.over).all(axis=-1).reshape(len(some), -1).any(axis=1)
        kinds = np.where(outside, Kind.JOINT_LIMIT.reason, Kind.UNREACHABLE.reason)
        found += np.where(inside, Kind.SINGULAR.reason, kinds).tolist()
    return found


def nodes_at_rolls(
    solver: Solver,
    placed: PlacedTargets,
    window: RollWindow,
    roll_step: float,
    limits: SingularityLimits,
    also: Floats | None = None,
) -> Nodes:
    """Candidates of all targets at all sampled rolls.

    Args:
        solver: the arm.
        placed: targets, base frame.
        window: allowed roll.
        roll_step: distance of roll samples, rad.
        limits: singularity margins to keep.
        also: further rolls, (m,), rad.

    Returns:
        Nodes.
    """
    rolls = window.samples(roll_step)
    if also is not None and len(also):
        rolls = np.unique(np.concatenate([rolls, also]))
    Ts = placed.Ts_base_target
    n, r = len(Ts), len(rolls)
    per_pass = max(CHUNK // r, 1)
    parts = [
        solver.candidates(apply_roll(Ts[i : i + per_pass, None], rolls).reshape(-1, 4, 4))
        for i in range(0, n, per_pass)
    ]
    q = _joined([p.q for p in parts]).reshape(n, r, len(parts[0].raw[0]), -1, solver.chain.n)
    margin, cost = np.empty((*q.shape[:-1], len(KINDS))), np.empty(q.shape[:-1])
    least = limits.values(solver.geometry is not None)
    for i in range(0, n, per_pass):
        some = slice(i, i + per_pass)
        margin[some] = margins(solver.chain, solver.geometry, q[some])
        allowed = np.isfinite(q[some, ..., 0]) & (margin[some] >= least).all(axis=-1)
        room = np.minimum(q[some] - solver.chain.lower, solver.chain.upper - q[some]).min(axis=-1)
        cost[some] = np.where(allowed, node_cost(room, margin[some], least), np.inf)
    shape = (n, r, -1, solver.chain.n)
    return Nodes(
        solver=solver,
        limits=limits,
        rolls=rolls,
        window=window,
        q=q,
        raw=np.concatenate([p.raw for p in parts]).reshape(shape),
        over=np.concatenate([p.over for p in parts]).reshape(shape),
        reach_excess=np.concatenate([p.reach_excess for p in parts]).reshape(n, r),
        margin=margin,
        cost=cost,
        exhaustive=parts[0].exhaustive,
    )


def _joined(parts: list[Floats]) -> Floats:
    """Candidates of several passes, padded to the most combinations of turns that any of them has."""
    k = max(p.shape[2] for p in parts)
    out = np.full((sum(map(len, parts)), parts[0].shape[1], k, parts[0].shape[3]), np.nan)
    first = 0
    for p in parts:
        out[first : first + len(p), :, : p.shape[2]] = p
        first += len(p)
    return out


def node_cost(room: Floats, margin: Floats, least: Floats) -> Floats:
    """Cost of a node: high close to a singularity or to a joint limit.

    Args:
        room: of the joint nearest to its limit, (...), rad.
        margin: singularity margins, (..., 4).
        least: what they have to keep, (4,).

    Returns:
        (...) s.
    """
    tight = np.clip(1 - room / NEAR_LIMIT, 0.0, 1.0) ** 2
    with np.errstate(divide="ignore", invalid="ignore"):
        # 1 at the margin itself, a quarter at twice the margin
        near = np.where(least > 0, (least / margin) ** 2, 0.0).sum(axis=-1)
    return 0.3 * tight + 0.1 * np.nan_to_num(near)


def near_cost(distance: Floats, clearance: float) -> Floats:
    """Cost of a node that keeps its clearance, but not twice the clearance.

    Args:
        distance: least distance of anything from anything, (...), m.
        clearance: what has to be kept, m.

    Returns:
        (...) s; 0 where no clearance is asked for.
    """
    if clearance <= 0:
        return np.zeros(np.shape(distance))
    return NEAR_COST * np.clip(2.0 - distance / clearance, 0.0, 1.0) ** 2
