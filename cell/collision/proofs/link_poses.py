"""The arm's links and the shapes on them: where they are at many configurations, and what stands still around them.

    links = ArmLinks(checker)
    poses = links.poses(q)                      # q (m, n) rad -> frames of the joints and middles of the shapes
    links.shape(geom)                           # in the frame of its joint; of what stands still in the base frame

Base frame, metres, radians.
"""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from ik.chain import Floats

from ...arrays import Ints
from ..arm_poses import joint_of_shapes
from ..checker import Checker
from .convex_shapes import ConvexShape, convex_shape

WORLD = -1


@dataclass(frozen=True, eq=False)
class LinkPoses:
    """Where the arm's links are at samples, base frame.

    Attributes:
        R: of the joints' frames, (m, n, 3, 3).
        p: (m, n, 3), m.
        centres: of the arm's shapes, (m, g, 3), m.
    """

    R: Floats
    p: Floats
    centres: Floats


class ArmLinks:
    """The shapes of one checker's arm, and of what stands still at its table pose."""

    def __init__(self, checker: Checker) -> None:
        """Prepare.

        Args:
            checker: of an arm at a table that stands.
        """
        scene = self._scene = checker.scene
        self.chain = scene.chain
        solid = scene.arm_geom & scene.contact_bits.any(axis=0)
        self.T_world_base = scene.T_world_base()
        self.owner, self._shapes = self._arm_shapes(np.flatnonzero(solid))
        self.moving = np.flatnonzero(solid)
        self.centre = np.stack([self._shapes[g].middle for g in self.moving.tolist()])
        self.size = np.array([self._shapes[g].size for g in self.moving.tolist()])
        self.joint = self.owner[self.moving]
        # of each link the shape that reaches furthest
        order = np.lexsort((-np.linalg.norm(self.centre, axis=1) - self.size, self.joint))
        self._outer = order[np.unique(self.joint[order], return_index=True)[1]]
        self._still: dict[int, ConvexShape] = {}
        self._data = checker.posed()

    def poses(self, q: Floats) -> LinkPoses:
        """Where the links are at configurations (m, n), rad."""
        R, p = self.chain.frames(q)
        centres = np.empty((len(q), len(self.joint), 3))
        for j in np.unique(self.joint).tolist():
            mine = self.joint == j
            centres[:, mine] = self.centre[mine] @ np.swapaxes(R[:, j], -1, -2) + p[:, j, None]
        return LinkPoses(R, p, centres)

    def places(self, poses: LinkPoses) -> Floats:
        """Coordinates that tell where the arm is: of a shape far out on each link, (m, 3 links), m."""
        return poses.centres[:, self._outer].reshape(len(poses.p), -1)

    def travel(self, poses: LinkPoses, a: Ints, b: Ints) -> Floats:
        """How far any point of the arm is at most at samples a from where it is at samples b, (t,), m."""
        # the chord of a turn, of what is 1 from its centre
        chord = np.sqrt(((poses.R[a] - poses.R[b]) ** 2).sum(axis=(2, 3)) / 2.0)
        away = np.sqrt(((poses.centres[a] - poses.centres[b]) ** 2).sum(axis=2))
        out: Floats = (away + chord[:, self.joint] * self.size).max(axis=1)
        return out

    def shape(self, geom: int) -> ConvexShape:
        """A shape in the frame of its joint; of what stands still in the base frame."""
        if self.owner[geom] >= 0:
            return self._shapes[geom]
        if geom not in self._still:
            base = self.T_world_base
            R = base[:3, :3].T @ self._data.geom_xmat[geom].reshape(3, 3)
            p = base[:3, :3].T @ (self._data.geom_xpos[geom] - base[:3, 3])
            self._still[geom] = convex_shape(self._scene.model, geom, R, p)
        return self._still[geom]

    def reach(self, geom: Ints, direction: Floats) -> Floats:
        """How far shapes reach in directions, each in its own frame, (k,) and (k, 3) -> (k,), m."""
        out, order = np.empty(len(geom)), np.argsort(geom, kind="stable")
        each, begins = np.unique(geom[order], return_index=True)
        for g, a, b in zip(each.tolist(), begins.tolist(), [*begins.tolist(), len(geom)][1:], strict=True):
            mine = order[a:b]
            out[mine] = self.shape(g).support(direction[mine])
        return out

    def _arm_shapes(self, geoms: Ints) -> tuple[Ints, dict[int, ConvexShape]]:
        """Joint that carries each geom, (ngeom,), or WORLD, and the arm's shapes in the frames of their joints."""
        scene, model, base = self._scene, self._scene.model, self.T_world_base
        data = mujoco.MjData(model)
        mujoco.mj_kinematics(model, data)
        R, p = (x[0] for x in scene.chain.frames(data.qpos[scene.arm_qpos][None]))
        owner, shapes = np.full(model.ngeom, WORLD), {}
        owner[geoms] = joint_of_shapes(scene, geoms)
        for g in geoms.tolist():
            i = int(owner[g])
            turn = (base[:3, :3] @ R[i]).T
            place = R[i].T @ (base[:3, :3].T @ (data.geom_xpos[g] - base[:3, 3]) - p[i])
            shapes[g] = convex_shape(model, g, turn @ data.geom_xmat[g].reshape(3, 3), place)
        return owner, shapes
