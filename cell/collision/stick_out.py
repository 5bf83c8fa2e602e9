"""How far the wire reaches beyond the torch: where the torch is further than that from the part, so is the wire.

    stick_out_of(scene)      # m; infinite where no shape of the torch is checked against all that the wire may meet

The torch is checked against the part with everything else, so that a clearance kept on the way across often leaves
nothing to look for. Metres.
"""

from __future__ import annotations

import weakref

import mujoco
import numpy as np

from ik.chain import Floats

from ..arrays import Ints
from ..scene.contacts import left_out
from ..scene.scene import Scene
from .proofs.convex_shapes import ConvexShape, convex_shape
from .wire import wire_and_part

NEARER = 60  # steps towards the nearest point of a shape: each gives a point of it, so that fewer only tell more
GEOM = mujoco.mjtGeom
# those that ``convex_shape`` has as they are: of others it has more than there is
EXACT = [int(kind) for kind in (GEOM.mjGEOM_MESH, GEOM.mjGEOM_CAPSULE, GEOM.mjGEOM_CYLINDER, GEOM.mjGEOM_SPHERE)]
SLACK = 1e-6  # m, of rounding
_known: weakref.WeakKeyDictionary[Scene, float] = weakref.WeakKeyDictionary()


def stick_out_of(scene: Scene) -> float:
    """How far any point of the wire is at most from a shape of the torch that is checked against the part, m.

    Args:
        scene: the whole cell.

    Returns:
        The distance; infinite where there is no such shape, 0 where there is no wire.
    """
    if scene not in _known:
        _known[scene] = _stick_out(scene)
    return _known[scene]


def _stick_out(scene: Scene) -> float:
    model, (wire, part) = scene.model, wire_and_part(scene)
    wires = np.flatnonzero(wire)
    if not len(wires):
        return 0.0
    torch = _checked_against(scene, np.flatnonzero(part))
    if not torch or not scene.tool_geom[wires].all():
        return float("inf")
    data = mujoco.MjData(model)  # in any configuration: what moves with the TCP stands alike in all
    mujoco.mj_kinematics(model, data)
    shapes = [_shape(model, data, geom) for geom in torch]
    return max(_beyond(_shape(model, data, int(wire)), shapes) for wire in wires) + SLACK


def _checked_against(scene: Scene, part: Ints) -> list[int]:
    """Shapes that move with the TCP, are no wire, and are checked against all geoms of the part."""
    model, (meets, met) = scene.model, scene.contact_bits
    first = np.unique(model.geom_bodyid[part], return_index=True)[1]
    exact = np.isin(model.geom_type, EXACT) & scene.tool_geom & ~scene.wire_geom
    solid = [geom for geom in np.flatnonzero(exact).tolist() if (meets[geom] & met[part]).all()]
    return [geom for geom in solid if not any(left_out(model, geom, int(part[k])) for k in first)]


def _shape(model: mujoco.MjModel, data: mujoco.MjData, geom: int) -> ConvexShape:
    return convex_shape(model, geom, data.geom_xmat[geom].reshape(3, 3), data.geom_xpos[geom])


def _beyond(wire: ConvexShape, torch: list[ConvexShape]) -> float:
    """How far any point of the wire is at most from the one of some shapes that it is least far from, m.

    Of a convex shape how far its points are from another is most at a corner.
    """
    far = [np.linalg.norm(wire.points[:, None] - shape.points[None], axis=2).min(axis=1).max() for shape in torch]
    nearest = torch[int(np.argmin(far))]
    return float(_off(nearest, wire.points).max()) + wire.ball + wire.disc


def _off(shape: ConvexShape, x: Floats) -> Floats:
    """How far points (m, 3) are from a shape at most, (m,), m: from a point of it that is found by Frank and Wolfe."""
    corners = shape.points
    p = np.repeat(corners.mean(axis=0)[None], len(x), axis=0)
    for _ in range(NEARER):
        to = corners[np.argmax((x - p) @ corners.T, axis=1)] - p
        along = np.einsum("mi,mi->m", x - p, to) / np.maximum(np.einsum("mi,mi->m", to, to), 1e-30)
        p = p + np.clip(along, 0.0, 1.0)[:, None] * to
    off = x - p
    across = off - (off @ shape.axis)[:, None] * shape.axis
    wide = np.linalg.norm(across, axis=1, keepdims=True)
    off = off - across * np.minimum(1.0, shape.disc / np.maximum(wide, 1e-30))
    return np.maximum(np.linalg.norm(off, axis=1) - shape.ball, 0.0)
