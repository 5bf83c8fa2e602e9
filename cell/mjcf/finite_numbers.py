"""Numbers of a model that are none: places, sizes and axes that are NaN, infinite, or larger than any cell.

    require_finite(model, "blade.case.yaml")  # as soon as a model is compiled

MuJoCo compiles them: a shape whose place is NaN touches nothing, and nothing is said.
"""

from __future__ import annotations

import mujoco
import numpy as np

from ..errors import InputError

LARGEST = 1e6  # m, or rad
FIELDS = {
    "jnt": ("pos", "axis", "range"),
    "geom": ("pos", "quat", "size"),
    "site": ("pos", "quat"),
    "body": ("pos", "quat"),
}
KIND = {"jnt": "joint"}


def require_finite(model: mujoco.MjModel, where: str) -> None:
    """Refuse a model with a number that is none.

    Args:
        model: compiled.
        where: the case file, for the message.

    Raises:
        InputError: the first element that has one, and which of its attributes.
    """
    for joint, at in enumerate(model.jnt_qposadr.tolist()):
        if not abs(model.qpos0[at]) <= LARGEST:
            raise InputError(f"{where}: joint {model.joint(joint).name or joint}: its ref is {model.qpos0[at]:g}")
    for key, names in FIELDS.items():
        kind = KIND.get(key, key)
        for name in names:
            values = np.asarray(getattr(model, f"{key}_{name}")).reshape(-1, 1)
            found = np.flatnonzero(~(np.abs(values) <= LARGEST).all(axis=1))
            if len(found):
                width = len(values) // len(getattr(model, f"{key}_{name}"))
                element = getattr(model, kind)(int(found[0]) // width)
                raise InputError(
                    f"{where}: {kind} {element.name or element.id}: its {name} is {values[found[0], 0]:g}; a number "
                    f"within {LARGEST:g} is needed"
                )
    if not np.isfinite(model.mesh_vert).all():
        vertex = int(np.flatnonzero(~np.isfinite(model.mesh_vert).all(axis=1))[0])
        mesh = int(np.searchsorted(model.mesh_vertadr, vertex, side="right")) - 1
        raise InputError(f"{where}: mesh {model.mesh(mesh).name or mesh}: a vertex is not a number")
