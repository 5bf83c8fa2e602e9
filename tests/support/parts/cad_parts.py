"""Parts as CAD programs make them, with known truth: a turned hub and what stands on it, lying anywhere.

    part = cad_part(7)
    part.vertices, part.faces            # input frame, mm
    part.truth.direction, part.truth.stands[0].volume_mm3

Vertices lie on the true surfaces, as a CAD program's tessellation puts them. What the truth says of volumes comes from
the solids before they are joined, cut by a body of revolution of 1024 sides.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np
import trimesh
from manifold3d import CrossSection, Manifold, Mesh64
from scipy.spatial.transform import Rotation

FINE = 1024
HUBS = ("cylinder", "steps", "draft", "cone")
KINDS = ("blade", "boss", "pipe", "rib", "pin_in_pipe")
FORMATS = ("stl", "obj", "ply", "3mf", "glb")


@dataclass(frozen=True)
class Stands:
    """What stands on the body.

    Attributes:
        kind: one of KINDS, or collar.
        volume_mm3: outside of the body.
        radius_mm: of the body there (on a cone the mean over its root).
        half_angle_deg: of the cone there; 0 on a cylinder.
    """

    kind: str
    volume_mm3: float
    radius_mm: float
    half_angle_deg: float = 0.0


@dataclass(frozen=True, eq=False)
class Truth:
    """What is to be found.

    Attributes:
        point: (3,) of the axis, input frame, mm.
        direction: (3,) of the axis.
        stands: what stands on the body.
        volume_mm3: of the whole part.
        sides: of the body's polygon.
    """

    point: np.ndarray
    direction: np.ndarray
    stands: tuple[Stands, ...]
    volume_mm3: float
    sides: int


@dataclass(frozen=True, eq=False)
class CadPart:
    """A part with its truth.

    Attributes:
        words: how it was made.
        vertices: (n, 3) input frame, mm.
        faces: (m, 3).
        truth: what is to be found.
    """

    words: str
    vertices: np.ndarray
    faces: np.ndarray
    truth: Truth

    def save(self, folder: Path, kind: str, digits: int | None = None) -> Path:
        """Write it to a file of a kind; vertices rounded to digits where given."""
        points = self.vertices if digits is None else np.round(self.vertices, digits)
        path = folder / f"part.{kind}"
        trimesh.Trimesh(points, self.faces, process=False).export(path)
        return path

    def moved(self, motion: np.ndarray) -> CadPart:
        """The part elsewhere."""
        turn, shift = motion[:3, :3], motion[:3, 3]
        truth = replace(self.truth, point=turn @ self.truth.point + shift, direction=turn @ self.truth.direction)
        return CadPart(self.words, self.vertices @ turn.T + shift, self.faces, truth)


@dataclass(frozen=True)
class Section:
    """A stretch of the hub, radii at its ends."""

    low: float
    high: float
    radius_low: float
    radius_high: float

    @property
    def half_angle_deg(self) -> float:
        """Of the cone."""
        return math.degrees(math.atan2(self.radius_high - self.radius_low, self.high - self.low))


@dataclass
class _Build:
    rng: np.random.Generator
    sides: int
    sections: list[Section]
    profile: list[tuple[float, float]]
    solid: Manifold
    fine: Manifold
    stands: list[Stands] = field(default_factory=list)
    words: list[str] = field(default_factory=list)
    cylinder_mm2: float = 0.0  # of bosses' own cylinders so far

    def add(self, kind: str, solid: Manifold, section: Section) -> None:
        outside = solid - self.fine
        self.solid += solid
        radius = 0.5 * (section.radius_low + section.radius_high)
        self.stands.append(Stands(kind, outside.volume(), radius, section.half_angle_deg))


def revolved(profile: list[tuple[float, float]], sides: int) -> Manifold:
    """A closed (r, z) polyline turned about z."""
    return Manifold.revolve(CrossSection([profile]), sides)


def arrays(solid: Manifold) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and faces."""
    out = solid.to_mesh64()
    return np.asarray(out.vert_properties)[:, :3].copy(), np.asarray(out.tri_verts).astype(np.int64)


def from_arrays(vertices: np.ndarray, faces: np.ndarray) -> Manifold:
    """A solid of arrays; turned round where it is inside out."""
    solid = Manifold(Mesh64(np.ascontiguousarray(vertices, float), np.ascontiguousarray(faces, np.uint64)))
    if solid.is_empty():
        raise ValueError(f"no solid: {solid.status()}")
    if solid.volume() < 0:
        return from_arrays(vertices, faces[:, ::-1])
    return solid


def _arc(
    centre: tuple[float, float], radius: float, first: float, last: float, steps: int
) -> list[tuple[float, float]]:
    return [
        (centre[0] + radius * math.cos(a), centre[1] + radius * math.sin(a))
        for a in np.linspace(first, last, steps + 1)
    ]


def filleted_blade(radius: float, thickness: float, reach: float, fillet: float, steps: int) -> CrossSection:
    """Section of a radial blade on +x with concave root fillets tangent to the cylinder and to the blade."""
    half = 0.5 * thickness
    inner = 0.5 * radius
    plate = CrossSection([[(inner, -half), (reach, -half), (reach, half), (inner, half)]])
    if fillet <= 0:
        return plate
    y = half + fillet
    x = math.sqrt((radius + fillet) ** 2 - y * y)
    on_body = math.atan2(-y, -x)  # seen from the fillet's centre, towards the axis
    curve = _arc((x, y), fillet, -math.pi / 2, on_body, steps)
    foot = curve[-1]
    web = [(inner, 0.0), (curve[0][0], 0.0), *curve, (0.6 * foot[0], 0.6 * foot[1])]
    upper = CrossSection([web]) if _signed_area(web) > 0 else CrossSection([web[::-1]])
    return plate + upper + upper.mirror((0, 1))


def _signed_area(points: list[tuple[float, float]]) -> float:
    x, y = np.array(points).T
    return 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))


def boss_fillet(radius: float, boss: float, fillet: float, around: int, steps: int) -> Manifold:
    """The ring between a cylinder about z and a boss along +x, as a rolling ball leaves it; with its core."""
    phi = 2 * np.pi * np.arange(around) / around
    out = np.column_stack([np.zeros(around), np.cos(phi), np.sin(phi)])
    y, z = ((boss + fillet) * out[:, k] for k in (1, 2))
    centre = np.column_stack([np.sqrt((radius + fillet) ** 2 - y * y), y, z])
    towards_body = -np.column_stack([centre[:, 0], y, np.zeros(around)]) / (radius + fillet)
    angle = np.arccos(np.clip((-out * towards_body).sum(axis=1), -1, 1))[:, None]
    rings = []
    for t in np.linspace(0, 1, steps + 1):
        ray = (np.sin((1 - t) * angle) * -out + np.sin(t * angle) * towards_body) / np.sin(angle)
        rings.append(centre + fillet * ray)
    rings.append(rings[-1] * [0.7, 0.7, 1.0])
    inner = np.array([[0.0, 0.0, 0.0]])
    vertices = np.concatenate([*rings, [[rings[0][:, 0].max(), 0.0, 0.0]], inner])
    vertices[:around, 0] = rings[0][:, 0]
    i = np.arange(around)
    j, faces = (i + 1) % around, []
    for k in range(len(rings) - 1):
        a, b = k * around, (k + 1) * around
        faces += [np.column_stack([a + i, b + i, b + j]), np.column_stack([a + i, b + j, a + j])]
    top, bottom, last = len(vertices) - 2, len(vertices) - 1, (len(rings) - 1) * around
    faces += [
        np.column_stack([i, j, np.full(around, top)]),
        np.column_stack([last + j, last + i, np.full(around, bottom)]),
    ]
    return from_arrays(vertices, np.concatenate(faces))


def radial_cylinder(radius: float, inner: float, reach: float, around: int) -> Manifold:
    """A cylinder along +x; its corners at the angles of `boss_fillet`."""
    ring = [(radius * math.cos(a), radius * math.sin(a)) for a in 2 * np.pi * np.arange(around) / around]
    along_z = Manifold.extrude(CrossSection([ring]), reach - inner)
    # x of the section becomes y, y becomes z, and z becomes x
    return along_z.transform([[0, 0, 1, inner], [1, 0, 0, 0], [0, 1, 0, 0]])


def hub(rng: np.random.Generator, kind: str, sides: int) -> _Build:
    """A turned hub about z from z = 0 up."""
    radius, length = float(rng.uniform(5, 60)), float(rng.uniform(0.8, 3.0))
    length *= radius
    if kind == "cylinder":
        sections = [Section(0.0, length, radius, radius)]
    elif kind == "steps":
        first = radius * float(rng.uniform(0.6, 0.85))
        sections = [Section(0.0, 0.6 * length, radius, radius), Section(0.6 * length, 1.2 * length, first, first)]
    else:
        angle = math.radians(rng.uniform(0.3, 3.0) if kind == "draft" else rng.uniform(4.0, 20.0))
        top = max(radius - length * math.tan(angle), 0.4 * radius)
        length = (radius - top) / math.tan(angle)
        sections = [Section(0.0, length, radius, top)]
    words = [kind, f"R{radius:.3f}", f"L{length:.2f}", f"sides {sides}"]
    points = [(0.0, 0.0), *_start(rng, sections[0], words)]
    for before, after in pairwise(sections):
        points.append((before.radius_high, before.high))
        step = before.radius_high - after.radius_low
        fillet = step * float(rng.uniform(0.2, 0.8)) if rng.random() < 0.5 else 0.0
        fillet = min(fillet, 0.15 * (after.high - after.low))
        if fillet:
            words.append(f"shoulder fillet {fillet:.2f}")
            centre = (after.radius_low + fillet, after.low + fillet)
            points += _arc(centre, fillet, -math.pi / 2, -math.pi, int(rng.integers(2, 12)))
        else:
            points.append((after.radius_low, after.low))
    points += _finish(rng, sections[-1], words)
    points.append((0.0, sections[-1].high))
    made = revolved(points, sides)
    if rng.random() < 0.5:
        bore = sections[-1].radius_high * float(rng.uniform(0.2, 0.45))
        words.append(f"bore {bore:.2f}")
        high = sections[-1].high
        made -= Manifold.cylinder(high + 2, bore, bore, max(sides // 2, 12)).translate((0, 0, -1))
    fine = revolved(points, FINE).scale((1 / math.cos(math.pi / FINE) ** 0.5,) * 2 + (1.0,))
    # beyond its ends nothing stands on it here
    return _Build(rng, sides, sections, points, made, fine, words=words)


def _start(rng: np.random.Generator, section: Section, words: list[str]) -> list[tuple[float, float]]:
    """The lower end: sharp or with a chamfer."""
    r, z = section.radius_low, section.low
    if rng.random() < 0.3:
        c = 0.06 * min(section.high - section.low, r)
        words.append(f"chamfer {c:.2f}")
        return [(r - c, z), (r - c * math.tan(math.radians(section.half_angle_deg)) * -1, z + c)]
    return [(r, z)]


def _finish(rng: np.random.Generator, section: Section, words: list[str]) -> list[tuple[float, float]]:
    """The upper end: sharp or rounded."""
    r, z = section.radius_high, section.high
    if section.half_angle_deg == 0 and rng.random() < 0.3:
        f = 0.08 * min(section.high - section.low, r)
        words.append(f"rounded end {f:.2f}")
        return _arc((r - f, z - f), f, 0.0, math.pi / 2, int(rng.integers(2, 10)))
    return [(r, z)]


def _keyway(build: _Build, azimuth: float, section: Section) -> None:
    """A groove along the hub, open at its lower end."""
    r = section.radius_low
    width, depth = 0.25 * r, 0.12 * r
    groove = Manifold.cube((2 * depth, width, 0.5 * (section.high - section.low))).translate(
        (r - depth, -0.5 * width, -0.1)
    )
    build.solid -= groove.rotate((0, 0, math.degrees(azimuth))).translate((0, 0, section.low))
    build.words.append("keyway")


def _stand(build: _Build, kind: str, section: Section, azimuth: float, room: float) -> None:
    """Put one on a section at an azimuth; room: half the width there is, mm."""
    rng = build.rng
    r, length = min(section.radius_low, section.radius_high), section.high - section.low
    on_cylinder = section.half_angle_deg == 0
    turn, middle = (0.0, 0.0, math.degrees(azimuth)), section.low + length * float(rng.uniform(0.4, 0.5))
    around, steps = int(rng.integers(16, 97)), int(rng.integers(2, 17))
    if kind in ("blade", "rib"):
        thickness = room * float(rng.uniform(0.2, 0.8))
        reach = r + (r * float(rng.uniform(0.3, 6.0)) if kind == "blade" else 0.15 * r)
        fillet = min(0.5 * thickness * float(rng.uniform(0.2, 1.0)), room - 0.5 * thickness, 0.5 * (reach - r))
        fillet = fillet if on_cylinder and rng.random() < 0.7 else 0.0
        shape = filleted_blade(r, thickness, max(section.radius_low, section.radius_high) + reach - r, fillet, steps)
        high = length * float(rng.uniform(0.2, 0.5))
        solid = Manifold.extrude(shape, high).translate((0, 0, middle - 0.5 * high))
        build.words.append(f"{kind} t{thickness:.2f} f{fillet:.2f}/{steps}")
        build.add(kind, solid.rotate(turn), section)
        return
    boss = min(room, 0.22 * length) * float(rng.uniform(0.4, 0.75))
    free = sum(2 * math.pi * s.radius_low * (s.high - s.low) for s in build.sections)
    height = min(r * float(rng.uniform(0.3, 2.0)), 0.12 * free / (2 * math.pi * boss))
    reach = max(section.radius_low, section.radius_high) + height
    build.cylinder_mm2 += 2 * math.pi * boss * height
    fillet = min(boss * float(rng.uniform(0.1, 0.5)), room - boss, 0.45 * height, 0.23 * length - boss)
    fillet = fillet if on_cylinder and kind != "pin_in_pipe" and rng.random() < 0.7 else 0.0
    solid = radial_cylinder(boss, 0.5 * r, reach, around)
    build.words.append(f"{kind} r{boss:.2f} f{fillet:.2f}/{around}/{steps}")

    def put(one: Manifold) -> Manifold:
        return one.translate((0, 0, middle)).rotate(turn)

    if fillet > 0:
        solid += boss_fillet(r, boss, fillet, around, steps)
    if kind == "boss":
        build.add("boss", put(solid), section)
        return
    hole = put(radial_cylinder(0.6 * boss, 0.0, reach + 1.0, around))
    build.add("pipe", put(solid) - hole, section)
    if kind == "pin_in_pipe":
        build.add("pin", put(radial_cylinder(0.3 * boss, 0.5 * r, reach + 0.1 * boss, around)), section)


def _collar(build: _Build, section: Section) -> None:
    """A full ring that stands out farther than it is long."""
    r, length = section.radius_low, section.high - section.low
    high, reach = 0.1 * length, r * float(build.rng.uniform(1.6, 3.0))
    high = min(high, 0.5 * (reach - r))
    low = section.high - 0.12 * length - high
    ring = [(0.5 * r, low), (reach, low), (reach, low + high), (0.5 * r, low + high)]
    if build.rng.random() < 0.4:
        fillet = 0.1 * min(length, reach - r) * 0.3
        build.words.append(f"collar fillet {fillet:.2f}")
        curve = _arc((r + fillet, low + high + fillet), fillet, -math.pi / 2, -math.pi, 6)
        ring = [*ring[:2], ring[2], *curve, (0.5 * r, low + high + fillet)]
    build.words.append("collar")
    build.add("collar", revolved(ring, build.sides), section)


@cache
def cad_part(seed: int) -> CadPart:
    """A part of a seed; the same one every time.

    Args:
        seed: which.

    Returns:
        The part.
    """
    rng = np.random.default_rng([seed, 15])
    sides = round(math.exp(rng.uniform(math.log(8), math.log(500))))
    build = hub(rng, str(rng.choice(HUBS, p=(0.45, 0.25, 0.15, 0.15))), sides)
    for section in build.sections:
        if section is not build.sections[0] and rng.random() < 0.5:
            continue
        count = int(rng.integers(1, 7))
        pattern = rng.random() < 0.5
        kind = str(rng.choice(KINDS))
        phase = float(rng.uniform(0, 2 * np.pi))
        room = 0.75 * min(section.radius_low, section.radius_high) * min(math.sin(math.pi / max(count, 3)), 0.6)
        state = rng.bit_generator.state
        for k in range(count):
            if pattern:
                rng.bit_generator.state = state  # all alike
            elif k:
                kind = str(rng.choice(KINDS))
            _stand(build, kind, section, phase + 2 * math.pi * k / count, room)
        if section.half_angle_deg == 0 and rng.random() < 0.25:
            _collar(build, section)
        if rng.random() < 0.2 and count < 5:
            _keyway(build, phase + math.pi / count, section)
    vertices, faces = arrays(build.solid)
    truth = Truth(np.zeros(3), np.array([0.0, 0.0, 1.0]), tuple(build.stands), build.solid.volume(), sides)
    part = CadPart(", ".join(build.words), vertices, faces, truth)
    motion = np.eye(4)
    if rng.random() < 0.75:
        motion[:3, :3] = Rotation.random(random_state=int(rng.integers(2**31))).as_matrix()
    motion[:3, 3] = rng.uniform(-1, 1, 3) * float(rng.choice([0.0, 100.0, 1000.0]))
    return part.moved(motion)
