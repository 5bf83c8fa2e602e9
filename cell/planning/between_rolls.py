"""A target that no sampled roll reaches may be reached at one between them: whether the arm can also stand there.

    hint = standing_between(context, nodes, T, stage, roll)    # RollBetween(roll_deg=93.6), or with what is in the way

Kinematics alone names such a roll (``ik.reachability_proof``); here every configuration at it, and at rolls beside it,
is held against the cell. Radians and metres.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ik.chain import Floats
from ik.roll import apply_roll
from ik.singularity import margins

from ..failure import Contact, RollBetween
from .configurations import Nodes
from .context import Context

BESIDE = np.deg2rad(np.array([0.0, *(s * d for d in (0.25, 0.5, 1, 2, 3, 4, 5, 6) for s in (-1, 1))]))


STANDS = np.empty(0)  # axes of a table that does not move


def standing_between(
    context: Context, nodes: Nodes, T: Floats, stage: int, roll: float, table: Floats = STANDS
) -> RollBetween | None:
    """Whether the arm can stand at a target at a roll between the samples.

    Args:
        context: the cell and what is to be kept.
        nodes: of the target's bead, for the window and the margins.
        T: the target at roll 0, (4, 4), m.
        stage: deposits laid when it is welded.
        roll: a roll at which a configuration keeps limits and margins, rad.
        table: E1, E2 there, (2,), rad; (0,) where the table stands.

    Returns:
        The roll at which a configuration keeps the clearance as well, there or beside it. Else the roll of the least
        bad configuration, with its nearest pair. None where there is no configuration.
    """
    solver, window = context.solver, nodes.window
    rolls = roll + BESIDE
    rolls = rolls[window.excess(rolls) == 0.0] if not window.is_fixed else rolls[:1]
    q = solver.candidates(apply_roll(T[None], rolls)).q
    least = context.limits.values(solver.geometry is not None)
    allowed = np.isfinite(q[..., 0]) & (margins(solver.chain, solver.geometry, q) >= least).all(axis=-1)
    at = np.argwhere(allowed)
    if not len(at):
        return None
    axes = np.concatenate([q[tuple(at.T)], np.tile(table, (len(at), 1))], axis=1)
    found = context.screen.clearances(axes, np.full(len(at), stage))
    free = found.distance >= context.settings.clearance
    k = int(np.argmax(free)) if free.any() else int(np.argmax(found.distance))
    deg = round(float(np.rad2deg(rolls[at[k, 0]])), 3)
    if free.any():
        return RollBetween(deg)
    hit = context.describe(found, k)
    return RollBetween(deg, replace(hit, contact=Contact(hit.pair)))
