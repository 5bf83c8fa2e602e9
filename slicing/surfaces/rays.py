"""Rays that go back from points, against their normals, to a surface of revolution.

across_axis(points, normals, (0.0, 0.0), np.full(len(points), 20.0))    # (n,) mm to the cylinder of radius 20
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

from ..mesh.solid import Floats

MOST_STEPS = 400  # of the march back to a surface of revolution
NEAR_MM, FAR_MM = 1e-10, 1e5  # how near it must come; how far it goes
STEP_MM = 1e-9  # to either side of a height, so that a step there is seen


class HasDistance(Protocol):
    """What knows its distance from points."""

    def distance(self, points: Floats) -> Floats:
        """Signed distance (n,), mm, positive outside."""


class Wide(Protocol):
    """What knows its radius at a height."""

    def radius_at(self, z: Floats) -> Floats:
        """Radius (n,) at heights (n,), mm."""


def widest_at(surface: Wide, z: Floats) -> Floats:
    """Radius (n,) of a surface of revolution at heights, at a step the greater of the two."""
    return np.maximum(surface.radius_at(z - STEP_MM), surface.radius_at(z + STEP_MM))


def across_axis(points: Floats, normals: Floats, axis_point: tuple[float, float], radius: Floats) -> Floats:
    """Distances back (n,) to circles about the axis, each of its own radius (n,), across the axis."""
    relative = points[:, :2] - axis_point
    across = normals[:, :2]
    length = np.hypot(relative[:, 0], relative[:, 1])
    # |relative - t across|² = radius²:  a t² - 2 b t + c = 0, the first root met from outside
    a = (across**2).sum(axis=1)
    b = (relative * across).sum(axis=1)
    c = (length - radius) * (length + radius)
    d = b * b - a * c
    with np.errstate(divide="ignore", invalid="ignore"):
        near = c / (b + np.sqrt(np.maximum(d, 0.0)))
    return np.where((d >= 0) & (b > 0), near, np.inf)


def marched(points: Floats, normals: Floats, surface: HasDistance) -> Floats:
    """Distance back from outside (n,): each step as long as the distance to the surface, so none passes it.

    Along the surface's own normal the first step arrives; rays that graze it take many.
    """
    gone = np.maximum(surface.distance(points), 0.0)
    open_ = np.flatnonzero(gone > NEAR_MM)
    for _ in range(MOST_STEPS):
        step = surface.distance(points[open_] - gone[open_, None] * normals[open_])
        gone[open_] += np.maximum(step, 0.0)
        open_ = open_[(step > NEAR_MM) & (gone[open_] < FAR_MM)]
        if len(open_) == 0:
            break
    gone[open_] = np.inf
    return np.where(gone < FAR_MM, gone, np.inf)
