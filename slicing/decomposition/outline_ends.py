"""Where a body's outline goes on beyond what is seen of it: within end flanges, and out to the rim of an end face.

    outline = carried_through(solid, body_outline(bands))       # frame: z is the axis

Lengths in mm.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..mesh.solid import Floats
from .bands import Band
from .outline import Outline
from .turned_faces import FEW_SIDES_RAD

LEVELS, STEP = 200, 0.05  # examined beyond an end: at most so many, and how far apart, of the radius
RIM, LEAST_RIM = 0.02, 1e-7  # of the radius: the greatest and the least length of a rim
RIM_RING = 1.025  # examined for a rim is a ring just within the end's radius


def carried_through(solid: Any, outline: Outline) -> Outline:
    """The outline with its ends carried on through what surrounds them: an end flange that is not round.

    Args:
        solid: the part (manifold3d), z the axis.
        outline: of the body as far as its surface is seen.

    Returns:
        The outline, its end cylinders carried on as far as there is material right round them, and its end cones out
        to the rim of an end face.
    """
    vertices = np.asarray(solid.to_mesh64().vert_properties, dtype=np.float64)[:, :3]
    first, last = outline.sections[0], outline.sections[-1]
    if first.is_cylinder:
        low = -_surrounded(solid, first.radius_low, -outline.low, -vertices[:, 2], -1.0)
        first = first.between(low, first.high)
    if len(outline.sections) == 1:
        last = first
    if last.is_cylinder:
        high = _surrounded(solid, last.radius_high, outline.high, vertices[:, 2], 1.0)
        last = last.between(last.low, high)
    sections = (first, *outline.sections[1:-1], last) if len(outline.sections) > 1 else (last,)
    return Outline((*_rim(solid, sections[0], vertices, -1.0), *sections, *_rim(solid, sections[-1], vertices, 1.0)))


def _rim(solid: Any, end: Band, vertices: Floats, way: float) -> list[Band]:
    """Beyond an end cone the stretch out to an end face's rim, which is too flat for a cone: the foot of a fillet."""
    radius, height = (end.radius_high, end.high) if way > 0 else (end.radius_low, end.low)
    if end.is_cylinder:
        return []
    far = way * _surrounded(solid, radius / RIM_RING, way * height, way * vertices[:, 2], way)
    length = way * (far - height)
    if not LEAST_RIM * radius < length <= RIM * radius:
        return []
    widest = _inscribed(solid, far - way * LEAST_RIM * radius)
    if widest <= radius:
        return []
    if way > 0:
        return [Band(height, far, radius, widest)]
    return [Band(far, height, widest, radius)]


def _inscribed(solid: Any, height: float) -> float:
    """Radius of the largest polygon about the axis within the outer border of a section; 0 where there is none."""
    import shapely

    around = [shapely.Polygon(loop) for loop in solid.slice(height).to_polygons()]
    outer = [polygon for polygon in around if polygon.contains(shapely.Point(0.0, 0.0))]
    if not outer:
        return 0.0
    border = max(outer, key=lambda polygon: polygon.area).exterior
    flat = float(border.distance(shapely.Point(0.0, 0.0)))
    away = np.hypot(*np.asarray(border.coords).T)
    corners = away[(away >= flat) & (away <= flat / np.cos(FEW_SIDES_RAD))]
    return float(np.median(corners)) if len(corners) else flat


def _surrounded(solid: Any, radius: float, end: float, heights: Floats, way: float) -> float:
    """How far up (way 1; down, with heights turned over, -1) from an end a cylinder lies in the solid right round."""
    from manifold3d import CrossSection

    far = float(heights.max())
    if far - end <= 1e-3 * radius:
        return end
    ring = CrossSection.circle(1.02 * radius, 180) - CrossSection.circle(1.002 * radius, 180)

    def surrounded(height: float) -> bool:
        return bool((ring - solid.slice(way * height)).area() <= 0.01 * ring.area())

    # equal steps, so that it does not depend on where the mesh has corners; just beside the end it may be bare
    step = min(max(STEP * radius, (far - end) / LEVELS), 0.5 * (far - end))
    last = end
    while last + step < far and surrounded(last + step):
        last += step
    if last == end:
        return end
    bare = min(last + step, far)
    if bare == far and surrounded(far - 1e-3 * step):
        return far
    while bare - last > 1e-5 * radius:
        middle = 0.5 * (last + bare)
        last, bare = (middle, bare) if surrounded(middle) else (last, middle)
    return last
