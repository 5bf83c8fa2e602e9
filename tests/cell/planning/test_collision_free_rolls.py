"""A roll between the samples is only called reachable where the arm can stand there."""

from __future__ import annotations

import numpy as np
import pytest

from cell.case.read import load_case
from cell.job.job import prepare
from cell.planning.collision_free_rolls import standing_between
from cell.planning.configurations import evaluate
from cell.planning.context import Context, settings_of
from cell.scene.placement import place
from cell.scene.scene import table_angles
from ik.reachability_proof import certify


@pytest.mark.parametrize("blocked", [False, True])
def test_a_roll_is_called_reached_alone_only_where_nothing_is_in_the_way(make_case, blocked):
    block = {"name": "block", "box": {"size_mm": [600, 600, 600]}, "position_mm": [600, 0, 900]}
    job = prepare(load_case(make_case(fixtures=[block] if blocked else [])))
    table, settings = table_angles(job.scene, 90, 180), settings_of(job)
    placed = place(job.targets, job.scene.T_base_part(*table))
    context = Context.of(job, table)
    nodes = evaluate(job.solver, placed.rows(slice(0, 1)), job.window, settings.roll_step, context.limits)
    T = placed.Ts_base_target[0]
    roll = float(certify(job.solver.chain, T[None], job.window, context.limits, job.solver.form).roll[0])
    hint = standing_between(context, nodes, T, int(job.deposits_before[0]), roll)
    if blocked:
        assert hint.collision.measure < 5
        assert abs(hint.roll_deg - np.rad2deg(roll)) < 6.001
    else:
        assert hint.collision is None
