"""Shapes and settings with which MuJoCo's collision detection misses nothing.

    make_detectable(world, case)              # the last step before a scene is compiled
    lean_cylinders(model)                     # the first one after

Random pairs of all kinds of shapes were compared with a second engine (``bench/soundness/collision_engines.py``).
Unsafe in MuJoCo 4.0 are: a capsule and a box, where the capsule runs through the box with both ends outside (no
contact); two boxes (distances up to 46 mm too large); any convex pair of which several contacts are computed
(``multiccd``: the deepest may be left out, 240 mm deep reads as 2 mm apart); and any convex pair far out with the 35
iterations that are the default (17 mm deep reads as 8 mm apart), of shapes of a few millimetres with 500 of them too.
So boxes become meshes of their eight corners, which leaves their surface as it is, one contact a pair is computed, and
the iterations are no limit. A mesh collides as its whole convex hull. Height fields and signed distance fields
are refused: MuJoCo reports the first 50 contacts of a pair, among which the nearest need not be.
"""

from __future__ import annotations

from itertools import product

import mujoco
import numpy as np

from ..case.sections import Case
from ..errors import InputError

LEAN = 1e-7  # rad
ITERATIONS = 2000  # of GJK and EPA a pair; what takes fewer costs no more
CORNERS = np.array(list(product((-1.0, 1.0), repeat=3)))
WHOLE_HULL = -1  # of MuJoCo's maxhullvert
GEOM = mujoco.mjtGeom
REFUSED = {GEOM.mjGEOM_HFIELD: "a height field", GEOM.mjGEOM_SDF: "a signed distance field"}


def make_detectable(world: mujoco.MjSpec, case: Case) -> None:
    """Give a scene the shapes and settings with which no collision is missed.

    Args:
        world: the composed cell, contact bits set; changed.
        case: what it was made from.

    Raises:
        InputError: a shape collides of which MuJoCo's distances are not reliable.
    """
    _set_options(world.option)
    solid = [geom for geom in world.geoms if geom.contype or geom.conaffinity]
    _refuse(solid, case)
    meshes = {geom.meshname for geom in solid if geom.meshname}
    for mesh in world.meshes:
        if mesh.name in meshes:
            mesh.maxhullvert = WHOLE_HULL
    for geom in solid:
        # a margin of the model's own shifts the distances that are searched
        geom.margin = geom.gap = 0.0
        if geom.type == GEOM.mjGEOM_BOX:
            _as_corners(world, geom)
    for pair in world.pairs:
        pair.margin = pair.gap = 0.0


def lean_cylinders(model: mujoco.MjModel) -> None:
    """Turn moving cylinders by a negligible angle, so that none is ever exactly upright.

    Of a cylinder upright on a plane MuJoCo 4.0 finds the rim's lowest point by a direction that is all rounding: in a
    fifth of the configurations its distance is too small by the radius.

    Args:
        model: compiled; changed.
    """
    moves = model.body_weldid[model.geom_bodyid] != 0
    for geom in np.flatnonzero(moves & (model.geom_type == GEOM.mjGEOM_CYLINDER)).tolist():
        turned = np.zeros(4)
        mujoco.mju_mulQuat(turned, model.geom_quat[geom].copy(), np.array([1.0, LEAN / 2, 0.0, 0.0]))
        model.geom_quat[geom] = turned
        # MuJoCo leaves the turn of a shape that stands in its body's own frame unread
        model.geom_sameframe[geom] = mujoco.mjtSameFrame.mjSAMEFRAME_NONE


def _set_options(option: mujoco.MjOption) -> None:
    disable = mujoco.mjtDisableBit
    option.disableflags |= int(disable.mjDSBL_MULTICCD)
    option.disableflags &= ~int(disable.mjDSBL_NATIVECCD)
    option.ccd_iterations = ITERATIONS


def _refuse(solid: list[mujoco.MjsGeom], case: Case) -> None:
    for geom in solid:
        if geom.type in REFUSED:
            name = geom.name or f"a shape of body {geom.parent.name}"
            raise InputError(
                f"{case.path}: {name} is {REFUSED[geom.type]}, for which clearances cannot be computed; "
                "use boxes, cylinders, capsules, spheres, ellipsoids or meshes"
            )


def _as_corners(world: mujoco.MjSpec, box: mujoco.MjsGeom) -> None:
    """Make a box a mesh of its eight corners, in its place."""
    size = np.array(box.size)
    if not np.isnan(box.fromto[0]):
        ends = np.array(box.fromto).reshape(2, 3)
        along, quat = ends[0] - ends[1], np.zeros(4)
        mujoco.mju_quatZ2Vec(quat, along / np.linalg.norm(along))
        box.pos, box.quat, size = ends.mean(axis=0), quat, np.array([size[0], size[0], np.linalg.norm(along) / 2])
        box.fromto = np.full(6, np.nan)
    name = f"corners/{len(world.meshes)}"
    # a shell's inertia: that of the volume of a thin sheet is too small for MuJoCo
    world.add_mesh(name=name, uservert=(CORNERS * size).ravel(), inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL)
    box.type, box.meshname = GEOM.mjGEOM_MESH, name
    box.typeinertia = mujoco.mjtGeomInertia.mjINERTIA_VOLUME  # a mesh says itself what its inertia is
