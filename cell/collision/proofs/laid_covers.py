"""Convex shapes that hold all that is laid of a sub-volume: one plane serves for hundreds of pieces.

    covers = LaidCovers(scene, geoms)       # geoms: ids of the deposits that collide
    ids = covers.ids(deposits_laid)         # of the covers of what is laid by then, one for each sub-volume
    covers.shape(ids[0], shape_of)          # base frame, where shape_of(geom) gives a deposit's shape there

A part that grows is below the torch nearly everywhere: a plane that keeps the torch apart from the hull of all its
pieces keeps it apart from each. Where the torch dips into a hollow of the part no such plane is found, and the pieces
are taken one by one. To find the few corners that hold all others takes as long as thousands of directions, and a layer
is asked about in some hundred: so a layer's points are held as they are until there are many. Metres.
"""

from __future__ import annotations

import weakref
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import mujoco
import numpy as np

from ik.chain import Floats
from slicing import convex_hull

from ...arrays import Ints
from ...scene.scene import Scene
from .convex_shapes import ConvexShape

DIRECTIONS = 300  # in which points are looked for that reach furthest
ROUNDS = 4  # times that points beyond the hull of these are taken as well
ENOUGH, MOST_GROWN = 1e-3, 0.01  # share by which a cover may be larger; and more than which it is of no use
SAME, ROUNDING = 1e-9, 1e-6  # share by which points may be beyond a hull that holds them; and a cover thicker for that
LEAST_DEEP = 1e-9  # m from a hull's middle to its faces
TOGETHER = 500  # points that are weighed at once: their products with all faces stay in the cache
MOST_LATER = 1500  # points that are held beside a cover as they are, before one of all is made: that costs far more
Z = np.array([0.0, 0.0, 1.0])
NO_POINTS = np.zeros((0, 3))


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
        self._laid = [[mine[at == n] for n in range(self._stages)] for mine, at in of_each]
        self._begins = [int(at.min()) for _, at in of_each]
        self._made: dict[int, Cover] = {}

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
        return self._cover(cover, shape_of).shape

    def _cover(self, cover: int, shape_of: Callable[[int], ConvexShape]) -> Cover:
        k, deposits_laid = divmod(cover - self._first, self._stages)
        known = deposits_laid
        while known - 1 > self._begins[k] and cover - deposits_laid + known not in self._made:
            known -= 1
        for number in range(known, deposits_laid + 1):  # one layer after the other: each adds to the cover before it
            at = cover - deposits_laid + number
            if at not in self._made:
                before = self._made.get(at - 1) if number - 1 > self._begins[k] else None
                self._made[at] = _next([shape_of(g) for g in self._laid[k][number - 1].tolist()], before)
        return self._made[cover]


_made: weakref.WeakKeyDictionary[mujoco.MjModel, dict[tuple[tuple[float, float], bytes], LaidCovers]]
_made = weakref.WeakKeyDictionary()


def covers_of(scene: Scene, table: tuple[float, float], geoms: Ints) -> LaidCovers:
    """The covers of deposits of a scene at one table pose, made once; as of :class:`LaidCovers`."""
    known = _made.setdefault(scene.model, {})
    key = table, np.asarray(geoms, dtype=np.int64).tobytes()
    if key not in known:
        known[key] = LaidCovers(scene, geoms)
    return known[key]


@dataclass(frozen=True, eq=False)
class Cover:
    """A convex shape of few corners that holds many points, and those that came later as they are.

    Attributes:
        hull: holds the many.
        points: of the many those that are on their hull or near it, (k, 3), m: the hull of these holds all others.
        later: points that came later, (l, 3), m.
    """

    hull: ConvexShape
    points: Floats
    later: Floats

    @cached_property
    def shape(self) -> ConvexShape:
        """What holds all of them."""
        if not len(self.later):
            return self.hull
        return ConvexShape(np.concatenate([self.hull.points, self.later]), self.hull.ball, Z, 0.0)

    def with_points(self, points: Floats) -> Cover:
        """The cover of other points too, (m, 3), m."""
        later = np.concatenate([self.later, points])
        if len(later) <= MOST_LATER:
            return Cover(self.hull, self.points, later)
        return Cover.of(np.concatenate([self.points, later]))

    @classmethod
    def of(cls, points: Floats) -> Cover:
        """The hull of those of some points, (k, 3), that reach furthest, grown until none is beyond a face."""
        mine, grown = _furthest(points - points.mean(axis=0)), np.inf
        middle = points[mine].mean(axis=0)  # within the hull
        off = points - middle
        for _ in range(ROUNDS):
            corners, normals = convex_hull(off[mine])
            if len(normals) < 4:
                break
            normals /= np.maximum((corners @ normals.T).max(axis=0), LEAST_DEEP)[:, None]
            along, furthest, beyond = _along(off, normals)
            grown = max(float(along.max()), 1.0)
            if grown - 1.0 <= ENOUGH:
                break
            mine = np.union1d(mine, furthest[along > 1.0 + ENOUGH])
        if grown > 1.0 + MOST_GROWN:  # flat, or nearly so: all of them
            return cls(ConvexShape(points, 0.0, Z, 0.0), points, NO_POINTS)
        beyond[mine] = np.inf
        thicker = ROUNDING * float(np.linalg.norm(off, axis=1).max())
        return cls(ConvexShape(middle + grown * corners, thicker, Z, 0.0), points[beyond > 1.0 + SAME], NO_POINTS)


def _furthest(off: Floats) -> Ints:
    """Points that reach furthest in directions spread evenly where the points are as wide every way, ascending."""
    spread, turn = np.linalg.eigh(np.cov(off.T))
    even = turn / np.sqrt(np.maximum(spread, 1e-12))
    k = np.arange(DIRECTIONS)
    z, about = 1 - (2 * k + 1) / DIRECTIONS, k * np.pi * (3 - np.sqrt(5))
    flat = np.sqrt(1 - z**2)
    return np.unique(_along(off @ even, np.stack([np.cos(about) * flat, np.sin(about) * flat, z], axis=1))[1])


def _along(points: Floats, directions: Floats) -> tuple[Floats, Ints, Floats]:
    """How far points reach in directions, (d,); which of them does, (d,); and how far each does at most, (k,)."""
    far, which = np.full(len(directions), -np.inf), np.zeros(len(directions), dtype=np.int64)
    most = np.empty(len(points))
    for first in range(0, len(points), TOGETHER):
        product = directions @ points[first : first + TOGETHER].T
        at = product.argmax(axis=1)
        most[first : first + TOGETHER] = product.max(axis=0)
        there = product[np.arange(len(at)), at]
        further = there > far
        far[further], which[further] = there[further], first + at[further]
    return far, which, most


def _next(pieces: list[ConvexShape], before: Cover | None) -> Cover:
    """The cover of a deposit's pieces and of what was laid of the same sub-volume before."""
    if any(piece.ball or piece.disc or piece.endless for piece in pieces):
        raise ValueError("a deposit that is more than the hull of its points")
    if before is not None and not pieces:
        return before
    points = np.concatenate([piece.points for piece in pieces])
    return Cover.of(points) if before is None else before.with_points(points)
