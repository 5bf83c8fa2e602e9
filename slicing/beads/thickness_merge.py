"""Thin stretches of beads merged into the layer above: which ones, and the thickness that the beads there gain.

    runs, done, handed = merged(sliced, bead, fine, runs, above, parameters)
    above = gaining(sliced, above, handed, parameters)

See `slicing.beads.thickness_policy` for when a bead of the layer above takes over what is left out below it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from ..layers.layer import SlicedSubVolume
from ..mesh.solid import Bools, Floats, Ints
from ..parameters import BeadParameters
from .bead import Bead
from .exact_points import point_between
from .fine_thickness import SLACK_MM, SPACING_MM, FinelySampledBead, Run, fine_thickness, interpolate, segment_ends

STOP_MM = 3.0  # a bead has targets so close where it takes over thickness


@dataclass(frozen=True, eq=False)
class MergedStretch:
    """A stretch of a bead that the layer above takes over.

    Attributes:
        points: (n, 3) along it, mm.
        normals: (n, 3) of its surface.
        thickness: (n,) mm.
    """

    points: Floats
    normals: Floats
    thickness: Floats


def merged(
    sliced: SlicedSubVolume,
    bead: Bead,
    fine: FinelySampledBead,
    runs: Sequence[Run],
    above: list[Bead],
    parameters: BeadParameters,
) -> tuple[list[Run], list[str], list[MergedStretch]]:
    """Runs split into those the layer above takes over and those that stay.

    Args:
        sliced: the sub-volume.
        bead: a bead that leaves the limits.
        fine: the same seen closely.
        runs: where it leaves them.
        above: the beads of the next layer.
        parameters: how wide beads are.

    Returns:
        The runs; "merged" or "reported" of each; what is handed to the layer above.
    """
    handed: list[MergedStretch] = []
    out_runs: list[Run] = []
    done: list[str] = []
    for run in runs:
        n, h_max = len(bead.points), sliced.parameters.h_max_mm
        at = np.concatenate([fine.at, fine.at[1:] + n]) if bead.closed else fine.at
        inner = at[(at > run[0]) & (at < run[1])]
        at = np.unique(np.concatenate([[run[0]], inner, [run[1]]]))
        points = np.array([interpolate(sliced, bead, u)[0] for u in at[[0, -1]]])
        rows = np.round(np.interp(at[1:-1] % n if bead.closed else at[1:-1], fine.at, np.arange(len(fine.at))))
        points = np.concatenate([points[:1], fine.points[rows.astype(np.int64)], points[1:]])
        thickness = np.interp(at % n if bead.closed else at, fine.at, fine.thickness)
        normals = sliced.layers[bead.layer].surface.normals(points)
        there = _over(sliced, points, normals, above, 0.5 * parameters.width_mm)
        can = (thickness < sliced.parameters.h_min_mm) & (there + thickness <= h_max + SLACK_MM)
        can[[0, -1]] = can[[1, -2]] if len(can) > 2 else can[[0, -1]]  # the limit itself goes with what is within
        for first, last, merged in _stretches(can):
            out_runs.append((float(at[first]), float(at[last])))
            done.append("merged" if merged else "reported")
            if merged:
                some = slice(first, last + 1)
                handed.append(MergedStretch(points[some], normals[some], thickness[some]))
    return out_runs, done, handed


def _stretches(flags: Bools) -> list[tuple[int, int, bool]]:
    """Stretches of equal flags as first and last number; where they change, the place belongs to both."""
    change = np.flatnonzero(flags[1:] != flags[:-1]) + 1
    # what is merged ends where it last could be
    change = change - (flags[np.maximum(change - 1, 0)]).astype(np.int64)
    marks = [0, *change.tolist(), len(flags) - 1]
    out = []
    for a, b in pairwise(marks):
        if b > a:
            out.append((a, b, bool(flags[a : b + 1].all())))
    return out or [(0, len(flags) - 1, bool(flags.all()))]


def _over(sliced: SlicedSubVolume, points: Floats, normals: Floats, above: Sequence[Bead], reach_mm: float) -> Floats:
    """Thickness of the beads that lie over points (n,); inf where none does."""
    from scipy.spatial import cKDTree

    if not above:
        return np.full(len(points), np.inf)
    looked = [fine_thickness(sliced, bead) for bead in above]
    cloud = np.concatenate([f.points for f in looked])
    thickness = np.concatenate([f.thickness for f in looked])
    # the nearest sideways: seen from where the point's normal meets the layer above
    gap = np.maximum(-sliced.layers[above[0].layer].surface.distance(points), 0.0)
    _, k = cKDTree(cloud).query(points + gap[:, None] * normals)
    return np.where(_sideways(cloud[k] - points, normals) <= reach_mm, thickness[k], np.inf)


def _sideways(way: Floats, normals: Floats) -> Floats:
    return np.sqrt(((way - (way * normals).sum(axis=1)[:, None] * normals) ** 2).sum(axis=1))


def gaining(
    sliced: SlicedSubVolume, above: list[Bead], handed: Sequence[MergedStretch], parameters: BeadParameters
) -> list[Bead]:
    """The beads above, with the thickness of what is left out below them.

    Where beads left out lie side by side below a place, the thickest counts: they fill one and the same gap.

    Args:
        sliced: the sub-volume.
        above: the beads of a layer.
        handed: what the layer below hands to it.
        parameters: how wide beads are.

    Returns:
        The beads; those that take something over have points every SPACING_MM.
    """
    if not handed or not above:
        return above
    from scipy.spatial import cKDTree

    surface, reach = sliced.layers[above[0].layer].surface, 0.5 * parameters.width_mm
    lifted = [h.points + np.maximum(-surface.distance(h.points), 0.0)[:, None] * h.normals for h in handed]
    trees = [cKDTree(line) for line in lifted]
    out = []
    for bead in above:
        low, high = bead.points.min(axis=0) - 2 * reach, bead.points.max(axis=0) + 2 * reach
        near = [k for k, p in enumerate(lifted) if (p.max(axis=0) >= low).all() and (p.min(axis=0) <= high).all()]
        if not near:
            out.append(bead)
            continue
        fine = _exactly(sliced, bead)
        more = np.zeros(len(fine.points))
        for i in near:
            h = handed[i]
            k, share, past = _foot(fine.points, lifted[i], trees[i].query(fine.points)[1])
            below = h.points[k] + share[:, None] * (h.points[k + 1] - h.points[k])
            takes = ~past & (_sideways(fine.points - below, h.normals[k]) <= reach)
            there = h.thickness[k] + share * (h.thickness[k + 1] - h.thickness[k])
            more = np.maximum(more, np.where(takes, there, 0.0))
        out.append(_with_more(fine, more) if more.any() else bead)
    return out


def _with_more(bead: Bead, more: Floats) -> Bead:
    """A bead that gains thickness, with points where the gain begins and ends and in between, for the targets."""
    takes = more > 0.0
    step = max(round(STOP_MM / SPACING_MM), 1)
    edge = takes & ~(np.roll(takes, 1) & np.roll(takes, -1))
    stops = {*bead.stops, *np.flatnonzero(edge).tolist(), *np.flatnonzero(takes)[::step].tolist()}
    return replace(bead, gained_mm=bead.gained_mm + more, stops=tuple(sorted(stops)))


def _foot(points: Floats, line: Floats, near: Ints) -> tuple[Ints, Floats, Bools]:
    """Nearest places (number, share of the way to the next) of an open line; whether a point is past its ends."""
    last = len(line) - 2
    feet = []
    for k in (np.clip(near - 1, 0, last), np.clip(near, 0, last)):
        along = line[k + 1] - line[k]
        raw = ((points - line[k]) * along).sum(axis=1) / np.maximum((along**2).sum(axis=1), 1e-300)
        share = np.clip(raw, 0.0, 1.0)
        away = ((points - line[k] - share[:, None] * along) ** 2).sum(axis=1)
        past = ((k == 0) & (raw < -1e-6)) | ((k == last) & (raw > 1 + 1e-6))
        feet.append((k, share, away, past))
    (k0, s0, a0, p0), (k1, s1, a1, p1) = feet
    first = a0 < a1
    return np.where(first, k0, k1), np.where(first, s0, s1), np.where(first, p0, p1)


def _exactly(sliced: SlicedSubVolume, bead: Bead) -> Bead:
    """The same bead with points every SPACING_MM, all on the exact curve."""
    n = len(bead.points)
    points: list[Floats] = []
    gained: list[Floats] = []
    for k in range(n if bead.closed else n - 1):
        a, b = segment_ends(bead, k)
        count = max(int(np.ceil(np.sqrt(((b - a) ** 2).sum()) / SPACING_MM)), 1)
        share = np.arange(count) / count
        between = point_between(sliced, bead.layer, a, b)(share[1:]) if count > 1 else np.zeros((0, 3))
        points.append(np.concatenate([a[None], between]))
        gained.append((1 - share) * bead.gained_mm[k] + share * bead.gained_mm[(k + 1) % n])
    first = np.append(0, np.cumsum([len(some) for some in points]))
    if not bead.closed:
        points.append(bead.points[-1:])
        gained.append(bead.gained_mm[-1:])
    stops = tuple(int(first[k]) for k in bead.stops)
    return replace(bead, points=np.concatenate(points), gained_mm=np.concatenate(gained), stops=stops)
