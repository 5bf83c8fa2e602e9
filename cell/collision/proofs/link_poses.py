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
from .laid_covers import covers_of

WORLD = -1
LAST_LINKS = 3  # by whose places it is told which samples are alike: where these are, the others hardly differ


@dataclass(frozen=True, eq=False)
class LinkPoses:
    """Where the arm's links are at samples, base frame.

    Attributes:
        R: of the joints' frames, (m, n, 3, 3).
        p: (m, n, 3), m.
        centres: of balls that hold the arm's shapes, (m, b, 3), m.
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
        self.centre, self.size, self.joint = self._balls()
        # of each of the last links the ball that reaches furthest
        order = np.lexsort((-np.linalg.norm(self.centre, axis=1) - self.size, self.joint))
        self._outer = order[np.unique(self.joint[order], return_index=True)[1]][-LAST_LINKS:]
        self._still: dict[int, ConvexShape] = {}
        self._data = checker.posed()
        laid = np.flatnonzero((scene.deposit_of_geom >= 0) & scene.contact_bits.any(axis=0))
        self.covers = covers_of(scene, checker.table, np.setdiff1d(laid, checker.ignored), self.shape)
        bits = np.bitwise_or.reduce(scene.contact_bits[:, laid], axis=1)
        one, other = scene.contact_bits[:, self.moving] & bits[::-1, None]
        self.meets_laid = self.moving[(one | other) != 0]  # the wire may touch what is laid
        self.owner = np.append(self.owner, np.full(self.covers.stop - len(self.owner), WORLD))

    def _balls(self) -> tuple[Floats, Floats, Ints]:
        """Balls that hold the arm's shapes, (b, 3), (b,) m, and the joints that carry them: one round each link's.

        Of what the last joint carries, which moves furthest, each shape has its own.
        """
        moving = self.moving.tolist()
        centre = np.stack([self._shapes[g].middle for g in moving])
        size, joint = np.array([self._shapes[g].size for g in moving]), self.owner[self.moving]
        own = np.flatnonzero(joint == joint.max())
        balls = [(centre[k], size[k], joint[k]) for k in own.tolist()]
        for j in np.unique(joint).tolist()[:-1]:
            mine = joint == j
            low, high = (centre[mine] - size[mine, None]).min(axis=0), (centre[mine] + size[mine, None]).max(axis=0)
            middle = (low + high) / 2
            balls.append((middle, (np.linalg.norm(centre[mine] - middle, axis=1) + size[mine]).max(), j))
        at, radius, carried = zip(*sorted(balls, key=lambda ball: ball[2]), strict=True)
        return np.array(at), np.array(radius), np.array(carried)

    def poses(self, q: Floats) -> LinkPoses:
        """Where the links are at configurations (m, n), rad."""
        R, p = self.chain.frames(q)
        centres = np.empty((len(q), len(self.joint), 3))
        for j in np.unique(self.joint).tolist():
            mine = self.joint == j
            # one product for all samples: many small ones cost more than they compute
            turned = (R[:, j].reshape(-1, 3) @ self.centre[mine].T).reshape(len(q), 3, -1)
            centres[:, mine] = np.swapaxes(turned, 1, 2) + p[:, j, None]
        return LinkPoses(R, p, centres)

    def places(self, poses: LinkPoses) -> Floats:
        """Coordinates that tell where the arm is: of a shape far out on each of its last links, (m, 9), m."""
        return poses.centres[:, self._outer].reshape(len(poses.p), -1)

    def travel(self, poses: LinkPoses, a: Ints, b: Ints) -> Floats:
        """How far any point of the arm is at most at samples a from where it is at samples b, (t,), m."""
        # the chord of a turn, of what is 1 from its centre
        turned, moved = (poses.R[a] - poses.R[b]).reshape(len(a), -1, 9), poses.centres[a] - poses.centres[b]
        chord = np.sqrt(np.einsum("tji,tji->tj", turned, turned) / 2.0)
        away = np.sqrt(np.einsum("tgi,tgi->tg", moved, moved))
        out: Floats = (away + chord[:, self.joint] * self.size).max(axis=1)
        return out

    def shape(self, geom: int) -> ConvexShape:
        """A shape in the frame of its joint; of what stands still, and covers of it, in the base frame."""
        if geom >= self._scene.model.ngeom:
            return self.covers.shape(geom)
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
