"""The cheapest path through samples of the roll, branch by branch, with the costs of all edges computed at once.

A faster search than :mod:`ik.bead_path`, for closed forms: whole turns of joints are not part of the nodes, but are
chosen for the path that is found, so that a target has one node for each roll and branch::

    nodes = lowest_angles(chain, raw)                      # (j, t, g, r) lowest angles inside the limits
    edges = prices(chain, nodes, rolls, bounds, shifts, circular=True)     # (t - 1, g, s, r)
    way = cheapest(cost, edges, shifts)                # branch and (t,) samples, or None
    q = with_whole_turns(chain, nodes_on_way, q_before)         # (t, j), or None where the turns of a joint run out

A path that this search does not find may still exist: one that has to change its turns is left to the full search.
Radians, seconds.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .bead_path import move_price
from .chain import Chain, Floats
from .joint_turns import SLACK, TURN
from .roll import wrap

Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]
ROUNDING = 1e-9  # share of a price
BLOCK = 12_000  # edges priced at a time: what fits a core's cache


@dataclass(frozen=True, eq=False)
class Bounds:
    """Limits of the edges from target to target.

    Attributes:
        speed: joint speed limits, (j,), rad/s.
        times: for each edge, (t - 1,), s.
        largest: most that any joint may move on it, (t - 1,), rad.
        roll_price: of turning the roll, s/rad.
        roll_step: most that the roll may turn on it, (t - 1,), rad.
    """

    speed: Floats
    times: Floats
    largest: Floats
    roll_price: float
    roll_step: Floats


def several_turns(chain: Chain) -> Bools:
    """Joints that can stand at an angle in more than one turn, (j,)."""
    return np.asarray(chain.upper - chain.lower + 2 * SLACK >= TURN)


def lowest_angles(chain: Chain, raw: Floats) -> tuple[Floats, Bools, Floats]:
    """Every joint at its lowest angle inside the limits.

    Args:
        chain: the arm.
        raw: configurations in any turn, (t, r, g, j), rad, NaN where there is none.

    Returns:
        Angles (j, t, g, r), rad; which are inside the limits, (t, g, r); and the room of the tightest joint, at its
        best turn, (t, g, r), rad.
    """
    q = np.ascontiguousarray(np.moveaxis(raw, (3, 2), (0, 2)))
    room = np.full(q.shape[1:], np.inf)
    inside = np.ones(q.shape[1:], dtype=bool)
    for j, angle in enumerate(q):
        span = chain.upper[j] - chain.lower[j]
        angle -= chain.lower[j] - SLACK
        angle -= TURN * np.floor(angle / TURN)
        angle -= SLACK
        inside &= angle <= span + SLACK  # NaN compares false
        here = angle
        if span >= TURN:
            most = np.floor((span + SLACK - angle) / TURN)
            here = angle + TURN * np.clip(np.round((span / 2 - angle) / TURN), 0.0, np.maximum(most, 0.0))
        np.minimum(room, np.minimum(here, span - here), out=room)
        angle += chain.lower[j]
    return q, inside, room


def prices(chain: Chain, q: Floats, rolls: Floats, bounds: Bounds, shifts: Ints, *, circular: bool) -> Floats:
    """Prices of all edges.

    Args:
        chain: the arm.
        q: from :func:`lowest_angles`, (j, t, g, r).
        rolls: of each target's samples, (t, r), rad.
        bounds: what edges have to keep.
        shifts: by how many samples the roll may change, (s,).
        circular: whether the first and the last sample are neighbours.

    Returns:
        (t - 1, g, s, r) s: of arriving at sample r from sample r - shift; infinite where that is not allowed.
    """
    count = q.shape[-1]
    source = np.arange(count) - shifts[:, None]
    outside = None if circular else (source < 0) | (source >= count)
    source %= count
    turning = several_turns(chain)
    out: Floats = np.empty((q.shape[1] - 1, q.shape[2], *source.shape))
    at_a_time = max(BLOCK // max(out[:1].size, 1), 1)
    for first in range(0, len(out), at_a_time):
        price, stop = out[first : first + at_a_time], min(first + at_a_time, len(out))
        price[:] = 0.0
        needed, furthest = np.zeros_like(price), np.zeros_like(price)
        move = np.empty_like(price)
        for j in range(len(q)):
            np.subtract(q[j, first + 1 : stop + 1, :, None], q[j, first:stop].take(source, axis=2), out=move)
            if turning[j]:
                move[:] = wrap(move)
            np.abs(move, out=move)
            np.maximum(furthest, move, out=furthest)
            move /= bounds.speed[j]
            np.maximum(needed, move, out=needed)
            price += move
        turn = np.abs(wrap(rolls[first + 1 : stop + 1, None, :] - rolls[first:stop].take(source, axis=1)))
        some = slice(first, stop), None, None, None
        allowed = (furthest <= bounds.largest[some]) & (needed <= bounds.times[some])
        allowed &= (turn <= bounds.roll_step[first:stop, None, None] + 1e-9)[:, None]
        if outside is not None:
            allowed &= ~outside
        price[:] = move_price(needed, price)
        price += (bounds.roll_price * turn)[:, None]
        price[~allowed] = np.inf
    return out


def cheapest(cost: Floats, edges: Floats, shifts: Ints) -> tuple[int, Ints] | None:
    """The cheapest path.

    Args:
        cost: of each node, (t, g, r), s; infinite where it is not allowed.
        edges: from :func:`prices`.
        shifts: as given there.

    Returns:
        The branch, and the sample at each target, (t,); None where there is no way.
    """
    count = cost.shape[2]
    if count == len(shifts) == 1:  # of a held roll each branch has one way
        return steadiest(cost, edges, np.inf)
    source = (np.arange(count) - shifts[:, None]) % count
    here, come = cost[0], [cost[0]]
    for price, edge in zip(cost[1:], edges, strict=True):
        here = (here.take(source, axis=1) + edge).min(axis=1) + price
        come.append(here)
    g, r = (int(v) for v in np.unravel_index(int(here.argmin()), here.shape))
    if not np.isfinite(here[g, r]):
        return None
    arrived = np.stack(come)[:-1, g].take(source, axis=1) + edges[:, g]
    way = [r]
    for choice in reversed(arrived.argmin(axis=1).tolist()):
        way.append(int(source[choice[way[-1]], way[-1]]))
    return g, np.array(way[::-1])


def steadiest(cost: Floats, edges: Floats, shift_price: float) -> tuple[int, Ints] | None:
    """The cheapest path at one sample of the roll, if every path on which the roll changes costs more.

    Args:
        cost: of each node, (t, g, r), s; infinite where it is not allowed.
        edges: from :func:`prices`, of the roll that stays at its sample, (t - 1, g, 1, r).
        shift_price: what an edge to another sample costs at least, s.

    Returns:
        As of :func:`cheapest`, which finds the same; None where it takes that.
    """
    branches, count = cost.shape[1:]
    steps = np.stack([edges[:, :, 0], cost[1:]], axis=1).reshape(-1, branches, count)
    total = np.cumsum(np.concatenate([cost[:1], steps]), axis=0)[-1]
    g, r = (int(v) for v in np.unravel_index(int(total.argmin()), total.shape))
    if not np.isfinite(total[g, r]):
        return None
    least = np.minimum(edges.min(axis=(1, 2, 3)), shift_price)
    with_shift = cost.min(axis=(1, 2)).sum() + least.sum() + shift_price - least.max(initial=0.0)
    if not total[g, r] < (1 - ROUNDING) * with_shift:
        return None
    return g, np.full(len(cost), r)


def with_whole_turns(chain: Chain, q: Floats, q_before: Floats | None) -> Floats | None:
    """A path with the whole turns of its joints.

    Args:
        chain: the arm.
        q: lowest angles along the way, (t, j), rad.
        q_before: where the arm comes from, (j,), rad: the turns nearest to it; None: those with most room.

    Returns:
        (t, j) rad, inside the limits without a jump; None where a joint's range does not hold the whole way.
    """
    move = np.diff(q, axis=0)
    turning = several_turns(chain)
    move[:, turning] = wrap(move[:, turning])
    out = np.concatenate([q[:1], q[0] + np.cumsum(move, axis=0)])
    low, high = out.min(axis=0), out.max(axis=0)
    least = np.ceil((chain.lower - SLACK - low) / TURN)
    most = np.floor((chain.upper + SLACK - high) / TURN)
    if (least > most).any():
        return None
    wanted = (chain.lower + chain.upper - low - high) / 2 if q_before is None else q_before - out[0]
    return np.clip(out + TURN * np.clip(np.round(wanted / TURN), least, most), chain.lower, chain.upper)
