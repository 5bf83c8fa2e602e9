"""Between two samples of a motion: nothing is hit on the way, by clearance against travel.

    radius = radii(scene)                                  # (n,) m
    open_at = unproved(checker, radius, q, stage, found)   # steps of q that could not be proved free

A step is free if the clearances at its ends add up to more than the longest way any point of the arm can travel on it;
otherwise it is halved, and its middle looked at. What is still open after the last halving counts as not free.

Source: Schwarzer, Saha, Latombe, Adaptive dynamic collision checking for single and multiple articulated robots in
complex environments, IEEE T-RO 2005.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from ik.chain import Floats

from .collision import Clearances, Ints
from .swept import joint_way

if TYPE_CHECKING:
    from .scene import Scene

HALVINGS = 8


class Sees(Protocol):
    """Collision detection, of the arm or of the table."""

    reach: float

    def way(self, radius: Floats, a: Floats, b: Floats, /) -> Floats:
        """How far anything can travel towards anything on steps, (m,), m; see ``cell.swept``."""
        ...

    def clearances(self, q: Floats, stage: Ints, /) -> Clearances:
        """As of :class:`cell.collision.Checker`."""
        ...


def radii(scene: Scene) -> Floats:
    """How far any point of the arm and its tool can be from each joint, whatever the joints after it do.

    Args:
        scene: the cell.

    Returns:
        (n,) m: of joint i the greater of what its own link holds and the way to the next joint plus that joint's.
    """
    import mujoco

    model, chain = scene.model, scene.chain
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    bodies = [int(model.joint(name).bodyid[0]) for name in chain.names]
    anchors = np.array([data.xanchor[model.joint(name).id] for name in chain.names])
    last = {body: i for i, body in enumerate(bodies)}  # of several joints in one body the last, which the others carry
    out = np.zeros(chain.n)
    for g in np.flatnonzero(scene.arm_geom & scene.contact_bits.any(axis=0)):
        body = int(model.geom_bodyid[g])
        while body not in bodies:
            body = int(model.body_parentid[body])
        i = last[body]
        out[i] = max(out[i], float(np.linalg.norm(data.geom_xpos[g] - anchors[i]) + model.geom_rbound[g]))
    for i in range(chain.n - 2, -1, -1):
        out[i] = max(out[i], float(np.linalg.norm(chain.origins[i + 1, :3, 3])) + out[i + 1])
    return out


def unproved(
    checker: Sees, radius: Floats, q: Floats, stage: Ints, found: Clearances, apart: Ints | None = None
) -> tuple[Ints, Clearances]:
    """Steps of a motion that cannot be proved free of contact.

    Args:
        checker: collision detection at the table pose.
        radius: from :func:`radii`, (n,), m.
        q: samples, (m, n), rad; between neighbours the joints move on straight lines.
        stage: deposits laid at each sample, (m,).
        found: clearances at the samples.
        apart: motion that each sample belongs to, (m,); steps from one motion to the next are left out.

    Returns:
        First samples of the open steps, (k,), and the nearest pair seen on each of them.
    """
    step = np.arange(len(q) - 1)
    if apart is not None:
        step = step[apart[:-1] == apart[1:]]
    known = np.minimum(found.distance, checker.reach)
    a, b, da, db = q[step], q[step + 1], known[step], known[step + 1]
    laid = np.maximum(stage[step], stage[step + 1])
    for _ in range(HALVINGS):
        open_ = _open(checker, radius, a, b, da + db)
        step, laid = step[open_], laid[open_]
        a, b, da, db = (x[open_] for x in (a, b, da, db))
        if not len(step):
            return step, Clearances.none(0)
        middle = (a + b) / 2
        seen = checker.clearances(middle, laid)
        dm = np.minimum(seen.distance, checker.reach)
        hit = dm <= 0
        if hit.any():
            left, row = np.unique(step[hit], return_index=True)
            return left, seen.rows(np.flatnonzero(hit)[row])
        step, laid = np.concatenate([step, step]), np.concatenate([laid, laid])
        a, b = np.concatenate([a, middle]), np.concatenate([middle, b])
        da, db = np.concatenate([da, dm]), np.concatenate([dm, db])
    open_ = _open(checker, radius, a, b, da + db)
    left = np.unique(step[open_])
    return left, found.rows(left)


def _open(checker: Sees, radius: Floats, a: Floats, b: Floats, room: Floats) -> NDArray[np.bool_]:
    """Steps whose clearances at both ends together do not prove them free; most are settled by the cheaper bound."""
    open_: NDArray[np.bool_] = room <= joint_way(radius, a, b)
    k = np.flatnonzero(open_)
    open_[k] = room[k] <= checker.way(radius, a[k], b[k])
    return open_
