"""A part that cannot be built: what is looked at is judged as without a budget, and the rest is left open."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import mujoco
import numpy as np
import pytest
from support.paths import ROOT

from cell.case.read import load_case
from cell.cli.arguments import CHECK_TEXT
from cell.collision.checker import Checker
from cell.collision.proofs.reach_radii import tool_radii
from cell.job.job import Job, prepare
from cell.planning import infeasible_part
from cell.planning.bead_outcome import BeadPlan
from cell.planning.collision_free_rolls import checked_rolls, collision_free_rolls, free_nowhere
from cell.planning.context import Context
from cell.planning.edges.edge_check import SearchedBead
from cell.planning.infeasible_part import InfeasiblePartJudge, lost_alone
from cell.planning.station_search import HIT, Ends, StationSearch
from cell.planning.unreachable import unreachable
from cell.scene.scene import table_angles
from cell.verdict.check import check_fixed
from cell.verdict.result import NOT_LOOKED_AT, Result
from ik.roll import apply_roll

# leaves no room for the nozzle above the last layers, at any roll
LID = {"name": "lid", "box": {"size_mm": [10, 300, 300]}, "position_mm": [-78, 0, 120], "on": "table"}
# leaves room on one side of a boss
POST = {"name": "post", "box": {"size_mm": [120, 12, 60]}, "position_mm": [-120, 9, 120], "on": "table"}


@pytest.fixture
def job_with(make_case):
    def made(*fixtures: dict, every: bool = False, **sections: dict) -> Job:
        path = make_case(fixtures=list(fixtures), checks={"every_target": every}, **sections)
        return prepare(load_case(path))

    return made


@pytest.fixture
def nothing_over(monkeypatch):
    monkeypatch.setattr(infeasible_part, "FLOOR", 0)


def asked(monkeypatch, job: Job) -> tuple[Result, int]:
    """A verdict, and how many configurations collision detection was asked about."""
    count, really = [0], Checker.clearances

    def counted(self, q, deposits_laid, *met):
        count[0] += len(q)
        return really(self, q, deposits_laid, *met)

    with monkeypatch.context() as patch:
        patch.setattr(Checker, "clearances", counted)
        return check_fixed(job, 90, 180), count[0]


@pytest.mark.parametrize("fixture", [pytest.param(LID, marks=pytest.mark.slow), POST], ids=["all", "share"])
def test_what_is_looked_at_is_judged_as_if_all_were(job_with, nothing_over, fixture):
    found, whole = check_fixed(job_with(fixture), 90, 180), check_fixed(job_with(fixture, every=True), 90, 180)
    assert whole.not_looked_at == 0
    assert 0 < found.not_looked_at < len(found.rows)
    assert found.infeasible > 0
    for one, other in zip(found.rows, whole.rows, strict=True):
        if one.looked_at:
            assert (one.verdict, one.reason) == (other.verdict, other.reason)


def test_nothing_that_was_left_out_is_counted(job_with, nothing_over):
    found = check_fixed(job_with(LID), 90, 180)
    assert sum(found.reasons.values()) == found.infeasible == len(found.failures)
    assert found.looked_at + found.not_looked_at == len(found.rows)
    assert not found.feasible
    frame = found.to_frame()
    open_ = ~frame["looked_at"]
    assert open_.sum() == found.not_looked_at > 0
    assert not frame["feasible"][open_].any()
    assert set(frame["reason"][open_]) == {NOT_LOOKED_AT}
    assert np.isnan(frame["A1_deg"][open_]).all()


@pytest.mark.slow
def test_the_same_is_looked_at_every_time(job_with, nothing_over):
    one, other = (check_fixed(job_with(POST), 90, 180) for _ in range(2))
    assert [row.detail for row in one.rows] == [row.detail for row in other.rows]
    assert [row.verdict for row in one.rows] == [row.verdict for row in other.rows]


def test_a_part_that_is_small_enough_is_looked_at_whole(job_with):
    assert check_fixed(job_with(LID), 90, 180).not_looked_at == 0


@pytest.mark.parametrize("fixture", [pytest.param(LID, marks=pytest.mark.slow), POST], ids=["all", "share"])
def test_no_is_said_at_no_more_than_half_again_of_the_work_for_yes(monkeypatch, job_with, nothing_over, fixture):
    good, most = asked(monkeypatch, job_with())
    assert good.feasible
    bad, work = asked(monkeypatch, job_with(fixture))
    assert not bad.feasible
    assert work <= 1.5 * most


def test_contacts_are_charged_as_well_as_configurations(monkeypatch, job_with):
    job = job_with()
    t = job.targets
    context = context_of(replace(job, targets=replace(t, normal=-t.normal)))  # from within the part
    seen, really = [], Checker._collide

    def counted(self, far):
        seen.append(really(self, far))
        return seen[-1]

    monkeypatch.setattr(Checker, "_collide", counted)
    judge, before = InfeasiblePartJudge(context, 0), context.work
    all_of_it = judge.left(0)
    assert len(lost_alone(context, [0, 1, 2, 3])) == 4
    judge.charge(before)
    assert sum(seen) > 5 * len(seen)
    # each costs a twentieth of a configuration, about
    assert judge.spent == pytest.approx(len(seen) + sum(seen) / 20)
    assert judge.left(0) == pytest.approx(all_of_it - judge.spent)


def test_a_bead_that_comes_out_whole_is_charged_for_what_is_not_easy(job_with, monkeypatch):
    context = context_of(job_with())
    stop = int(np.flatnonzero(np.diff(context.laid) > 0)[0]) + 1 if np.diff(context.laid).any() else 8
    whole = BeadPlan(0, stop, (), {}, {})

    def charged(asked: int) -> float:
        judge = InfeasiblePartJudge(context, 0)

        def in_full(_: float | None) -> BeadPlan:
            context.checker.asked.count += asked
            return whole

        assert judge.affords(0, stop)
        assert judge.plan(0, stop, None, in_full) is whole
        assert not judge.lost
        return judge.spent

    assert charged(infeasible_part.EASY * stop) == 0
    assert charged(infeasible_part.EASY * stop + 100) == 100


def test_a_bead_beyond_the_budget_is_postponed_in_the_first_pass_alone(job_with, nothing_over):
    context = context_of(job_with())
    for full_searches, postponed in ((0, True), (1, False)):
        judge = InfeasiblePartJudge(context, 0, full_searches=full_searches)
        judge.spent = 1e9
        bead = judge.plan(0, 4, None, lambda _: BeadPlan(0, 4, (), {}, {}))
        assert (bead is None) == postponed
        assert not judge.lost


def test_out_of_reach_is_proved_for_all_without_a_question_about_collisions(monkeypatch, job_with, nothing_over):
    job = job_with(positioner={"position_mm": [6000, 0, 0]})
    found, work = asked(monkeypatch, job)
    assert found.not_looked_at == 0
    assert found.reasons["unreachable"] == len(found.rows)
    assert all(row.proved for row in found.rows)
    assert work < len(found.rows)


def context_of(job: Job) -> Context:
    return Context.of(job, table_angles(job.scene, 90, 180))


def test_targets_judged_together_are_judged_as_one_by_one(job_with):
    context = context_of(job_with(POST))
    some = list(range(0, len(context.deposits_before), max(len(context.deposits_before) // 12, 1)))
    together = lost_alone(context, some)
    assert 0 < len(together) < len(some)
    alone = {i: m for i in some for m in [lost_alone(context, [i]).get(i)] if m is not None}
    assert {i: m.failure for i, m in together.items()} == {i: m.failure for i, m in alone.items()}
    assert not unreachable(context, some)


@pytest.mark.parametrize("away_mm", [pytest.param(9, marks=pytest.mark.slow), 60])
def test_a_turn_of_the_roll_frees_nothing_before_the_angle_said(job_with, away_mm):
    x, _, z = POST["position_mm"]
    context = context_of(job_with(POST | {"position_mm": [x, away_mm, z]}))
    some = np.arange(0, len(context.deposits_before), max(len(context.deposits_before) // 8, 1))
    rolls = np.deg2rad(np.arange(-180, 180, 20.0))
    target, roll = np.repeat(some, len(rolls)), np.tile(rolls, len(some))
    looked = checked_rolls(context, target, roll)
    held = np.flatnonzero(looked.held > 0)
    assert len(held) > 10
    if away_mm >= 30:  # of these some are free at other rolls
        assert np.isin(looked.target[held], looked.free_targets()).any()
    for share in (-0.98, -0.5, 0.5, 0.98):
        turned = looked.roll[held] + share * np.minimum(looked.held[held], np.pi)
        Ts = apply_roll(context.placed.rows(looked.target[held]).Ts_base_target, turned)
        q = context.solver.candidates(Ts).q
        row, g, k = np.nonzero(np.isfinite(q[..., 0]))
        seen = context.screen.clearances(q[row, g, k], context.deposits_before[looked.target[held[row]]])
        assert (seen.distance < context.settings.clearance).all()


def test_the_tool_is_nowhere_further_from_the_wire_than_said(job_with):
    scene = job_with().scene
    model, data = scene.model, mujoco.MjData(scene.model)
    data.qpos[scene.arm_qpos] = scene.home
    mujoco.mj_forward(model, data)
    tcp, found = scene.sites["tcp"], tool_radii(scene)
    corners = np.array(list(product((-1, 1), repeat=3)))
    for g in np.flatnonzero(scene.tool_geom):
        box = model.geom_aabb[g]
        half = box[3:] / np.sqrt(3.0)  # inside it, whatever its shape is within its box
        points = data.geom_xpos[g] + (box[:3] + corners * half * [0, 0, 1]) @ data.geom_xmat[g].reshape(3, 3).T
        local = (points - data.site_xpos[tcp]) @ data.site_xmat[tcp].reshape(3, 3)
        assert np.hypot(local[:, 0], local[:, 1]).max() <= found[g] + 1e-9
    assert np.isinf(found[~scene.tool_geom]).all()


def test_the_tool_reaches_as_far_from_the_wire_as_said(job_with):
    scene = job_with().scene
    model, data = scene.model, mujoco.MjData(scene.model)
    data.qpos[scene.arm_qpos] = scene.home + 0.1  # the same wherever the arm stands
    mujoco.mj_forward(model, data)
    tcp, found, kinds = scene.sites["tcp"], tool_radii(scene), set()
    wire, at = data.site_xmat[tcp].reshape(3, 3)[:, 2], data.site_xpos[tcp]
    for g in np.flatnonzero(np.isfinite(found)).tolist():
        kind, size, R = int(model.geom_type[g]), model.geom_size[g], data.geom_xmat[g].reshape(3, 3)
        kinds.add(kind)
        ends, thick = np.array([[0, 0, -size[1]], [0, 0, size[1]]]), size[0]
        if kind == mujoco.mjtGeom.mjGEOM_MESH:
            mesh = model.geom_dataid[g]
            first = model.mesh_vertadr[mesh]
            ends, thick = model.mesh_vert[first : first + model.mesh_vertnum[mesh]].astype(float), 0.0
        off = np.linalg.norm(np.cross(data.geom_xpos[g] + ends @ R.T - at, wire), axis=1).max()
        assert found[g] == pytest.approx(off + thick, abs=1e-7)
    assert kinds <= {mujoco.mjtGeom.mjGEOM_MESH, mujoco.mjtGeom.mjGEOM_CAPSULE, mujoco.mjtGeom.mjGEOM_CYLINDER}
    assert mujoco.mjtGeom.mjGEOM_MESH in kinds or len(kinds) > 1


def without_holding(context: Context) -> Context:
    """The same where no turn is known by which the tool stays in a collision."""
    out = replace(context)
    out.__dict__["tool_radius"] = np.full(len(context.tool_radius), np.inf)
    return out


@pytest.mark.slow
@pytest.mark.parametrize("fixture", [LID, POST], ids=["all", "share"])
def test_targets_that_are_free_nowhere_are_those_without_a_free_roll(job_with, fixture):
    job = job_with(fixture)
    context, step = context_of(job), np.deg2rad(5.0)
    some = list(range(0, len(context.deposits_before), max(len(context.deposits_before) // 20, 1)))
    begun = context.asked
    found, work = free_nowhere(context, some, step), context.asked - begun
    stretches = collision_free_rolls(without_holding(context_of(job)), some, step)
    assert set(found) == {i for i, free in stretches.items() if not free}
    assert len(found) == len(some) if fixture is LID else 0 < len(found) < len(some)
    assert work < 20 * len(some)  # of 72 rolls in 8 branches
    for i, best in found.items():
        assert best is not None
        T = apply_roll(context.placed.rows([i]).Ts_base_target, np.array([best.roll]))
        assert context.solver.chain.forward(best.q[None])[0] == pytest.approx(T[0], abs=1e-9)
        seen = context.screen.clearances(best.q[None], context.deposits_before[[i]])
        assert best.clearances.distance[0] == pytest.approx(seen.distance[0], abs=1e-6)
        assert best.clearances.distance[0] < context.settings.clearance


@pytest.mark.parametrize("lost", [[1], [0, 2]], ids=["one", "every second"])
def test_layers_that_are_lost_leave_the_others_as_they_are(monkeypatch, job_with, nothing_over, lost):
    job = job_with()
    good, most = asked(monkeypatch, job)
    t = job.targets
    wrong = np.isin(t.layer, lost)
    assert 0 < wrong.sum() < len(wrong)
    assert not wrong[-1]
    bad, work = asked(monkeypatch, replace(job, targets=replace(t, normal=np.where(wrong[:, None], -1, 1) * t.normal)))
    assert good.feasible
    assert {i for i, row in enumerate(bad.rows) if row.reason is not None} <= set(np.flatnonzero(wrong).tolist())
    assert all(row.looked_at and row.reason is None for row, off in zip(bad.rows, wrong, strict=True) if not off)
    assert work <= 1.25 * most


def test_of_targets_that_are_free_a_few_rolls_are_looked_at(job_with):
    context = context_of(job_with())
    some, before = range(len(context.deposits_before)), context.asked
    assert free_nowhere(context, some, np.deg2rad(5.0)) == {}
    assert context.asked - before < 16 * len(some)


@pytest.mark.parametrize("fixture", [LID, POST], ids=["all", "share"])
def test_rolls_that_a_quick_search_takes_for_lost_collide(job_with, fixture):
    context = context_of(job_with(fixture))
    firsts = np.flatnonzero(np.diff(job_with(fixture).targets.bead, prepend=-1))
    search = StationSearch(SearchedBead.of(context, int(firsts[-1]), len(context.laid)), np.deg2rad(10), Ends())
    before = context.asked
    assert search.cheapest_path() is None
    looks = context.asked - before
    s, g, r = np.nonzero((search.known == HIT) & np.isfinite(search.cost))
    assert len(s) > 2 * looks > 0  # most were not looked at
    at = context.deposits_before[firsts[-1] + search.at[s]]
    assert (context.screen.clearances(search.q[:, s, g, r].T, at).distance < context.settings.clearance).all()


@pytest.mark.parametrize("fixture", [LID, pytest.param(POST, marks=pytest.mark.slow)], ids=["all", "share"])
def test_rolls_at_which_the_tool_is_held_hide_nothing(job_with, fixture):
    context = context_of(job_with(fixture))
    some = list(range(0, len(context.deposits_before), max(len(context.deposits_before) // 6, 1)))
    step = np.deg2rad(5.0)
    found, work = collision_free_rolls(context, some, step), context.asked
    everywhere = without_holding(context_of(job_with(fixture)))
    assert found == collision_free_rolls(everywhere, some, step)
    assert work < everywhere.asked


def test_help_and_formats_say_how_much_of_a_lost_part_is_looked_at() -> None:
    small = f"({infeasible_part.FLOOR:,} for parts of up to {infeasible_part.SMALL} targets)"
    most = f"{infeasible_part.LARGE_FLOOR:,} configurations {small}"
    formats = (ROOT / "docs" / "formats.md").read_text(encoding="utf-8")
    assert f"{most} and {infeasible_part.PER_TARGET} more for each target" in " ".join(CHECK_TEXT.split())
    assert f"{most} and {infeasible_part.PER_TARGET} more for each target" in " ".join(formats.split())
    assert f"takes more than {infeasible_part.EASY} configurations for each of its targets" in " ".join(formats.split())
