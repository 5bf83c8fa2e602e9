"""The wire on travels: it may touch the part where it is welded, and is a rod like any other on the way across.

    checker = wire_checker(setup.checker)            # None where the tool has no wire
    c = checker.clearances(q, stage)                 # of the wire from the part, out to 20 mm

Drawn back along itself, a wire leaves the part the way it came; across, what its torch clears it need not clear. Metres
and radians.
"""

from __future__ import annotations

import weakref
from dataclasses import replace

import numpy as np

from ..scene.composition import Piece
from ..scene.contacts import SOLID
from ..scene.scene import Scene
from .checker import NEVER, Checker

_made: weakref.WeakKeyDictionary[Checker, Checker | None] = weakref.WeakKeyDictionary()
WIRE_REACH = 20e-3  # m: nothing is asked for but not to touch, yet far samples and corners are proved free sooner


def wire_checker(checker: Checker) -> Checker | None:
    """Collision detection of the wire and the part alone.

    Args:
        checker: of the whole cell, at the same table pose and without the same deposits.

    Returns:
        The same for the wire, made once; None where the tool's wire is not modelled.
    """
    if checker not in _made:
        _made[checker] = _made_of(checker)
    return _made[checker]


def _made_of(checker: Checker) -> Checker | None:
    scene = wire_scene(checker.scene)
    if scene is None:
        return None
    # where the model names pairs, it takes a copy in which they are never met
    beside = None if scene.model.npair else checker
    return Checker(scene, checker.table, WIRE_REACH, checker.without, pair_gap=NEVER, beside=beside)


def wire_scene(scene: Scene) -> Scene | None:
    """A scene in which nothing is solid but the wire and the part; None where there is no wire."""
    model = scene.model
    wire = scene.wire_geom & scene.contact_bits.any(axis=0)
    if not wire.any():
        return None
    part = np.isin(scene.piece_of_geom, (Piece.SUPPORT, Piece.PART))
    bits = np.stack([np.where(wire, SOLID, 0), np.where(part, SOLID, 0)]).astype(scene.contact_bits.dtype)
    bodies = scene.body_contype.copy()
    bodies[model.geom_bodyid[wire]] |= SOLID
    return replace(scene, contact_bits=bits, body_contype=bodies)
