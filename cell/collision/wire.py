"""The wire on travels: it may touch the part at the beads, and collides like any rod in between.

    checker = wire_checker(setup.checker)            # None where the tool has no wire
    c = checker.clearances(q, deposits_laid)                 # of the wire from the part, out to 20 mm

Drawn back along its own axis, a wire leaves the part as it came. On the way across it may touch the part where the
torch does not. Far from the part, as on most of the path from home, nothing has to be checked. Metres and radians.
"""

from __future__ import annotations

import weakref
from collections.abc import Callable, Collection
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ik.chain import Floats

from ..arrays import Ints
from ..scene.composition import BodyOwner
from ..scene.contacts import SOLID
from ..scene.scene import Scene
from .arm_poses import joint_of_shapes
from .checker import NEVER, Checker
from .clearances import Clearances

SLACK = 1e-6  # m, of rounding
_made: weakref.WeakKeyDictionary[Checker, Checker | None] = weakref.WeakKeyDictionary()
WIRE_REACH = 20e-3  # m: nothing is asked for but not to touch, yet far samples and corners are proved free sooner


def wire_checker(checker: Checker) -> Checker | None:
    """Collision detection of the wire and the part alone.

    Args:
        checker: of the whole cell, at the same table pose and without the same deposits.

    Returns:
        The same for the wire, made once; None where the tool's wire is not modelled.
    """
    if checker not in _made:
        _made[checker] = _made_of(checker)
    return _made[checker]


def _made_of(checker: Checker) -> Checker | None:
    scene = wire_scene(checker.scene)
    if scene is None:
        return None
    # where the model names pairs, it takes data in which they are never met
    beside = None if scene.model.npair else checker
    return _WireChecker(scene, checker.table, checker.without, beside)


class _WireChecker(Checker):
    """Collision detection of a wire and a part; configurations far from the whole part are not queried."""

    def __init__(
        self, scene: Scene, table: tuple[float, float], without: Collection[int], beside: Checker | None = None
    ) -> None:
        """Prepare.

        Args:
            scene: from :func:`wire_scene`.
            table: E1 and E2, rad.
            without: deposits that do not count.
            beside: as of :class:`cell.collision.checker.Checker`.
        """
        super().__init__(scene, table, WIRE_REACH, without, pair_gap=NEVER, beside=beside)
        model, data = scene.model, self._data
        base = self._T_world_base = scene.T_world_base()
        wire, part = (np.flatnonzero(bits) for bits in scene.contact_bits)
        # the balls round the wire's shapes, in the frames of their joints
        R, p = (x[0] for x in scene.chain.frames(data.qpos[scene.arm_qpos[: scene.chain.n]][None]))
        self._joint, self._size = joint_of_shapes(scene, wire), model.geom_rbound[wire]
        at = (data.geom_xpos[wire] - base[:3, 3]) @ base[:3, :3]
        self._centre = np.einsum("wij,wi->wj", R[self._joint], at - p[self._joint])
        # the box round all of the part, in the world
        turn, box = np.abs(data.geom_xmat[part].reshape(-1, 3, 3)), model.geom_aabb[part]
        middle = data.geom_xpos[part] + np.einsum("gij,gj->gi", data.geom_xmat[part].reshape(-1, 3, 3), box[:, :3])
        half = np.einsum("gij,gj->gi", turn, box[:, 3:])
        self._low = (middle - half).min(axis=0, initial=np.inf)
        self._high = (middle + half).max(axis=0, initial=-np.inf)

    def __reduce__(self) -> tuple[Any, ...]:
        """For another process: made anew of the scene."""
        return _WireChecker, (self.scene, self.table, self.without)

    def clearances(
        self, q: Floats, deposits_laid: Ints, met: Callable[[int, Ints, Floats], None] | None = None
    ) -> Clearances:
        """As of the checker of everything."""
        near = np.arange(len(q)) if met is not None else np.flatnonzero(self._may_be_near(q))
        if len(near) == len(q):
            return super().clearances(q, deposits_laid, met)
        out = Clearances.none(len(q))
        out.put(near, super().clearances(q[near], deposits_laid[near]))
        return out

    def _may_be_near(self, q: Floats) -> NDArray[np.bool_]:
        """Whether something of the part may be within reach, for each configuration, (m,)."""
        chain, base = self.scene.chain, self._T_world_base
        if len(self.scene.arm_qpos) != chain.n:  # the part turns with the table
            return np.ones(len(q), dtype=bool)
        R, p = chain.frames(q)
        at = p[:, self._joint] + np.einsum("mwij,wj->mwi", R[:, self._joint], self._centre)
        at = at @ base[:3, :3].T + base[:3, 3]
        away = np.linalg.norm(np.maximum(np.maximum(self._low - at, at - self._high), 0.0), axis=2)
        return np.asarray((away <= self._size + self.reach + SLACK).any(axis=1))


def wire_and_part(scene: Scene) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Which geoms are the wire, and which are what it may touch where it is welded: part and support, (ngeom,) each."""
    solid = scene.contact_bits.any(axis=0)
    return scene.wire_geom & solid, np.isin(scene.piece_of_geom, (BodyOwner.SUPPORT, BodyOwner.PART)) & solid


def wire_scene(scene: Scene) -> Scene | None:
    """A scene in which nothing is solid but the wire and the part; None where there is no wire."""
    model, (wire, part) = scene.model, wire_and_part(scene)
    if not wire.any():
        return None
    bits = np.stack([np.where(wire, SOLID, 0), np.where(part, SOLID, 0)]).astype(scene.contact_bits.dtype)
    bodies = scene.body_contype.copy()
    bodies[model.geom_bodyid[wire]] |= SOLID
    return replace(scene, contact_bits=bits, body_contype=bodies)
