"""The parts of built sub-volumes that their layers do not contain, as convex pieces for collisions.

    rest_of_built([mesh], shape.hulls)        # {"built/SV1/rest/0": (k, 3), ..}

Layers stand for what is laid: beads as high as they are thick, on the outline of their lower side. A sub-volume that is
there from the start is as its mesh is. An underside between two layers, what widens within one, and what lies below
the first plane are metal that no layer holds. Millimetres, part frame.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence

import numpy as np
from manifold3d import Manifold, OpType

from ik.chain import Floats
from slicing import Mesh, convex_hull

from ..mjcf.convex_pieces import CORNERS

FILLED = 0.8  # share of its hull that a piece has to fill
SMALLEST_MM = 4.0  # pieces are not cut further
THIN_MM = 0.5  # mean thickness of a hull that may be filled less: it reaches no further than that off its piece
PADDED_MM = 0.05  # by which pieces are made thicker, so that rounding leaves no gap


def rest_of_built(built: Sequence[Mesh], hulls: Mapping[str, Floats]) -> dict[str, Floats]:
    """Vertices of convex pieces that hold what neither the body nor its own layers hold of a solid, by geom name.

    Args:
        built: sub-volumes that are there from the start.
        hulls: vertices of convex pieces by geom name, those of the body and of the sub-volumes' layers among them.

    Raises:
        PartError: a mesh does not bound a solid.
    """
    rest: dict[str, Floats] = {}
    for solid in built:
        of_it = ("body/", f"built/{solid.name}/")
        left = _left(solid, [points for name, points in hulls.items() if name.startswith(of_it)])
        rest.update((f"built/{solid.name}/rest/{i}", points) for i, points in enumerate(_pieces(left)))
    return rest


def _left(solid: Mesh, hulls: Iterable[Floats]) -> Manifold:
    """A solid without convex pieces."""
    from slicing import solid_of  # its room is loaded only where something is built already

    all_of_it: Manifold = solid_of(solid.vertices, solid.faces, solid.name)
    return all_of_it - Manifold.batch_boolean([Manifold.hull_points(points) for points in hulls], OpType.Add)


def _pieces(solid: Manifold) -> Iterator[Floats]:
    """Vertices of convex pieces that hold a solid: it is halved across its longest side until they hold little more."""
    todo = [part for part in solid.decompose() if not part.is_empty()]
    while todo:
        piece = todo.pop()
        low, high = np.array(piece.bounding_box()).reshape(2, 3)
        axis = int(np.argmax(high - low))
        if (high - low)[axis] < SMALLEST_MM or _is_filled(piece):
            yield _padded(np.asarray(piece.to_mesh64().vert_properties)[:, :3])
            continue
        normal = np.eye(3)[axis]
        halves = piece.split_by_plane((normal[0], normal[1], normal[2]), float((low + high)[axis] / 2))
        todo += [part for half in halves for part in half.decompose() if not part.is_empty()]


def _is_filled(piece: Manifold) -> bool:
    hull = piece.hull()
    volume, area = hull.volume(), hull.surface_area()
    return bool(piece.volume() >= FILLED * volume or 2 * volume <= THIN_MM * area)


def _padded(points: Floats) -> Floats:
    return convex_hull((points[:, None] + PADDED_MM * CORNERS).reshape(-1, 3))[0]
