"""How far any point of the arm travels on a step: a bound from both ends of the step.

    swept = MotionBounds(scene, radius)
    swept.bound(a, b)             # (m,) m: of the arm's points against anything, the arm itself among it
    CoupledBounds(scene, radius).bound(a, b)      # the same where E1 and E2 turn as well, behind the arm's joints

The sum of the arcs that each joint can move its farthest point by overestimates the travel many times where the joints
compensate each other, as along a bead, where the torch moves slowly while the wrist turns. Where both ends of a step
are known, a point x is off the straight line between its places there by t (1 - t) / 2 of the greatest |x''| at most,
and that is less than the sum over all pairs of joints i, k of |dq_i| |dq_k| times the radius about the outer one.
Metres, radians.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import mujoco
import numpy as np

from ik.chain import Floats

from ...scene.table_kinematics import TableKinematics
from ..arm_poses import joint_of_shapes

if TYPE_CHECKING:
    from ...scene.scene import Scene


def joint_travel_bound(radius: Floats, a: Floats, b: Floats) -> Floats:
    """The sum over the joints of the arc that the farthest point can describe about each, (m,), m."""
    way: Floats = (np.abs(b - a) * radius).sum(axis=1)
    return way


class MotionBounds:
    """Bounds for one scene's arm."""

    def __init__(self, scene: Scene, radius: Floats) -> None:
        """Prepare.

        Args:
            scene: the composed cell.
            radius: from ``cell.collision.proofs.reach_radii.radii``, (n,), m.
        """
        model, chain = scene.model, scene.chain
        data = mujoco.MjData(model)
        mujoco.mj_kinematics(model, data)
        self.chain, self.radius = chain, radius
        R, p = chain.frames(data.qpos[scene.arm_qpos][None])
        base = scene.T_world_base()
        geoms = np.flatnonzero(scene.arm_geom & scene.contact_bits.any(axis=0))
        self._joint, centre = joint_of_shapes(scene, geoms), []
        for g, i in zip(geoms.tolist(), self._joint.tolist(), strict=True):
            at = base[:3, :3].T @ (data.geom_xpos[g] - base[:3, 3])
            centre.append(R[0, i].T @ (at - p[0, i]))
        self._centre, self._size = np.array(centre).reshape(-1, 3), model.geom_rbound[geoms].copy()

    def bound(self, a: Floats, b: Floats, parts: int = 2) -> Floats:
        """The most by which two things can get nearer to one another on the way, both ends' shares added up.

        Args:
            a: where each step begins, (m, n), rad.
            b: where it ends, (m, n), rad.
            parts: how many of the two are parts of the arm, 1 or 2: the other stands still.

        Returns:
            (m,), m: if the clearances at a step's ends add up to more, nothing touches on it.
        """
        joints = joint_travel_bound(self.radius, a, b)
        if not len(a):
            return joints
        straight = self.straight(self.chain.frames(a), self.chain.frames(b))
        # of a point that is off its chord by an eighth of the curvature at most, the ways from both ends add up to
        # this; two parts of the arm may both move, one towards the other
        return np.minimum(joints, parts * (straight + curvature(self.radius, np.abs(b - a)) / 4))

    def bend(self, turn: Floats, parts: int = 2) -> Floats:
        """Greatest second derivative of the relative motion of two things on steps of turns (m, n), rad: (m,), m."""
        return parts * curvature(self.radius, turn)

    def straight(self, before: tuple[Floats, Floats], after: tuple[Floats, Floats]) -> Floats:
        """How far any point of the arm is after steps from where it was before them.

        Args:
            before: rotations (m, n, 3, 3) and origins (m, n, 3) of the joints' frames.
            after: likewise.

        Returns:
            (m,), m: at most that.
        """
        dR, dp = after[0] - before[0], after[1] - before[1]
        # the chord of a turn, of what is 1 from its centre
        chord = np.sqrt(np.einsum("mjab,mjab->mj", dR, dR) / 2.0)
        moved = dp[:, self._joint] + np.einsum("mgab,gb->mga", dR[:, self._joint], self._centre)
        away = np.sqrt(np.einsum("mga,mga->mg", moved, moved))
        most: Floats = (away + chord[:, self._joint] * self._size).max(axis=1, initial=0.0)
        return most


def curvature(radius: Floats, turn: Floats) -> Floats:
    """Greatest second derivative along steps of any point that a chain of axes carries, (m,), m.

    Args:
        radius: of what each axis carries, the outermost axis first, (n,), m.
        turn: of each axis on each step, (m, n), rad.
    """
    return np.asarray((turn * radius * (2 * np.cumsum(turn, axis=1) - turn)).sum(axis=1))


# of the third derivative: what is off the parabola through a step's ends and middle is |t (t - 1/2) (t - 1)| / 6 of it
OFF_PARABOLA = 1 / (72 * np.sqrt(3.0))


def change_of_curvature(radius: Floats, turn: Floats) -> Floats:
    """Greatest third derivative along steps, as :func:`curvature`, (m,), m: a third turn about the same axes."""
    outer = np.cumsum(turn, axis=1)
    return np.asarray((radius * (outer**3 - (outer - turn) ** 3)).sum(axis=1))


class CoupledBounds:
    """Bounds for one scene's arm and table, with the table's axes behind the arm's joints.

    Against the cell and itself the arm moves as usual; against what is on the table it moves as seen from there, which
    along a bead is little, however far the table turns. Seen from the table the arm is a chain with two more axes.
    """

    def __init__(self, scene: Scene, radius: Floats) -> None:
        """Prepare.

        Args:
            scene: the composed cell, with the arm's own joints alone.
            radius: from ``cell.collision.proofs.reach_radii.all_radii``, (n + 2,), m.
        """
        self.radius, self._n = radius, scene.chain.n
        self._arm = MotionBounds(scene, radius[: self._n])
        self._table = TableKinematics.of(scene)
        _, first = scene.chain.frames(np.zeros((1, self._n)))
        to_tilt = float(np.linalg.norm(self._table.anchor[0] - first[0, 0]))
        apart = float(np.linalg.norm(self._table.anchor[1] - self._table.anchor[0]))
        # how far the arm gets from E2 and from E1
        self._seen_radius = np.array([to_tilt + apart, to_tilt]) + radius[0]

    def bound(self, a: Floats, b: Floats, parts: int = 2) -> Floats:
        """As :meth:`MotionBounds.bound`, of steps (m, n + 2), with whatever moves."""
        joints = joint_travel_bound(self.radius, a, b)
        if not len(a):
            return joints
        n, chain = self._n, self._arm.chain
        turn = np.abs(b - a)
        frames_a, frames_b = chain.frames(a[:, :n]), chain.frames(b[:, :n])
        arm = np.minimum(
            joint_travel_bound(self.radius[:n], a[:, :n], b[:, :n]),
            2 * (self._arm.straight(frames_a, frames_b) + curvature(self.radius[:n], turn[:, :n]) / 4),
        )
        seen = np.zeros(len(a))
        for carried in (np.array([1.0, 0.0]), np.array([1.0, 1.0])):  # the tilting part, and what E2 turns on it
            poses_a, poses_b = (self._table.poses(x[:, n:] * carried) for x in (a, b))
            straight = self._arm.straight(_seen(poses_a, frames_a), _seen(poses_b, frames_b))
            outer = turn[:, n:][:, ::-1] * carried[::-1]
            radius = np.concatenate([self._seen_radius, self.radius[:n]])
            seen = np.maximum(seen, straight + curvature(radius, np.concatenate([outer, turn[:, :n]], axis=1)) / 4)
        return np.maximum(arm, np.minimum(joints, seen))

    def bend(self, turn: Floats, parts: int = 2) -> Floats:
        """As :meth:`MotionBounds.bend`, of turns (m, n + 2): of the arm's own and as seen from the table, together."""
        n = self._n
        radius = np.concatenate([self._seen_radius, self.radius[:n]])
        seen = curvature(radius, np.concatenate([turn[:, n:][:, ::-1], turn[:, :n]], axis=1))
        return self._arm.bend(turn[:, :n]) + seen


def _seen(Ts: Floats, frames: tuple[Floats, Floats]) -> tuple[Floats, Floats]:
    """Frames of the joints as they are seen from poses (m, 4, 4)."""
    Rt = np.swapaxes(Ts[:, None, :3, :3], -1, -2)
    return Rt @ frames[0], (Rt @ (frames[1] - Ts[:, None, :3, 3])[..., None])[..., 0]
