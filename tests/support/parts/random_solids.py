"""Random solids with cavities, islands within holes and several shells, and their sections made without slicing.

solid = random_solid(np.random.default_rng(3))
unrolled_section(solid.translate((60, 0, 0)), 55.0).area()
"""

from __future__ import annotations

import manifold3d
import numpy as np

FINE_MM = 0.8  # sides of faces that are bent straight


def _turned_box(rng: np.random.Generator, low: float, high: float) -> manifold3d.Manifold:
    size = rng.uniform(low, high, 3)
    return manifold3d.Manifold.cube(tuple(size), True).rotate(tuple(rng.uniform(0, 360, 3)))


def _blob(rng: np.random.Generator, low: float, high: float) -> manifold3d.Manifold:
    kind = rng.integers(3)
    if kind == 0:
        return _turned_box(rng, low, high)
    size = rng.uniform(low, high)
    if kind == 1:
        return manifold3d.Manifold.sphere(size / 2, int(rng.integers(8, 40)))
    length, top = rng.uniform(low, high), size / 2 * rng.uniform(0.3, 1.0)
    turned = manifold3d.Manifold.cylinder(length, size / 2, top, int(rng.integers(5, 40)), True)
    return turned.rotate(tuple(rng.uniform(0, 360, 3)))


def random_solid(rng: np.random.Generator) -> manifold3d.Manifold:
    """A solid of some 40 mm about the origin, with a hole through it, an island in that, a cavity and an island there.

    Args:
        rng: where it comes from.

    Returns:
        The solid: three or more shells, none touching another.
    """
    outer = manifold3d.Manifold.cube((36, 36, 30), True).rotate(tuple(rng.uniform(-12, 12, 3)))
    for _ in range(int(rng.integers(0, 4))):
        outer += _blob(rng, 8, 20).translate(tuple(rng.uniform(-16, 16, 3)))
    solid = outer - _tube(rng, 7.0)
    pin = _tube(rng, 5.0)
    if rng.random() < 0.6:
        pin -= _tube(rng, 2.5)
    solid += pin ^ manifold3d.Manifold.cube((30, 30, float(rng.uniform(20, 60))), True)
    place = rng.uniform(10, 12, 2) * rng.choice([-1, 1], 2)
    cavity = _blob(rng, 5, 7).translate((*place, 0))
    island = manifold3d.Manifold.cube((1.5, 1.5, 1.5), True).rotate(tuple(rng.uniform(0, 90, 3))).translate((*place, 0))
    solid -= cavity
    return solid + island if rng.random() < 0.6 else solid


def _tube(rng: np.random.Generator, radius: float) -> manifold3d.Manifold:
    sides = int(rng.integers(4, 30))
    return manifold3d.Manifold.cylinder(90, radius, radius, sides, True)


def unrolled_section(solid: manifold3d.Manifold, radius: float) -> manifold3d.CrossSection:
    """A solid's section by a cylinder about z, unrolled: the solid is bent straight, then cut by a plane.

    Args:
        solid: all of it at x > 0.
        radius: of the cylinder, mm.

    Returns:
        The section, (radius times angle, z), areas as on the cylinder.
    """

    def straight(points: np.ndarray) -> np.ndarray:
        angle = np.arctan2(points[:, 1], points[:, 0])
        return np.stack([radius * angle, points[:, 2], np.hypot(points[:, 0], points[:, 1])], axis=1)

    # (angle, z, r) is as right-handed as (r, angle, z)
    bent = solid.refine_to_length(FINE_MM).warp_batch(straight)
    if bent.volume() < 0:
        raise AssertionError("the solid is inside out")
    return bent.slice(radius)
