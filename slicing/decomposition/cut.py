"""Cut what stands on a body of revolution off it, with manifold3d (frame: z is the axis).

How the cut is made exact. The mesh's body is a polygon inscribed in the cylinder; the cutter is a finer one
circumscribed about it, and wider by the rounding of the coordinates. So no skin of the body is left outside, and
walls are cut where they stand (they reach through to the polygon below). The corners of the cut are then moved
along the radius onto the outline, by a few millionths of it; the error of the footprint's area is of that order.

    cut = cut_off(solid_of(vertices, faces, "part"), outline, noise_mm)
    cut.pieces[0].vertices, cut.pieces[0].faces        # closed; the root's corners lie on the outline
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..mesh.closest_point import least_over_triangles
from ..mesh.manifold import manifold_of, triangles_of
from ..mesh.shells import winding_numbers
from ..mesh.solid import Bools, Floats, Ints, PartError
from .outline import Outline
from .turned_steps import is_turned, is_turned_step

CUTTER_SIDES = 1024  # sides of the cutter: its corners are 5e-6 of the radius outside
SLIVER_MM, SLIVER_SIZE = 0.05, 2e-3  # a piece that stands out less (and less than that share of the radius) is none
BULGE = 0.05  # of the body's radius: a dome's, beyond the cones it is taken for
SLIVER_SHARE = 1e-6  # of the part's volume: neither is a smaller one


@dataclass(frozen=True, eq=False)
class CutPiece:
    """A closed mesh that was cut.

    Attributes:
        vertices: (n, 3) mm, the cut's corners on the outline.
        faces: (m, 3), outward.
        cut: (k,) numbers of the faces that the cut made.
        root: (j,) those of them on cylinders and cones, the others being on steps and ends.
    """

    vertices: Floats
    faces: Ints
    cut: Ints
    root: Ints

    @property
    def feet(self) -> int:
        """In how many separate places it was cut."""
        from scipy.sparse import coo_array
        from scipy.sparse.csgraph import connected_components

        used, compact = np.unique(self.faces[self.cut], return_inverse=True)
        compact = compact.reshape(-1, 3)
        rows, columns = compact.ravel(), np.roll(compact, 1, axis=1).ravel()
        graph = coo_array((np.ones(len(rows)), (rows, columns)), shape=(len(used), len(used)))
        return int(connected_components(graph, directed=False)[0])

    @property
    def centroid(self) -> Floats:
        """Centre of gravity (3,), mm."""
        origin = self.vertices.mean(axis=0)
        a, b, c = (self.vertices[self.faces[:, k]] - origin for k in range(3))
        volume = np.einsum("ij,ij->i", a, np.cross(b, c)) / 6.0
        middle: Floats = origin + (volume[:, None] * (a + b + c)).sum(axis=0) / (4.0 * volume.sum())
        return middle


@dataclass(frozen=True)
class RejectedPiece:
    """A piece that is no sub-volume: its volume, and how near it comes to the body."""

    volume_mm3: float
    gap_mm: float


@dataclass(frozen=True)
class Sliver:
    """What is too small to keep: how far it stands out, and its volume."""

    height_mm: float
    volume_mm3: float


@dataclass(frozen=True, eq=False)
class Cut:
    """What a cut gives.

    Attributes:
        pieces: what stands on the outline's cylinders and cones.
        body: the rest.
        on_ends: what stands on ends and steps alone, left with the body.
        floating: what touches nothing, left with the body.
        slivers: what was too small to keep.
        steps: what goes round the body like a thread, left with it.
        beside_outline: all that stands out of the outline and is no piece, visibly: vertices (n, 3) mm and faces.
    """

    pieces: list[CutPiece]
    body: CutPiece
    on_ends: list[RejectedPiece]
    floating: list[RejectedPiece]
    slivers: list[Sliver]
    steps: list[Sliver] = field(default_factory=list)
    beside_outline: list[tuple[Floats, Ints]] = field(default_factory=list)


def solid_of(vertices: Floats, faces: Ints, name: str) -> Any:
    """A manifold3d solid; shells that overlap are united (parts are often saved as body and blades that intersect).

    Args:
        vertices: (n, 3) mm.
        faces: (m, 3), outward.
        name: for the message.

    Returns:
        The solid.

    Raises:
        PartError: the mesh bounds no solid.
    """
    import manifold3d  # heavy: only where solids are cut

    solid = manifold_of(vertices, faces, name)
    if solid.is_empty():
        raise PartError(f"{name}: the mesh encloses nothing")
    shells = whole_solids(solid)
    if len(shells) < 2 or any(shell.volume() <= 0 for shell in shells):
        return solid
    return manifold3d.Manifold.batch_boolean(shells, manifold3d.OpType.Add)


def whole_solids(solid: Any) -> list[Any]:
    """The connected solids of one: what manifold3d's decompose gives, each with the cavities within it.

    Args:
        solid: manifold3d; its shells do not cross.

    Returns:
        Solids (manifold3d), those of positive volume first come first. A cavity that lies in none is left as it is.

    Source:
        manifold3d's decompose() gives the shell of a cavity as a solid of its own, of negative volume (its issue 745).
    """
    shells = solid.decompose()
    if all(shell.volume() > 0 for shell in shells):
        return list(shells)
    filled = [[shell] for shell in shells if shell.volume() > 0]
    outer = [vertices[faces] for vertices, faces, _ in (arrays_of(own[0]) for own in filled)]
    alone = []
    for shell in shells:
        if shell.volume() > 0:
            continue
        vertices, faces, _ = arrays_of(shell)
        middle = vertices[faces[:1]].mean(axis=1)
        around = [k for k, triangles in enumerate(outer) if winding_numbers(middle, triangles)[0] > 0.5]
        if around:
            filled[min(around, key=lambda k: float(filled[k][0].volume()))].append(shell)
        else:
            alone.append(shell)
    return [*(own[0] if len(own) == 1 else _composed(own) for own in filled), *alone]


def _composed(shells: list[Any]) -> Any:
    """One solid of shells that do not meet, their faces knowing where they come from."""
    import manifold3d

    data = [shell.to_mesh64() for shell in shells]
    first = np.cumsum([0, *(len(d.vert_properties) for d in data)])
    corner = np.cumsum([0, *(3 * len(d.tri_verts) for d in data)])
    faces = [np.asarray(d.tri_verts) + np.uint64(n) for d, n in zip(data, first.tolist(), strict=False)]
    runs = [np.asarray(d.run_index[:-1]) + n for d, n in zip(data, corner.tolist(), strict=False)]
    ids = [np.asarray(d.run_original_id) for d in data]
    return manifold3d.Manifold(
        manifold3d.Mesh64(
            np.concatenate([np.asarray(d.vert_properties)[:, :3] for d in data]),
            np.concatenate(faces),
            run_index=np.append(np.concatenate(runs), corner[-1]).astype(np.uint64),
            run_original_id=np.concatenate(ids).astype(np.uint32),
        )
    )


def arrays_of(solid: Any, cutter_id: int = -1) -> tuple[Floats, Ints, Ints]:
    """Vertices (n, 3), faces (m, 3) and the numbers (k,) of the faces that come from the cutter."""
    data = solid.to_mesh64()
    runs = np.asarray(data.run_index, dtype=np.int64) // 3
    ids = np.repeat(np.asarray(data.run_original_id, dtype=np.int64), np.diff(runs))
    return *triangles_of(solid), np.flatnonzero(ids == cutter_id)


def clearance(noise_mm: float, radius_mm: float) -> float:
    """How far the cutter stays off the corners of a body of a radius, whose mesh is rounded to noise_mm."""
    return 4 * noise_mm + 1e-6 * radius_mm


def cut_off(solid: Any, outline: Outline, noise_mm: float, steps_to_mm: float = math.inf) -> Cut:
    """Cut off what lies outside a body of revolution.

    Args:
        solid: the part (manifold3d).
        outline: of the body.
        noise_mm: rounding of the coordinates.
        steps_to_mm: up to this radius what goes round the body like a thread is the body's.

    Returns:
        The pieces, in no particular order.
    """
    cutter = _cutter(outline, noise_mm)
    number, least = cutter.original_id(), SLIVER_SHARE * solid.volume()
    kept = solid ^ cutter
    pieces: list[CutPiece] = []
    slivers: list[Sliver] = []
    steps: list[Sliver] = []
    ends: list[RejectedPiece] = []
    floating: list[RejectedPiece] = []
    beside: list[tuple[Floats, Ints]] = []
    thin = min(SLIVER_MM, SLIVER_SIZE * outline.widest)
    for part in whole_solids(solid - cutter):
        vertices, faces, cut = arrays_of(part, number)
        height = _standing_out(vertices, outline)
        sliver = Sliver(height, float(part.volume()))
        if part.volume() < least or height < thin:
            slivers.append(sliver)
            if height >= thin:
                beside.append((vertices, faces))
            continue
        piece = _on_outline(vertices, faces, cut, outline)
        skin = np.delete(faces, cut, axis=0)
        if len(piece.root) and _thin_on_cones(piece, height, outline) and is_turned(vertices, skin):
            slivers.append(sliver)
            beside.append((vertices, faces))
        elif len(piece.root) and _radius(vertices) <= steps_to_mm and is_turned_step(part, vertices, skin, outline):
            kept += part
            steps.append(sliver)
            beside.append((vertices, faces))
        elif len(piece.root):
            pieces.append(piece)
        else:
            kept += part
            beside.append((vertices, faces))
            (ends if len(cut) else floating).append(RejectedPiece(float(part.volume()), _least_off(part, outline)))
    return Cut(pieces, _on_outline(*arrays_of(kept, number), outline), ends, floating, slivers, steps, beside)


def _least_off(part: Any, outline: Outline) -> float:
    """How near a piece comes to the body, mm."""
    vertices, faces, _ = arrays_of(part)
    return least_over_triangles(vertices[faces], lambda p: outline.off(np.hypot(p[:, 0], p[:, 1]), p[:, 2]))


def _cutter(outline: Outline, noise_mm: float) -> Any:
    """The body of revolution, a little wider than the outline everywhere (its ends and steps as well)."""
    sections = outline.sections
    clear = clearance(noise_mm, outline.widest)
    points: list[tuple[float, float]] = []
    for k, section in enumerate(sections):
        before = sections[k - 1].radius_high + sections[k - 1].over_mm if k else 0.0
        after = sections[k + 1].radius_low + sections[k + 1].over_mm if k + 1 < len(sections) else 0.0
        first, last = section.radius_low + section.over_mm, section.radius_high + section.over_mm
        if not points or abs(before - first) > clear:
            points.append((section.low + math.copysign(clear, before - first), first))
        points.append((section.high - math.copysign(clear, after - last), last))
    angle = 2 * np.pi * np.arange(CUTTER_SIDES) / CUTTER_SIDES
    circle = np.column_stack([np.cos(angle), np.sin(angle)]) / math.cos(math.pi / CUTTER_SIDES)
    rings = [np.column_stack([circle * (r + clear), np.full(CUTTER_SIDES, z)]) for z, r in points]
    ends = np.array([[0.0, 0.0, points[0][0]], [0.0, 0.0, points[-1][0]]])
    i = np.arange(CUTTER_SIDES)
    j, last_ring, apex = (i + 1) % CUTTER_SIDES, (len(rings) - 1) * CUTTER_SIDES, len(rings) * CUTTER_SIDES
    faces = [
        np.column_stack([j, i, np.full(CUTTER_SIDES, apex)]),
        np.column_stack([last_ring + i, last_ring + j, np.full(CUTTER_SIDES, apex + 1)]),
    ]
    for a in range(0, last_ring, CUTTER_SIDES):
        b = a + CUTTER_SIDES
        faces += [np.column_stack([a + i, a + j, b + j]), np.column_stack([a + i, b + j, b + i])]
    return solid_of(np.concatenate([*rings, ends]), np.concatenate(faces), "the body of revolution").as_original()


def _radius(vertices: Floats) -> float:
    return float(np.hypot(vertices[:, 0], vertices[:, 1]).max())


def _standing_out(vertices: Floats, outline: Outline) -> float:
    """Greatest distance of vertices from the body."""
    return float(outline.off(np.hypot(vertices[:, 0], vertices[:, 1]), vertices[:, 2]).max())


def _thin_on_cones(piece: CutPiece, height: float, outline: Outline) -> bool:
    """As low on cones as what a dome or a fillet bulges out of those that stand for it, which is no sub-volume."""
    section = outline.section_at(piece.vertices[piece.faces[piece.root], 2].mean(axis=1))
    cones = not any(outline.sections[k].is_cylinder for k in np.unique(section))
    return cones and height < BULGE * outline.widest


def _lateral(vertices: Floats, cut: Ints) -> Bools:
    """Which faces (k, 3) of a cut lie on cylinders and cones, not on flats across the axis."""
    a, b, c = (vertices[cut[:, k]] for k in range(3))
    normal, middle = np.cross(b - a, c - a), (a + b + c)[:, :2]
    radial = np.abs((normal[:, :2] * middle).sum(axis=1)) / np.maximum(np.hypot(*middle.T), 1e-300)
    return radial > 0.1 * np.abs(normal[:, 2])


def _on_outline(vertices: Floats, faces: Ints, cut: Ints, outline: Outline) -> CutPiece:
    """A piece with the corners of its cut moved onto the outline, along the radius."""
    root = cut[_lateral(vertices, faces[cut])]
    used, position = np.unique(faces[root], return_inverse=True)
    # which section a corner belongs to is a matter of its faces: at a step two radii meet
    owner = np.zeros(len(used), dtype=np.int64)
    owner[position.reshape(-1)] = np.repeat(outline.section_at(vertices[faces[root], 2].mean(axis=1)), 3)
    z = vertices[used, 2]
    radii = np.stack([s.radius_at(np.clip(z, s.low, s.high)) for s in outline.sections])
    target = np.take_along_axis(radii, owner[None], axis=0)[0]
    points = vertices.copy()
    points[used, :2] *= (target / np.hypot(vertices[used, 0], vertices[used, 1]))[:, None]
    return CutPiece(points, faces, cut, root)
