"""Beads whose thickness leaves h_min .. h_max (the paper's figure 18): reported, trimmed or merged.

    layers, places = with_policy(sliced, layers, parameters)      # by sliced.parameters.thickness
    places[0].done, places[0].length_mm, places[0].start_mm

report: beads stay as they are; the places are listed.
trim:   a bead ends where its thickness reaches the limit, found on the exact curve; a closed bead becomes open ones.
merge:  where a bead is too thin it is left out, and the bead of the layer above it takes over its thickness: what the
        layer above has to fill there reaches down to the layer below the one left out. It does so only where a
        bead of the layer above lies over it (half a bead's width sideways at most) and the sum stays within
        h_max; elsewhere the bead stays and is reported, as it is where it is too thick. Layers are processed from
        the body outward, so that thickness taken over counts when the next layer is examined.

Thin places are found on finely sampled beads (`slicing.beads.fine_thickness`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..layers.layer import SlicedSubVolume
from ..mesh.solid import Bools, Floats
from ..parameters import BeadParameters
from .bead import Bead
from .exact_points import point_between
from .fine_thickness import SLACK_MM, FinelySampledBead, Run, fine_thickness, interpolate, segment_ends
from .thickness_merge import MergedStretch, gaining, merged

LEAST_MM = 1e-3  # shorter beads are not laid, shorter places not reported
WORDS = {"reported": "left as it is", "trimmed": "not laid", "merged": "laid by the layer above"}


@dataclass(frozen=True)
class ThicknessPlace:
    """A stretch of a bead whose thickness leaves the limits.

    Attributes:
        layer: its layer.
        kind: of the bead.
        done: reported, trimmed or merged.
        length_mm: of the stretch.
        thickness_mm: least and greatest in it.
        start_mm: where it begins (part frame).
        end_mm: where it ends.
    """

    layer: int
    kind: str
    done: str
    length_mm: float
    thickness_mm: tuple[float, float]
    start_mm: tuple[float, float, float]
    end_mm: tuple[float, float, float]

    def to_dict(self) -> dict[str, Any]:
        """As rbam-slices/1 writes it."""
        return {
            "layer": self.layer,
            "kind": self.kind,
            "done": self.done,
            "length_mm": self.length_mm,
            "thickness_mm": list(self.thickness_mm),
            "start_mm": list(self.start_mm),
            "end_mm": list(self.end_mm),
        }


def with_policy(
    sliced: SlicedSubVolume, layers: Sequence[Sequence[Bead]], parameters: BeadParameters
) -> tuple[list[list[Bead]], list[ThicknessPlace]]:
    """Beads treated by the sub-volume's policy.

    Args:
        sliced: the sub-volume; its parameters name the policy and the limits.
        layers: beads, layer by layer from the body outward.
        parameters: how wide beads are.

    Returns:
        The beads, layer by layer, and the places where the thickness leaves the limits.
    """
    out = [list(beads) for beads in layers]
    places: list[ThicknessPlace] = []
    policy = sliced.parameters.thickness
    for k, layer in enumerate(sliced.layers):
        low, high = layer.thickness_mm
        gained = any(bead.gained_mm.any() for bead in out[k])
        borders = parameters.pattern == "contour" and parameters.first_mm == 0.0
        if borders and not gained and _within(sliced, np.array([low, high])).all():
            continue
        kept: list[Bead] = []
        handed: list[MergedStretch] = []
        for bead in out[k]:
            runs, fine = _runs(sliced, bead)
            if not runs:
                kept.append(bead)
                continue
            done = ["trimmed" if policy == "trim" else "reported"] * len(runs)
            if policy == "merge" and k + 1 < len(out):
                runs, done, new_handed = merged(sliced, bead, fine, runs, out[k + 1], parameters)
                handed += new_handed
            cut = [run for run, what in zip(runs, done, strict=True) if what != "reported"]
            kept += _without(sliced, bead, cut) if cut else [bead]
            new = [_place(sliced, bead, fine, run, what) for run, what in zip(runs, done, strict=True)]
            places += [place for place in new if place.length_mm > LEAST_MM]
        out[k] = kept
        if handed:
            out[k + 1] = gaining(sliced, out[k + 1], handed, parameters)
    return out, places


def _within(sliced: SlicedSubVolume, thickness: Floats) -> Bools:
    p = sliced.parameters
    return (thickness >= p.h_min_mm - SLACK_MM) & (thickness <= p.h_max_mm + SLACK_MM)


def _runs(sliced: SlicedSubVolume, bead: Bead) -> tuple[list[Run], FinelySampledBead]:
    """Where a bead leaves the limits, from place to place, the ends exact.

    On a closed bead a run may go on over its first point: then its end is beyond the bead's number of points.
    """
    fine = fine_thickness(sliced, bead)
    good = _within(sliced, fine.thickness)
    if good.all():
        return [], fine
    n = float(len(bead.points))
    if not good.any():
        return [(0.0, fine.at[-1])], fine
    change = np.flatnonzero(good[1:] != good[:-1])
    roots = [(_limit(sliced, bead, fine, int(i)), bool(good[i])) for i in change]
    begins, ends = [u for u, leaves in roots if leaves], [u for u, leaves in roots if not leaves]
    if not good[0] and not bead.closed:
        begins.insert(0, 0.0)
    if not good[-1] and not bead.closed:
        ends.append(fine.at[-1])
    if bead.closed and not good[0]:  # a run over the first point
        ends.append(ends.pop(0) + n)
    return list(zip(begins, ends, strict=True)), fine


def _limit(sliced: SlicedSubVolume, bead: Bead, fine: FinelySampledBead, i: int) -> float:
    """The place between two looked-at ones where the thickness reaches the limit, found on the exact curve."""
    from scipy.optimize import brentq

    low, high = float(fine.at[i]), float(fine.at[i + 1])
    k = min(int(low), len(bead.points) - 1)
    between = point_between(sliced, bead.layer, *segment_ends(bead, k))
    gained = bead.gained_mm[[k, (k + 1) % len(bead.points)]]
    p = sliced.parameters
    bad = fine.thickness[i] if not _within(sliced, fine.thickness[i : i + 1])[0] else fine.thickness[i + 1]
    limit = p.h_min_mm if bad < p.h_min_mm else p.h_max_mm

    def over(u: float) -> float:
        share = u - k
        at = sliced.thickness_at(bead.layer, between(np.array([share])))[0]
        return float(at + (1 - share) * gained[0] + share * gained[1] - limit)

    begin, finish = over(low), over(high)
    if begin == 0.0 or begin * finish > 0.0:  # touches the limit to within the slack
        return low if abs(begin) <= abs(finish) else high
    return float(brentq(over, low, high, xtol=1e-13))


def _without(sliced: SlicedSubVolume, bead: Bead, runs: Sequence[Run]) -> list[Bead]:
    """What is left of a bead."""
    n = len(bead.points)
    last = float(n if bead.closed else n - 1)
    if runs[0][0] <= 0.0 and runs[0][1] >= last:
        return []
    runs = sorted(runs)
    if bead.closed:
        keep = [(a[1], b[0] + (n if b[0] < a[1] else 0)) for a, b in zip(runs, [*runs[1:], runs[0]], strict=True)]
    else:
        bounds = [0.0, *(u for run in runs for u in run), last]
        keep = list(zip(bounds[::2], bounds[1::2], strict=True))
    return [part for u, v in keep if (part := _stretch(sliced, bead, u, v)).length_mm > LEAST_MM]


def _stretch(sliced: SlicedSubVolume, bead: Bead, begin: float, end: float) -> Bead:
    """An open bead from place to place."""
    n = len(bead.points)
    inner = np.arange(int(np.floor(begin)) + 1, int(np.ceil(end)))
    (a, gained_a), (b, gained_b) = interpolate(sliced, bead, begin), interpolate(sliced, bead, end)
    points = np.concatenate([a[None], bead.points[inner % n], b[None]])
    gained = np.concatenate([[gained_a], bead.gained_mm[inner % n], [gained_b]])
    stops = tuple(1 + i for i, k in enumerate(inner % n) if k in bead.stops)
    step = np.sqrt((np.diff(points, axis=0) ** 2).sum(axis=1))
    fine = np.append(True, step > 1e-9)
    if not fine.all():
        stops = ()
        points, gained = points[fine], gained[fine]
    return replace(bead, points=points, gained_mm=gained, closed=False, stops=stops)


def _place(sliced: SlicedSubVolume, bead: Bead, fine: FinelySampledBead, run: Run, done: str) -> ThicknessPlace:
    n = len(bead.points)
    begin, end = (interpolate(sliced, bead, u)[0] for u in run)
    inside = (fine.at >= run[0]) & (fine.at <= run[1]) | (fine.at <= run[1] - n) & bead.closed
    values = fine.thickness[inside]
    if not len(values):
        values = fine.thickness[[int(np.argmin(np.abs(fine.at - run[0])))]]
    length = _stretch(sliced, bead, *run).length_mm
    x, y = [(float(p[0]), float(p[1]), float(p[2])) for p in (begin, end)]
    return ThicknessPlace(bead.layer, bead.kind, done, length, (float(values.min()), float(values.max())), x, y)


def policy_lines(sliced: SlicedSubVolume, places: Sequence[ThicknessPlace]) -> list[str]:
    """A line for every layer and what was done there: how much, how thick, where.

    Too thin places that are only reported under the policy "report" are left to the slicer, which reports them.

    Args:
        sliced: the sub-volume.
        places: from `with_policy`.

    Returns:
        The lines.
    """
    p = sliced.parameters
    lines = []
    for layer, done in sorted({(place.layer, place.done) for place in places}):
        some = [q for q in places if (q.layer, q.done) == (layer, done)]
        if p.thickness == "report":
            some = [q for q in some if q.thickness_mm[1] > p.h_max_mm + SLACK_MM]
        if not some:
            continue
        low, high = min(q.thickness_mm[0] for q in some), max(q.thickness_mm[1] for q in some)
        length = sum(q.length_mm for q in some)
        x, y, z = max(some, key=lambda q: q.length_mm).start_mm
        lines.append(
            f"{sliced.name}: layer {layer}: {length:.1f} mm of beads in {len(some)} place(s) {WORDS[done]}:"
            f" {low:.3f} .. {high:.3f} mm thick, outside {p.h_min_mm:g} .. {p.h_max_mm:g} mm; the longest from"
            f" ({x:.1f}, {y:.1f}, {z:.1f})"
        )
    return lines
