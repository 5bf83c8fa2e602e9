"""Stations of a bead: a few of its targets, with the candidates at them (all rolls and branches).

    (nodes,) = StationNodes.of_each([bead], roll_step)       # what each costs to be in
    nodes.at, nodes.q, nodes.cost
    held_rolls_price([bead], [nodes], branch, rolls, roll_step)      # (b,) s: of rolls held all along

Metres, radians, seconds.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from ik import bead_path_quick as banded
from ik import closed_form
from ik.bead_path import ROLL_COST
from ik.chain import Floats
from ik.roll import apply_roll
from ik.singularity import margins

from ..arrays import Ints
from ..scene.placement import PlacedTargets
from .configurations import node_cost
from .context import Context
from .edges.edge_check import SearchedBead

LEAST_STATIONS = 4
EVERY = 4  # targets, of which one is checked where beads are to be weighed
STILL = np.array([0])  # samples that a held roll changes by from target to target


@dataclass(frozen=True)
class Spacing:
    """How far apart stations are at most.

    Attributes:
        length: along the bead, m.
        turn: of the wire, rad.
    """

    length: float = 0.04
    turn: float = np.deg2rad(12.0)

    @classmethod
    def of_a_held_roll(cls) -> Spacing:
        """A wider spacing, for a held roll: only the branch is chosen, and the path is checked all along anyway."""
        return cls(4 * cls.length, 4 * cls.turn)


@dataclass(frozen=True, eq=False)
class StationNodes:
    """The candidates at the stations of a bead.

    Attributes:
        Ts: the bead's targets at roll 0, base frame, (t, 4, 4), m.
        at: the stations, (s,).
        q: configurations there, (j, s, g, r), rad.
        cost: what each costs, (s, g, r), s; infinite where it is not allowed.
    """

    Ts: Floats
    at: Ints
    q: Floats
    cost: Floats

    @classmethod
    def of_each(cls, beads: Sequence[SearchedBead], roll_step: float, spacing: Spacing | None = None) -> list[Self]:
        """Those of beads, worked out together.

        Args:
            beads: that :meth:`StationSearch.suits`, one after the other in the part.
            roll_step: distance of the roll's samples, rad.
            spacing: of the stations; what suits the roll's window where left out.
        """
        context = beads[0].context
        spacing = spacing or (Spacing.of_a_held_roll() if context.window.is_fixed else Spacing())
        targets = context.placed.rows(slice(beads[0].first, beads[-1].first + len(beads[-1])))
        Ts = np.split(targets.Ts_base_target, np.cumsum([len(bead) for bead in beads])[:-1])
        at = [stations(bead.placed, spacing) for bead in beads]
        some = np.concatenate([each[k] for each, k in zip(Ts, at, strict=True)])
        rolls = context.window.samples(roll_step)
        q, cost = nodes_of_poses(context, some, np.broadcast_to(rolls, (len(some), len(rolls))))
        ends = np.cumsum([len(k) for k in at])[:-1]
        return [cls(*one) for one in zip(Ts, at, np.split(q, ends, axis=1), np.split(cost, ends), strict=True)]


def held_rolls_price(
    beads: Sequence[SearchedBead], nodes: Sequence[StationNodes], branch: int, rolls: Floats, roll_step: float
) -> Floats:
    """What beads cost in a branch with rolls (b,) held all along, (b,), s: by one of a few steps of each.

    Args:
        beads: the beads.
        nodes: theirs.
        branch: the branch.
        rolls: rad.
        roll_step: distance of the roll's samples, rad.
    """
    context = beads[0].context
    some = [np.arange((len(bead) - 2) % EVERY // 2, len(bead) - 1, EVERY) for bead in beads]
    Ts = np.concatenate([each.Ts[np.stack([i, i + 1], axis=1).ravel()] for each, i in zip(nodes, some, strict=True)])
    every = np.broadcast_to(rolls, (len(Ts), len(rolls)))
    q, cost = nodes_of_poses(context, Ts, every, branch)
    # between the steps there are edges as well, which do not count
    times, largest = (
        np.repeat(np.concatenate([getattr(bead, name)[i] for bead, i in zip(beads, some, strict=True)]), 2)[:-1]
        for name in ("times", "largest")
    )
    bounds = banded.Bounds(beads[0].speed, times, largest, ROLL_COST / roll_step, np.full(len(times), roll_step))
    edges = banded.prices(context.solver.chain, q, every, bounds, STILL, circular=False)
    weight = np.repeat([len(bead) / len(i) for bead, i in zip(beads, some, strict=True)], [len(i) for i in some])
    return np.asarray(weight @ (cost[::2, 0] + edges[::2, 0, 0]))


def nodes_of_poses(context: Context, Ts: Floats, rolls: Floats, branch: int | None = None) -> tuple[Floats, Floats]:
    """Nodes (j, t, g, r) of poses (t, 4, 4) at rolls (t, r), and what each costs, (t, g, r), s."""
    solver = context.solver
    assert solver.form is not None
    rolled = apply_roll(Ts[:, None], rolls)
    if branch is None:
        raw = closed_form.solve(solver.form, rolled)
    else:
        raw = closed_form.solve_branch(solver.form, rolled, branch)[:, :, None]
    q, inside, room = banded.lowest_angles(solver.chain, raw)
    margin = np.swapaxes(margins(solver.chain, solver.geometry, raw), 1, 2)
    least = context.limits.values(True)
    allowed = inside & (margin >= least).all(axis=-1)
    return q, np.where(allowed, node_cost(room, margin, least), np.inf)


def stations(placed: PlacedTargets, spacing: Spacing) -> Ints:
    """Targets at most a spacing apart, the first and the last among them."""
    measure = _apart(placed.bead, spacing)
    if placed.moving is not None:  # what the arm has to do is another way
        measure = np.maximum(measure, _apart(placed, spacing))
    along = np.concatenate([[0.0], np.cumsum(measure)])
    wanted = max(int(np.ceil(along[-1])) + 1, LEAST_STATIONS)
    some = np.searchsorted(along, np.linspace(0.0, along[-1], wanted) - 1e-9)
    return np.unique(np.append(some, len(along) - 1))


def _apart(placed: PlacedTargets, spacing: Spacing) -> Floats:
    """How far each target is from the one before, (t - 1,), as a share of what stations are apart."""
    length = np.linalg.norm(np.diff(placed.position, axis=0), axis=1)
    cosine = np.einsum("ti,ti->t", placed.normal[1:], placed.normal[:-1])
    return np.maximum(length / spacing.length, np.arccos(np.clip(cosine, -1.0, 1.0)) / spacing.turn)
