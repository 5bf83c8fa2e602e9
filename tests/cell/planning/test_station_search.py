"""The quick search of a bead against the full one, and what it must leave to it."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest
import trimesh
from support.jobs.boss_motion import boss_case
from support.jobs.searches import setup_of

from cell.planning.bead_plan import plan_bead
from cell.planning.bead_search import BeadSearch
from cell.planning.configurations import nodes_at_rolls
from cell.planning.edges.edge_check import SearchedBead
from cell.planning.station_search import Ends, StationSearch
from cell.planning.stations import Spacing, stations
from ik.bead_path import ROLL_COST, move_price
from ik.roll import wrap


def beads_of(job):
    firsts = np.flatnonzero(np.diff(job.targets.bead, prepend=-1)).tolist()
    return list(zip(firsts, [*firsts[1:], len(job.targets.bead)], strict=True))


@pytest.fixture(scope="module")
def boss(tmp_path_factory):
    folder = tmp_path_factory.mktemp("quick")
    return setup_of(boss_case(folder, roll="free", sampling={"min_segment_mm": 2.0}))


def full(bead, roll_step, q_before=None):
    context = bead.context
    return BeadSearch(bead, nodes_at_rolls(context.solver, bead.placed, context.window, roll_step, context.limits)).run(
        q_before
    )


def travel_price(stretch, bead, roll_step):
    move = np.abs(np.diff(stretch.q_targets, axis=0)) / bead.speed
    turn = np.abs(wrap(np.diff(stretch.roll)))
    return float((move_price(move.max(axis=1), move.sum(axis=1)) + ROLL_COST / roll_step * turn).sum())


def test_it_finds_what_the_full_search_finds_at_no_higher_price(boss):
    job, context = boss
    step = context.settings.roll_step
    for first, stop in beads_of(job):
        bead = SearchedBead.of(context, first, stop)
        stretch = StationSearch(bead, step, Ends()).run()
        plan = full(bead, step)
        assert plan.whole
        (best,) = plan.stretches
        assert stretch is not None
        assert (stretch.first, stretch.stop) == (first, stop)
        # rolls between the samples are open to it, stations in between are not
        assert travel_price(stretch, bead, step) <= 1.1 * travel_price(best, bead, step) + 1e-3
        T = context.solver.chain.forward(stretch.q_targets)
        assert T[:, :3, 3] == pytest.approx(bead.placed.position, abs=1e-9)
        assert -T[:, :3, 2] == pytest.approx(bead.placed.normal, abs=1e-9)
        assert stretch.clearances.distance.min() >= context.settings.clearance
        edge, f = stretch.edge - first, stretch.fraction
        at = bead.placed.position
        chord = at[edge] + f[:, None] * (at[np.minimum(edge + 1, len(at) - 1)] - at[edge])
        assert stretch.position == pytest.approx(chord, abs=1e-9)


def test_it_begins_where_the_arm_comes_from_and_ends_well_off_what_it_is_told(boss):
    job, context = boss
    first, stop = beads_of(job)[1]
    bead, step = SearchedBead.of(context, first, stop), context.settings.roll_step
    plain = StationSearch(bead, step, Ends()).run()
    elsewhere = StationSearch(bead, step, Ends(end_off=[plain.q_targets[-1]])).run()
    assert np.abs(wrap(elsewhere.q_targets[-1] - plain.q_targets[-1])).max() >= np.deg2rad(40)
    # coming from there, that is where it begins: anything else is further
    back = StationSearch(bead, step, Ends(q_before=elsewhere.q_targets[0])).run()
    assert np.abs(back.q_targets[0] - elsewhere.q_targets[0]).max() < np.deg2rad(15)
    assert np.abs(back.q_targets[0] - plain.q_targets[0]).max() > np.deg2rad(15)


def test_stations_are_near_each_other_and_hold_both_ends(boss):
    _, context = boss
    rng = np.random.default_rng(3)
    position = np.cumsum(rng.uniform(0, 0.01, (200, 3)), axis=0)
    placed = replace(context.placed, position=position, normal=np.tile([0.0, 0.0, 1.0], (200, 1)))
    at = stations(placed, Spacing())
    assert (at[0], at[-1]) == (0, 199)
    length = np.linalg.norm(np.diff(position, axis=0), axis=1)
    along = np.concatenate([[0.0], np.cumsum(length)])[at]
    assert np.diff(along).max() <= 0.04 + 2 * length.max()
    angle = np.linspace(0, np.pi, 200)
    placed = replace(placed, normal=np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1), position=0 * position)
    assert np.diff(angle[stations(placed, Spacing())]).max() <= np.deg2rad(12) + 2 * np.pi / 199


def test_what_moves_with_the_tcp_collides_alike_in_every_branch(boss):
    _, context = boss
    nodes = nodes_at_rolls(context.solver, context.placed, context.window, context.settings.roll_step, context.limits)
    index = np.argwhere(np.isfinite(nodes.q[:20, ..., 0]))
    found = context.screen.clearances(nodes.q[tuple(index.T)], context.deposits_before[index[:, 0]])
    alike = (found.distance < context.settings.clearance) & context.screen.of_tool(found.pair)
    assert alike.any()
    assert not alike.all()
    pose = index[:, 0] * nodes.q.shape[1] + index[:, 1]
    depth = {}
    for k in np.flatnonzero(alike):
        depth.setdefault(pose[k], []).append(found.distance[k])
    for p, distances in depth.items():
        # the same hit, or a deeper one of the arm's
        assert np.ptp(distances) < 1e-6
        assert found.distance[pose == p].max() <= max(distances) + 1e-6


def neck(job, context, stretch, sample):
    """Where the first of the torch is that lies well beside the wire, m, world frame."""
    data = mujoco.MjData(job.scene.model)
    data.qpos[job.scene.table_qpos] = context.checker.table
    data.qpos[job.scene.arm_qpos] = stretch.q[sample]
    mujoco.mj_kinematics(job.scene.model, data)
    tcp = data.site(job.case.tool.tcp)
    wire = tcp.xmat.reshape(3, 3)[:, 2]
    off = data.geom_xpos[np.flatnonzero(job.scene.tool_geom)] - tcp.xpos
    aside = np.linalg.norm(np.cross(off, wire), axis=1)
    # turning the roll brings it away from there
    return tcp.xpos + off[np.argmin(np.where(aside > 0.07, np.linalg.norm(off, axis=1), np.inf))]


@pytest.fixture(scope="module")
def beside(boss, tmp_path_factory):
    """A bead whose plain way leads past a post, at its targets with little more room than it has to have."""
    job, context = boss
    folder = tmp_path_factory.mktemp("beside")
    bounds = beads_of(job)[0]
    plain = StationSearch(SearchedBead.of(context, *bounds), context.settings.roll_step, Ends()).run()
    at, least = neck(job, context, plain, 0), context.settings.clearance
    for gap in np.arange(0.02, 0.12, 0.004):
        place_mm = (1e3 * (at + np.array([0, gap, 0]))).tolist()
        post = {"name": "post", "box": {"size_mm": [8, 8, 8]}, "position_mm": place_mm}
        _, context = setup_of(boss_case(folder, roll="free", sampling={"min_segment_mm": 2.0}, fixtures=[post]))
        found = context.checker.clearances(plain.q_targets, context.deposits_before[slice(*bounds)])
        if found.distance.min() > least:
            break
    assert found.distance.min() < 1.8 * least
    return SearchedBead.of(context, *bounds)


@pytest.mark.slow
@pytest.mark.parametrize("search", ["quick", "full"])
def test_a_way_with_more_room_is_preferred(beside, search):
    context = beside.context
    step = context.settings.roll_step
    way = StationSearch(beside, step, Ends()).run() if search == "quick" else full(beside, step).stretches[0]
    found = context.checker.clearances(way.q_targets, beside.deposits_before)
    assert found.distance.min() > 1.9 * context.settings.clearance


@pytest.mark.slow
def test_a_post_between_stations_is_gone_round(tmp_path):
    # a bead most of the way round the body and back, stations far from each other
    far = Spacing(1.0, np.deg2rad(150))
    wall = trimesh.creation.box((30.0, 300.0, 3.0))
    wall.apply_translation([-20.0, 0, 60])
    wall.export(tmp_path / "wall.stl")
    case = {"part": {"sub_volumes": ["wall.stl"], "body": {"radius_mm": 20, "z_mm": [0, 120]}}, "roll": "free"}
    job, context = setup_of(boss_case(tmp_path, "open", **case))
    bounds = beads_of(job)[0]
    bead = SearchedBead.of(context, *bounds)
    straight = StationSearch(bead, context.settings.roll_step, Ends(), far).run()
    off = np.linalg.norm(straight.position[:, None] - bead.placed.position[stations(bead.placed, far)], axis=2).min(
        axis=1
    )
    here = int(np.argmax(off))
    at = neck(job, context, straight, here)
    post = {"name": "post", "box": {"size_mm": [8, 8, 8]}, "position_mm": (1e3 * at).tolist()}
    job, context = setup_of(boss_case(tmp_path, "post", **case, fixtures=[post]))
    hit = context.checker.clearances(straight.q, np.full(len(straight.q), context.deposits_before[bounds[0]]))
    assert hit.distance.min() < 0
    assert hit.distance[[0, -1]].min() > context.settings.clearance
    search = StationSearch(SearchedBead.of(context, *bounds), context.settings.roll_step, Ends(), far)
    stations_before = len(search.at)
    round_it = search.run()
    assert round_it is not None
    assert len(search.at) > stations_before
    assert round_it.clearances.distance.min() >= context.settings.clearance


def test_what_it_cannot_find_is_left_to_the_full_search(boss, monkeypatch):
    job, context = boss
    bounds = beads_of(job)[0]
    monkeypatch.setattr(StationSearch, "run", lambda self: None)
    assert plan_bead(context, *bounds, None).whole
