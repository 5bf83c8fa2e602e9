"""How far convex shapes reach in given directions.

    shape = convex_shape(model, geom, R, p)      # in a frame in which the shape stands at R, p
    shape.support(directions)                    # (3, k) -> (k,), m: of all its points x the greatest direction . x

A plane that two shapes lie on either side of keeps them apart by the gap between their supports. Metres.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import mujoco
import numpy as np

from ik.chain import Floats

from ...arrays import Ints

GEOM = mujoco.mjtGeom
PRODUCTS = 100_000  # of points and directions that are worked out at once: they stay in the cache
ALONG = 1e-12  # of a plane's normal across: what is more reaches infinitely far


@dataclass(frozen=True, eq=False)
class ConvexShape:
    """The hull of some points, thickened by a ball and by a disc.

    Attributes:
        points: (v, 3), m.
        ball: radius of the ball, m.
        axis: normal of the disc, (3,).
        disc: its radius, m.
        endless: whether it is all that lies against ``axis`` from the first point.
    """

    points: Floats
    ball: float
    axis: Floats
    disc: float
    endless: bool = False

    @cached_property
    def middle(self) -> Floats:
        """A point about which it lies, (3,), m."""
        return np.asarray((self.points.min(axis=0) + self.points.max(axis=0)) / 2)

    @cached_property
    def size(self) -> float:
        """Radius of a ball about its middle that holds it, m."""
        return float(np.linalg.norm(self.points - self.middle, axis=1).max()) + self.ball + self.disc

    def support(self, direction: Floats) -> Floats:
        """How far it reaches.

        Args:
            direction: (3,) or (3, k), of unit length.

        Returns:
            () or (k,), m; infinite where it has no end.
        """
        if self.endless:
            across = 1.0 - self.axis @ direction
            return np.where(across <= ALONG, self.points[0] @ direction, np.inf)
        out = self.points[0] @ direction if len(self.points) == 1 else self._furthest(direction)
        out = out + self.ball
        if self.disc:
            out += self.disc * np.sqrt(np.clip(1.0 - (self.axis @ direction) ** 2, 0.0, 1.0))
        return np.asarray(out)

    def _furthest(self, direction: Floats) -> Floats:
        """How far its points reach, (3,) or (3, k) -> () or (k,), m."""
        if direction.ndim == 1 or len(self.points) * direction.shape[1] < PRODUCTS:
            return np.asarray((self.points @ direction).max(axis=0))
        some, out = max(PRODUCTS // len(self.points), 64), np.empty(direction.shape[1])
        for first in range(0, len(out), some):
            (self.points @ direction[:, first : first + some]).max(axis=0, out=out[first : first + some])
        return out


def convex_shape(model: mujoco.MjModel, geom: int, R: Floats, p: Floats) -> ConvexShape:
    """The shape of a geom as collision detection has it, or one that holds it.

    Args:
        model: the compiled model.
        geom: id.
        R: rotation of the geom's frame, (3, 3).
        p: its origin, (3,), m.

    Returns:
        The shape; of a kind that is none of those below the ball that MuJoCo has round it.
    """
    kind, size = int(model.geom_type[geom]), model.geom_size[geom]
    z = R[:, 2]
    if kind == GEOM.mjGEOM_MESH:
        return ConvexShape(_hull(model, int(model.geom_dataid[geom])) @ R.T + p, 0.0, z, 0.0)
    if kind == GEOM.mjGEOM_PLANE:
        return ConvexShape(p[None], 0.0, z, 0.0, endless=True)
    ends = p + np.outer([-1.0, 1.0], z) * size[1]
    if kind == GEOM.mjGEOM_CAPSULE:
        return ConvexShape(ends, float(size[0]), z, 0.0)
    if kind == GEOM.mjGEOM_CYLINDER:
        return ConvexShape(ends, 0.0, z, float(size[0]))
    if kind == GEOM.mjGEOM_SPHERE:
        return ConvexShape(p[None], float(size[0]), z, 0.0)
    return ConvexShape(p[None], float(model.geom_rbound[geom]), z, 0.0)


def _hull(model: mujoco.MjModel, mesh: int) -> Floats:
    """Corners of a mesh's convex hull, in the geom's frame, (v, 3), m."""
    first, count = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
    every = model.mesh_vert[first : first + count].astype(float)
    at = int(model.mesh_graphadr[mesh])
    if at < 0:
        return every
    corners = int(model.mesh_graph[at])
    index: Ints = model.mesh_graph[at + 2 + corners : at + 2 + 2 * corners]
    return every[index]
