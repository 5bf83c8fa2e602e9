"""Free rolls at places on a bead, and the places between which no motion leads.

    search = CutSearch(context, first, stop)
    for places in search.begun_at(near):                   # ascending places; search.place tells that of each target
        search.cut(places, branch)                         # two of them between which no way seems to lead, or None
        finer = search.refined(places, branches)           # more of them, where the roll turns far; None: nowhere
    search.confirmed({branch: places})                     # the same once nothing free is overlooked there

Places are the bead's targets, and others where these are far apart. At first only samples of the roll are checked. If
limits or margins forbid two neighbouring samples, or a sample at two places, everything between them is taken as
forbidden; nothing is known of rolls between samples. This shows where to look. What seems to be a cut is then checked
closely: no free roll lies between two that were checked, and what is forbidden is forbidden all along.

Depths of penetration are taken from the collision engine. Metres and radians.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ik.chain import Floats
from ik.roll import wrap

from ...arrays import Ints
from ...rigid import great_circle
from ...scene.placement import PlacedTargets
from ..collision_free_rolls import (
    FINEST,
    MOST_DETOUR,
    KnownRolls,
    checked_rolls,
    rolls_around,
    rolls_sampled,
    with_rolls_between,
)
from ..configurations import BRANCHES
from ..context import FINER_ROLLS, Context
from ..edges.edge_tracking import EdgePoses
from ..stations import Spacing, nodes_of_poses, stations

Bools = NDArray[np.bool_]
AROUND = 1  # stations on either side of where a bead may be cut that are looked at as well
MOST_NEAR = 3  # such stretches of a bead
FAR_TURN = np.deg2rad(15.5)  # of the roll from place to place: it may go round what is in the way
PARTS = 3  # in which a step of the roll that may hide something free is cut
SAME_ROLL = 1e-9  # rad
APART, TURNED = 5e-3, np.deg2rad(3.0)  # m along the bead and turn of the wire, rad, of neighbouring places at most


@dataclass(frozen=True, eq=False)
class _Sampled:
    """A place at the samples of the roll: room, (g, r), m, as of ``KnownRolls``, NaN where not checked; q (g, r, j)."""

    room: Floats
    q: Floats


@dataclass(frozen=True, eq=False)
class _Barred:
    """Samples of the roll that the arm cannot have, or may not have, anywhere between two places, by branch.

    Attributes:
        deep: it is too deep in a collision at both, (g, r).
        bare: limits and margins forbid it at both, (g, r).
    """

    deep: Bools
    bare: Bools


class CutSearch:
    """Free rolls at places on a bead: its targets, and others between targets that are far apart."""

    def __init__(self, context: Context, first: int, stop: int) -> None:
        """Nothing is checked yet.

        Args:
            context: the arm and the cell.
            first: the bead's first target.
            stop: one past its last.
        """
        targets = context.placed.rows(slice(first, stop))
        placed, self.place = _dense(targets)  # place of every target
        laid = np.full(len(placed.position), context.deposits_before[first])
        self.context = replace(context, placed=placed, deposits_before=laid)
        self.step = context.settings.roll_step
        self.rolls = rolls_around(context, self.step)
        self._stations = stations(targets, Spacing())
        self._known: dict[int, KnownRolls] = {}
        self._sampled: dict[int, _Sampled] = {}
        self._closely: dict[tuple[int, int], Floats] = {}  # rolls that are free, of places and branches: none is hidden
        self._barred: dict[tuple[int, int], _Barred] = {}
        self._forbidden: dict[tuple[int, int], Bools] = {}

    def begun_at(self, near: Sequence[tuple[int, int]]) -> Iterator[list[int]]:
        """Places to begin with, a few at a time: those between which the bead may be cut, and stations around.

        Args:
            near: pairs of targets, counted from the bead's first, between which it may be; none: anywhere.
        """
        at = self._stations
        for a, b in near[:MOST_NEAR] or [(0, len(self.place) - 1)]:
            low, high = np.searchsorted(at, a, "right") - 1 - AROUND, np.searchsorted(at, b) + AROUND
            some = [a, b, *at[max(low, 0) : high + 1].tolist()]
            yield sorted({int(self.place[i]) for i in some})

    def cut(self, places: Sequence[int], branch: int, *, closely: bool = False) -> tuple[int, int] | None:
        """The closest of some places between which no way leads in a branch, by what is known of them.

        Args:
            places: ascending.
            branch: the branch.
            closely: whether what limits and margins forbid is to be so all along.
        """
        reached = self._reached(places, branch, closely=closely)
        end = next((k for k, some in enumerate(reached) if not len(some)), None)
        if end is None:
            return None
        begin = end
        while all(map(len, self._reached(places[begin : end + 1], branch, closely=closely))):
            begin -= 1
        return (places[begin], places[end]) if begin < end else (places[max(end - 1, 0)], places[max(end, 1)])

    def confirmed(self, places_of: Mapping[int, Sequence[int]]) -> dict[int, tuple[int, int]]:
        """By branch the closest of its places between which no way leads: looked at closely."""
        found: dict[int, tuple[int, int]] = {}
        left = dict(places_of)
        while left:
            cuts = {g: self.cut(places, g, closely=True) for g, places in left.items()}
            among = {g: [i for i in left[g] if c[0] <= i <= c[1]] for g, c in cuts.items() if c is not None}
            new = {g: [i for i in some if (i, g) not in self._closely] for g, some in among.items()}
            found.update({g: c for g, c in cuts.items() if c is not None and not new[g]})
            left = {g: left[g] for g, some in new.items() if some}
            if left:
                self._look_closely([(i, g) for g in left for i in new[g]])
        return found

    def refined(self, places: Sequence[int], branches: Iterable[int]) -> list[int] | None:
        """The places and others half-way between two, where the roll turns furthest from one to the next in a branch.

        Returns:
            None where it does not turn far in any.
        """
        new: set[int] = set()
        for g in branches:
            reached = self._reached(places, g, closely=False)
            turns = [
                float(np.abs(wrap(on[:, None] - come)).min(axis=1).max()) if b - a > 1 and len(on) else 0.0
                for (a, b), come, on in zip(pairwise(places), reached[:-1], reached[1:], strict=False)
            ]
            k = int(np.argmax(turns)) if turns else 0
            if turns and turns[k] > FAR_TURN:
                new.add((places[k] + places[k + 1]) // 2)
        return sorted({*places, *new}) if new else None

    def _reached(self, places: Sequence[int], branch: int, *, closely: bool) -> list[Floats]:
        """Rolls at places that may be reached from the first of them, up to the first at which there are none."""
        self._look(places)
        out = [self._free(places[0], branch)]
        for a, b in pairwise(places):
            if not len(out[-1]):
                break
            barred = self._barred[a, b]
            deep, bare = barred.deep[branch], barred.bare[branch]
            on = self._led_to(deep | bare, out[-1], self._free(b, branch))
            if closely and bare.any() and len(self._led_to(deep, out[-1], self._free(b, branch))) > len(on):
                on = self._led_to(deep | bare & self._forbidden_between(a, b)[branch], out[-1], self._free(b, branch))
            out.append(on)
        return out

    def _led_to(self, barred: Bools, come: Floats, free: Floats) -> Floats:
        """Those of some rolls that others lead to without a sample that is barred (r,) between."""
        circular, blocked = self.context.window.is_full, self.rolls[barred]
        reached = np.zeros(len(blocked) + 1, dtype=bool)  # sectors that are
        reached[roll_sectors(blocked, come, circular=circular)] = True
        return free[reached[roll_sectors(blocked, free, circular=circular)]]

    def _free(self, place: int, branch: int) -> Floats:
        known = self._closely.get((place, branch))
        return self.rolls[self._sampled[place].room[branch] >= 0] if known is None else known

    def _look(self, places: Sequence[int]) -> None:
        """Check places at the samples of the roll, and what is barred from each to the next."""
        new: Ints = np.array([i for i in places if i not in self._known], dtype=np.int64)
        if len(new):
            known = rolls_sampled(self.context, new, self.step, flips=True)
            for i in new.tolist():
                here = self._known[i] = known.rows(known.target == i)
                shape = BRANCHES, len(self.rolls)
                sampled = _Sampled(np.full(shape, np.nan), np.zeros((*shape, here.q.shape[1])))
                at = here.branch, np.searchsorted(self.rolls, here.roll)
                sampled.room[at], sampled.q[at] = here.room, here.q
                self._sampled[i] = sampled
        pairs = [pair for pair in pairwise(places) if pair not in self._barred]
        if pairs:
            self._bar(pairs)

    def _bar(self, pairs: Sequence[tuple[int, int]]) -> None:
        """Determine the barred samples between pairs of places."""
        room, other_room = (np.stack([self._sampled[pair[k]].room for pair in pairs]) for k in (0, 1))
        q, other_q = (np.stack([self._sampled[pair[k]].q for pair in pairs]) for k in (0, 1))
        bare = np.isneginf(room) & np.isneginf(other_room)
        deep: Bools = (room < 0) & (other_room < 0) & np.isfinite(room) & np.isfinite(other_room)
        from_q, depth = q[deep], -(room[deep] + other_room[deep])
        to_q = from_q + wrap(other_q[deep] - from_q)
        way = self.context.screen.travel_bound(self.context.radius, from_q, to_q)
        deep[deep] = np.asarray(depth >= MOST_DETOUR * way)
        self._barred.update({pair: _Barred(deep[k], bare[k]) for k, pair in enumerate(pairs)})

    def _forbidden_between(self, a: int, b: int) -> Bools:
        """Whether limits and margins forbid samples of the roll all along between two places, by branch, (g, r)."""
        if (a, b) not in self._forbidden:
            edge, t = np.repeat(np.arange(a, b), 2), np.tile([0.0, 0.5], b - a)
            poses = EdgePoses.of(self.context.placed, np.arange(a, b), np.zeros((b - a, 2)))
            allowed = self._allowed(poses.at(edge - a, t), np.broadcast_to(self.rolls, (len(edge), len(self.rolls))))
            self._forbidden[a, b] = np.asarray(~allowed.any(axis=0))
        return self._forbidden[a, b]

    def _allowed(self, Ts: Floats, rolls: Floats) -> Bools:
        """Whether limits and margins allow poses (t, 4, 4) at rolls (t, r), by branch, (t, g, r)."""
        return np.asarray(np.isfinite(nodes_of_poses(self.context, Ts, rolls)[1]))

    def _look_closely(self, some: Sequence[tuple[int, int]]) -> None:
        """Check all rolls of some places, each in a branch."""
        places = np.unique([i for i, _ in some])
        wanted = np.zeros((int(places[-1]) + 1, BRANCHES), dtype=bool)
        wanted[tuple(np.array(some).T)] = True
        first, *rest = (self._known[i] for i in places.tolist())
        known = first.sorted_with(*rest)
        known = known.rows(wanted[known.target, known.branch])
        known = with_rolls_between(
            self.context, self._with_edges(known, places), beside_free=False, flips=True, parts=PARTS
        )
        free = known.rows(known.room >= 0)
        self._closely.update({(i, g): free.roll[(free.target == i) & (free.branch == g)] for i, g in some})

    def _with_edges(self, known: KnownRolls, places: Ints) -> KnownRolls:
        """The same with rolls at which limits and margins begin to forbid, or to allow: found without collisions.

        Where neighbouring rolls are forbidden, all of the finest samples between them are taken that are allowed; where
        one is and the other collides, how far from that one it is allowed, and what is allowed beyond.
        """
        rolls = self.context.window.samples(self.step / FINER_ROLLS**2)
        Ts = self.context.placed.Ts_base_target
        allowed = np.zeros((int(places[-1]) + 1, BRANCHES, len(rolls)), dtype=bool)
        allowed[places] = self._allowed(Ts[places], np.broadcast_to(rolls, (len(places), len(rolls))))
        k = np.arange(len(known.roll) - 1)
        same = (known.target[k] == known.target[k + 1]) & (known.branch[k] == known.branch[k + 1])
        out = np.isneginf(known.room)
        closed = known.held[k] + known.held[k + 1] >= np.diff(known.roll)
        k = k[same & ~closed & ((out[k] & (known.room[k + 1] < 0)) | (out[k + 1] & (known.room[k] < 0)))]
        more: list[tuple[int, float]] = []  # row that a roll lies behind, and the roll
        edges: list[tuple[int, float, float]] = []  # row, the last roll that is allowed and the next, which is not
        for row in k.tolist():
            between = (rolls > known.roll[row] + SAME_ROLL) & (rolls < known.roll[row + 1] - SAME_ROLL)
            fine, may = rolls[between], allowed[known.target[row], known.branch[row], between]
            if out[row] and out[row + 1]:
                more += [(row, roll) for roll in fine[may].tolist()]
                continue
            if out[row]:  # from the other side
                fine, may = fine[::-1], may[::-1]
            inner, outer = (row + 1, row) if out[row] else (row, row + 1)
            on = int(np.argmin(np.append(may, False)))  # so many are allowed before the first that is not
            edges.append((row, *np.array([known.roll[inner], *fine, known.roll[outer]])[on : on + 2].tolist()))
            more += [(row, roll) for roll in fine[on:][may[on:]].tolist()]
        more += self._narrowed(known, edges)
        if not more:
            return known
        behind, roll = np.array([row for row, _ in more]), np.array([roll for _, roll in more])
        return known.sorted_with(
            checked_rolls(self.context, known.target[behind], roll, known.branch[behind], flips=True)
        )

    def _narrowed(self, known: KnownRolls, edges: Sequence[tuple[int, float, float]]) -> list[tuple[int, float]]:
        """Both rolls of edges, as close to one another as matters."""
        if not edges:
            return []
        row = np.array([edge[0] for edge in edges])
        may, may_not = (np.array([edge[k] for edge in edges]) for k in (1, 2))
        Ts, branch = self.context.placed.Ts_base_target[known.target[row]], known.branch[row]
        while np.abs(may_not - may).max() > FINEST:
            middle = (may + may_not) / 2
            allowed = self._allowed(Ts, middle[:, None])[np.arange(len(row)), branch, 0]
            may, may_not = np.where(allowed, middle, may), np.where(allowed, may_not, middle)
        return [*zip(row.tolist(), may.tolist(), strict=True), *zip(row.tolist(), may_not.tolist(), strict=True)]


def roll_sectors(blocked: Floats, roll: Floats, *, circular: bool) -> Ints:
    """Between which of some blocked rolls other rolls are.

    Args:
        blocked: ascending, (b,), rad.
        roll: (m,), rad.
        circular: whether what is behind the last is before the first.

    Returns:
        Numbers, (m,), alike where no blocked roll lies between.
    """
    sector: Ints = np.searchsorted(blocked, roll)
    return sector % len(blocked) if circular and len(blocked) else sector


def _dense(targets: PlacedTargets) -> tuple[PlacedTargets, Ints]:
    """A bead's targets and places between those that are far apart; and which place each target is, (t,)."""
    p, n = targets.position, targets.normal
    turn = np.arccos(np.clip(np.einsum("ti,ti->t", n[1:], n[:-1]), -1.0, 1.0))
    measure = np.maximum(np.linalg.norm(np.diff(p, axis=0), axis=1) / APART, turn / TURNED)
    parts = np.maximum(np.ceil(measure - 1e-9), 1).astype(np.int64)
    place = np.append(0, np.cumsum(parts))
    edge = np.append(np.repeat(np.arange(len(parts)), parts), len(parts) - 1)
    fraction = ((np.arange(len(edge)) - place[edge]) / parts[edge])[:, None]
    position = p[edge] + fraction * (p[edge + 1] - p[edge])
    return PlacedTargets(position, great_circle(n[edge], n[edge + 1], fraction[:, 0]), targets.reference), place
