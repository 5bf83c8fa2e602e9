"""Joints of several turns: every configuration is listed, few of its standings, and each is looked at for itself."""

from __future__ import annotations

import numpy as np
from support.cells.arms import offset_wrist_arm, replaced, sampled, welder

from cell.case.read import load_case
from cell.job.job import prepare
from cell.planning.bead_search import BeadSearch
from cell.planning.configurations import nodes_at_rolls
from cell.planning.context import Context, settings_of
from cell.planning.edges.edge_check import SearchedBead
from cell.scene.placement import place_targets
from cell.scene.scene import table_angles
from ik.chain import Chain
from ik.solver import WINDOW, Solver


def turning(chain: Chain, turns: float) -> Chain:
    limit = np.full(chain.n, turns * np.pi)
    return replaced(chain, lower=-limit, upper=limit)


def test_limits_of_two_turns_lose_no_configuration_and_list_few_standings():
    for arm, seeds in ((offset_wrist_arm(), 16), (welder(), 1)):
        one, two = (Solver(s.chain, s.form, s.geometry, seeds) for s in _solvers(arm))
        Ts = one.chain.forward(sampled(one.chain, 12))
        a, b = (solver.candidates(Ts).q.reshape(len(Ts), -1, 6) for solver in (one, two))
        assert np.isfinite(b[..., 0]).sum() <= 8 * np.isfinite(a[..., 0]).sum(), "of 64"
        gap = np.abs((a[:, :, None] - b[:, None] + np.pi) % (2 * np.pi) - np.pi).max(axis=-1)
        least = np.nanmin(np.where(np.isfinite(gap), gap, np.inf), axis=2)
        here = np.isfinite(a[..., 0])
        if one.form is not None:  # a search may end in other solutions
            assert least[here].max() < 1e-6
        assert np.isfinite(b[..., 0]).any(axis=1).all()
        assert np.nanmax(np.abs(b)) > np.pi, "ways go on past half a turn"
        assert np.nanmax(np.abs(b)) <= WINDOW + 1e-9


def _solvers(arm):
    return Solver.for_chain(turning(arm, 1)), Solver.for_chain(turning(arm, 2))


def test_two_turns_of_one_joint_alone_are_listed_whole():
    chain = welder()  # A6 has +-350 deg
    q = Solver.for_chain(chain).candidates(chain.forward(sampled(chain, 40))).q
    assert np.nanmax(np.abs(q[..., 5])) > np.deg2rad(300)


def test_configurations_of_a_search_are_looked_at_one_by_one(make_case):
    path = make_case(ik={"solver": "dls", "seeds": 6}, roll={"range_deg": [-60, 60]})
    job = prepare(load_case(path))
    settings, table = settings_of(job), table_angles(job.scene, 90, 180)
    placed = place_targets(job.targets, job.scene.T_base_part(*table))
    context = Context.of(job, table)
    some = slice(0, 4)
    nodes = nodes_at_rolls(job.solver, placed.rows(some), job.window, settings.roll_step, context.limits)
    search = BeadSearch(SearchedBead.of(context, 0, 4), nodes)
    mixed = 0
    for i in range(4):
        search._judge_targets(np.array([i]))
        index = np.argwhere(np.isfinite(nodes.cost[i]))
        q = nodes.q[i][tuple(index.T)]
        free = context.screen.clearances(q, np.repeat(job.deposits_before[i], len(q))).distance >= settings.clearance
        assert search._free[i][tuple(index.T)].tolist() == free.tolist()
        mixed += len(np.unique(np.column_stack([index[:, 0], free]), axis=0)) > len(np.unique(index[:, 0]))
    assert mixed > 0
