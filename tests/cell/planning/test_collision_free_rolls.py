"""A roll between the samples is only called reachable where the arm can stand there."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from cell.case.read import load_case
from cell.job.job import prepare
from cell.planning.collision_free_rolls import (
    FINEST,
    KnownRolls,
    _may_hide,
    _open_between,
    _spread,
    roll_between_samples,
)
from cell.planning.configurations import nodes_at_rolls
from cell.planning.context import Context, settings_of
from cell.scene.placement import place_targets
from cell.scene.scene import table_angles
from ik.reachability_proof import certify


@pytest.mark.parametrize("blocked", [False, True])
def test_a_roll_is_called_reached_alone_only_where_nothing_is_in_the_way(make_case, blocked):
    block = {"name": "block", "box": {"size_mm": [600, 600, 600]}, "position_mm": [600, 0, 900]}
    job = prepare(load_case(make_case(fixtures=[block] if blocked else [])))
    table, settings = table_angles(job.scene, 90, 180), settings_of(job)
    placed = place_targets(job.targets, job.scene.T_base_part(*table))
    context = Context.of(job, table)
    nodes = nodes_at_rolls(job.solver, placed.rows(slice(0, 1)), job.window, settings.roll_step, context.limits)
    T = placed.Ts_base_target[0]
    roll = float(certify(job.solver.chain, T[None], job.window, context.limits, job.solver.form).roll[0])
    hint = roll_between_samples(context, nodes, T, int(job.deposits_before[0]), roll)
    if blocked:
        assert hint.collision.measure < 5
        assert abs(hint.roll_deg - np.rad2deg(roll)) < 6.001
    else:
        assert hint.collision is None


def test_a_free_roll_is_looked_at_however_narrow_the_room_is_between_what_holds_the_tool():
    rng = np.random.default_rng(7)
    rolls = np.linspace(-np.pi, np.pi, 73)
    closed = 0
    for _ in range(300):
        ends = np.sort(rng.uniform(-np.pi, np.pi, 2 * rng.integers(1, 5))).reshape(-1, 2)
        inside = np.minimum(rolls[:, None] - ends[:, 0], ends[:, 1] - rolls[:, None]).max(axis=1)
        seen = rng.random(len(rolls)) < 0.2
        seen[[0, -1]] = True
        held = _spread(rolls, np.where(seen, np.maximum(inside, 0.0), 0.0)[None], circular=False)
        is_open = _open_between(rolls, seen[None], held)[0]
        assert is_open[(inside < 0) & ~seen].all()
        closed += (~is_open & ~seen).sum()
    assert closed > 1000  # what is held all of the way is left out


def looked(room: tuple[float, float], held: tuple[float, float]) -> KnownRolls:
    """Two neighbouring rolls 10 degrees apart, in which the arm's one joint turns by 10 degrees."""
    roll = np.deg2rad([0.0, 10.0])
    none = np.zeros(2, dtype=int)
    q = np.deg2rad([[0.0], [10.0]])
    pair = np.full((2, 2), -1)
    return KnownRolls(none, none, roll, q, np.array(room), np.array(held), pair, np.full((2, 3), np.nan))


@pytest.mark.parametrize("share", [0.05, 0.5, 0.95, 1.05])
def test_what_is_less_deep_at_both_rolls_than_the_arm_goes_between_them_may_be_free_there(share):
    travel = 0.2  # m from one roll to the other
    context = SimpleNamespace(
        placed=SimpleNamespace(axes=lambda q, _: q),
        screen=SimpleNamespace(travel_bound=lambda radius, a, b: np.full(len(a), travel)),
        radius=np.ones(1),
    )
    deep = -share * travel / 2
    assert _may_hide(context, looked((deep, deep), (0.0, 0.0))).tolist() == [True]
    assert _may_hide(context, looked((-travel, -travel), (0.0, 0.0))).tolist() == [False]
    gap = np.deg2rad(10.0)
    assert _may_hide(context, looked((-1e-3, -1e-3), (share * gap / 2, share * gap / 2))).tolist() == [share < 1]
    assert gap > FINEST
