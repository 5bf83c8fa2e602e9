"""Parts as machine shops and foundries get them, with known truth: grooves, keyways, bores, letters, gussets, shrouds.

    part = machined_part(7)

A hub of `support.cad_parts` with what is turned, milled and bored in it, and with stands of its own: blades whose tips
a ring joins, gussets between hub and flange, letters and pads a fraction of a millimetre high, lattices, worm flights
of one turn and less, blades with fir-tree roots in slots of the hub. In sizes from 5 mm to 3 m.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache

import numpy as np
from manifold3d import CrossSection, Manifold
from scipy.spatial.transform import Rotation

from .cad_parts import (
    FINE,
    CadPart,
    Section,
    Truth,
    _Build,
    arrays,
    from_arrays,
    radial_cylinder,
    revolved,
)

Room = tuple[float, float, float]  # radius of the body, and where stands may be along it, lowest and highest, mm
SIZES_MM = (5.0, 40.0, 40.0, 40.0, 200.0, 3000.0)
AWAY, FARTHEST_MM = (0.0, 2.5, 250.0), 2e4  # times the size, from the origin


def bar(rng: np.random.Generator, sides: int, size: float) -> _Build:
    """A cylinder about z from z = 0, a size across."""
    radius = 0.5 * size * float(rng.uniform(0.6, 1.0))
    length = radius * float(rng.uniform(2.0, 5.0))
    profile = [(0.0, 0.0), (radius, 0.0), (radius, length), (0.0, length)]
    fine = revolved(profile, FINE).scale((1 / math.cos(math.pi / FINE) ** 0.5,) * 2 + (1.0,))
    words = [f"R{radius:.3f}", f"L{length:.2f}", f"sides {sides}"]
    section = Section(0.0, length, radius, radius)
    return _Build(rng, sides, [section], profile, revolved(profile, sides), fine, words=words)


# ---- what is taken away -------------------------------------------------------------------------------------------


def ring_grooves(build: _Build, at: Room) -> None:
    """Grooves of O-rings and snap rings, right round the hub above what stands on it."""
    rng, (r, _, high) = build.rng, at
    top = build.sections[0].high
    wide, deep = 0.12 * (top - high), r * rng.uniform(0.03, 0.15)
    for k in range(int(rng.integers(1, 4))):
        z = high + (top - high) * (0.2 + 0.25 * k)
        build.solid -= revolved([(r - deep, z), (1.2 * r, z), (1.2 * r, z + wide), (r - deep, z + wide)], build.sides)


def through_keyway(build: _Build, at: Room) -> None:
    """A groove along the whole hub, where nothing stands."""
    r = at[0]
    top = build.sections[0].high
    groove = Manifold.cube((0.4 * r, 0.25 * r, 1.2 * top)).translate((0.85 * r, -0.125 * r, -0.1 * top))
    build.solid -= groove.rotate((0, 0, 30.0 + 60.0 * int(build.rng.integers(6))))


def cross_bore(build: _Build, at: Room) -> None:
    """A bore right through, across the axis, above what stands on it."""
    r, _, high = at
    top = build.sections[0].high
    size = min(0.25 * (top - high), 0.6 * r) * build.rng.uniform(0.3, 1.0)
    bore = Manifold.cylinder(3 * r, size, size, 40, True).rotate((90, 0, build.rng.uniform(0, 360)))
    build.solid -= bore.translate((0, 0, 0.5 * (top + high)))


def stepped_bore(build: _Build, at: Room) -> None:
    """A bore of two diameters along the axis."""
    r, top = at[0], build.sections[0].high
    wide, narrow = r * build.rng.uniform(0.5, 0.9), r * build.rng.uniform(0.2, 0.45)
    n, deep = max(build.sides // 2, 12), top * build.rng.uniform(0.2, 0.8)
    build.solid -= revolved([(0, -1), (narrow, -1), (narrow, deep), (wide, deep), (wide, 2 * top), (0, 2 * top)], n)


def engraved(build: _Build, at: Room) -> None:
    """Shallow letters milled into the side above what stands on it."""
    r, _, high = at
    top = build.sections[0].high
    tall, deep = 0.3 * (top - high), 0.02 * r
    for k, letter in enumerate(_letters(build.rng, tall)):
        cutter = letter.rotate((90, 0, 90)).translate((r - deep, 0, 0.5 * (top + high) - 0.5 * tall))
        build.solid -= cutter.rotate((0, 0, 25.0 * k))


def flats(build: _Build, at: Room) -> None:
    """Two flats for a spanner above what stands on it."""
    r, _, high = at
    top = build.sections[0].high
    block = Manifold.cube((2 * r, 4 * r, 0.4 * (top - high)), True)
    for way in (-1, 1):
        build.solid -= block.translate((way * 1.85 * r, 0, high + 0.5 * (top - high)))


TAKEN: dict[str, Callable[[_Build, Room], None]] = {
    f.__name__: f for f in (ring_grooves, through_keyway, cross_bore, stepped_bore, engraved, flats)
}


def _letters(rng: np.random.Generator, tall: float) -> list[Manifold]:
    """A few letters as prisms along z, as tall as that and as thick."""
    t = 0.18 * tall
    bars = {
        "L": [(0, 0, t, tall), (0, 0, 0.6 * tall, t)],
        "T": [(0.2 * tall, 0, t, tall), (0, tall - t, 0.6 * tall, t)],
        "H": [(0, 0, t, tall), (0.42 * tall, 0, t, tall), (0, 0.41 * tall, 0.6 * tall, t)],
        "O": [(0, 0, t, tall), (0.42 * tall, 0, t, tall), (0, 0, 0.6 * tall, t), (0, tall - t, 0.6 * tall, t)],
    }
    made = []
    for name in rng.choice(list(bars), int(rng.integers(1, 5))):
        shape = CrossSection()
        for x, y, w, h in bars[str(name)]:
            shape += CrossSection.square((w, h)).translate((x - 0.3 * tall, y))
        made.append(Manifold.extrude(shape, tall))
    return made


# ---- what stands on it --------------------------------------------------------------------------------------------


def letters(build: _Build, at: Room) -> None:
    """Raised letters, a little higher than the body's facets are deep."""
    r, low, high = at
    tall = min(0.6 * (high - low), 0.4 * r)
    raised = max(0.03 * r, 3 * r * (1 - math.cos(math.pi / build.sides)))
    for k, letter in enumerate(_letters(build.rng, tall)):
        prism = letter.scale((1, 1, (0.5 * r + raised) / tall)).rotate((90, 0, 90)).translate((0.5 * r, 0, 0))
        prism = prism.translate((0, 0, 0.5 * (low + high) - 0.5 * tall)).rotate((0, 0, 60.0 * k))
        build.add("letter", prism, build.sections[0])


def shroud(build: _Build, at: Room) -> None:
    """Blades whose tips a ring joins: one sub-volume."""
    rng, (r, low, high) = build.rng, at
    reach, wall = r * rng.uniform(1.8, 3.0), 0.1 * r
    ring = revolved([(reach, low), (reach + wall, low), (reach + wall, high), (reach, high)], build.sides)
    count = int(rng.integers(3, 10))
    blade = Manifold.cube((reach + 0.5 * wall - 0.5 * r, 0.1 * r, 0.8 * (high - low)))
    blade = blade.translate((0.5 * r, -0.05 * r, low + 0.1 * (high - low)))
    for k in range(count):
        ring += blade.rotate((0, 0, 360.0 * k / count))
    build.add("shroud", ring, build.sections[0])


def gussets(build: _Build, at: Room) -> None:
    """A flange with thin gussets up to the hub: one sub-volume."""
    rng, (r, low, high) = build.rng, at
    reach, thick = r * rng.uniform(1.6, 2.5), 0.12 * (high - low)
    whole = revolved([(0.5 * r, low), (reach, low), (reach, low + thick), (0.5 * r, low + thick)], build.sides)
    thin, count = r * rng.uniform(0.01, 0.08), int(rng.integers(3, 9))
    out, up = 0.95 * reach, high - low
    shape = CrossSection([[(0.5 * r, 0.0), (out, 0.0), (out, 0.5 * thick), (r, up), (0.5 * r, up)]])
    gusset = Manifold.extrude(shape, thin).rotate((90, 0, 0)).translate((0, 0.5 * thin, low + 0.5 * thick))
    for k in range(count):
        whole += gusset.rotate((0, 0, 360.0 * (k + 0.3) / count))
    build.add("flange", whole, build.sections[0])


def fir_tree(build: _Build, at: Room) -> None:
    """Blades with fir-tree roots that fill slots of the hub, in one solid with it."""
    rng, (r, low, high) = build.rng, at
    count, thick, reach = int(rng.integers(3, 7)), 0.08 * r, r * rng.uniform(1.5, 3.0)
    half = [(0.7, 0.03), (0.75, 0.08), (0.8, 0.05), (0.85, 0.11), (0.9, 0.06), (1.1, 0.06)]
    outline = [(x * r, y * r) for x, y in half] + [(x * r, -y * r) for x, y in half[::-1]]
    root = CrossSection([outline[::-1]])
    shape = root + CrossSection.square((reach - r, thick)).translate((r, -0.5 * thick))
    blade = Manifold.extrude(shape, 0.8 * (high - low)).translate((0, 0, low + 0.1 * (high - low)))
    for k in range(count):
        build.add("blade", blade.rotate((0, 0, 360.0 * k / count)), build.sections[0])


def lattice(build: _Build, at: Room) -> None:
    """Struts to and fro between the hub and a rim: one sub-volume that stands in many places."""
    r, low, _ = at
    n, half, reach = int(build.rng.integers(6, 12)), 0.05 * r, 1.8 * r
    rim = revolved(
        [(reach, low), (reach + 2 * half, low), (reach + 2 * half, low + 0.3 * r), (reach, low + 0.3 * r)], 64
    )
    step, middle = 180.0 / n, low + 0.15 * r
    foot = (0.8 * r, 0.0)
    for k in range(n):
        for way in (-1, 1):
            a = math.radians(step * way)
            end = ((reach + half) * math.cos(a), (reach + half) * math.sin(a))
            strut = _strut((*foot, middle), (*end, middle), half)
            rim += strut.rotate((0, 0, 2 * step * k))
    build.add("lattice", rim, build.sections[0])


def _strut(a: tuple[float, float, float], b: tuple[float, float, float], half: float) -> Manifold:
    """A square bar from a point to another one at the same height."""
    way = np.subtract(b, a)
    length = float(np.linalg.norm(way))
    box = Manifold.cube((length, 2 * half, 2 * half)).translate((0, -half, -half))
    return box.rotate((0, 0, math.degrees(math.atan2(way[1], way[0])))).translate(a)


def worm(build: _Build, at: Room) -> None:
    """A helical blade about the hub, farther out than it is thick."""
    rng, (r, low, high) = build.rng, at
    reach, thick = r * rng.uniform(1.4, 2.2), 0.08 * (high - low)
    turns = rng.uniform(0.5, 2.0)
    steps = int(48 * turns)
    angle = np.linspace(0, 2 * np.pi * turns, steps + 1)
    z = np.linspace(low, high - thick, steps + 1)
    corners = []
    for a, height in zip(angle, z, strict=True):
        x, y = math.cos(a), math.sin(a)
        for radius, up in ((0.7 * r, 0.0), (reach, 0.0), (reach, thick), (0.7 * r, thick)):
            corners.append((radius * x, radius * y, height + up))
    faces = [(0, 2, 1), (0, 3, 2)]
    for k in range(steps):
        a, b = 4 * k, 4 * k + 4
        for i in range(4):
            j = (i + 1) % 4
            faces += [(a + i, a + j, b + j), (a + i, b + j, b + i)]
    last = 4 * steps
    faces += [(last, last + 1, last + 2), (last, last + 2, last + 3)]
    build.add("worm", from_arrays(np.array(corners), np.array(faces)), build.sections[0])


def pads(build: _Build, at: Room) -> None:
    """Low pads and studs side by side."""
    rng, (r, low, high) = build.rng, at
    for k in range(int(rng.integers(2, 7))):
        size = min(0.2 * r, 0.3 * (high - low))
        stud = radial_cylinder(size, 0.5 * r, r * rng.uniform(1.1, 1.3), int(rng.integers(16, 64)))
        build.add("stud", stud.translate((0, 0, 0.5 * (low + high))).rotate((0, 0, 60.0 * k)), build.sections[0])


STANDS: dict[str, Callable[[_Build, Room], None]] = {
    f.__name__: f for f in (letters, shroud, gussets, fir_tree, lattice, worm, pads)
}


@cache
def machined_part(seed: int) -> CadPart:
    """A part of a seed; the same one every time.

    Args:
        seed: which.

    Returns:
        The part.
    """
    rng = np.random.default_rng([seed, 18])
    sides = round(math.exp(rng.uniform(math.log(16), math.log(300))))
    size = float(rng.choice(SIZES_MM))
    build = bar(rng, sides, size)
    section = build.sections[0]
    at = (section.radius_low, 0.1 * section.high, 0.55 * section.high)
    stands = str(rng.choice(list(STANDS)))
    STANDS[stands](build, at)
    taken = [str(one) for one in rng.choice(list(TAKEN), int(rng.integers(0, 3)), replace=False)]
    if stands not in ("pads", "letters"):
        taken = [one for one in taken if one != "through_keyway"]  # it would cut a root
    for one in taken:
        TAKEN[one](build, at)
    vertices, faces = arrays(build.solid)
    words = ", ".join([*build.words, stands, *taken])
    truth = Truth(np.zeros(3), np.array([0.0, 0.0, 1.0]), tuple(build.stands), build.solid.volume(), sides)
    motion = np.eye(4)
    if rng.random() < 0.75:
        motion[:3, :3] = Rotation.random(random_state=int(rng.integers(2**31))).as_matrix()
    motion[:3, 3] = rng.uniform(-1, 1, 3) * min(size * float(rng.choice(AWAY)), FARTHEST_MM)
    return CadPart(words, vertices, faces, truth).moved(motion)
