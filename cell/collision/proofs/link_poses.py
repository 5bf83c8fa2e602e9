"""The arm's links and the shapes on them: where they are at many configurations, and what stands still around them.

    links = ArmLinks(checker)
    poses = links.poses(q)                      # q (m, n) rad -> frames of the joints and middles of the shapes
    links.shape(geom)                           # in the frame of its joint; of what stands still in the base frame

Base frame, metres, radians.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import mujoco
import numpy as np

from ik.chain import Floats

from ...arrays import Ints
from ..arm_poses import joint_of_shapes
from ..checker import Checker
from .convex_shapes import ConvexShape, convex_shape
from .laid_covers import covers_of

WORLD = -1
LAST_LINKS = 3  # by whose places samples are taken as alike: where these are, the others hardly differ


@dataclass(frozen=True, eq=False)
class LinkPoses:
    """Where the arm's links are at samples, base frame; samples last, so that what is worked out runs along memory.

    Attributes:
        axes: of the joints' frames: axis, component, joint and sample, (3, 3, n, m).
        place: of their origins, (3, n, m), m.
        centres: of balls that hold the arm's shapes, (b, 3, m), m.
    """

    axes: Floats
    place: Floats
    centres: Floats

    @property
    def R(self) -> Floats:
        """Rotations of the joints' frames, (m, n, 3, 3)."""
        return self.axes.transpose(3, 2, 1, 0)

    @property
    def p(self) -> Floats:
        """Their origins, (m, n, 3), m."""
        return self.place.transpose(2, 1, 0)

    def axes_of(self, joint: Ints, sample: Ints) -> Floats:
        """Axes of the frames of joints at samples, (k,) each: axis, component, and which, (3, 3, k)."""
        n, m = self.axes.shape[2:]
        return self.axes.reshape(9, n * m).take(joint * m + sample, axis=1).reshape(3, 3, -1)

    def places_of(self, joint: Ints, sample: Ints) -> Floats:
        """Origins of the frames of joints at samples, (3, k), m."""
        n, m = self.place.shape[1:]
        return self.place.reshape(3, n * m).take(joint * m + sample, axis=1)


def seen_from(axes: Floats, v: Floats) -> Floats:
    """Vectors (3, k) of the base frame as frames with these axes (3, 3, k) see them, (3, k)."""
    return np.einsum("cxk,xk->ck", axes, v)


def as_seen(axes: Floats, v: Floats) -> Floats:
    """Vectors (3, k) that frames with these axes (3, 3, k) see, in the base frame, (3, k)."""
    return np.einsum("cxk,ck->xk", axes, v)


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
        self.covers = covers_of(scene, checker.table, np.setdiff1d(laid, checker.ignored))
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
        axes, place = self.chain.frame_axes(q)
        centres = np.empty((len(self.joint), 3, len(q)))
        for j in np.unique(self.joint).tolist():
            mine = self.joint == j
            # one product for all samples: many small ones cost more than they compute
            turned = (self.centre[mine] @ axes[:, :, j].reshape(3, -1)).reshape(-1, 3, len(q))
            centres[mine] = turned + place[:, j]
        return LinkPoses(axes, place, centres)

    def places(self, poses: LinkPoses) -> Floats:
        """Coordinates that describe the arm's pose: of a shape far out on each of its last links, (m, 9), m."""
        return np.ascontiguousarray(poses.centres[self._outer].reshape(-1, poses.centres.shape[-1]).T)

    def travel(self, poses: LinkPoses, a: Ints, b: Ints) -> Floats:
        """Farthest that any point of the arm is displaced between samples a and samples b, (t,), m."""
        turned, moved = (_between(each, a, b) for each in (poses.axes, poses.centres))
        turned = turned.reshape(9, -1, len(a))
        # the chord of a turn, of what is 1 from its centre
        chord = np.sqrt(np.einsum("xjt,xjt->jt", turned, turned) / 2.0)
        return self._furthest(chord, moved)

    def off_middle(self, poses: LinkPoses, halfway: LinkPoses, step: Ints) -> Floats:
        """How far any point of the arm is at most, half-way, from the middle of its places at the ends of steps, m.

        Args:
            poses: at the samples.
            halfway: in the middles of the steps.
            step: the steps by their first samples, (k,).
        """
        skew, off = (
            half - (each.take(step, axis=-1) + each.take(step + 1, axis=-1)) / 2
            for half, each in ((halfway.axes, poses.axes), (halfway.centres, poses.centres))
        )
        skew = skew.reshape(9, -1, len(step))
        # of what is 1 from its centre
        turned = np.sqrt(np.einsum("xjt,xjt->jt", skew, skew))
        return self._furthest(turned, off)

    def _furthest(self, turned: Floats, moved: Floats) -> Floats:
        """How far any point is moved at most, (t,), m: links turn by (n, t), the balls' middles move by (b, 3, t)."""
        away = np.sqrt(np.einsum("gxt,gxt->gt", moved, moved))
        away += turned[self.joint] * self.size[:, None]
        out: Floats = away.max(axis=0)
        return out

    def shape(self, geom: int) -> ConvexShape:
        """A shape in the frame of its joint; of what stands still, and covers of it, in the base frame."""
        if geom >= self._scene.model.ngeom:
            return self.covers.shape(geom, self.shape)
        if self.owner[geom] >= 0:
            return self._shapes[geom]
        if geom not in self._still:
            base = self.T_world_base
            R = base[:3, :3].T @ self._data.geom_xmat[geom].reshape(3, 3)
            p = base[:3, :3].T @ (self._data.geom_xpos[geom] - base[:3, 3])
            self._still[geom] = convex_shape(self._scene.model, geom, R, p)
        return self._still[geom]

    def reach(self, geom: Ints, direction: Floats) -> Floats:
        """How far shapes reach in directions, each in its own frame, (k,) and (3, k) -> (k,), m."""
        if (geom[1:] < geom[:-1]).any():
            order, out = np.argsort(geom, kind="stable"), np.empty(len(geom))
            out[order] = self.reach(geom[order], direction[:, order])
            return out
        out = np.empty(len(geom))
        for a, b in pairwise(np.flatnonzero(np.diff(geom, prepend=-1, append=-1)).tolist()):
            out[a:b] = self.shape(int(geom[a])).support(direction[:, a:b])
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


def _between(x: Floats, a: Ints, b: Ints) -> Floats:
    """Differences of what is known at samples, which are last: at samples a less at samples b."""
    rows = x.reshape(-1, x.shape[-1])
    out = rows.take(a, axis=1)
    out -= rows.take(b, axis=1)
    return out.reshape(*x.shape[:-1], -1)
