"""A surface of revolution as bands, each of them a piece of one cone, and a mesh cut at the bands' borders.

A profile that is a function of z (see `slicing.surfaces.profile.ProfileChain`) divides space by horizontal planes into
slabs; within a slab the surface is one cone, and what lies inside it is convex. A triangle is cut at these planes
into *cells*, each in one slab, and each side of a cell is a *segment*: a part of a mesh edge, or a chord of a
triangle in a border plane. Segments are shared by the two cells beside them, so whatever is decided once a
segment (how often it crosses the surface, and where) holds on both sides, and curves chain by name across
triangles and bands alike.

A step of the profile is a slab of no height: there the coordinate that runs through the slab is not z but the
place along the step. A triangle through its plane has a cell in it, whose sides are the chord below, the chord
above and the two points where its edges pass.

    bands = Bands.of(surface.chain(5e-4))
    cells = cut_at_slabs(mesh, faces, bands)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..mesh.solid import Bools, Floats, Ints, Mesh
from ..surfaces.profile import ProfileChain

STEP_MM = 1e-9  # points of a chain closer in height than this make a step


@dataclass(frozen=True, eq=False)
class ProfileSlabs:
    """Knots (points of the profile) and slabs: slab j lies between knots j - 1 and j.

    Attributes:
        r: (k,) radii at the knots, mm.
        z: (k,) their heights; equal neighbours are a step.
        at_r: (k + 1,) radius of each slab's cone at height at_z.
        at_z: (k + 1,) mm.
        slope: (k + 1,) dr/dz of each slab's cone; 0 for steps.
        step: (k + 1,) slabs of no height.
        empty: (k + 1,) slabs in which nothing is inside.
        area: (k + 1,) area of the surface per radian, mm², from knot 0 to the slab's point at_z (0 for the
            slabs at either side of knot 0).
    """

    r: Floats
    z: Floats
    at_r: Floats
    at_z: Floats
    slope: Floats
    step: Bools
    empty: Bools
    area: Floats

    @classmethod
    def of(cls, chain: ProfileChain) -> ProfileSlabs:
        """The bands of a profile."""
        r, z = chain.r, chain.z.copy()
        for k in np.flatnonzero(np.diff(z) < STEP_MM):
            z[k + 1] = z[k]
        rise, run = np.diff(z), np.diff(r)
        step = np.concatenate([[False], rise == 0.0, [False]])
        slope = np.concatenate([[chain.slope[0]], run / np.where(rise > 0, rise, np.inf), [chain.slope[1]]])
        empty = np.isnan(slope)
        band = 0.5 * (r[:-1] + r[1:]) * np.hypot(rise, run)
        area = np.concatenate([[0.0, 0.0], np.cumsum(band)])
        at_r, at_z = np.append(r[0], r), np.append(z[0], z)
        return cls(r, z, at_r, at_z, np.where(empty, 0.0, slope), step, empty, area)

    def slab(self, z: Floats) -> Ints:
        """The slab that points at heights z lie in; points in a border plane belong below it."""
        return np.searchsorted(self.z, z, side="left")

    def radius(self, slab: Ints, z: Floats) -> Floats:
        """Radius of the slabs' cones at heights; -1 where nothing is inside."""
        return np.where(self.empty[slab], -1.0, self.at_r[slab] + self.slope[slab] * (z - self.at_z[slab]))

    def area_to(self, slab: Ints, r: Floats, z: Floats) -> Floats:
        """Area of the surface per radian from knot 0 up to points (r, z) of slabs, mm²."""
        rise = z - self.at_z[slab]
        k = self.slope[slab]
        cone = np.sqrt(1.0 + k * k) * (self.at_r[slab] + 0.5 * k * rise) * rise
        step = 0.5 * np.abs(r * r - self.at_r[slab] ** 2)
        return self.area[slab] + np.where(self.step[slab], step, cone)


@dataclass(frozen=True, eq=False)
class Segments:
    """Sides of cells, one a row: straight, with the radius of the surface linear along them.

    Attributes:
        begin: (s, 3) mm.
        end: (s, 3) mm.
        begin_r: (s,) radius of the surface at the beginning; not above 0 where nothing is inside.
        end_r: (s,) at the end.
    """

    begin: Floats
    end: Floats
    begin_r: Floats
    end_r: Floats


@dataclass(frozen=True, eq=False)
class CutTriangles:
    """Triangles cut at the borders of the bands.

    Attributes:
        face: (c,) row of the triangle among those asked for.
        slab: (c,) which slab.
        sides: (c, 6) numbers of segments round the cell, counter-clockwise seen from outside the solid; -1
            where there is none.
        forward: (c, 6) the side runs along its segment, not against it.
        segments: all of them.
    """

    face: Ints
    slab: Ints
    sides: Ints
    forward: Bools
    segments: Segments


@dataclass(frozen=True, eq=False)
class _UpwardEdges:
    """Mesh edges turned so that they never run into a lower slab."""

    begin: Ints
    end: Ints
    low: Ints
    high: Ints
    first: Ints  # number of each edge's first segment


def cut_at_slabs(mesh: Mesh, faces: Ints, bands: ProfileSlabs) -> CutTriangles:
    """Cut triangles at the borders of bands.

    Args:
        mesh: the solid.
        faces: (m,) numbers of the triangles.
        bands: the surface's.

    Returns:
        Their cells.
    """
    ends, edge_of_side = mesh.edges_and_sides
    used, sides = np.unique(edge_of_side[faces], return_inverse=True)
    sides = sides.reshape(-1, 3)
    edges = _turned(mesh, ends[used], bands)
    parts = edges.high - edges.low + 1
    corner_slab = bands.slab(mesh.vertices[mesh.faces[faces], 2])
    low, high = corner_slab.min(axis=1), corner_slab.max(axis=1)
    chords = high - low
    first_chord = parts.sum() + np.cumsum(chords) - chords
    face = np.repeat(np.arange(len(faces)), chords + 1)
    slab = _counted(chords + 1) + low[face]
    cell_sides = np.full((len(face), 6), -1, dtype=np.int64)
    forward = np.zeros((len(face), 6), dtype=bool)
    chord = first_chord[face] + slab - low[face]
    for k in range(3):
        edge = sides[face, k]
        here, there = corner_slab[face, k], corner_slab[face, (k + 1) % 3]
        part = edges.first[edge] + slab - edges.low[edge]
        cell_sides[:, 2 * k] = np.where((edges.low[edge] <= slab) & (slab <= edges.high[edge]), part, -1)
        forward[:, 2 * k] = mesh.faces[faces[face], k] == edges.begin[edge]
        up, down = (here <= slab) & (slab < there), (here >= slab) & (slab > there)
        cell_sides[:, 2 * k + 1] = np.where(up, chord, np.where(down, chord - 1, -1))
        forward[:, 2 * k + 1] = up
    portions = _portions(mesh, edges, bands)
    across = _chords(mesh, edges, bands, sides, corner_slab, low, chords)
    segments = Segments(*(np.concatenate([getattr(s, n) for s in (portions, across)]) for n in
                          ("begin", "end", "begin_r", "end_r")))  # fmt: skip
    return CutTriangles(face, slab, cell_sides, forward, segments)


def _counted(sizes: Ints) -> Ints:
    """0, 1, .. up to each size, one after the other."""
    return np.arange(sizes.sum()) - np.repeat(np.cumsum(sizes) - sizes, sizes)


def _turned(mesh: Mesh, ends: Ints, bands: ProfileSlabs) -> _UpwardEdges:
    slabs = bands.slab(mesh.vertices[ends, 2])
    against = slabs[:, 0] > slabs[:, 1]
    begin, end = np.where(against, ends[:, 1], ends[:, 0]), np.where(against, ends[:, 0], ends[:, 1])
    low, high = slabs.min(axis=1), slabs.max(axis=1)
    parts = high - low + 1
    return _UpwardEdges(begin, end, low, high, np.cumsum(parts) - parts)


def _crossing(mesh: Mesh, edges: _UpwardEdges, edge: Ints, knot: Ints, bands: ProfileSlabs) -> Floats:
    """Points (n, 3) where edges pass the planes of knots; the same numbers whichever segment asks."""
    a, b = mesh.vertices[edges.begin[edge]], mesh.vertices[edges.end[edge]]
    rise = b[:, 2] - a[:, 2]
    t = np.clip((bands.z[knot] - a[:, 2]) / np.where(rise > 0, rise, 1.0), 0.0, 1.0)
    points = a + t[:, None] * (b - a)
    points[:, 2] = bands.z[knot]
    return points


def _portions(mesh: Mesh, edges: _UpwardEdges, bands: ProfileSlabs) -> Segments:
    """Parts of edges, slab by slab."""
    parts = edges.high - edges.low + 1
    edge = np.repeat(np.arange(len(parts)), parts)
    slab = edges.low[edge] + _counted(parts)
    begin, end = mesh.vertices[edges.begin[edge]], mesh.vertices[edges.end[edge]]
    begin_r, end_r = bands.radius(slab, begin[:, 2]), bands.radius(slab, end[:, 2])
    for row, point, radius, back in (
        (np.flatnonzero(slab > edges.low[edge]), begin, begin_r, 1),
        (np.flatnonzero(slab < edges.high[edge]), end, end_r, 0),
    ):
        knot = slab[row] - back
        point[row] = _crossing(mesh, edges, edge[row], knot, bands)
        radius[row] = np.where(bands.empty[slab[row]], -1.0, bands.r[knot])
    return Segments(begin, end, begin_r, end_r)


def _chords(
    mesh: Mesh, edges: _UpwardEdges, bands: ProfileSlabs, sides: Ints, corner_slab: Ints, low: Ints, chords: Ints
) -> Segments:
    """Chords of triangles in border planes, from the side that runs up to the one that runs down."""
    face = np.repeat(np.arange(len(chords)), chords)
    knot = low[face] + _counted(chords)
    here, there = corner_slab[face], np.roll(corner_slab, -1, axis=1)[face]
    rows, at = np.arange(len(face)), knot[:, None]
    rising = np.argmax((here <= at) & (at < there), axis=1)
    falling = np.argmax((there <= at) & (at < here), axis=1)
    begin = _crossing(mesh, edges, sides[face][rows, rising], knot, bands)
    end = _crossing(mesh, edges, sides[face][rows, falling], knot, bands)
    return Segments(begin, end, bands.r[knot], bands.r[knot])
