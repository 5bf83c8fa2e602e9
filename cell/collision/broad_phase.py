"""Which bodies of a large part are near enough to the arm to be checked.

    near = BroadPhase.of(scene, data)              # None for a part of one body
    for room in near.rooms(q): ...             # q (m, n) rad: how far each body is from the arm at least, (b,) m
    near.select(model.body_conaffinity, room, reach)  # before mj_collision: leaves out what is too far off

MuJoCo visits every geom of each body that may collide. For a part of thousands of layers this costs more than the
collisions themselves. Bounding spheres overlap wherever two geoms are within reach of each other, so no pair within
reach is left out. Metres.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import mujoco
import numpy as np
from numpy.typing import NDArray

from ik.chain import Floats

from ..arrays import Ints
from .arm_poses import CHUNK, ArmPoses

if TYPE_CHECKING:
    from ..scene.scene import Scene

SLACK = 1e-6  # m, of rounding


@dataclass(frozen=True, eq=False)
class BroadPhase:
    """Bodies of the part's pieces, at one table pose.

    Attributes:
        bodies: ids, (b,).
        conaffinity: their own, (b,).
        centre: of each body's pieces, (b, 3), world frame.
        geoms: of the arm, those that may collide, (g,).
        radius: of a sphere round a geom and one round a body's pieces, added up, (g, b), m.
        poses: kinematics of the arm.
    """

    bodies: Ints
    conaffinity: NDArray[np.int32]
    centre: Floats
    geoms: Ints
    radius: Floats
    poses: ArmPoses

    @classmethod
    def of(cls, scene: Scene, data: mujoco.MjData, poses: ArmPoses | None = None) -> BroadPhase | None:
        """Prepare.

        Args:
            scene: the composed cell, with the arm's own joints alone.
            data: its table's pose, after mj_kinematics.
            poses: kinematics of the arm, where there is one already.
        """
        model = scene.model
        bodies = [b for b in range(model.nbody) if model.body(b).name.startswith("pieces_")]
        if not bodies:
            return None
        centre, radius = np.empty((len(bodies), 3)), np.empty(len(bodies))
        for i, body in enumerate(bodies):
            place, bound = (x[model.geom_bodyid == body] for x in (data.geom_xpos, model.geom_rbound))
            centre[i] = (place.min(axis=0) + place.max(axis=0)) / 2
            radius[i] = float((np.linalg.norm(place - centre[i], axis=1) + bound).max())
        geoms = np.flatnonzero(scene.arm_geom & scene.contact_bits.any(axis=0))
        both = model.geom_rbound[geoms][:, None] + radius + SLACK
        own = scene.body_conaffinity[bodies]
        return cls(np.array(bodies), own, centre, geoms, both, poses or ArmPoses(scene))

    def rooms(self, q: Floats) -> Iterator[Floats]:
        """Lower bounds of the distances of bodies from the colliding shapes of the arm.

        Args:
            q: configurations, (m, n), rad.

        Yields:
            For each configuration (b,), m.
        """
        for first in range(0, len(q), CHUNK):
            place = self.poses.places(self.geoms, q[first : first + CHUNK]).reshape(-1, 3)
            square = np.einsum("gi,gi->g", place, place)[:, None] - 2.0 * place @ self.centre.T
            square += np.einsum("bi,bi->b", self.centre, self.centre)
            away = np.sqrt(np.maximum(square, 0.0)).reshape(-1, *self.radius.shape)
            yield from (away - self.radius).min(axis=1)

    def select(self, conaffinity: NDArray[np.int32], room: Floats, reach: float) -> None:
        """Let only those bodies collide that the arm may be within reach of.

        Args:
            conaffinity: of all bodies of a model, in which it is set, (nbody,).
            room: from :meth:`rooms`, (b,), m.
            reach: how far is looked, m.
        """
        conaffinity[self.bodies] = np.where(room <= reach, self.conaffinity, 0)
