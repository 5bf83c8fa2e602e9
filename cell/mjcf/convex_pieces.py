"""A solid as convex pieces that hold all of it.

    found = convex_pieces(mesh)               # trimesh, any unit
    found.pieces                              # vertices of convex pieces, (k, 3) each
    found.excess                              # by what share of the solid's volume they are more than it

The solid is cut along planes of its own faces, always the piece that lacks most to its hull, until the hulls hold no
more than the solid or there are enough of them. Cuts leave nothing out, and a hull holds its piece: what the pieces
stand for is never smaller than the solid.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING

import numpy as np
from manifold3d import Manifold
from manifold3d import Mesh as ManifoldMesh

from ik.chain import Floats

if TYPE_CHECKING:
    import trimesh

MOST_PIECES = 64  # pieces
EXACT_SHARE = 1e-4  # share of the solid's volume that its hulls may hold besides it
PLANES = 12  # that are tried for a cut
LEAST_GAIN = 1e-5  # share of a hull's volume, of rounding
TRIANGLES = 4000  # that planes are tried on at each cut: fewer planes for finer meshes
WORK = 60_000  # triangles checked for cuts in all
THIN = 1e-6  # thickness over length of what may be left where a cut runs along a face
GRAIN = 1e-6  # of a mesh's length: a piece thinner than this is lost in single precision, in which MuJoCo has it
CORNERS = np.array(list(product((-1.0, 1.0), repeat=3)))
MOST_OUTSIDE = 1e-5  # share of a mesh's length by which its surface may be outside its pieces: rounding
MOST_TESTS = 200_000_000  # of points against planes of the pieces' hulls
IN_IT = 1e-6  # share of a cavity's volume that may be outside the solid around it: rounding
REFLEX = 1e-3  # rad by which an edge has to be bent inwards to be taken for one


@dataclass(frozen=True, eq=False)
class ConvexPieces:
    """Convex pieces that hold a solid.

    Attributes:
        pieces: their vertices, (k, 3) each.
        excess: the volume that the pieces hold besides the solid, as a share of the solid's; infinite where the mesh
            encloses no volume and its hull stands for it.
    """

    pieces: tuple[Floats, ...]
    excess: float


def convex_pieces(mesh: trimesh.Trimesh, most: int = MOST_PIECES) -> ConvexPieces:
    """Cut a solid into convex pieces.

    Args:
        mesh: closed; its shells turned outwards, those of cavities inwards, or all the other way round. A shell
            that is turned inwards and lies in no other is a solid turned inside out, and counts as one.
        most: pieces at most.

    Returns:
        The pieces; one hull for a convex solid, and for a mesh that is no solid or crosses itself.

    Raises:
        ValueError: a part of the solid is too thin a sheet: pieces of it would be taken for rounding and left out.
    """
    whole = _solid(mesh)
    if whole is None:
        return ConvexPieces((np.asarray(mesh.vertices, dtype=np.float64),), np.inf)
    volume = whole.volume()
    parts = _parts(whole)
    if not all(is_thick(_corners(part)) for part in parts):
        raise ValueError(f"a part of the mesh is thinner than {THIN:g} of its length; make it thicker")
    heap = [(-_lacks(piece), number, piece) for number, piece in enumerate(parts)]
    heapq.heapify(heap)
    done: list[Manifold] = []
    number = len(heap)
    work = 0
    while heap and len(heap) + len(done) < most and work < WORK:
        lacks, _, piece = heapq.heappop(heap)
        if -lacks <= EXACT_SHARE * volume / most:
            done.append(piece)
            continue
        halves = _cut(piece)
        work += piece.num_tri()
        if not halves:
            done.append(piece)
        for half in halves:
            heapq.heappush(heap, (-_lacks(half), number, half))
            number += 1
    pieces = [*done, *(piece for *_, piece in heap)]
    excess = sum(_lacks(piece) for piece in pieces) / volume
    hulls = tuple(_without_slivers([_corners(piece.hull()) for piece in pieces]))
    if not _hold(hulls, mesh):  # its faces cross: what of it is solid is not known
        return ConvexPieces((np.asarray(mesh.vertices, dtype=np.float64),), np.inf)
    return ConvexPieces(hulls, max(float(excess), 0.0))


def _hold(hulls: tuple[Floats, ...], mesh: trimesh.Trimesh) -> bool:
    """Whether corners and middles of a mesh's faces are in one of the hulls; of large meshes some of them."""
    slack = MOST_OUTSIDE * float(np.ptp(mesh.vertices, axis=0).max())
    if len(hulls) == 1:  # of all corners, but for a shell that was lost for having no volume
        hull, whole = (np.stack([points.min(axis=0), points.max(axis=0)]) for points in (hulls[0], mesh.vertices))
        return bool(np.abs(hull - whole).max() <= slack)
    from scipy.spatial import ConvexHull  # heavy: only where there is a fixture of a concave mesh

    planes = [ConvexHull(hull).equations for hull in hulls]
    left = np.concatenate([mesh.vertices, mesh.triangles_center])
    left = left[:: -(-len(left) * sum(map(len, planes)) // MOST_TESTS)]
    for hull, faces in zip(hulls, planes, strict=True):
        near = np.flatnonzero(((left >= hull.min(axis=0) - slack) & (left <= hull.max(axis=0) + slack)).all(axis=1))
        held = np.ones(len(near), dtype=bool)
        for normal, offset in zip(faces[:, :3], faces[:, 3], strict=True):
            held &= left[near] @ normal + offset <= slack
        left = np.delete(left, near[held], axis=0)
    return not len(left)


def _parts(solid: Manifold) -> list[Manifold]:
    """A solid's parts that do not touch; itself where one of them bounds a cavity."""
    parts: list[Manifold] = solid.decompose()
    return parts if all(part.volume() > 0 for part in parts) else [solid]


def _without_slivers(hulls: list[Floats]) -> Iterator[Floats]:
    """Hulls with a volume; those too thin to be one made thicker, or left out where another holds them."""
    grain = GRAIN * float(np.ptp(np.concatenate(hulls), axis=0).max())
    thick = [hull for hull in hulls if is_thick(hull, grain)]
    yield from thick
    if len(thick) == len(hulls):
        return
    from scipy.spatial import ConvexHull  # heavy: only where a hull is thin

    faces = [ConvexHull(hull).equations for hull in thick]
    for thin in (hull for hull in hulls if not is_thick(hull, grain)):
        slack = max(THIN * float(np.ptp(thin, axis=0).max()), grain)
        if any((thin @ one[:, :3].T + one[:, 3]).max() <= slack for one in faces):
            continue  # of the rounding of a cut along a face
        yield (thin[:, None] + 4 * slack * CORNERS).reshape(-1, 3)


def is_thick(points: Floats, least: float = 0.0) -> bool:
    """Whether points enclose a volume and not only the rounding of a cut.

    Args:
        points: (k, 3).
        least: thickness below which they do not, unit of the points.

    Returns:
        Whether they do.
    """
    if len(points) < 4:
        return False
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False) / np.sqrt(len(points))
    return bool(spread[2] > max(THIN * spread[0], least))


def _solid(mesh: trimesh.Trimesh) -> Manifold | None:
    """The mesh as a solid; None where it is none."""
    joined = mesh.copy()
    joined.merge_vertices(merge_tex=True, merge_norm=True)
    if not joined.is_watertight:
        return None
    if joined.volume < 0:
        joined.invert()  # all of its faces are turned inwards
    joined = _right_side_out(joined)
    scale = float(np.ptp(joined.vertices, axis=0).max())
    made = _manifold(joined)
    if made.is_empty() or made.volume() <= 1e-9 * scale**3:
        return None
    return made


def _right_side_out(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    """A closed mesh with those of its shells turned that are inside out, and no cavity of another."""
    shells = list(mesh.split(only_watertight=False))
    wrong = [shell for shell in shells if shell.volume < 0]
    if not wrong:
        return mesh
    solids = [shell for shell in shells if shell.volume > 0]
    for shell in wrong:
        turned = shell.copy()
        turned.invert()
        around = [
            solid
            for solid in solids
            if (solid.bounds[0] <= shell.bounds[0]).all() and (solid.bounds[1] >= shell.bounds[1]).all()
        ]
        own = _manifold(turned)
        if not any((own - _manifold(solid)).volume() <= IN_IT * own.volume() for solid in around):
            shell.invert()
    import trimesh

    joined = trimesh.util.concatenate(shells)
    assert isinstance(joined, trimesh.Trimesh)
    return joined


def _manifold(mesh: trimesh.Trimesh) -> Manifold:
    vertices, faces = np.asarray(mesh.vertices, dtype=np.float32), np.asarray(mesh.faces, dtype=np.uint32)
    return Manifold(ManifoldMesh(vert_properties=vertices, tri_verts=faces))


def _lacks(piece: Manifold) -> float:
    return float(piece.hull().volume() - piece.volume())


def _corners(piece: Manifold) -> Floats:
    return np.asarray(piece.to_mesh().vert_properties[:, :3], dtype=np.float64)


def _cut(piece: Manifold) -> list[Manifold]:
    """The parts of a piece on both sides of the plane that leaves the least to their hulls."""
    # cutting a frame open gains nothing yet, but what follows does
    best, least = [], _lacks(piece) + LEAST_GAIN * piece.hull().volume()
    for normal, offset in _planes(piece):
        sides = [side for side in piece.split_by_plane(normal, offset) if not side.is_empty()]
        if len(sides) < 2:
            continue
        parts = [part for side in sides for part in _parts(side)]
        lacks = sum(_lacks(part) for part in parts)
        if lacks < least:
            best, least = parts, lacks
    return best


def _planes(piece: Manifold) -> list[tuple[tuple[float, float, float], float]]:
    """Planes of the faces beside edges that are bent inwards, those of the largest area first, and halves."""
    import trimesh

    mesh = piece.to_mesh()
    solid = trimesh.Trimesh(
        mesh.vert_properties[:, :3].astype(np.float64), mesh.tri_verts.astype(np.int64), process=False
    )
    inwards = ~solid.face_adjacency_convex & (solid.face_adjacency_angles > REFLEX)
    faces = np.unique(solid.face_adjacency[inwards])
    normals = solid.face_normals[faces]
    offsets = np.einsum("ij,ij->i", normals, solid.triangles[faces, 0])
    size = float(np.ptp(solid.vertices, axis=0).max()) or 1.0
    keys = np.round(np.column_stack([normals, offsets / size]), 4)
    _, first, which = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    area = np.bincount(which.ravel(), weights=solid.area_faces[faces], minlength=len(first))
    chosen = first[np.argsort(-area)][: max(min(PLANES, TRIANGLES // len(solid.faces)), 0)]
    planes = [(_triple(normals[i]), float(offsets[i])) for i in chosen.tolist()]
    low, high = solid.bounds
    planes += [(_triple(np.eye(3)[axis]), float((low[axis] + high[axis]) / 2)) for axis in range(3)]
    return planes


def _triple(vector: Floats) -> tuple[float, float, float]:
    return float(vector[0]), float(vector[1]), float(vector[2])
