"""Names in a model that a case binds.

Use:

    require(model, "site", "flange", "robot.flange")           # its id, or a line that lists the names there are
"""

from __future__ import annotations

import mujoco

from ..errors import InputError


def require(model: mujoco.MjModel, kind: str, name: str, what: str) -> int:
    """The id of a named element.

    Args:
        model: the compiled scene.
        kind: "body", "joint", "site" or "geom".
        name: its name.
        what: what it is needed for, for the error.

    Raises:
        InputError: there is none; names those there are.
    """
    try:
        return int(getattr(model, kind)(name).id)
    except KeyError:
        count = {"body": model.nbody, "joint": model.njnt, "site": model.nsite, "geom": model.ngeom}[kind]
        names = sorted(filter(None, (getattr(model, kind)(i).name for i in range(count))))
        shown = ", ".join(names[:12]) + (", ..." if len(names) > 12 else "")
        raise InputError(f"{what}: the model has no {kind} named {name!r}; it has {shown or 'none'}") from None
