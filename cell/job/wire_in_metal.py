"""Where the wire would run through metal between nozzle and bead: a layer that juts out over the bead, or the support.

    job.wires_in_metal                        # {target: Failure}
    metal = Metal.of(case, shape, targets, job.layers_lie_below)
    metal.met(wires)                          # which piece each wire runs through, and over which length

At a target the wire lies along the deposition direction, whatever the arm does. It may touch the part, since its end is
in the bead, but it may not run through metal that is there already. That is the case where its whole cross-section is
in metal; along a wall beside the bead it may graze the metal. A sub-volume's own lower layers lie below all of its
beads, and are not checked. Part frame, mm.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import mujoco
import numpy as np
from numpy.typing import NDArray

from ik.chain import Floats
from slicing import PartShape, Targets, hull_planes

from ..arrays import Ints, repeat_with_index
from ..case.sections import Case
from ..failure import Contact, Failure, Kind
from ..scene.scene import Scene
from ..units import METRES_PER_MM

if TYPE_CHECKING:
    from scipy.spatial import cKDTree

STEP_MM = 1.0  # along a bead, between wires that are checked
BEAD_SLACK_MM = 0.5  # above a bead's own thickness, from where on metal counts: curved layers are chords
SKIN_LINES = 8  # lines on a wire's skin that stand for its cross-section, beside its axis
LARGE_SIZE = 4.0  # times the usual size, from which on a piece is compared with all wires
FEW_PIECES = 64  # pieces, up to which all are compared with all wires
CHUNK = 4096  # wires checked in one go
AT_ONCE = 16_384  # pairs of a wire and a plane that are looked at in one go: they stay in the processor's cache
NEIGHBOURS = 4  # targets for which one plane is looked for
SUPPORT_SIDES = 96  # of the polygon about a support: its corners are 0.05 % of the radius further out
OUTSIDE_MM = 1e-6  # outside a plane by more than this, so that rounding does not matter
Planes = tuple[Floats, Floats]  # outward normals (p, 3) and offsets (p,) of a convex piece
NOTE = "the wire runs through it between nozzle and bead, in any pose of the arm"


@dataclass(frozen=True, eq=False)
class Wires:
    """Wires in the part frame.

    Attributes:
        tip: their ends, (n, 3).
        out: unit directions from there to the nozzle, (n, 3).
        free: length from the tip on that stands in the bead, (n,).
        length: out to the nozzle.
        radius: of the wire.
        laid: deposits that are there, (n,): those with a lower number.
        sub_volume: index of the sub-volume that is laid, (n,).
    """

    tip: Floats
    out: Floats
    free: Floats
    length: float
    radius: float
    laid: Ints
    sub_volume: Ints

    def rows(self, index: Ints) -> Wires:
        """Some of the wires."""
        of = (self.tip[index], self.out[index], self.free[index])
        return Wires(*of, self.length, self.radius, self.laid[index], self.sub_volume[index])

    def skin(self, index: Ints) -> Wires:
        """Lines on the skin of some of the wires, SKIN_LINES of each in turn."""
        across = np.linalg.svd(self.out[index][:, None])[2][:, 1:]
        turn = np.linspace(0.0, 2 * np.pi, SKIN_LINES, endpoint=False)
        off = self.radius * (np.cos(turn)[:, None] * across[:, :1] + np.sin(turn)[:, None] * across[:, 1:])
        lines = self.rows(np.repeat(index, SKIN_LINES))
        return replace(lines, tip=lines.tip + off.reshape(-1, 3))

    @cached_property
    def boxes(self) -> tuple[Floats, Floats]:
        """Least and greatest coordinates of what counts of every wire, (n, 3) each."""
        ends = np.stack([self.tip + self.free[:, None] * self.out, self.tip + self.length * self.out])
        return ends.min(axis=0) - self.radius, ends.max(axis=0) + self.radius


@dataclass(frozen=True, eq=False)
class Metal:
    """What is there of a part while it is built, as convex pieces.

    Attributes:
        names: of the pieces.
        points: their corners, (k, 3) each.
        deposit: number of the deposit each belongs to, (m,); -1: there from the start.
        sub_volume: index of the sub-volume each belongs to, (m,); -1: of none whose layers lie below one another.
    """

    names: tuple[str, ...]
    points: tuple[Floats, ...]
    deposit: Ints
    sub_volume: Ints

    @classmethod
    def of(cls, case: Case, shape: PartShape, targets: Targets, layers_lie_below: bool) -> Metal:
        """A part and what it stands on.

        Args:
            case: says what it stands on.
            shape: the part.
            targets: on its beads.
            layers_lie_below: whether a sub-volume's lower layers lie below all of its beads.
        """
        pieces = dict(shape.hulls)
        support = case.support
        if support is not None:
            turn = np.linspace(0.0, 2 * np.pi, SUPPORT_SIDES, endpoint=False)
            corners = support.radius_mm / np.cos(np.pi / SUPPORT_SIDES)  # so that all of the support is inside
            ring = corners * np.column_stack([np.cos(turn), np.sin(turn)]) - case.part.position_mm[:2]
            top = -case.part.position_mm[2]
            heights = np.repeat([top - support.height_mm, top], len(ring))
            pieces["support"] = np.column_stack([np.tile(ring, (2, 1)), heights])
        words = [name.split("/") for name in pieces]
        number = [int(w[1]) if w[0] == "deposit" else -1 for w in words]
        own = {name: k for k, name in enumerate(targets.sub_volume)} if layers_lie_below else {}
        owner = [own.get(w[2], -1) if w[0] == "deposit" else -1 for w in words]
        return cls(tuple(pieces), tuple(pieces.values()), np.array(number), np.array(owner))

    @cached_property
    def boxes(self) -> tuple[Floats, Floats]:
        """Least and greatest coordinates of every piece, (m, 3) each."""
        low, high = np.array([[p.min(axis=0), p.max(axis=0)] for p in self.points]).swapaxes(0, 1)
        return low, high

    def met(self, wires: Wires) -> tuple[Ints, Floats]:
        """What every wire runs through.

        Args:
            wires: the wires.

        Returns:
            Numbers of the pieces, (n,), -1: none; and over which length, (n,), mm.
        """
        found, length = np.full(len(wires.tip), -1, dtype=np.int64), np.zeros(len(wires.tip))
        planes: dict[int, Planes] = {}
        for own in np.unique(wires.sub_volume).tolist():
            others = np.flatnonzero((self.sub_volume < 0) | (self.sub_volume != own))
            low, high = self.boxes
            search = _BoxTree.of(low[others], high[others], self.deposit[others])
            mine = np.flatnonzero(wires.sub_volume == own)
            for first in range(0, len(mine), CHUNK):
                index = mine[first : first + CHUNK]
                some = wires.rows(index)
                which, at = search.pairs(some)
                found[index], length[index] = self._run_through(some, which, others[at], planes)
        return found, length

    def may_be_met(self, t: Targets) -> NDArray[np.bool_]:
        """Targets from which up to the next one of the bead a wire may run through something, (n,).

        None does where the wires at both targets begin outside one plane of every piece and lead away from it: so do
        all between them, whose directions are mixed of theirs. Neighbours are tried with one plane: of those that the
        wire in their middle leads away from the one that it is furthest off.
        """
        n = len(t.bead)
        after = np.minimum(np.arange(n) + np.append(np.diff(t.bead) == 0, False), n - 1)
        free = t.thickness_mm + BEAD_SLACK_MM
        in_bead = np.minimum(free, free[after])[:, None]
        from_there, to_there = t.position + in_bead * t.normal, t.position[after] + in_bead * t.normal[after]
        out: NDArray[np.bool_] = np.zeros(n, dtype=bool)
        for own in np.unique(t.sub_volume_index).tolist():
            mine = np.flatnonzero(t.sub_volume_index == own)
            others = np.flatnonzero((self.sub_volume < 0) | (self.sub_volume != own))
            if (self.deposit[others] >= 0).any():  # of many pieces near by the boxes tell sooner
                out[mine] = True
                continue
            group = np.arange(len(mine)) // NEIGHBOURS
            middle = mine[np.minimum(np.arange(group[-1] + 1) * NEIGHBOURS + NEIGHBOURS // 2, len(mine) - 1)]
            for m in others.tolist():
                normals, offsets = hull_planes(self.points[m])
                if not len(normals):
                    continue
                one = _furthest_off((normals, offsets), from_there[middle], t.normal[middle])[group]
                for begins, i in ((from_there, mine), (to_there, after[mine])):
                    away = np.einsum("ni,ni->n", normals[one], t.normal[i]) >= 0
                    off = np.einsum("ni,ni->n", normals[one], begins[mine]) - offsets[one]
                    out[mine] |= ~away | (off <= OUTSIDE_MM)
        return out

    def _run_through(self, wires: Wires, which: Ints, piece: Ints, planes: dict[int, Planes]) -> tuple[Ints, Floats]:
        """The piece that every wire runs through, and over which length, of those that come into question."""
        found, length = np.full(len(wires.tip), -1, dtype=np.int64), np.zeros(len(wires.tip))
        begins, all_of_it = np.full(len(wires.tip), np.inf), np.zeros(len(wires.tip), dtype=bool)
        for m in np.unique(piece).tolist():
            if m not in planes:
                planes[m] = hull_planes(self.points[m])
            k = which[piece == m]
            begin, end = _within(planes[m], wires.rows(k))
            k, begin, end = k[begin < end], begin[begin < end], end[begin < end]
            normals, offsets = planes[m]
            # where the axis is a radius deep in a piece, so are all lines on the skin in it
            deep_begin, deep_end = _within((normals, offsets - wires.radius), wires.rows(k))
            all_of_it[k] |= deep_begin < deep_end
            nearer = begin < begins[k]
            k, begin, end = k[nearer], begin[nearer], end[nearer]
            found[k], length[k], begins[k] = m, end - begin, begin
        through = np.flatnonzero((found >= 0) & ~all_of_it)
        skin, met = wires.skin(through), np.zeros(SKIN_LINES * len(through), dtype=bool)
        number = np.full(len(found), -1, dtype=np.int64)
        number[through] = np.arange(len(through))
        for m in np.unique(piece[number[which] >= 0]).tolist():
            of = number[which[piece == m]]
            lines = (SKIN_LINES * of[of >= 0, None] + np.arange(SKIN_LINES)).ravel()
            begin, end = _within(planes[m], skin.rows(lines))
            met[lines] |= begin < end
        grazed = through[~met.reshape(-1, SKIN_LINES).all(axis=1)]
        found[grazed], length[grazed] = -1, 0.0
        return found, length


@dataclass(frozen=True, eq=False)
class _BoxTree:
    """Pieces' boxes, in which those near a wire are looked up.

    Attributes:
        low: least coordinates of every piece, (m, 3).
        high: greatest.
        deposit: number of the deposit each belongs to, (m,).
        large: numbers of the large pieces, which are compared with every wire.
        small: of all others.
        size: half the diagonal of the largest of these.
        tree: their middles; None where there are few, all of them large then.
    """

    low: Floats
    high: Floats
    deposit: Ints
    large: Ints
    small: Ints
    size: float
    tree: cKDTree | None

    @classmethod
    def of(cls, low: Floats, high: Floats, deposit: Ints) -> _BoxTree:
        """Of some boxes."""
        if len(low) <= FEW_PIECES:
            return cls(low, high, deposit, np.arange(len(low)), np.zeros(0, dtype=np.int64), 0.0, None)
        from scipy.spatial import cKDTree  # heavy: only where there are many

        half = 0.5 * np.linalg.norm(high - low, axis=1)
        is_small = half <= LARGE_SIZE * np.median(half)
        small = np.flatnonzero(is_small)
        large, size, tree = np.flatnonzero(~is_small), half[small].max(initial=0.0), cKDTree(0.5 * (low + high)[small])
        return cls(low, high, deposit, large, small, float(size), tree)

    def pairs(self, wires: Wires) -> tuple[Ints, Ints]:
        """Wires and pieces that are there by then whose boxes meet where part of the piece is high enough."""
        every = np.arange(len(wires.tip))
        middle = wires.tip + 0.5 * wires.length * wires.out
        reach = 0.5 * wires.length + wires.radius + self.size
        near = [] if self.tree is None else self.tree.query_ball_point(middle, reach)
        which = [np.repeat(every[: len(near)], [len(some) for some in near])]
        piece = [self.small[np.array([k for some in near for k in some], dtype=np.int64)]]
        for m in self.large.tolist():
            which.append(every)
            piece.append(np.full(len(every), m))
        return self._meeting(wires, np.concatenate(which), np.concatenate(piece))

    def _meeting(self, wires: Wires, which: Ints, piece: Ints) -> tuple[Ints, Ints]:
        there = self.deposit[piece] < wires.laid[which]
        which, piece = which[there], piece[there]
        low, high = wires.boxes
        meet = ((low[which] <= self.high[piece]) & (high[which] >= self.low[piece])).all(axis=1)
        which, piece = which[meet], piece[meet]
        middle, half = 0.5 * (self.low + self.high)[piece], 0.5 * (self.high - self.low)[piece]
        out = wires.out[which]
        rises = ((middle - wires.tip[which]) * out + half * np.abs(out)).sum(axis=1) >= wires.free[which]
        return which[rises], piece[rises]


def _furthest_off(planes: Planes, begins: Floats, out: Floats) -> Ints:
    """Of the planes that a direction leads away from, or along, the one that its beginning is furthest off, (n,)."""
    normals, offsets = planes
    found = np.empty(len(begins), dtype=np.int64)
    rows = max(AT_ONCE // len(normals), 1)
    for k in range(0, len(begins), rows):
        some = slice(k, k + rows)
        above = begins[some] @ normals.T
        above -= offsets
        above[out[some] @ normals.T < 0] = -np.inf
        found[some] = above.argmax(axis=1)
    return found


def _within(planes: Planes, wires: Wires) -> tuple[Floats, Floats]:
    """Between which lengths wires' axes are in a convex piece, (n,) each; begin >= end: nowhere."""
    normals, offsets = planes
    if not len(normals):  # a piece without a volume
        return np.full(len(wires.tip), np.inf), np.full(len(wires.tip), -np.inf)
    rises, above = wires.out @ normals.T, wires.tip @ normals.T - offsets
    with np.errstate(divide="ignore", invalid="ignore"):
        at = -above / rises
    beside = (rises == 0) & (above > 0)
    low = np.where(rises < 0, at, np.where(beside, np.inf, -np.inf)).max(axis=1)
    high = np.where(rises > 0, at, np.inf).min(axis=1)
    return np.maximum(low, wires.free), np.minimum(high, wires.length)


def wire_size(scene: Scene) -> tuple[float, float] | None:
    """How far the wire reaches back from the TCP, and its radius, mm; None where no wire is modelled.

    Args:
        scene: the composed cell.
    """
    model, wires = scene.model, np.flatnonzero(scene.wire_geom & scene.contact_bits.any(axis=0))
    if not len(wires):
        return None
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    place, z = data.site_xpos[scene.sites["tcp"]], data.site_xmat[scene.sites["tcp"]].reshape(3, 3)[:, 2]
    length, radius = 0.0, np.inf
    for geom in wires.tolist():
        turn = data.geom_xmat[geom].reshape(3, 3)
        along = np.abs(turn.T @ z) @ model.geom_aabb[geom, 3:]
        centre = data.geom_xpos[geom] + turn @ model.geom_aabb[geom, :3]
        length = max(length, float((place - centre) @ z + along))
        # of several the thinnest: a thicker one takes more metal to be run through with all of it
        radius = min(radius, float(np.sort(model.geom_aabb[geom, 3:])[0]))
    return length / METRES_PER_MM, radius / METRES_PER_MM


def wires_in_metal(scene: Scene, metal: Metal, targets: Targets, laid: Ints, deposit: Ints) -> dict[int, Failure]:
    """Targets at which, or on the way to or from which, the wire would run through metal that is there already.

    Args:
        scene: the composed cell.
        metal: what is there of the part.
        targets: on its beads.
        laid: deposits that are there at each target, (n,): those with a lower number.
        deposit: number of the deposit that each target belongs to, (n,): whether a piece of it is there already when
            the target is welded is not known, so that nothing is proved by it.
    """
    size = wire_size(scene)
    if size is None or not len(targets):
        return {}
    target, tip, out = _along(targets, metal.may_be_met(targets))
    wires = wires_at(targets, laid, size, target, (tip, out))
    met, length = metal.met(wires)
    hit = np.flatnonzero(met >= 0)
    hit = hit[np.argsort(length[hit], kind="stable")]  # of several at a target the worst counts
    worst = dict(zip(target[hit].tolist(), hit.tolist(), strict=True))
    wire = scene.case.tool.wire[0]
    out_of_layer = metal.deposit[met] < deposit[target]
    return {
        i: replace(wire_failure(wire, metal.names[met[k]], float(length[k])), proved=bool(out_of_layer[k]))
        for i, k in sorted(worst.items())
    }


def wires_at(
    targets: Targets, laid: Ints, size: tuple[float, float], target: Ints, pose: tuple[Floats, Floats]
) -> Wires:
    """Wires while targets are welded.

    Args:
        targets: on the beads.
        laid: deposits that are there at each target, (n,): those with a lower number.
        size: from :func:`wire_size`.
        target: the target that each wire is at, (m,).
        pose: tips and unit directions to the nozzle, (m, 3) each, part frame, mm.
    """
    free = targets.thickness_mm[target] + BEAD_SLACK_MM
    return Wires(*pose, free, *size, laid[target], targets.sub_volume_index[target])


def wire_failure(wire: str, piece: str, length: float) -> Failure:
    """A wire that runs through a piece of the part or its support.

    Args:
        wire: name of the wire's shape.
        piece: name of the piece.
        length: of the wire in it, mm.
    """
    contact = Contact(pair=(wire, piece), note=NOTE)
    return Failure(Kind.COLLISION, measure=-round(length, 3), limit=0.0, contact=contact, proved=True)


def _along(t: Targets, which: NDArray[np.bool_]) -> tuple[Ints, Floats, Floats]:
    """Points along the beads, from some targets (n,) to the next ones, no further apart than ``STEP_MM``.

    Returns:
        The nearest target, the place and the direction out of each.
    """
    n = len(t.bead)
    step = np.linalg.norm(np.diff(t.position, axis=0), axis=1)
    count = np.where(np.diff(t.bead) == 0, np.maximum(np.ceil(step / STEP_MM), 1), 1).astype(np.int64)
    count = np.append(count, 1) * which
    row, place = repeat_with_index(count)
    f = place / count[row]
    after = np.minimum(row + 1, n - 1)
    mix = f[:, None]
    out = (1 - mix) * t.normal[row] + mix * t.normal[after]
    out /= np.linalg.norm(out, axis=1)[:, None]
    return np.where(f > 0.5, after, row), (1 - mix) * t.position[row] + mix * t.position[after], out
