"""A second collision engine (coal) on what MuJoCo looks at: distances of pairs, and of a scene's arm from everything.

    distance = signed_distance(shape_of(model, g), pose(data, g), shape_of(model, h), pose(data, h))
    other = SecondEngine(scene, case, part);  other.nearest(q, table, deposits_laid)

The shapes are those of the models as they were given: nothing of ``cell.mjcf.detection`` is used. Metres.
"""

from __future__ import annotations

from unittest.mock import patch

import coal
import mujoco
import numpy as np
from scipy.spatial import ConvexHull

from cell.scene.compose import compose
from cell.scene.scene import Scene

GEOM = mujoco.mjtGeom
REQUEST = coal.DistanceRequest()
REQUEST.enable_signed_distance = True
REQUEST.gjk_tolerance = REQUEST.epa_tolerance = 1e-8
REQUEST.gjk_max_iterations = REQUEST.epa_max_iterations = 500


def shape_of(model, g):
    """A geom as coal has it, its frame the geom's."""
    kind, size = model.geom_type[g], model.geom_size[g]
    if kind == GEOM.mjGEOM_MESH:
        m = model.geom_dataid[g]
        points = model.mesh_vert[model.mesh_vertadr[m] :][: model.mesh_vertnum[m]].astype(float)
        some = coal.StdVec_Vec3s()
        for point in points[ConvexHull(points).vertices]:
            some.append(point)
        return coal.Convex.convexHull(some, True, "Qt")
    return {
        int(GEOM.mjGEOM_PLANE): lambda: coal.Halfspace(np.array([0.0, 0.0, 1.0]), 0.0),
        int(GEOM.mjGEOM_SPHERE): lambda: coal.Sphere(size[0]),
        int(GEOM.mjGEOM_CAPSULE): lambda: coal.Capsule(size[0], 2 * size[1]),
        int(GEOM.mjGEOM_ELLIPSOID): lambda: coal.Ellipsoid(*size),
        int(GEOM.mjGEOM_CYLINDER): lambda: coal.Cylinder(size[0], 2 * size[1]),
        int(GEOM.mjGEOM_BOX): lambda: coal.Box(*(2 * size)),
    }[int(kind)]()


def placed(data, g):
    return coal.Transform3s(data.geom_xmat[g].reshape(3, 3), data.geom_xpos[g].copy())


def signed_distance(a, T_a, b, T_b):
    """Of two shapes, m; -inf where coal does not know how deep they are in one another."""
    return coal.distance(a, T_a, b, T_b, REQUEST, coal.DistanceResult())


def pairs_of(scene: Scene):
    """All pairs of geoms that are to be kept apart, of which the arm has one, (k, 2)."""
    model, bits = scene.model, scene.contact_bits
    weld, parent = model.body_weldid, model.body_parentid
    excluded = {(int(s) >> 16, int(s) & 0xFFFF) for s in model.exclude_signature}
    named = {frozenset((int(a), int(b))) for a, b in zip(model.pair_geom1, model.pair_geom2, strict=True)}
    out = []
    solid = np.flatnonzero(bits.any(axis=0))
    for i, a in enumerate(solid.tolist()):
        for b in solid[i + 1 :].tolist():
            if not (scene.arm_geom[a] or scene.arm_geom[b]):
                continue
            one, two = (int(weld[model.geom_bodyid[g]]) for g in (a, b))
            above = [int(weld[parent[w]]) for w in (one, two)]
            near = one == two or (one and two and (above[0] == two or above[1] == one))
            bodies = tuple(sorted(int(model.geom_bodyid[g]) for g in (a, b)))
            meet = (bits[0, a] & bits[1, b]) | (bits[0, b] & bits[1, a])
            if frozenset((a, b)) in named or (meet and not near and bodies not in excluded):
                out.append((a, b))
    return np.array(out)


class SecondEngine:
    """All pairs of a scene, without any broad phase."""

    def __init__(self, scene, case, part):
        with patch("cell.scene.compose.make_detectable"):
            self.model = compose(case, part).model  # the shapes as they were given
        self.data, self.scene, self.pairs = mujoco.MjData(self.model), scene, pairs_of(scene)
        self.shapes = {g: shape_of(self.model, g) for g in np.unique(self.pairs).tolist()}

    def nearest(self, q, table, deposits_laid, reach):
        """The nearest pair in one configuration: distance, m, infinite beyond the reach; and the pair."""
        model, data = self.model, self.data
        data.qpos[self.scene.arm_qpos], data.qpos[self.scene.table_qpos] = q, table
        mujoco.mj_kinematics(model, data)
        a, b = self.pairs.T
        apart = np.linalg.norm(data.geom_xpos[a] - data.geom_xpos[b], axis=1)
        plane = (model.geom_type[self.pairs] == GEOM.mjGEOM_PLANE).any(axis=1)
        laid = (self.scene.deposit_of_geom[self.pairs] < deposits_laid).all(axis=1)
        near = laid & (plane | (apart - model.geom_rbound[a] - model.geom_rbound[b] <= reach))
        best, pair = np.inf, (-1, -1)
        for g, h in self.pairs[near].tolist():
            d = signed_distance(self.shapes[g], placed(data, g), self.shapes[h], placed(data, h))
            if d < min(best, reach):
                best, pair = d, (g, h)
        return best, pair
