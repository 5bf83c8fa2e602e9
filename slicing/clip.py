"""The part of a planar layer that lies outside the body.

A plane parallel to the axis cuts the body in a strip |u| < u0 of the plane, u measured from the foot of the
axis. What is left of the layer are two half planes, and a region is cut to a half plane loop by loop:

    curves = outside_body(curves, plane, body)

Loops are cut where they cross the line; each place where a loop leaves the half plane is joined along the
line to the next place where one comes back. Orientation is kept: outer loops counter-clockwise, holes
clockwise.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from slicing.intersect import Curve
from slicing.part import Floats
from slicing.surfaces import Plane

if TYPE_CHECKING:
    from slicing.layers import Body

LEAST_AREA_MM2 = 1e-6  # what is left of a region that only touches the body's side


def outside_body(curves: list[Curve], plane: Plane, body: Body) -> list[Curve]:
    """Cut a planar layer where the body begins.

    Args:
        curves: closed loops on the plane, the region on their left.
        plane: parallel to z.
        body: the body.

    Returns:
        The loops of the region outside the body; the same ones if the plane passes the body by, or none goes
        inside.
    """
    u_axis, v_axis = plane.axes()
    axis = np.append(body.surface.axis_point, 0.0)
    height = -float(plane.distance(axis[None])[0])
    half = body.radius_mm**2 - height**2
    if half <= 0 or not curves:
        return curves
    if all(
        (body.surface.distance(curve.points) > -1e-7).all() and not _crosses(curve, body) for curve in curves
    ):
        return curves
    foot = axis + height * np.asarray(plane.normal)
    loops = [np.stack([(c.points - foot) @ u_axis, (c.points - foot) @ v_axis], axis=1) for c in curves]
    kept: list[Curve] = []
    for side in (1.0, -1.0):
        for loop in clip_half_plane([p * [side, 1.0] for p in loops], float(np.sqrt(half)), side):
            flat = loop * [side, 1.0]
            area = float(0.5 * _twice_area(flat))
            if abs(area) > LEAST_AREA_MM2:
                points = foot + flat[:, :1] * u_axis + flat[:, 1:] * v_axis
                kept.append(Curve(points, True, area < 0, area))
    return kept


def _crosses(curve: Curve, body: Body) -> bool:
    """Whether a side of the loop dips into the body between its ends."""
    a = curve.points[:, :2] - body.surface.axis_point
    step = np.roll(a, -1, axis=0) - a
    length2 = (step**2).sum(axis=1)
    t = np.clip(-(a * step).sum(axis=1) / np.where(length2 > 0, length2, 1.0), 0.0, 1.0)
    closest = a + t[:, None] * step
    return bool((np.hypot(closest[:, 0], closest[:, 1]) < body.radius_mm - 1e-7).any())


def _twice_area(loop: Floats) -> float:
    after = np.roll(loop, -1, axis=0)
    return float((loop[:, 0] * after[:, 1] - loop[:, 1] * after[:, 0]).sum())


def clip_half_plane(loops: list[Floats], limit: float, side: float) -> list[Floats]:
    """The region's part at first coordinate >= limit.

    Args:
        loops: (n, 2) closed loops in mirrored coordinates (side * u, v), the region on the left for side 1,
            on the right for side -1.
        limit: the line.
        side: 1 or -1.

    Returns:
        Loops of the part, in the same coordinates and sense.
    """
    kept: list[Floats] = []
    runs: list[Floats] = []
    for loop in loops:
        inside = loop[:, 0] > limit
        if inside.all():
            kept.append(loop)
        elif inside.any():
            runs += _runs(loop, inside, limit)
    # along the line the kept half plane is on the region's side: downwards for side 1, upwards for side -1
    leave = np.argsort([-side * run[-1, 1] for run in runs], kind="stable")
    enter = np.argsort([-side * run[0, 1] for run in runs], kind="stable")
    after = {int(a): int(b) for a, b in zip(leave, enter, strict=True)}
    while after:
        begin = next(iter(after))
        chain, run = [runs[begin]], after.pop(begin)
        while run != begin:
            chain.append(runs[run])
            run = after.pop(run)
        kept.append(np.concatenate(chain))
    return kept


def _runs(loop: Floats, inside: np.ndarray, limit: float) -> list[Floats]:
    """Stretches of a loop within the half plane, each from the line to the line."""
    n, runs = len(loop), []
    for first in np.flatnonzero(inside & ~np.roll(inside, 1)):
        last = first
        while inside[(last + 1) % n]:
            last += 1
        body = loop[np.arange(first, last + 1) % n]
        entry = _on_line(loop[first - 1], loop[first], limit)
        leave = _on_line(loop[last % n], loop[(last + 1) % n], limit)
        runs.append(np.concatenate([entry[None], body, leave[None]]))
    return runs


def _on_line(a: Floats, b: Floats, limit: float) -> Floats:
    t = (limit - a[0]) / (b[0] - a[0])
    return np.array([limit, a[1] + t * (b[1] - a[1])])
