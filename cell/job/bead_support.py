"""What lies below another slicer's beads: stretches over nothing, and stretches inside metal that is there already.

    below = Below(scene, path, targets, laid)
    found = unsupported_beads(below)                           # BeadOverhang, one for every bead that overhangs
    sunk_bead_warnings(below)                                  # where beads lie in earlier layers or in the body

An overhang is measured as for layers that are sliced here: from the edge of what lies below to the bead's outer edge,
seen along the deposition direction. At half a bead's width the bead's middle is on that edge. Metal counts as below a
bead where it is no further down than half the bead's thickness. Part frame, mm.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from ik.chain import Floats
from slicing import Code, Targets, Toolpath, Warning, bead_hulls

from ..arrays import Ints, repeat_with_index
from ..rigid import pose
from ..scene.part_contact import carriers_of
from ..scene.scene import Scene
from ..units import METRES_PER_MM
from .wire_in_metal import Metal, Wires

ALLOWED = 0.5  # of a bead's width that may stand out where the case says nothing
SPACED = 0.5  # bead widths between places that are looked at along a bead
DOWN = 0.5  # of a bead's thickness, down to which metal is below it
SKIN = 0.05  # of its thickness: below the bead's underside by so much, where beads beside it do not reach
LEAST_SUNK_MM = 0.1  # thinner beads than twice this may lie so deep: hulls of curved layers are chords
POINT_MM = 1e-2  # length of a line that stands for a point
RAY_MM = 1e-4  # radius of a line that looks for metal
SIDE_MM = 0.5  # between lines beside a bead's middle
FARTHEST = 4.0  # bead widths up to which an overhang is measured
DEEPEST_MM = 1000.0  # down to which the next metal is looked for
CLOSE_MM = 0.05  # how closely
MEASURED = 4  # places of a bead that are measured
ROUNDING_MM = 1e-6  # of thicknesses in a file
LISTED = 6  # beads that get a line of their own
Bools = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class BeadOverhang:
    """The overhang of one bead beyond the limit.

    Attributes:
        bead: its number.
        sub_volume: that it is of.
        layer: its number within that.
        targets: at or next to what hangs, (k,).
        hanging_mm: length that hangs.
        length_mm: of the whole bead.
        out_mm: how far it stands out at most; None where nothing lies below it that far out.
        down_mm: how far below it the next metal is where it is nearest; None where there is none.
        width_mm: of the bead.
        place_mm: the middle of what hangs, (3,).
    """

    bead: int
    sub_volume: str
    layer: int
    targets: tuple[int, ...]
    hanging_mm: float
    length_mm: float
    out_mm: float | None
    down_mm: float | None
    width_mm: float
    place_mm: tuple[float, ...]

    @property
    def all_of_it(self) -> bool:
        """Whether the whole bead hangs."""
        return self.hanging_mm > (1.0 - 1e-6) * self.length_mm


class _Places(NamedTuple):
    """Places along beads: the bead, the nearest targets, the middle of the underside, and directions, (n, ..)."""

    bead: Ints
    targets: Ints  # (n, 2): twice the same, or both where they are as near
    under: Floats
    out: Floats
    aside: Floats
    thickness: Floats
    length: Floats

    def rows(self, index: Ints | Bools) -> _Places:
        bead, targets, *rest = self
        return _Places(bead[index], targets[index], *(column[index] for column in rest))


def unsupported_beads(below: Below, limit_mm: float | None = None) -> tuple[BeadOverhang, ...]:
    """The beads of another slicer that stand out over what lies below them.

    Args:
        below: the beads and what may lie below them.
        limit_mm: how far a bead may stand out; None: half its width.

    Returns:
        One entry for every bead of which something hangs.
    """
    width, places, targets = below.width, below.places, below.targets
    allowed = (ALLOWED * width if limit_mm is None else limit_mm) - width / 2
    if allowed >= 0.0:
        hangs = ~below.within(places, allowed)
    else:  # its edges may stand out by less than half a bead: there is metal below both sides
        hangs = ~(below.at(places, -allowed) & below.at(places, allowed))
    whole = np.bincount(places.bead, places.length)
    found = []
    for some, out, down in below.measured(places.rows(hangs), width):
        first = int(some.targets[0, 0])
        bead = int(some.bead[0])
        found.append(
            BeadOverhang(
                bead,
                targets.sub_volume[int(targets.sub_volume_index[first])],
                int(targets.layer[first]),
                tuple(np.unique(some.targets).tolist()),
                float(some.length.sum()),
                float(whole[bead]),
                out,
                down,
                width,
                tuple(some.under[len(some.under) // 2].tolist()),
            )
        )
    return tuple(found)


class Below:
    """Beads, and what may lie below them: metal of earlier ones, the body, the support, the table and fixtures on it.

    Args:
        scene: the composed cell.
        path: what the beads were read from.
        targets: on the beads, in the order of deposition.
        deposit: number of the layer that each target belongs to, counted as they are laid, (n,).
    """

    def __init__(self, scene: Scene, path: Toolpath, targets: Targets, deposit: Ints) -> None:
        self.targets, self.width = targets, path.beads.width_mm
        self.places = _places_along(targets, self.width, path.metal_below)
        one_each = replace(
            targets,
            sub_volume=("beads",),
            sub_volume_index=np.zeros_like(targets.sub_volume_index),
            layer=targets.bead,
        )
        hulls = {k: v for k, v in scene.part.hulls.items() if not k.startswith("deposit/")}
        hulls |= dict(bead_hulls(one_each, self.width, below=path.metal_below))
        shape = replace(scene.part, hulls=hulls, first_deposit=(0,), n_deposits=int(targets.bead[-1]) + 1)
        self.metal = Metal.of(scene.case, shape, one_each, False)
        starts = np.searchsorted(targets.bead, np.arange(int(targets.bead[-1]) + 1))
        layer = deposit[starts]
        self.first_of_layer = np.searchsorted(layer, layer)  # the first bead of each bead's layer
        self.carriers = _Carriers(scene)

    def sunk(self, places: _Places) -> Bools:
        """Whether the middle of a bead's section lies in the body, the support or an earlier layer, (n,)."""
        half = np.maximum(0.5 * places.thickness, LEAST_SUNK_MM)[:, None]
        middle, none = places.under + half * places.out, np.zeros(len(places.bead))
        laid = self.first_of_layer[places.bead]
        return self.metal.met(Wires(middle, places.out, none, POINT_MM, RAY_MM, laid, none.astype(np.int64)))[0] >= 0

    def at(self, places: _Places, aside: float | Floats, depth: Floats | None = None) -> Bools:
        """Whether something lies below places so far beside the beads' middles, no further down than depth, (n,)."""
        off, n = np.broadcast_to(aside, len(places.bead)), len(places.bead)
        depth = DOWN * places.thickness if depth is None else depth
        if not n:
            return np.zeros(0, dtype=bool)
        skin = SKIN * places.thickness
        deepest = float((depth - skin).max())
        tip = places.under - (skin + deepest)[:, None] * places.out + off[:, None] * places.aside
        # beside a bead's middle lie the others of its layer, as high as itself
        laid = np.where(off == 0.0, places.bead, self.first_of_layer[places.bead])
        free, none = deepest - (depth - skin), np.zeros(n, dtype=np.int64)
        held = self.metal.met(Wires(tip, places.out, free, deepest, RAY_MM, laid, none))[0] >= 0
        left = np.flatnonzero(~held)
        under = places.under[left] + off[left, None] * places.aside[left]
        held[left] = self.carriers.below(under, places.out[left], places.thickness[left], depth[left])
        return held

    def within(self, places: _Places, allowed: float) -> Bools:
        """Whether something lies below places, or beside them by no more than so far, (n,)."""
        held = self.at(places, 0.0)
        steps = np.linspace(0.0, allowed, int(np.ceil(allowed / SIDE_MM)) + 1)[1:]
        for aside in (steps[:, None] * [1.0, -1.0]).ravel().tolist():
            left = np.flatnonzero(~held)
            held[left] = self.at(places.rows(left), aside)
        return held

    def measured(self, places: _Places, width: float) -> Iterator[tuple[_Places, float | None, float | None]]:
        """Places that hang, bead by bead, with how far they stand out and how far down the next metal is.

        Of every bead MEASURED places are measured at most.
        """
        beads, start, count = np.unique(places.bead, return_index=True, return_counts=True)
        number = np.arange(len(places.bead)) - np.repeat(start, count)
        every = np.repeat(-(-count // MEASURED), count)
        some = np.flatnonzero(number % every == every // 2)
        out, down = self.out_mm(places.rows(some), width), self.down_mm(places.rows(some))
        for k in range(len(beads)):
            mine = places.bead[some] == beads[k]
            far, near = float(out[mine].max()), float(down[mine].min())
            rows = places.rows(np.arange(start[k], start[k] + count[k]))
            yield rows, far if np.isfinite(far) else None, near if np.isfinite(near) else None

    def out_mm(self, places: _Places, width: float) -> Floats:
        """Overhang of beads at places, (n,), mm; inf beyond the range that is measured."""
        found = np.full(len(places.bead), np.inf)
        for step in np.arange(-width / 2, FARTHEST * width, SIDE_MM).tolist():
            left = np.flatnonzero(np.isinf(found))
            one, other = (self.at(places.rows(left), side) for side in (step, -step))
            found[left[one & other if step < 0.0 else one | other]] = width / 2 + step
        return found

    def down_mm(self, places: _Places) -> Floats:
        """How far straight below places the next metal is, (n,); inf where it is further than is looked."""
        low, high = np.zeros(len(places.bead)), np.full(len(places.bead), np.inf)
        for depth in (2.0 ** np.arange(int(np.log2(DEEPEST_MM)) + 1)).tolist():
            left = np.flatnonzero(np.isinf(high))
            met = self.at(places.rows(left), 0.0, np.maximum(depth, DOWN * places.thickness[left]))
            high[left[met]], low[left[~met]] = depth, depth
        seen = np.flatnonzero(np.isfinite(high))
        while len(seen) and float((high - low)[seen].max()) > CLOSE_MM:
            middle = 0.5 * (low + high)[seen]
            met = self.at(places.rows(seen), 0.0, middle)
            high[seen[met]], low[seen[~met]] = middle[met], middle[~met]
        return high


class _Carriers:
    """Shapes that carry the part: the table's, the support, and fixtures on the table."""

    def __init__(self, scene: Scene) -> None:
        self.model = scene.model
        self.data = mujoco.MjData(self.model)
        mujoco.mj_kinematics(self.model, self.data)
        self.geoms = carriers_of(scene)
        part = scene.sites["part"]
        self.T_world_part = pose(self.data.site_xpos[part], self.data.site_xmat[part])

    def below(self, places: Floats, out: Floats, above: Floats, depth: Floats) -> Bools:
        """Whether lines from so far above places down to so far below them meet a shape, (n,)."""
        R, p = self.T_world_part[:3, :3], self.T_world_part[:3, 3]
        start = (places + above[:, None] * out) * METRES_PER_MM @ R.T + p
        way, length = -out @ R.T, (above + depth) * METRES_PER_MM
        held = np.zeros(len(places), dtype=bool)
        for geom in self.geoms.tolist():
            centre, reach = self.data.geom_xpos[geom], float(self.model.geom_rbound[geom])
            middle = start + 0.5 * length[:, None] * way
            near = np.linalg.norm(middle - centre, axis=1) <= reach + 0.5 * length
            for k in np.flatnonzero(near & ~held).tolist():
                held[k] = 0.0 <= self._distance(geom, start[k], way[k]) <= length[k]
        return held

    def _distance(self, geom: int, start: Floats, way: Floats) -> float:
        kind = self.model.geom_type[geom]
        if kind == mujoco.mjtGeom.mjGEOM_MESH:
            return float(mujoco.mj_rayMesh(self.model, self.data, geom, start, way, None))
        where = self.data.geom_xpos[geom], self.data.geom_xmat[geom], self.model.geom_size[geom]
        return float(mujoco.mju_rayGeom(*where, start, way, int(kind), None))


def _places_along(t: Targets, width: float, metal_below: bool) -> _Places:
    """Places along all beads, no further apart than SPACED of a bead's width, each with the length it stands for."""
    step = np.linalg.norm(np.diff(t.position, axis=0), axis=1)
    same = np.diff(t.bead) == 0
    count = np.append(np.where(same, np.maximum(np.ceil(step / (SPACED * width)), 1), 0), 0).astype(np.int64)
    row, number = repeat_with_index(count)
    share = ((number + 0.5) / count[row])[:, None]
    out = (1 - share) * t.normal[row] + share * t.normal[row + 1]
    out /= np.linalg.norm(out, axis=1)[:, None]
    way = t.position[row + 1] - t.position[row]
    aside = np.cross(out, way)
    length = np.linalg.norm(aside, axis=1)
    along = length <= 1e-6 * np.linalg.norm(way, axis=1)  # it rises along its own direction of deposition
    aside = np.where(along[:, None], np.cross(out, t.tangent[row]), aside)
    aside /= np.maximum(np.linalg.norm(aside, axis=1), 1e-12)[:, None]
    thickness = (1 - share[:, 0]) * t.thickness_mm[row] + share[:, 0] * t.thickness_mm[row + 1]
    under = (1 - share) * t.position[row] + share * t.position[row + 1]
    under = under - thickness[:, None] * out if metal_below else under
    targets = row[:, None] + np.column_stack([share > 0.5, share >= 0.5])
    return _Places(t.bead[row], targets, under, out, aside, thickness, step[row] / count[row])


def bead_overhang_warnings(found: Sequence[BeadOverhang], limit_mm: float | None) -> list[Warning]:
    """A warning for each of the worst beads that hang, and one for the rest.

    Args:
        found: from `unsupported_beads`.
        limit_mm: of the case.
    """
    worst = sorted(found, key=lambda one: -one.hanging_mm)
    lines = []
    for one in sorted(worst[:LISTED], key=lambda one: one.bead):
        allowed = ALLOWED * one.width_mm if limit_mm is None else limit_mm
        x, y, z = one.place_mm
        hangs = f"all {one.length_mm:.1f} mm" if one.all_of_it else f"{one.hanging_mm:.1f} of {one.length_mm:.1f} mm"
        if one.out_mm is None:
            down = "none lies" if one.down_mm is None else f"the next lies {one.down_mm:.1f} mm"
            what = f"there is no metal under {hangs} of it, at ({x:.1f}, {y:.1f}, {z:.1f}); {down} straight below"
        else:
            what = (
                f"{hangs} of it overhang what lies below by more than {allowed:g} mm, up to {one.out_mm:.1f} mm, "
                f"at ({x:.1f}, {y:.1f}, {z:.1f})"
            )
        text = f"part.toolpath: bead {one.bead} ({one.sub_volume} layer {one.layer}): {what}"
        lines.append(Warning(Code.OVERHANG, text, sub_volume=one.sub_volume, layer=one.layer))
    rest = worst[LISTED:]
    if rest:
        total = sum(one.hanging_mm for one in rest)
        beads = f"{len(rest)} more bead{'s' * (len(rest) > 1)} overhang{'s' * (len(rest) == 1)}"
        lines.append(Warning(Code.OVERHANG, f"part.toolpath: {beads}, over {total:.1f} mm in all"))
    return lines


def bead_thickness_warnings(targets: Targets, least_mm: float, most_mm: float) -> list[Warning]:
    """A warning where another slicer's beads are thinner or thicker than the process lays.

    Args:
        targets: on the beads.
        least_mm: slicing.h_min_mm of the case.
        most_mm: its slicing.h_max_mm.
    """
    t = targets.thickness_mm
    beyond = (t < least_mm - ROUNDING_MM) | (t > most_mm + ROUNDING_MM)
    if not beyond.any():
        return []
    beads, first = np.unique(targets.bead[beyond]), int(np.argmax(beyond))
    more = f"bead {beads[0]}" if len(beads) == 1 else f"{len(beads)} beads, from bead {beads[0]} on,"
    thick = t[beyond]
    name = targets.sub_volume[int(targets.sub_volume_index[first])]
    span = f"{thick.min():g}" if thick.min() == thick.max() else f"{thick.min():g} to {thick.max():g}"
    text = (
        f"part.toolpath: {more} {'is' if len(beads) == 1 else 'are'} {span} mm thick; the process lays "
        f"slicing.h_min_mm {least_mm:g} to slicing.h_max_mm {most_mm:g}"
    )
    return [Warning(Code.BEAD_THICKNESS, text, sub_volume=name, layer=int(targets.layer[first]))]


def sunk_bead_warnings(below: Below) -> list[Warning]:
    """A warning where another slicer's beads lie in metal that is there already.

    Such beads come of a file in another frame, of a thickness that is not the file's, or of `part.toolpath_metal`. A
    bead may reach into others by half its width at either end.

    Args:
        below: the beads and what lies below them.
    """
    places, t = below.places, below.targets
    sunk = np.flatnonzero(below.sunk(places))
    length = np.bincount(places.bead[sunk], places.length[sunk], minlength=len(t.closed))
    beads = np.flatnonzero(length > below.width)
    if not len(beads):
        return []
    bead = int(beads[0])
    mine = sunk[places.bead[sunk] == bead]
    first = int(places.targets[mine[0], 0])
    name, layer = t.sub_volume[int(t.sub_volume_index[first])], int(t.layer[first])
    more = f" and {len(beads) - 1} more lie" if len(beads) > 1 else " lies"
    x, y, z = places.under[mine[len(mine) // 2]].tolist()
    text = (
        f"part.toolpath: bead {bead} ({name} layer {layer}){more} with more than half the thickness in metal that is "
        f"there already (bead {bead} over {length[bead]:.1f} mm, at ({x:.1f}, {y:.1f}, {z:.1f})); check the frame and "
        "the thickness of the file, and part.toolpath_metal"
    )
    return [Warning(Code.BEAD_SUNK, text, sub_volume=name, layer=layer)]
