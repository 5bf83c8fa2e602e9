"""Where a layer closes over the end of a body of revolution.

Use:

    poles(layer)                              # (over the lower end, over the upper end)
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..curves.loops import Curve
from ..mesh.solid import PartError
from ..surfaces.meridians import lengths_along, meridian_of
from ..surfaces.surfaces import Cone, Cylinder, Plane, Revolved
from .layer import Layer


def poles(layer: Layer) -> tuple[bool, bool]:
    """Whether a layer's region holds the lower and the upper end of the body, where its surface meets the axis."""
    lower, _, upper = round_about(layer)
    return lower is not None, upper is not None


def round_about(layer: Layer) -> tuple[Curve | None, list[Curve], Curve | None]:
    """The border round the lower end of the body, those of rings, and that round the upper end.

    The borders that go round the axis lie one above the other; what lies between them is in the region by turns.
    """
    surface, rings = layer.surface, [curve for curve in layer.curves if curve.closed and curve.winding]
    if isinstance(surface, Plane) or not rings:  # nothing goes round an axis on a plane
        return None, [], None
    rings = _upwards(surface, rings)
    lower = rings.pop(0) if rings[0].winding < 0 else None
    upper = rings.pop() if rings and rings[-1].winding > 0 else None
    by_turns = all(curve.winding == (-1 if k % 2 else 1) for k, curve in enumerate(rings)) and len(rings) % 2 == 0
    once = all(abs(curve.winding) == 1 for curve in (lower, upper) if curve is not None)
    ends = surface.ends
    there = (lower is None or ends[0]) and (upper is None or ends[1])
    if not (by_turns and once and there):
        raise PartError(
            f"layer {layer.index}: its borders run round the body and past an end that the body does not "
            "have; the layer"
            " cannot be filled, only beads.pattern: contour can lay it"
        )
    return lower, rings, upper


def _upwards(surface: Cylinder | Cone | Revolved, rings: Sequence[Curve]) -> list[Curve]:
    """Curves that go round the axis in their order along it: by what lies below them, in lengths of the profile."""
    loops = [np.concatenate([curve.points, curve.points[:1]]) for curve in rings]
    every, ends = np.concatenate(loops), np.cumsum([len(loop) for loop in loops])[:-1]
    lengths = np.split(lengths_along(meridian_of(surface, every), surface, every), ends)
    below = []
    for curve, loop, s in zip(rings, loops, lengths, strict=True):
        turn = np.unwrap(np.arctan2(*(loop[:, :2] - surface.axis_point).T[::-1]))
        below.append(float((0.5 * (s[1:] + s[:-1]) * np.diff(turn)).sum()) / curve.winding)
    return [rings[k] for k in np.argsort(below)]
