"""Layers that are said to lock the torch out: without them what failed can be welded, and nothing else is said of."""

from __future__ import annotations

import numpy as np

from cell.case.read import load_case
from cell.job.job import prepare
from cell.planning.bead_plan import plan_bead
from cell.planning.blocking_layers import _bead_trial
from cell.planning.context import Context

# leaves room for the nozzle above some targets of a layer and not above others
POST = {"name": "post", "box": {"size_mm": [120, 12, 60]}, "position_mm": [-120, 9, 120], "on": "table"}


def test_what_is_in_the_way_of_a_fixture_is_blamed_on_no_layer(make_case) -> None:
    job = prepare(load_case(make_case(fixtures=[POST])))
    context = Context.of(job, (np.deg2rad(90), np.deg2rad(180)))
    bead = plan_bead(context, 0, int(np.searchsorted(job.targets.bead, 1)), None)
    failed = bead.target_failures.keys() | bead.edge_failures.keys()
    assert failed
    trial = _bead_trial(bead, set(failed), np.inf)
    assert trial.works(context) == set()  # nothing was taken away
    assert not trial.may_work(context)
