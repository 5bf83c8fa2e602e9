"""Beads that go further round than the table turns: they are split, and the table unwinds in between.

    freedom, upright = freedom_of(case, scene), upright_of(case)
    targets, cut = split_beads(targets, freedom, upright)

A bead right round a body needs a whole turn of E2, and a helix several turns. E2 has its range and, at either end, as
much as the cone about up allows. The rest is another piece of the bead. It begins at the target where the piece before
ended, with E2 turned back or the table tilted to the other side. The number of pieces is the least possible, and they
turn by equal angles where that takes no more pieces. Radians.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np

from ik.chain import Floats
from slicing import Code, Targets, Warning

from ..arrays import Ints
from ..case.sections import Case
from ..scene.scene import Scene, case_table
from ..scene.table_freedom import NAMES, TURN, TableFreedom

UPRIGHT_DEG = 10.0  # where the case does not say how far off up the deposition direction may be
RESERVE = 0.9  # of the cone, that a piece takes at most at the ends of E2's range
MOST_TURNS = 100  # of E2, either way


def upright_of(case: Case) -> float:
    """How far off up the deposition direction may be, rad."""
    deg = case.table.upright_deg
    return float(np.deg2rad(UPRIGHT_DEG if deg is None else deg))


def freedom_of(case: Case, scene: Scene) -> TableFreedom:
    """The table's axes as a case lets them move along.

    Raises:
        InputError: an axis that stands has no such angle.
    """
    return TableFreedom.of(scene, case.table.axes or NAMES, case_table(case, scene))


def for_moving_table(case: Case, scene: Scene, targets: Targets) -> tuple[Targets, tuple[Warning, ...]]:
    """Targets with their beads split where a table that moves along has to unwind; as they are for any other.

    Args:
        case: the case.
        scene: its cell.
        targets: part frame, mm.

    Returns:
        The targets, and a warning where beads are split.
    """
    if case.table.mode != "coordinated":
        return targets, ()
    freedom, upright = freedom_of(case, scene), upright_of(case)
    split, pieces = split_beads(targets, freedom, upright)
    some = {bead: count for bead, count in pieces.items() if count > 1}
    if not some:
        return targets, ()
    span = float(np.rad2deg(freedom.high[1] - freedom.low[1]))
    first = min(some)
    text = (
        f"table.mode coordinated: {len(some)} bead(s) go further round than E2 turns ({span:g} deg, and what"
        f" upright_deg {np.rad2deg(upright):g} adds): they are welded in pieces, with the arc off while the table turns"
        f" back; at most {max(some.values())} pieces, first bead {first} "
        f"({targets.sub_volume[_sub_volume(targets, first)]})"
    )
    return split, (Warning(Code.BEAD_SPLIT, text),)


def _sub_volume(targets: Targets, bead: int) -> int:
    return int(targets.sub_volume_index[np.searchsorted(targets.bead, bead)])


def split_beads(targets: Targets, freedom: TableFreedom, upright: float) -> tuple[Targets, dict[int, int]]:
    """Split beads that go further round than the table turns.

    Args:
        targets: part frame.
        freedom: the table's axes.
        upright: how far off up the deposition direction may be, rad.

    Returns:
        The targets, and how many pieces each of the beads is in.
    """
    low, high = freedom.low[1], freedom.high[1]
    ends = np.flatnonzero(np.diff(targets.bead, prepend=-1, append=targets.bead[-1] + 1))
    cuts: list[int] = []
    pieces: dict[int, int] = {}
    for first, stop in zip(ends[:-1].tolist(), ends[1:].tolist(), strict=True):
        mine: list[int] = []
        if freedom.moves[1] and np.isfinite(low) and np.isfinite(high):
            mine = _cuts(targets.normal[first:stop], freedom, upright)
        cuts += [first + k for k in mine]
        pieces[int(targets.bead[first])] = len(mine) + 1
    return (_split(targets, np.array(cuts)) if cuts else targets), pieces


def _cuts(normals: Floats, freedom: TableFreedom, upright: float) -> list[int]:
    """Targets of a bead at which it is split; none where that is of no use."""
    intervals = []
    solutions = freedom.exact(normals)
    # a solution that E1 cannot follow splits nothing, where there is one that it can
    E1 = [freedom.wrapped(s)[:, 0] for s in solutions]
    off = [freedom.off_at_turn(normals, s[:, 1], tilt).max() for s, tilt in zip(solutions, E1, strict=True)]
    followed = [s for s, most in zip(solutions, off, strict=True) if most <= upright]
    for exact in followed or solutions:
        E2, down, up = wound(normals, exact, freedom, RESERVE * upright)
        intervals.append((E2 - down, E2 + up))
    cuts = _greedy(intervals, freedom)
    if not cuts:
        return []
    even = _even(E2, len(cuts))
    ends = [] if even is None else list(pairwise([0, *even, len(E2) - 1]))
    fits = [any(_fits(low[a : b + 1], high[a : b + 1], freedom) for low, high in intervals) for a, b in ends]
    return even if even is not None and all(fits) else cuts


def wound(normals: Floats, exact: Floats, freedom: TableFreedom, upright: float) -> tuple[Floats, Floats, Floats]:
    """How E2 winds along a bead, and how far it may be off that, down and up.

    Args:
        normals: deposition directions, (t, 3), part frame.
        exact: angles of the table that bring them nearest to up, (t, 2), rad.
        freedom: the table's axes.
        upright: how far off up they may be, rad.

    Returns:
        E2 steady from target to target, (t,), and the two distances, (t,), rad; where E2 is as it likes, as before.
    """
    width = freedom.turns(normals, exact, upright)
    E2 = exact[:, 1].copy()
    free = (width >= np.pi / 2).all(axis=1)
    fixed = np.flatnonzero(~free)
    if len(fixed):
        E2[fixed] = np.unwrap(E2[fixed])
        E2 = np.interp(np.arange(len(E2)), fixed, E2[fixed])
    width[free] = TURN * MOST_TURNS
    return E2, width[:, 0], width[:, 1]


def _fits(low: Floats, high: Floats, freedom: TableFreedom) -> bool:
    """Whether intervals of E2 all meet its range in some turn."""
    turns = TURN * np.arange(-MOST_TURNS, MOST_TURNS + 1)
    return bool(((low.max() + turns <= freedom.high[1]) & (high.min() + turns >= freedom.low[1])).any())


def _greedy(intervals: list[tuple[Floats, Floats]], freedom: TableFreedom) -> list[int]:
    """Targets at which pieces begin that are as long as can be; none where a step by itself does not fit.

    Args:
        intervals: of E2 at each target, low and high ends (t,) each, rad: one pair a solution, of which each piece has
            the one that takes it furthest.
        freedom: the table's axes.
    """
    turns = TURN * np.arange(-MOST_TURNS, MOST_TURNS + 1)[:, None]
    cuts: list[int] = []
    at, count = 0, len(intervals[0][0])
    while at < count - 1:
        length = 0
        for low, high in intervals:
            most, least = np.maximum.accumulate(low[at:]), np.minimum.accumulate(high[at:])
            good = (most + turns <= freedom.high[1]) & (least + turns >= freedom.low[1])
            length = max(length, int(good.sum(axis=1).max()))  # what fits at first and then no more never does again
        if length < 2:
            return []
        at += length - 1
        if at < count - 1:
            cuts.append(at)
    return cuts


def _even(E2: Floats, count: int) -> list[int] | None:
    """Targets at which a bead is split into pieces that turn alike; None where they would fall together."""
    along = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(E2)))])
    at = np.searchsorted(along, along[-1] * np.arange(1, count + 1) / (count + 1) - 1e-9)
    ends = [0, *at.tolist(), len(E2) - 1]
    return None if min(np.diff(ends), default=1) < 1 else at.tolist()


def _split(targets: Targets, cuts: Ints) -> Targets:
    """Targets with those at cuts given twice: as the end of a piece, and as the beginning of the next."""
    t = targets
    index = np.insert(np.arange(len(t)), cuts, cuts)
    begins = np.zeros(len(index), dtype=np.int64)
    begins[cuts + np.arange(1, len(cuts) + 1)] = 1
    path = t.bead[index] + np.cumsum(begins)
    first = np.flatnonzero(np.diff(path, prepend=-1))
    whole = ~np.isin(t.bead, t.bead[cuts])
    closed = np.asarray(t.closed)[t.bead[index[first]]] & whole[index[first]]
    return replace(
        t,
        bead=path,
        closed=closed,
        sub_volume_index=t.sub_volume_index[index],
        layer=t.layer[index],
        position=t.position[index],
        normal=t.normal[index],
        tangent=t.tangent[index],
        thickness_mm=t.thickness_mm[index],
        speed_mm_s=t.speed_mm_s[index],
    )
