"""Where the part is at any angles of the table, in closed form and for many at once.

    table = TableKinematics.of(scene)
    table.poses(tables)                       # tables (m, 2) rad -> (m, 4, 4), the part in the arm's base frame
    table.upright(normals)                    # angles that turn directions of the part upwards

Axes and anchors are those of MuJoCo's kinematics with both axes at zero, so that a table whose axes are not square and
do not cross comes out as it is. Metres and radians.

Source: product of exponentials, and subproblems 1 and 2 of Paden and Kahan, in Murray, Li, Sastry, A Mathematical
Introduction to Robotic Manipulation, 1994, section 3.3.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import mujoco
import numpy as np

from ik.chain import Floats

from ..rigid import inverse, pose

if TYPE_CHECKING:
    from .scene import Scene


@dataclass(frozen=True, eq=False)
class TableKinematics:
    """The positioner's two axes, the first carrying the second.

    Attributes:
        T_base_part: pose of the part with both axes at zero, (4, 4), base frame, m.
        axis: directions of E1 and E2 then, (2, 3), unit vectors.
        anchor: a point on each, (2, 3), m.
        up: the world's vertical, (3,).
    """

    T_base_part: Floats
    axis: Floats
    anchor: Floats
    up: Floats

    @classmethod
    def of(cls, scene: Scene) -> TableKinematics:
        """The table of a composed cell, in its arm's base frame."""
        data = mujoco.MjData(scene.model)
        data.qpos[scene.table_qpos] = 0.0
        mujoco.mj_kinematics(scene.model, data)
        base = inverse(pose(data.xpos[scene.base_body], data.xmat[scene.base_body]))
        site = scene.sites["part"]
        R = base[:3, :3]
        return cls(
            T_base_part=base @ pose(data.site_xpos[site], data.site_xmat[site]),
            axis=data.xaxis[scene.table_joints] @ R.T,
            anchor=data.xanchor[scene.table_joints] @ R.T + base[:3, 3],
            up=R[:, 2],
        )

    def poses(self, tables: Floats) -> Floats:
        """Poses of the part in the base frame.

        Args:
            tables: E1, E2, (m, 2), rad.

        Returns:
            (m, 4, 4), m.
        """
        return self._turns(0, tables[:, 0]) @ self._turns(1, tables[:, 1]) @ self.T_base_part

    def directions(self, tables: Floats, part: Floats) -> Floats:
        """Directions (m, 3) of the part as they point at table angles (m, 2), (m, 3), base frame."""
        at_zero = part @ self.T_base_part[:3, :3].T
        turned = rotated(self.axis[1], tables[:, 1], at_zero)
        return rotated(self.axis[0], tables[:, 0], turned)

    def off(self, tables: Floats, part: Floats, aim: Floats | None = None) -> Floats:
        """Angles (m,) between directions (m, 3) of the part and a direction (3,), up where left out, rad."""
        aim = self.up if aim is None else aim
        # half the chord, since an angle as small as this is lost in its cosine
        chord = np.linalg.norm(self.directions(tables, part) - aim, axis=1)
        return np.asarray(2 * np.arcsin(np.clip(chord / 2, 0.0, 1.0)))

    def pull(self, tables: Floats, part: Floats) -> Floats:
        """How fast a direction of the part swings with each axis, (m, 2, 3), rad of it a rad of the axis."""
        there = self.directions(tables, part)
        first = np.broadcast_to(self.axis[0], there.shape)
        second = rotated(self.axis[0], tables[:, 0], np.broadcast_to(self.axis[1], there.shape))
        return np.stack([np.cross(first, there), np.cross(second, there)], axis=1)

    def upright(self, part: Floats, aim: Floats | None = None) -> Floats:
        """Table angles that turn directions of the part towards one, or as near to it as the axes can.

        Args:
            part: unit vectors, (m, 3), part frame.
            aim: unit vector, (3,), base frame; up where left out.

        Returns:
            The two solutions, (2, m, 2), rad, within a turn about zero. Where a direction is along E2 itself, E2 is 0.
        """
        goal = self.up if aim is None else aim
        u, v = self.axis
        p = part @ self.T_base_part[:3, :3].T
        across = np.cross(u, v)
        size = float(across @ across)
        if size < 1e-12:  # parallel axes: one of them is enough
            E2 = _turn_about(v, p, np.broadcast_to(goal, p.shape))
            one = np.stack([np.zeros(len(p)), E2], axis=1)
            return np.stack([one, one])
        cosine, a, b = float(u @ v), float(u @ goal), p @ v
        # the direction between the two turns: about v it comes from p, about u it goes to the aim
        along_u, along_v = (a - cosine * b) / size, (b - cosine * a) / size
        rest = (1 - along_u**2 - along_v**2 - 2 * along_u * along_v * cosine) / size
        height = np.sqrt(np.maximum(rest, 0.0))
        out = []
        for side in (1.0, -1.0):
            middle = along_u[:, None] * u + along_v[:, None] * v + (side * height)[:, None] * across
            E2 = _turn_about(v, p, middle)
            E1 = _turn_about(u, rotated(v, E2, p), np.broadcast_to(goal, p.shape))
            out.append(np.stack([E1, E2], axis=1))
        return np.stack(out)

    def nearest(self, part: Floats, held: Floats, axis: int, aim: Floats | None = None) -> Floats:
        """The angle of one axis that brings directions nearest to one, the other axis held.

        Args:
            part: unit vectors, (m, 3), part frame.
            held: angle of the other axis, (m,), rad.
            axis: the one that turns.
            aim: unit vector, (3,), base frame; up where left out.

        Returns:
            (m,), rad.
        """
        goal = np.broadcast_to(self.up if aim is None else aim, part.shape)
        p = part @ self.T_base_part[:3, :3].T
        if axis == 1:
            return _turn_about(self.axis[1], p, rotated(self.axis[0], -held, goal))
        return _turn_about(self.axis[0], rotated(self.axis[1], held, p), goal)

    def _turns(self, axis: int, angle: Floats) -> Floats:
        """Turns about an axis, (m, 4, 4)."""
        u = self.axis[axis]
        K = np.array([[0.0, -u[2], u[1]], [u[2], 0.0, -u[0]], [-u[1], u[0], 0.0]])
        out = np.zeros((len(angle), 4, 4))
        s, c = np.sin(angle)[:, None, None], np.cos(angle)[:, None, None]
        out[:, :3, :3] = np.eye(3) + s * K + (1 - c) * (K @ K)
        out[:, :3, 3] = self.anchor[axis] - out[:, :3, :3] @ self.anchor[axis]
        out[:, 3, 3] = 1.0
        return out


def rotated(axis: Floats, angle: Floats, v: Floats) -> Floats:
    """Vectors (m, 3) turned about a unit vector (3,) by angles (m,), rad; Rodrigues' formula."""
    s, c = np.sin(angle)[:, None], np.cos(angle)[:, None]
    return np.asarray(c * v + s * np.cross(axis, v) + (1 - c) * (v @ axis)[:, None] * axis)


def _turn_about(axis: Floats, a: Floats, b: Floats) -> Floats:
    """Angles (m,) about a unit vector (3,) that turn a nearest to b, both (m, 3); 0 where either is along it."""
    a, b = a - (a @ axis)[:, None] * axis, b - (b @ axis)[:, None] * axis
    sine, cosine = np.cross(a, b) @ axis, np.einsum("mi,mi->m", a, b)
    return np.where(np.hypot(sine, cosine) < 1e-12, 0.0, np.arctan2(sine, cosine))
