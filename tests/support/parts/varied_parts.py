"""More of what CAD programs make, with known truth: twisted and drafted blades, bosses, hoops, flanges with holes.

    part = varied_part(7)

Hubs are those of `support.cad_parts`, with pockets in their ends and holes through their sides as well. What stands on
one is in one solid with it, or a shell of its own that reaches into the hub.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache

import numpy as np
from manifold3d import CrossSection, Manifold
from scipy.spatial.transform import Rotation

from .cad_parts import HUBS, CadPart, Section, Truth, _Build, arrays, hub, radial_cylinder, revolved

Place = tuple[float, float, float]  # radius of the body, half the width and half the length that there are, mm


def twisted(rng: np.random.Generator, at: Place) -> Manifold:
    """A blade whose section turns along the axis."""
    r, wide, long = at
    reach = r * rng.uniform(1.3, 4.0)
    half, tip = 0.3 * wide, 0.3 * wide * rng.uniform(0.3, 1.0)
    shape = CrossSection([[(0.5 * r, -half), (reach, -tip), (reach, tip), (0.5 * r, half)]])
    turn = math.degrees(0.5 * wide / r) * rng.uniform(-1, 1)
    return Manifold.extrude(shape, 2 * long, 24, turn).rotate((0, 0, -0.5 * turn)).translate((0, 0, -long))


def drafted(rng: np.random.Generator, at: Place) -> Manifold:
    """A block that grows narrower outward, on all sides."""
    r, wide, long = at
    height, share = r * rng.uniform(0.8, 3.0), rng.uniform(0.4, 0.95)
    block = Manifold.extrude(CrossSection.square((2 * long, 1.4 * wide), True), height, 0, 0.0, (share, share))
    return block.rotate((0, 90, 0)).translate((0.6 * r, 0, 0))


def tilted(rng: np.random.Generator, at: Place) -> Manifold:
    """A boss that leans along the axis and aside."""
    r, wide, long = at
    boss = radial_cylinder(0.35 * min(wide, long), 0.0, r * rng.uniform(0.8, 1.2), int(rng.integers(16, 80)))
    lean = rng.uniform(-25, 25)
    return boss.rotate((0, lean, rng.uniform(-15, 15))).translate((0.7 * r, 0, 0))


def chamfered(rng: np.random.Generator, at: Place) -> Manifold:
    """A drafted round boss with a chamfer at its top and perhaps a blind hole."""
    r, wide, long = at
    a, top, n = 0.7 * min(wide, long), r * rng.uniform(1.3, 2.2), int(rng.integers(16, 80))
    b = a * rng.uniform(0.85, 1.0)
    profile = [(0.0, 0.6 * r), (a, 0.6 * r), (b, top - 0.2 * a), (b - 0.2 * a, top), (0.0, top)]
    solid = revolved(profile, n)
    if rng.random() < 0.5:
        solid -= Manifold.cylinder(top, 0.4 * a, 0.4 * a, n).translate((0, 0, rng.uniform(1.05, 1.2) * r))
    return solid.rotate((0, 90, 0))


def domed(rng: np.random.Generator, at: Place) -> Manifold:
    """A boss with half a ball on it."""
    r, wide, long = at
    a, top, n = 0.6 * min(wide, long), r * rng.uniform(1.2, 2.0), int(rng.integers(16, 64))
    return radial_cylinder(a, 0.5 * r, top, n) + Manifold.sphere(a, n).translate((top, 0, 0))


def slotted(rng: np.random.Generator, at: Place) -> Manifold:
    """A blade with a round hole and a slot through it."""
    r, wide, long = at
    high = r * rng.uniform(1.0, 3.0)
    blade = Manifold.cube((0.5 * r + high, 0.8 * wide, 2 * long)).translate((0.5 * r, -0.4 * wide, -long))
    size = min(0.3 * high, 0.5 * long)
    hole = Manifold.cylinder(4 * wide, size, size, 40, True).rotate((90, 0, 0)).translate((r + 0.55 * high, 0, 0))
    return blade - hole


def hoop(rng: np.random.Generator, at: Place) -> Manifold:
    """A handle that stands on the body in two places."""
    r, wide, long = at
    high, thick = r * rng.uniform(0.4, 1.0), 0.4 * long
    outer = Manifold.cube((0.5 * r + high, 0.8 * wide, 2 * long)).translate((0.5 * r, -0.4 * wide, -long))
    inner = Manifold.cube((r + 0.6 * high, wide, 2 * (long - thick))).translate((0.0, -0.5 * wide, thick - long))
    return outer - inner


def elbow(rng: np.random.Generator, at: Place) -> Manifold:
    """A pin with a bend along the axis."""
    r, wide, long = at
    a, out = 0.4 * min(wide, long), r * rng.uniform(1.4, 2.0)
    n = int(rng.integers(16, 60))
    up = Manifold.cylinder(r * rng.uniform(0.6, 1.5), a, a, n).translate((out, 0, 0))
    return radial_cylinder(a, 0.5 * r, out, n) + Manifold.sphere(a, n).translate((out, 0, 0)) + up


def square(rng: np.random.Generator, at: Place) -> Manifold:
    """A square block that stands askew, off the middle."""
    r, wide, long = at
    a = 0.55 * min(wide, long)
    block = Manifold.cube((r * rng.uniform(0.8, 1.6), 2 * a, 2 * a)).translate((0.6 * r, -a, -a))
    return block.rotate((rng.uniform(0, 90), 0, 0)).translate((0, 0.2 * wide * rng.uniform(-1, 1), 0))


SHAPES: dict[str, Callable[[np.random.Generator, Place], Manifold]] = {
    f.__name__: f for f in (twisted, drafted, tilted, chamfered, domed, slotted, hoop, elbow, square)
}


def _flange(build: _Build, section: Section, taken: Manifold) -> None:
    """A ring that stands out farther than it is long, with bolt holes."""
    rng, r = build.rng, section.radius_low
    reach, high = r * rng.uniform(1.5, 2.5), 0.08 * (section.high - section.low)
    high = min(high, 0.4 * (reach - r))
    low = section.high - 0.13 * (section.high - section.low) - high
    ring = revolved([(0.5 * r, low), (reach, low), (reach, low + high), (0.5 * r, low + high)], build.sides)
    count, radius = int(rng.integers(3, 13)), 0.15 * (reach - r)
    hole = Manifold.cylinder(3 * high, radius, radius, 24).translate((0.5 * (r + reach), 0, low - high))
    for k in range(count):
        ring -= hole.rotate((0, 0, 360.0 * k / count))
    if (ring ^ taken).is_empty():
        build.words.append(f"flange with {count} holes")
        build.add("collar", ring, section)


def _pockets(build: _Build, section: Section) -> None:
    """Pockets in the lower end, between bore and side."""
    r, count = min(section.radius_low, section.radius_high), int(build.rng.integers(3, 9))
    size, deep = 0.12 * r, 0.3 * (section.high - section.low)
    pocket = Manifold.cylinder(2 * deep, size, size, 20, True).translate((0.7 * r, 0, 0))
    for k in range(count):
        build.solid -= pocket.rotate((0, 0, 360.0 * k / count))
    build.words.append(f"{count} pockets")


def _side_holes(build: _Build, section: Section, phase: float, count: int) -> None:
    """Holes through the side between what stands there."""
    r = min(section.radius_low, section.radius_high)
    z, size = section.low + 0.45 * (section.high - section.low), 0.1 * r * math.sin(math.pi / max(count, 3))
    hole = radial_cylinder(size, 0.0, 1.2 * r, 24).translate((0, 0, z))
    for k in range(count):
        build.solid -= hole.rotate((0, 0, math.degrees(phase) + 360.0 * (k + 0.5) / count))
    build.words.append(f"{count} side holes")


@cache
def varied_part(seed: int) -> CadPart:
    """A part of a seed; the same one every time.

    Args:
        seed: which.

    Returns:
        The part.
    """
    rng = np.random.default_rng([seed, 16])
    sides = round(math.exp(rng.uniform(math.log(8), math.log(500))))
    build = hub(rng, str(rng.choice(HUBS, p=(0.5, 0.25, 0.15, 0.1))), sides)
    section, count, phase = build.sections[0], int(rng.integers(1, 7)), float(rng.uniform(0, 2 * math.pi))
    length = section.high - section.low
    r = section.radius_low + 0.42 * (section.radius_high - section.radius_low)
    at = (r, 0.75 * r * min(math.sin(math.pi / max(count, 3)), 0.6), float(rng.uniform(0.1, 0.22)) * length)
    alike, kinds, shells = rng.random() < 0.4, [], []
    apart = rng.random() < 0.3
    one = str(rng.choice(list(SHAPES)))
    state = rng.bit_generator.state
    whole, taken = build.solid, Manifold()
    for k in range(count):
        if alike:
            rng.bit_generator.state = state
        else:
            one = str(rng.choice(list(SHAPES)))
        shape = SHAPES[one](rng, at).translate((0, 0, section.low + 0.42 * length))
        shape = shape.rotate((0, 0, math.degrees(phase) + 360.0 * k / count))
        if not (shape ^ taken).is_empty() or (shape - build.fine).volume() < 1e-3 * shape.volume():
            continue  # nothing is known of two that meet
        taken += shape - build.fine
        kinds.append(one)
        build.add(one, shape, section)
        shells.append(shape - build.fine.scale((0.9, 0.9, 1.0)))
    build.words += kinds
    if section.half_angle_deg == 0 and rng.random() < 0.3 and not apart:
        _flange(build, section, taken)
    if rng.random() < 0.25 and not apart:
        _pockets(build, section)
    if rng.random() < 0.25 and not apart:
        _side_holes(build, section, phase, count)
    vertices, faces = arrays(build.solid)
    truth = Truth(np.zeros(3), np.array([0.0, 0.0, 1.0]), tuple(build.stands), build.solid.volume(), sides)
    if apart:
        build.words.append(f"{len(shells) + 1} shells")
        vertices, faces = _several([whole, *shells])
    motion = np.eye(4)
    if rng.random() < 0.75:
        motion[:3, :3] = Rotation.random(random_state=int(rng.integers(2**31))).as_matrix()
    motion[:3, 3] = rng.uniform(-1, 1, 3) * float(rng.choice([0.0, 100.0, 1000.0]))
    return CadPart(", ".join(build.words), vertices, faces, truth).moved(motion)


def _several(solids: list[Manifold]) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and faces of shells, each its own."""
    points, faces, n = [], [], 0
    for solid in solids:
        v, f = arrays(solid)
        points.append(v)
        faces.append(f + n)
        n += len(v)
    return np.concatenate(points), np.concatenate(faces)
