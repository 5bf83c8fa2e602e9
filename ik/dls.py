"""Damped least squares: inverse kinematics of any arm, many targets and seeds at once.

``solve`` runs every target from several seeds; ``track_edges`` refines one guess per target, which is how a path is
tracked from a neighbour's solution. Both keep the joints inside their limits and treat the roll about z_tcp as free,
limited or fixed::

    found = solve(chain, Ts_base_target, RollWindow.free(), seeds=16)
    found.q[found.ok]                     # configurations that reach their target

The step minimises |J dq - e|^2 + lambda |dq|^2 with lambda growing with the error that is left, so that it is bold
near the target and careful far away; joints that the error pushes against a limit are held there for the step. A miss
means *not found*, never *not reachable*. Every row is computed on its own: what else is in the batch changes nothing.

Source: Sugihara, Solvability-unconcerned inverse kinematics by the Levenberg-Marquardt method, IEEE T-RO 2011; the
held joints after Bertsekas, Projected Newton methods for optimization problems with simple constraints, 1982.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from .chain import Chain, Floats
from .dls_kernel import ColumnChain, Tool, jacobian, solve_damped
from .roll import RollWindow

POSITION_TOLERANCE = 1e-7  # m
ANGLE_TOLERANCE = 1e-7  # rad
LENGTH_SCALE = 0.5  # m that count as much as one radian in the error
FINISHED = 1e-18  # squared error of a solution that further steps cannot improve
DAMPING = 0.025  # lambda as a share of the squared error
LARGEST_STEP = 1.3  # rad a joint: the linear model is not worth more
MAX_TRIES = 6  # steps without a gain of PROGRESS after which a start is given up
PROGRESS = 0.99
WIDTH = 2048  # rows worked on at a time: what fits a core's cache
WAVES = (1, 3)  # seeds tried before looking which targets have enough; the rest follow at once
TURN = 2 * np.pi


@dataclass(frozen=True, eq=False)
class Solutions:
    """The result of a solver.

    Attributes:
        q: configurations, (m, s, n), rad; the best iterate where nothing was found.
        ok: whether the configuration reaches its target inside the joint limits, (m, s).
        position_error: (m, s), m.
        angle_error: (m, s), rad (wire direction and, outside the window, roll).
    """

    q: Floats
    ok: NDArray[np.bool_]
    position_error: Floats
    angle_error: Floats


def _error(tool: Tool, target: Floats, window: RollWindow, tool_roll: float) -> Floats:
    """Error of TCP frames against targets (x, y, z, p as (4, 3, m)), (5 or 6, m), for ``jacobian``'s rows."""
    tx, ty, tz, tp = target
    e = np.empty((5 if window.is_full else 6, tz.shape[1]))
    np.subtract(tp, tool.p, out=e[:3])
    # the wanted wire direction seen from the TCP; the turn that brings it into line has the axis e_z x z
    u, v, w = _dot(tool.x, tz), _dot(tool.y, tz), _dot(tool.z, tz)
    sine = np.sqrt(u * u + v * v)
    scale = np.arctan2(sine, w) / np.maximum(sine, 1e-300)
    # exactly opposed directions have no such axis, and any will do
    opposed = (sine < 1e-12) & (w < 0)
    e[3] = np.where(opposed, np.pi, -v * scale)
    e[4] = np.where(opposed, 0.0, u * scale)
    if not window.is_full:
        # the roll once the wire is brought into line by that turn: the twist of the relative rotation about z
        twist = np.arctan2(_dot(tool.x, ty) - _dot(tool.y, tx), _dot(tool.x, tx) + _dot(tool.y, ty))
        e[5] = -window.excess(twist + tool_roll)
    return e


def _dot(a: Floats, b: Floats) -> Floats:
    """Scalar products of columns; spelled out, so that the order of summation never depends on the shape."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def solve(
    chain: Chain,
    Ts_base_target: Floats,
    window: RollWindow,
    *,
    seeds: int = 16,
    rng_seed: int = 0,
    max_iterations: int = 80,
    enough: int | None = None,
) -> Solutions:
    """Search configurations for targets from several seeds each.

    Args:
        chain: the arm with its tool.
        Ts_base_target: targets at roll 0, (m, 4, 4), m.
        window: allowed roll about z_tcp.
        seeds: starts per target: the middle of the limits, then a low-discrepancy spread over them.
        rng_seed: shifts the spread; equal seeds give equal results.
        max_iterations: steps per start.
        enough: solutions of a target after which its other seeds are left out; None tries every seed.

    Returns:
        Found, with s = seeds. Seeds left out are not ok, stand at their start and have infinite errors.
    """
    m, n = len(Ts_base_target), chain.n
    starts = seeds_within_limits(chain, seeds, rng_seed)
    q = np.tile(starts, (m, 1, 1))
    position, angle = np.full((m, seeds), np.inf), np.full((m, seeds), np.inf)
    arm, targets = _columns(chain, Ts_base_target)
    for wave in _waves(seeds, enough):
        solved = (position[:, : wave[0]] <= POSITION_TOLERANCE) & (angle[:, : wave[0]] <= ANGLE_TOLERANCE)
        todo = np.flatnonzero(solved.sum(axis=1) < (enough or seeds + 1))
        row, seed = np.repeat(todo, len(wave)), np.tile(wave, len(todo))
        out = _descend(arm, targets, row, starts[seed].T, window, max_iterations, whole_turns=True)
        q[row, seed], position[row, seed], angle[row, seed] = out[:n].T, out[n], out[n + 1]
    return Solutions(q, (position <= POSITION_TOLERANCE) & (angle <= ANGLE_TOLERANCE), position, angle)


def _waves(seeds: int, enough: int | None) -> list[NDArray[np.int64]]:
    """Seeds in the groups they are tried in."""
    if enough is None:
        return [np.arange(seeds)]
    ends = np.cumsum(WAVES)
    return [w for w in np.split(np.arange(seeds), ends[ends < seeds]) if len(w)]


def seeds_within_limits(chain: Chain, count: int, rng_seed: int = 0) -> Floats:
    """Configurations spread evenly over the joint limits.

    Args:
        chain: the arm.
        count: how many.
        rng_seed: shifts the sequence.

    Returns:
        (count, n) rad; the first is the middle of the limits.

    Source: the R-sequence (Roberts 2018), a Kronecker sequence on the generalised golden ratio.
    """
    n = chain.n
    phi = 2.0
    for _ in range(60):
        phi = (1 + phi) ** (1 / (n + 1))
    alpha = phi ** -np.arange(1.0, n + 1)
    u = (0.5 + np.arange(count)[:, None] * alpha + rng_seed * 0.7548776662) % 1.0
    u[:1] = 0.5
    return chain.lower + u * (chain.upper - chain.lower)


def track_one(
    chain: Chain, Ts_base_target: Floats, q0: Floats, window: RollWindow, *, max_iterations: int = 30
) -> Solutions:
    """Bring one guess per target onto its target.

    Args:
        chain: the arm with its tool.
        Ts_base_target: targets at roll 0, (m, 4, 4), m.
        q0: guesses, (m, n), rad.
        window: allowed roll.
        max_iterations: steps.

    Returns:
        Found, with s = 1 squeezed away: q (m, n), ok (m,).
    """
    n = chain.n
    arm, targets = _columns(chain, Ts_base_target)
    row = np.arange(len(Ts_base_target))
    out = _descend(arm, targets, row, np.asarray(q0, dtype=float).T, window, max_iterations, whole_turns=False)
    q, position, angle = np.ascontiguousarray(out[:n].T), out[n], out[n + 1]
    return Solutions(q, (position <= POSITION_TOLERANCE) & (angle <= ANGLE_TOLERANCE), position, angle)


def _columns(chain: Chain, Ts: Floats) -> tuple[ColumnChain, Floats]:
    """The arm and its targets (x, y, z, p: (4, 3, m)) with lengths in units of LENGTH_SCALE."""
    targets = np.array(Ts[:, :3].transpose(2, 1, 0), dtype=float, order="C")
    targets[3] /= LENGTH_SCALE
    return _arm(chain), targets


@lru_cache(maxsize=16)
def _arm(chain: Chain) -> ColumnChain:
    """The chain's constants, worked out once: following a short bead would take less time than this."""
    return ColumnChain.of(chain, LENGTH_SCALE)


def _descend(
    arm: ColumnChain,
    targets: Floats,
    row: NDArray[np.int64],
    q0: Floats,
    window: RollWindow,
    max_iterations: int,
    *,
    whole_turns: bool,
) -> Floats:
    """Run starts to their end, WIDTH at a time; finished ones make room for the next.

    Args:
        arm: the arm.
        targets: (4, 3, t).
        row: target of each start, (m,).
        q0: starts, (n, m), rad.
        window: allowed roll.
        max_iterations: steps.
        whole_turns: whether a joint that leaves its limits may come in again a whole turn away.

    Returns:
        (n + 2, m): best configuration, its position error (m) and angle error (rad).
    """
    n, m = q0.shape
    done = np.empty((n + 2, m))
    begun = 0
    # rows of the state: q, best q, its errors, its size, steps without progress, steps
    state, here = np.empty((2 * n + 5, 0)), np.empty(0, dtype=np.int64)
    while begun < m or len(here):
        if begun < m and len(here) <= WIDTH // 2:
            fresh = np.arange(begun, min(begun + WIDTH - len(here), m))
            begun = fresh[-1] + 1
            state = np.concatenate([state, _fresh(arm, q0[:, fresh])], axis=1)
            here = np.concatenate([here, fresh])
            target = targets[:, :, row[here]]
        keep = _advance(arm, state, target, window, max_iterations, whole_turns)
        if not keep.all():
            done[:, here[~keep]] = state[n : 2 * n + 2, ~keep]
            state, here, target = state[:, keep], here[keep], target[:, :, keep]
    done[n] *= arm.unit
    return done


def _fresh(arm: ColumnChain, q0: Floats) -> Floats:
    q = np.clip(q0, arm.lower, arm.upper)
    nothing = np.full((3, q.shape[1]), np.inf)
    return np.concatenate([q, q, nothing, np.zeros((2, q.shape[1]))])


def _advance(
    arm: ColumnChain, state: Floats, target: Floats, window: RollWindow, max_iterations: int, whole_turns: bool
) -> NDArray[np.bool_]:
    """Test every row for its end and take a step, in place; gives the rows that go on."""
    n = len(arm.zero)
    q, best_q, best_error, (best, stale, age) = state[:n], state[n : 2 * n], state[2 * n : -3], state[-3:]
    tool, axes, points = arm.frames(q)
    e = _error(tool, target, window, arm.tool_roll)
    squares = e * e
    position = squares[0] + squares[1] + squares[2]
    angle = squares[3] + squares[4] + (squares[5] if len(e) > 5 else 0.0)
    size = position + angle
    stale += 1.0
    stale[size < PROGRESS * best] = 0.0
    better = size < best
    np.copyto(best_q, q, where=better)
    np.copyto(best_error, np.sqrt(np.stack([position, angle])), where=better)
    np.copyto(best, size, where=better)
    age += 1.0
    keep = (best > FINISHED) & (stale < MAX_TRIES) & (age <= max_iterations)
    A = jacobian(tool, axes, points, len(e))
    if len(e) > 5 and not window.is_fixed:
        A[5] *= e[5] != 0.0  # a roll inside the window is no task: its row must not hold the arm back
    _step(arm, q, A, e, size, whole_turns)
    return keep


def _step(arm: ColumnChain, q: Floats, A: Floats, e: Floats, size: Floats, whole_turns: bool) -> None:
    """One damped step, in place."""
    turns = (arm.upper - arm.lower >= TURN - 1e-9) & whole_turns
    low, high = (q <= arm.lower) & ~turns, (q >= arm.upper) & ~turns
    edge = np.flatnonzero((low | high).any(axis=0))
    if len(edge):
        # a joint at its limit that the error pulls outwards is held for this step
        B = np.take(A, edge, axis=2)
        pull = np.einsum("rnm,rm->nm", B, np.take(e, edge, axis=1))
        A[:, :, edge] = B * ~((low[:, edge] & (pull < 0)) | (high[:, edge] & (pull > 0)))
    dq = solve_damped(A, e, DAMPING * np.minimum(size, 1.0) + 1e-12)
    dq *= np.minimum(1.0, LARGEST_STEP / np.maximum(np.abs(dq).max(axis=0), 1e-12))
    q += dq
    if turns.any():
        q -= TURN * (turns & (q > arm.upper))
        q += TURN * (turns & (q < arm.lower))
    np.clip(q, arm.lower, arm.upper, out=q)
