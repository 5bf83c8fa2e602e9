"""What would help: changes that hold when they are made, no larger than they need be, and none made up."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import yaml

from cell.case.read import load_case, with_changes
from cell.cli.check_command import HELP_CHECKS, HELP_SECONDS
from cell.cli.main import main
from cell.failure import Failure, Kind
from cell.job.job import prepare
from cell.planning import infeasible_part
from cell.remedy_search import search as remedies_module
from cell.remedy_search.changes import CheckedCase, single_changes, table_pose_change
from cell.remedy_search.screening import Screening
from cell.remedy_search.search import remedies
from cell.remedy_search.target_groups import target_groups
from cell.scene.placement import place_targets
from cell.verdict.check import check_fixed
from cell.verdict.result import TargetVerdict
from ik.roll import apply_roll
from slicing.targets.targets import Targets

FEW = {"slicing": {"h_layer_mm": 3, "h_min_mm": 2, "h_max_mm": 4}}


def start_of(path):
    case = load_case(path)
    return CheckedCase(prepare(case), case.table.E1_deg, case.table.E2_deg)


def lines(count, beads):
    """Straight beads side by side, one a layer, 3 mm between targets and 2 mm between layers."""
    n = count * beads
    layer = np.repeat(np.arange(beads), count)
    along = np.tile(3.0 * np.arange(count), beads)
    position = np.column_stack([along, np.zeros(n), 2.0 * layer])
    x, z = np.tile([1.0, 0, 0], (n, 1)), np.tile([0, 0, 1.0], (n, 1))
    zero = np.zeros(n, dtype=int)
    return Targets(("SV1",), zero, layer, layer, position, z, x, np.full(n, 2.0), np.zeros(beads, dtype=bool))


def test_groups_are_connected_and_of_one_reason():
    targets = lines(10, 3)
    reasons = [None] * 30
    for i in (2, 3, 12, 13, 23):  # neighbours over three layers
        reasons[i] = "singular"
    reasons[4] = "collision"  # next to them, for another reason
    for i in (8, 28):  # two layers apart
        reasons[i] = "singular"
    found = [(g.reason, g.targets.tolist()) for g in target_groups(targets, reasons)]
    assert found[0] == ("singular", [2, 3, 12, 13, 23])
    assert sorted(found[1:]) == [("collision", [4]), ("singular", [8]), ("singular", [28])]
    assert target_groups(targets, [None] * 30) == []


@pytest.mark.parametrize("roll", [pytest.param({"fixed_deg": -20}, marks=pytest.mark.slow), {"range_deg": [-30, 40]}])
def test_what_is_screened_is_what_the_changed_case_has(roll, make_case):
    # one configuration of the arm as it is, at the screened pose, stands at the changed case's own pose
    path = make_case(**FEW, roll=roll)
    if "range_deg" in roll:
        content = yaml.safe_load(path.read_text())
        content.pop("support")
        content["part"]["rotation_deg"] = 30
        path.write_text(yaml.safe_dump(content))
    start = start_of(path)
    index = np.arange(0, len(start.job.targets), 5)
    seen = set()
    for change in [*single_changes(start, slower=True), table_pose_change(start)]:
        size = change.steps[len(change.steps) // 2]
        Ts, normal = start.poses(change, size, index)
        window = start.window(change, size)
        job, e1, e2 = start.changed(change, size)
        placed = place_targets(job.targets, job.scene.T_base_part(*np.deg2rad([e1, e2])))
        np.testing.assert_allclose(normal, placed.normal[index], atol=1e-12)
        q = start.job.solver.candidates(apply_roll(Ts, np.full(len(Ts), window.low))).raw
        ok = np.isfinite(q[..., 0])
        own = apply_roll(placed.Ts_base_target[index], np.full(len(index), job.window.low))
        there = np.broadcast_to(own[:, None], (*ok.shape, 4, 4))[ok]
        np.testing.assert_allclose(job.solver.chain.forward(q[ok]), there, atol=1e-9)
        assert np.isclose(job.window.high - job.window.low, window.high - window.low)
        if change.key == "process.deposition_speed_mm_s":
            assert (job.targets.speed_mm_s == job.case.process.deposition_speed_mm_s).all()
            assert (job.targets.speed_mm_s < start.job.targets.speed_mm_s).all()
        seen.add(change.family)
    assert {key for key, _ in seen} >= {"roll", "table.E1_deg", "table.E2_deg", "table", "positioner.position_mm"}
    assert ("part.position_mm", "x") in seen or ("support.height_mm", "") in seen


def test_a_positioner_that_was_measured_is_not_shifted(make_case):
    start = start_of(make_case(**FEW))
    assert any(change.key == "positioner.position_mm" for change in single_changes(start))
    case = start.job.case
    measured = {**case.positioner.model_dump(), "calibration": {"root_mm_deg": (1500, 0, 0, -90, 0, 0)}}
    start = replace(start, job=replace(start.job, case=with_changes(case, positioner=measured)))
    assert not any(change.key == "positioner.position_mm" for change in single_changes(start))


def with_change(path, change):
    """The case file with a change written into it."""
    content = yaml.safe_load(path.read_text())
    *sections, key = change["key"].split(".")
    here = content
    for name in sections:
        here = here.setdefault(name, {})
    here[key] = change["to"]
    path.write_text(yaml.safe_dump(content))
    return load_case(path)


def test_a_gravity_limit_asks_for_the_least_tilt_that_keeps_it(make_case):
    path = make_case(**FEW, roll={"fixed_deg": 0}, checks={"gravity_max_deg": 30}, table={"E1_deg": 20})
    start = start_of(path)
    result = check_fixed(start.job, 20, 180)
    best = next(iter(remedies(result)))
    assert best.checked == "part"
    assert best.left == 0
    # by the normals alone: the first whole degree at which all are within 30 degrees of up
    up = start.job.scene.T_world_base()[2, :3]
    for e1 in range(21, 91):
        normal = place_targets(start.job.targets, start.job.scene.T_base_part(*np.deg2rad([e1, 180]))).normal
        if (np.rad2deg(np.arccos(normal @ up)) <= 30).all():
            break
    assert best.change == {"key": "table.E1_deg", "from": 20.0, "to": float(e1)}
    case = with_change(path, best.change)
    assert check_fixed(prepare(case), case.table.E1_deg, case.table.E2_deg).feasible
    assert f"E1 20 -> {e1} (checked: whole part feasible)" in best.sentence


@pytest.mark.slow
def test_what_is_said_of_a_group_is_what_a_check_of_the_changed_case_gives(make_case):
    path = make_case(**FEW, roll={"fixed_deg": -60}, table={"E1_deg": -45, "E2_deg": 0})
    result = check_fixed(prepare(load_case(path)), -45, 0)
    assert not result.feasible
    found = [r for r in remedies(result) if r.change is not None]
    assert found
    for remedy in found:
        case = with_change(path, remedy.change)
        after = check_fixed(prepare(case), case.table.E1_deg, case.table.E2_deg)
        assert after.infeasible == remedy.left
        assert (remedy.checked == "part") == after.feasible
        assert all(after.rows[i].reason is None for i in remedy.targets)
        path = make_case(**FEW, roll={"fixed_deg": -60}, table={"E1_deg": -45, "E2_deg": 0})


def test_screening_refuses_nothing_that_can_be_reached(make_case):
    start = start_of(make_case(**FEW, roll={"fixed_deg": -60}, table={"E1_deg": -45, "E2_deg": 0}))
    n = len(start.job.targets)
    screening = Screening(start, range(n), [])
    some = [change for change in single_changes(start) if change.key in ("roll", "positioner.position_mm")][:4]
    screening.add(some)
    for change in some:
        for k in (0, len(change.steps) // 2, -1):
            Ts, _ = start.poses(change, change.steps[k], screening.sample)
            window = start.window(change, change.steps[k])
            rolls = np.linspace(window.low, window.high, 9)
            c = start.job.solver.candidates(apply_roll(Ts[:, None], rolls).reshape(-1, 4, 4))
            from ik.singularity import margins

            solver = start.job.solver
            keeps = margins(solver.chain, solver.geometry, c.q) >= start.job.singularity_limits.values(True)
            sampled = keeps.all(axis=-1).any(axis=(1, 2)).reshape(len(Ts), -1).any(axis=1)
            assert screening.reached[change][k][sampled].all()


def test_what_a_changed_case_leaves_open_is_not_called_mended(make_case, monkeypatch):
    monkeypatch.setattr(infeasible_part, "FLOOR", 0)
    lid = {"name": "lid", "box": {"size_mm": [10, 300, 300]}, "position_mm": [-78, 0, 120], "on": "table"}
    result = check_fixed(prepare(load_case(make_case(**FEW, fixtures=[lid]))), 90, 180)
    found = target_groups(result.job.targets, [None if row.failure is None else row.reason for row in result.rows])
    search = remedies_module._RemedySearch(result, found, lambda: None, np.inf)
    one = next(change for change in search.changes if not change.other_targets)
    after = check_fixed(*search.start.changed(one, one.steps[0]))
    left_open = {i for i, row in enumerate(after.rows) if not row.looked_at}
    assert left_open
    every = np.arange(len(result.rows))
    assert search._blame(one, one.steps[0], every, True) == left_open | set(after.failures)


@pytest.mark.slow
def test_nothing_is_made_up_where_nothing_helps(make_case):
    result = check_fixed(prepare(load_case(make_case(**FEW, positioner={"position_mm": [4000, 0, 0]}))), 90, 180)
    (only,) = remedies(result)
    assert only.change is None
    assert only.checked is None
    assert only.sentence.startswith("no single change found")
    assert "E1 -135 .. 135 deg" in only.sentence
    assert "positioner by up to 300 mm" in only.sentence


def test_without_a_closed_form_it_is_searched_all_the_same(make_case):
    few = {"slicing": {"h_layer_mm": 5, "h_min_mm": 4, "h_max_mm": 6}, "ik": {"solver": "dls", "seeds": 4}}
    path = make_case(**few, roll={"fixed_deg": 0}, checks={"gravity_max_deg": 30}, table={"E1_deg": 55})
    result = check_fixed(prepare(load_case(path)), 55, 180)
    assert [reason for reason, k in result.reasons.items() if k] == ["gravity"]
    best = next(iter(remedies(result)))
    assert best.checked == "part"
    assert best.change["key"] == "table.E1_deg"


def test_the_command_says_it_and_writes_it(make_case, tmp_path, capsys, monkeypatch):
    bad = make_case(**FEW, roll={"fixed_deg": 0}, checks={"gravity_max_deg": 30}, table={"E1_deg": 55})
    out = tmp_path / "r.json"
    assert main(["check", str(bad), "--json", str(out)]) == 1
    said = capsys.readouterr().out
    first = json.loads(out.read_text())["help"][0]
    assert set(first) == {"targets", "reason", "change", "checked", "infeasible_left", "sentence"}
    assert f"what would help: {first['sentence']}" in said
    assert main(["check", str(bad), "--no-remedies", "--json", str(out)]) == 1
    assert json.loads(out.read_text())["help"] == []
    assert "what would help" not in capsys.readouterr().out

    def cut_off(*args):
        yield from [next(iter(remedies(*args)))]
        raise KeyboardInterrupt

    monkeypatch.setattr(remedies_module, "remedies", cut_off)
    assert main(["check", str(bad), "--json", str(out)]) == 1  # the verdict stands, and so does what was found
    assert json.loads(out.read_text())["help"] == [first]
    assert "interrupted" in capsys.readouterr().err


def test_the_search_has_the_time_that_is_promised(make_case, monkeypatch):
    given = []

    def noted(result, progress, seconds):
        given.append(seconds / (HELP_SECONDS + HELP_CHECKS * result.seconds))
        return []

    monkeypatch.setattr(remedies_module, "remedies", noted)
    far = str(make_case(**FEW, positioner={"position_mm": [4000, 0, 0]}))
    assert main(["check", far]) == main(["check", far, "--remedies"]) == 1
    assert given == [1.0, np.inf]


@pytest.mark.parametrize(("left_s", "has"), [(6.0, True), (4.0, False)])
def test_no_check_is_begun_that_would_not_end_in_time(left_s, has, monkeypatch):
    search = SimpleNamespace(deadline=100.0, result=SimpleNamespace(seconds=5.0), left=3)
    monkeypatch.setattr(remedies_module, "time", SimpleNamespace(process_time=lambda: 100.0 - left_s))
    assert remedies_module._RemedySearch._has_time(search) == has
    assert search.left == (3 if has else 0)


@pytest.mark.parametrize(
    ("bad", "unseen", "checked", "said"),
    [
        (set(), 0, "part", "(checked: whole part feasible)"),
        ({7}, 0, "group", "(checked: these 2 targets feasible, 1 of the part not)"),
        ({7, 8, 9}, 2, "group", "(checked: these 2 targets feasible, 1 of the part not, 2 not checked)"),
    ],
)
def test_a_remedy_says_what_its_check_found(bad, unseen, checked, said):
    class Tilt:
        def words(self, was, to):
            return f"E1 {was} -> {to}"

        def effort(self, size):
            return size

    change = Tilt()
    start = SimpleNamespace(describe=lambda change, size: {"key": "table.E1_deg", "from": 0.0, "to": size})
    search = SimpleNamespace(checked={(change, 5.0): bad}, unseen={(change, 5.0): unseen}, start=start)
    found = remedies_module._RemedySearch._remedy(search, change, 5.0, np.array([2, 3]), "gravity")
    assert (found.checked, found.left) == (checked, len(bad) - unseen)
    assert found.sentence == f"E1 0.0 -> 5.0 {said}"


def test_nothing_is_searched_for_what_no_change_of_the_cell_mends(make_case, monkeypatch):
    found = check_fixed(prepare(load_case(make_case(**FEW, roll={"fixed_deg": 0}))), 90, 180)
    rows, lost = list(found.rows), [2, 3, 9]
    for i in lost:
        rows[i] = TargetVerdict(Failure(Kind.OVERHANG, 6.0, 2.5), None)
    overhanging = replace(found, rows=tuple(rows), motion=None)
    with monkeypatch.context() as patch:
        patch.delattr(remedies_module, "_RemedySearch")
        for moved in (None, found.tables):
            only = list(remedies(replace(overhanging, moved=moved)))
            assert [(r.targets.tolist(), r.reason, r.change, r.left) for r in only] == [(lost, "overhang", None, 3)]
            assert "checks.overhang_mm" in only[0].sentence
    # with another reason beside it, or beads of another slicer, which the table may carry, there is something to search
    searched = []
    monkeypatch.setattr(remedies_module._RemedySearch, "run", lambda *args: searched.append(args) or [])
    rows[5] = TargetVerdict(Failure(Kind.COLLISION, 1e-3, 5e-3), None)
    theirs = replace(found.job, overhanging_beads=(None,))
    for result in (replace(overhanging, rows=tuple(rows)), replace(overhanging, job=theirs)):
        before = len(searched)
        list(remedies(result, seconds=0.0))
        assert len(searched) > before


def test_a_feasible_case_needs_no_help(make_case):
    assert list(remedies(check_fixed(prepare(load_case(make_case(**FEW, roll={"fixed_deg": 0}))), 90, 180))) == []
