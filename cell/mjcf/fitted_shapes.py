"""Boxes, cylinders and other shapes that a model fits to a mesh, as shapes of their own.

    settle_fits(spec, "robot")               # the last step before a model is attached to a cell

What MuJoCo fits depends on compiler options of the model (``fitaabb``), of which a cell has its own: attached as they
are, such shapes would come out with other sizes in other places.
"""

from __future__ import annotations

import warnings

import mujoco
import numpy as np

from ..errors import InputError

GEOM = mujoco.mjtGeom
NOT_FITTED = (GEOM.mjGEOM_MESH, GEOM.mjGEOM_SDF)


def settle_fits(spec: mujoco.MjSpec, what: str) -> None:
    """Give every shape that is fitted to a mesh the size and place that its own model gives it.

    Args:
        spec: all its shapes named; changed.
        what: "robot", "tool" or "positioner", for messages.

    Raises:
        InputError: the model does not compile.
    """
    fitted = [geom for geom in spec.geoms if geom.meshname and geom.type not in NOT_FITTED]
    if not fitted:
        return
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            model = spec.copy().compile()
    except ValueError as error:
        raise InputError(f"{what}.model: does not compile: {' '.join(str(error).split())}") from None
    for geom in fitted:
        own, body = model.geom(geom.name), geom.parent
        keeps = {key: getattr(geom, key) for key in ("name", "type", "contype", "conaffinity", "group", "material")}
        rgba = geom.rgba.copy()
        spec.delete(geom)
        # in its body and in no frame: so is where MuJoCo says that it is
        made = body.add_geom(**keeps, rgba=rgba, size=own.size.copy(), pos=own.pos.copy(), quat=own.quat.copy())
        # what the body's default class says of shapes, the mesh to fit for one, is in these numbers already
        made.meshname, made.fromto = "", np.full(6, np.nan)
        made.alt.type = mujoco.mjtOrientation.mjORIENTATION_QUAT
