"""Edges and triangles of a mesh among numbered levels, and the pieces of curve between their crossings.

    rows, levels, shift = row_level_pairs(net.edge_low, net.edge_high, 0, 10)
    # (edge, level) of all crossings of ten levels

Levels are numbered upwards; what a vertex lies outside of is given by one number, its rank (see
`slicing.curves.parallel_levels`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..mesh.solid import Bools, Floats, Ints

Ranks = npt.NDArray[np.int32]  # small: they are gathered by every edge


@dataclass(frozen=True, eq=False)
class CrossingNet:
    """The triangles that are examined, numbered by themselves, and where they lie among the levels.

    Attributes:
        cut_at: (l,) heights over base of the cuts as they are made, ascending.
        vertices: (v, 3) mm.
        height: (v,) over base.
        rank: (v,) levels that the vertex lies outside of: the first so many.
        faces: (f, 3) corners.
        number: (f,) of the triangles in the mesh.
        sides: (f, 3) edges.
        edges: (e, 2) vertices.
        edge_low: (e,) first level that the edge meets.
        single_low: (e,) first level that it crosses once; the ones between are crossed twice.
        edge_high: (e,) the level after its last.
        face_low: (f,) first level that the triangle's sides meet.
        face_high: (f,) the level after their last.
        dipped: (f,) triangles with a side that crosses some level twice.
    """

    cut_at: Floats
    vertices: Floats
    height: Floats
    rank: Ranks
    faces: Ints
    number: Ints
    sides: Ints
    edges: Ints
    edge_low: Ranks
    single_low: Ranks
    edge_high: Ranks
    face_low: Ranks
    face_high: Ranks
    dipped: Bools


@dataclass(frozen=True, eq=False)
class LevelPieces:
    """Pieces of curve, each in one triangle on one level.

    Attributes:
        start: (p,) node at which each starts: 2 * crossing + root; -1 where it is a whole loop.
        end: (p,) node at which it ends.
        row: (p,) its triangle among those of the net.
        level: (p,) its level.
    """

    start: Ints
    end: Ints
    row: Ints
    level: Ints


def row_level_pairs(first: Ints | Ranks, after: Ints | Ranks, low: int, high: int) -> tuple[Ints, Ints, Ints]:
    """Pairs (row, level) of the levels first .. after - 1 of every row, as far as they lie in low .. high - 1.

    Returns:
        The rows and the levels of the pairs, row after row, and (n,) what to add to a level of a row to get the
        number of its pair.
    """
    rows = np.flatnonzero((first < after) & (first < high) & (after > low))
    begin = np.maximum(first[rows], low).astype(np.int64)
    count = np.minimum(after[rows], high) - begin
    total = np.cumsum(count)
    shift = np.zeros(len(first), dtype=np.int64)
    shift[rows] = total - count - begin
    row = np.repeat(rows, count)
    return row, np.arange(len(row)) - shift[row], shift
