"""Convex shapes that contain all that is laid of a sub-volume: one plane then serves for hundreds of pieces.

    covers = LaidCovers(scene, geoms)       # geoms: ids of the deposits that collide
    ids = covers.ids(deposits_laid)         # of the covers of what is laid by then, one for each sub-volume
    covers.shape(ids[0], shape_of)          # base frame, where shape_of(geom) gives a deposit's shape there

A growing part lies below the torch nearly everywhere: a plane that separates the torch from the hull of all pieces
separates it from each. Where the torch reaches into a hollow of the part there is no such plane, and the pieces are
taken one by one.

Finding the few corners that contain all other points takes as long as thousands of directions, and a layer is queried
in a few hundred. So a layer's points are kept as they are until there are many. These are a *block* of layers, and are
reduced to few corners once. Four blocks make a block of the next kind, and so on, each reduced from the corners of the
four. What is laid by a layer is a few blocks, at most three of each kind, and the points after the last of them. The
covers depend on the part alone: a process that handles late layers only makes the same covers as one that handles all
layers, and of the early layers it makes the blocks only. Metres.
"""

from __future__ import annotations

import weakref
from bisect import bisect_right
from collections.abc import Callable
from dataclasses import dataclass

import mujoco
import numpy as np

from ...arrays import Ints
from ...scene.scene import Scene
from .convex_shapes import ConvexShape
from .few_corners import Z, shape_of_few_corners

ENOUGH = 1e-3  # share by which the hull of a block of layers may be larger
ENOUGH_OF_BLOCKS = 2.5e-4  # and that of a block of blocks, which is larger by what these are as well
TOGETHER = 4  # blocks that make one of the next kind
MOST_LATER = 1500  # points after the last block that are held as they are: to make a block of them costs far more
MOST_HELD = 3000  # corners of blocks that are held as they are, before they are reduced together


class LaidCovers:
    """The covers of one scene's deposits. They do not refer to the scene, so that they are freed with its model."""

    def __init__(self, scene: Scene, geoms: Ints) -> None:
        """Nothing is made yet.

        Args:
            scene: the composed cell.
            geoms: deposits that count, (k,).
        """
        self._first, self._stages = scene.model.ngeom, scene.n_deposits + 1
        names = np.array([scene.model.geom(g).name.split("/")[2] for g in geoms.tolist()])
        number = scene.deposit_of_geom[geoms]
        of_each = [(geoms[names == name], number[names == name]) for name in dict.fromkeys(names.tolist())]
        self._begin(of_each)

    def _begin(self, of_each: list[tuple[Ints, Ints]]) -> None:
        """Of each sub-volume the shapes of its deposits and the numbers of these, (m,) each."""
        self._laid = [[mine[at == n] for n in range(self._stages)] for mine, at in of_each]
        self._begins = [int(at.min()) for _, at in of_each]
        self._counted = [_Counted([], begins, 0) for begins in self._begins]
        self._blocks: dict[tuple[int, int, int], ConvexShape] = {}
        self._held: dict[tuple[int, int], ConvexShape] = {}
        self._made: dict[int, ConvexShape] = {}

    @property
    def stop(self) -> int:
        """One past the last id; the first is the number of the scene's geoms."""
        return self._first + self._stages * len(self._laid)

    def ids(self, deposits_laid: int) -> list[int]:
        """Of the covers of what is laid by then, one for each sub-volume that has been begun."""
        return [
            self._first + k * self._stages + deposits_laid
            for k, begun in enumerate(self._begins)
            if begun < deposits_laid
        ]

    def shape(self, cover: int, shape_of: Callable[[int], ConvexShape]) -> ConvexShape:
        """The cover with an id.

        Args:
            cover: its id.
            shape_of: the shapes of deposits, always in the same frame.
        """
        if cover not in self._made:
            k, deposits_laid = divmod(cover - self._first, self._stages)
            self._made[cover] = self._cover(k, deposits_laid, shape_of)
        return self._made[cover]

    def _cover(self, k: int, deposits_laid: int, shape_of: Callable[[int], ConvexShape]) -> ConvexShape:
        """Of a sub-volume's blocks that are laid by then, and of the points after the last of them."""
        ends = self._ends(k, deposits_laid, shape_of)
        blocks = [self._first_blocks(k, len(ends), shape_of)] if ends else []
        later = self._layers(k, ends[-1] if ends else self._begins[k], deposits_laid, shape_of)
        return _together(blocks + later)

    def _first_blocks(self, k: int, count: int, shape_of: Callable[[int], ConvexShape]) -> ConvexShape:
        """So many blocks of layers of a sub-volume, from its beginning on."""
        if (k, count) not in self._held:
            held, at = [], 0
            for size in _sizes(count):
                held.append(self._block(k, at, size, shape_of))
                at += size
            many = sum(len(block.points) for block in held) > MOST_HELD
            self._held[k, count] = _reduced(held, ENOUGH_OF_BLOCKS) if many else _together(held)
        return self._held[k, count]

    def _block(self, k: int, at: int, size: int, shape_of: Callable[[int], ConvexShape]) -> ConvexShape:
        """So many blocks of layers of a sub-volume as one, from the one with a number on."""
        if (k, at, size) not in self._blocks:
            if size == 1:
                ends = self._counted[k].ends
                layers = self._layers(k, ends[at - 1] if at else self._begins[k], ends[at], shape_of)
                self._blocks[k, at, size] = _reduced(layers, ENOUGH)
            else:
                part = size // TOGETHER
                parts = [self._block(k, at + n * part, part, shape_of) for n in range(TOGETHER)]
                self._blocks[k, at, size] = _reduced(parts, ENOUGH_OF_BLOCKS)
        return self._blocks[k, at, size]

    def _ends(self, k: int, deposits_laid: int, shape_of: Callable[[int], ConvexShape]) -> list[int]:
        """Where blocks of layers of a sub-volume end that are laid by then: each as soon as it has enough points."""
        known = self._counted[k]
        while known.layers < deposits_laid:
            known.points += sum(len(shape_of(g).points) for g in self._laid[k][known.layers].tolist())
            known.layers += 1
            if known.points > MOST_LATER:
                known.ends.append(known.layers)
                known.points = 0
        return known.ends[: bisect_right(known.ends, deposits_laid)]

    def _layers(self, k: int, first: int, stop: int, shape_of: Callable[[int], ConvexShape]) -> list[ConvexShape]:
        """All pieces of some layers of a sub-volume."""
        pieces = [shape_of(g) for layer in self._laid[k][first:stop] for g in layer.tolist()]
        if any(piece.ball or piece.disc or piece.endless for piece in pieces):
            raise ValueError("a deposit that is more than the hull of its points")
        return pieces


_made: weakref.WeakKeyDictionary[mujoco.MjModel, dict[tuple[object, ...], LaidCovers]]
_made = weakref.WeakKeyDictionary()


def covers_of(scene: Scene, table: tuple[float, float], geoms: Ints) -> LaidCovers:
    """The covers of deposits of a scene at one table pose, made once; as of :class:`LaidCovers`.

    Scenes of one model may number its deposits otherwise, as where one sub-volume is looked at without the others.
    """
    known = _made.setdefault(scene.model, {})
    ids = np.asarray(geoms, dtype=np.int64)
    key = table, scene.n_deposits, ids.tobytes(), scene.deposit_of_geom[ids].tobytes()
    if key not in known:
        known[key] = LaidCovers(scene, geoms)
    return known[key]


@dataclass
class _Counted:
    """Layers whose points have been counted.

    Attributes:
        ends: where blocks end: one past the last layer of each.
        layers: layers up to here have been counted.
        points: of the layers after the last block.
    """

    ends: list[int]
    layers: int
    points: int


def _sizes(blocks: int) -> list[int]:
    """Of how many blocks of layers those consist that these are held as: the largest first, which begin the part."""
    sizes, size = [], 1
    while blocks:
        sizes += [size] * (blocks % TOGETHER)
        blocks, size = blocks // TOGETHER, size * TOGETHER
    return sizes[::-1]


def _reduced(shapes: list[ConvexShape], enough: float) -> ConvexShape:
    """A shape of few corners that holds shapes, larger by a share at most."""
    every = _together(shapes)
    few = shape_of_few_corners(every.points, enough)
    return ConvexShape(few.points, few.ball + every.ball, Z, 0.0)


def _together(shapes: list[ConvexShape]) -> ConvexShape:
    """The hull of shapes that are hulls of points, thickened by balls."""
    if len(shapes) == 1:
        return shapes[0]
    points = np.concatenate([shape.points for shape in shapes])
    return ConvexShape(points, max(shape.ball for shape in shapes), Z, 0.0)
