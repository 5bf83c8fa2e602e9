"""A helix on a cylinder as one endless bead."""

from __future__ import annotations

import numpy as np

from slicing import Targets


def helix(
    turns: float, radius_mm: float = 22.0, z_mm: float = 12.0, pitch_mm: float = 4.0, per_turn: int = 48
) -> Targets:
    """Targets of a helix about the part's axis, deposited outwards.

    Args:
        turns: how often it goes round.
        radius_mm: of the helix.
        z_mm: where it begins.
        pitch_mm: how far a turn rises.
        per_turn: targets a turn.
    """
    n = int(turns * per_turn) + 1
    a = np.linspace(0, 2 * np.pi * turns, n)
    normal = np.stack([np.cos(a), np.sin(a), np.zeros(n)], axis=1)
    position = radius_mm * normal
    position[:, 2] = z_mm + pitch_mm * a / (2 * np.pi)
    tangent = np.stack([-np.sin(a), np.cos(a), np.zeros(n)], axis=1)
    none = np.zeros(n, dtype=np.int64)
    return Targets(
        sub_volume=("SV1",),
        sub_volume_index=none,
        layer=none,
        bead=none,
        position=position,
        normal=normal,
        tangent=tangent,
        thickness_mm=np.full(n, 2.0),
        closed=np.array([False]),
    )
