"""What colours mean, the same in the viewer, in pictures and in films.

    rgba, legend = target_colours(result, "thickness")     # (n, 4), "thickness 1.39 .. 2.20 mm, blue to yellow"

Ramps go from dark to light, so that they read in grey as well.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, get_args

import numpy as np

from ik.chain import Floats

from ..job.job import Job
from ..verdict.result import NOT_LOOKED_AT

if TYPE_CHECKING:
    from ..verdict.result import Result

Colouring = Literal["layer", "thickness", "verdict"]
COLOURINGS: tuple[Colouring, ...] = get_args(Colouring)
RED, GREEN = (0.88, 0.08, 0.06, 1.0), (0.15, 0.65, 0.25, 1.0)
GREY = (0.55, 0.57, 0.6, 1.0)  # not looked at
PALE_RED = (0.95, 0.62, 0.58, 1.0)
HEAT = np.array([(0.50, 0.10, 0.10), (0.87, 0.33, 0.09), (0.98, 0.78, 0.28)])  # first layer to last
DEPTH = np.array([(0.16, 0.17, 0.45), (0.13, 0.45, 0.60), (0.25, 0.68, 0.50), (0.97, 0.87, 0.25)])  # thin to thick
SAME_THICKNESS_MM = 0.02  # mm: thicknesses no further apart than this are one


def ramp(share: Floats, stops: Floats) -> Floats:
    """Colours along a ramp.

    Args:
        share: (n,), 0 for its start, 1 for its end.
        stops: colours at even distances, (k, 3).

    Returns:
        (n, 3).
    """
    at = np.linspace(0.0, 1.0, len(stops))
    return np.stack([np.interp(share, at, channel) for channel in stops.T], axis=-1)


def layer_colours(job: Job) -> Floats:
    """A colour for every target by its layer, (n, 4); neighbouring layers differ in lightness as well."""
    t = job.targets
    layers = np.maximum(np.array(job.layers) - 1, 1)
    rgb = ramp(t.layer / layers[t.sub_volume_index], HEAT) * np.where(t.layer % 2, 0.84, 1.0)[:, None]
    return np.column_stack([rgb, np.ones(len(rgb))])


def target_colours(result: Result, by: Colouring) -> tuple[Floats, str]:
    """A colour for every target.

    Args:
        result: the verdict.
        by: what is coloured.

    Returns:
        Colours (n, 4), and what they mean in a few words.
    """
    t = result.job.targets
    if by == "layer":
        return layer_colours(result.job), "layer: dark is first"
    if by == "verdict":
        colour = {"feasible": GREEN, "infeasible": RED, NOT_LOOKED_AT: GREY}
        open_ = ", grey not checked" if result.not_looked_at else ""
        return np.array([colour[row.verdict] for row in result.rows]), f"verdict: green feasible, red not{open_}"
    low, high = float(t.thickness_mm.min()), float(t.thickness_mm.max())
    if high - low < SAME_THICKNESS_MM:
        return np.column_stack([ramp(np.full(len(t), 0.5), DEPTH), np.ones(len(t))]), f"thickness {low:.2f} mm"
    rgb = ramp((t.thickness_mm - low) / (high - low), DEPTH)
    return np.column_stack([rgb, np.ones(len(t))]), f"thickness {low:.2f} .. {high:.2f} mm, blue to yellow"
