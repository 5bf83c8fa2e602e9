"""The sweep: same verdicts as single checks, independent of who computes, resumable."""

import csv
import io
import json
import pickle

import numpy as np
import pytest
import yaml
from support.jobs.indexed import three_case, with_table

from cell.case.fingerprint import fingerprint
from cell.case.number_lists import values_of
from cell.case.read import load_case, with_changes
from cell.case.roll_text import parse_roll, roll_text
from cell.case.sections import REASONS
from cell.cli.main import main
from cell.cli.progress_bar import Bars
from cell.errors import InputError
from cell.job.job import prepare
from cell.pose_sweep.grid import Pose, grid
from cell.pose_sweep.ranking import sweep_columns, sweep_document
from cell.pose_sweep.sweep import PoseScreening, SweepTask, sweep, sweep_fingerprint, variant_of
from cell.report.sweep_lines import sweep_lines
from cell.verdict.check import check_fixed

POSES = [(90.0, 180.0), (0.0, 0.0), (-120.0, 45.0)]


def text_of(document):
    from rich.console import Console

    console = Console(file=io.StringIO(), width=200)
    for line in sweep_lines(document):
        console.print(line)
    return console.file.getvalue()


def test_every_pose_has_the_verdict_of_a_single_check(make_case):
    case = load_case(make_case())
    job = prepare(case)
    for pose, row in zip(POSES, sweep(case, POSES, processes=1), strict=True):
        result = check_fixed(job, *pose)
        assert (row["verdict"] == "feasible") == result.feasible
        assert row["looked_at"] + row["not_looked_at"] == len(job.targets)
        if row["searched"]:
            assert row["infeasible"] == result.infeasible
            assert row["reasons"] == result.reasons
        else:
            assert 0 < row["infeasible"] <= result.infeasible


def test_no_row_is_made_of_files_that_changed_while_the_sweep_ran(make_case):
    path = make_case(slicing={"h_layer_mm": 1.9})  # no other test has prepared such a part
    case = load_case(path)
    poses = (Pose(90.0, 180.0),)
    before = sweep_fingerprint(case)
    mesh = path.parent / "boss.stl"
    mesh.write_bytes(mesh.read_bytes() + b"\n")
    for task in (SweepTask(before, case, poses[0]), PoseScreening(before, case, poses)):
        with pytest.raises(InputError, match="changed while the sweep ran"):
            task()


def test_values_as_they_are_written():
    assert values_of("-10:10:10") == [-10.0, 0.0, 10.0]
    assert values_of("0:1:0.1")[-1] == pytest.approx(1.0)
    assert values_of([5, "0:2:1"]) == [5.0, 0.0, 1.0, 2.0]
    for bad in ("1:0:1", "0:1:0", "a", "0:1", "nan:1:1", "inf", [], None, True, "0:1e9:1"):
        with pytest.raises(ValueError, match=r"must be a number|has "):
            values_of(bad)


def test_grids(make_case):
    case = load_case(make_case())
    assert [p[:2] for p in grid(case, "-10:10:10", "5")] == [(-10.0, 5.0), (0.0, 5.0), (10.0, 5.0)]
    default = grid(case)
    assert Pose(90.0, -180.0) in default
    assert Pose(135.0, 135.0) in default
    assert len(default) == 7 * 8
    for bad in ("1:0:1", "0:1:0", "a", "0:1", "nan:1:1", "0:400:1"):
        with pytest.raises(InputError):
            grid(case, bad, "0")
    with pytest.raises(InputError, match="at most 100000"):
        grid(case, "0:10:0.01", "0:10:0.01")


def test_a_grid_may_stand_in_the_case_and_options_go_before_it(make_case):
    asked = {
        "E1_deg": "0:90:45",
        "E2_deg": 180,
        "roll": ["free", {"fixed_deg": -60}],
        "positioner": {"x_mm": [1400, 1500]},
    }
    case = load_case(make_case(sweep=asked))
    poses = grid(case)
    assert len(poses) == 3 * 2 * 2
    assert poses[0] == Pose(0.0, 180.0, "free", (1400.0, 0.0, 0.0, -90.0))
    assert {p.roll for p in poses} == {"free", "fixed:-60"}
    assert len(grid(case, "5", rolls=["range:-10:10"], placements=["1,2,3", "1,2,3,4"])) == 2
    assert all(Pose.of(p.columns()) == p for p in poses)
    plain = load_case(make_case("plain"))
    assert fingerprint(case) == fingerprint(plain)  # rows say their own pose


@pytest.mark.parametrize("written", ["10:50:20", '"10:50:20"', "[10, 30, 50]", "[10:30:20, 50]"])
def test_a_grid_in_yaml_is_not_a_number_to_the_base_of_60(make_case, written):
    path = make_case()
    path.write_text(path.read_text() + f"\nsweep:\n  E1_deg: {written}\n  height_mm: 5\n")
    assert load_case(path).sweep.E1_deg == [10.0, 30.0, 50.0]
    assert load_case(path).sweep.height_mm == [5.0]


def test_a_pose_changes_the_cell_and_nothing_else(make_case):
    job = prepare(load_case(make_case()))
    moved = variant_of(job, Pose(90, 180, "fixed:-60", (1400.0, 10.0, 20.0, 0.0), 150.0))
    assert moved.targets is job.targets
    assert moved.window.is_fixed
    assert moved.case.support.radius_mm == job.case.support.radius_mm
    T = moved.scene.T_world_base() @ moved.scene.T_base_part(0.0, 0.0)
    before = job.scene.T_world_base() @ job.scene.T_base_part(0.0, 0.0)
    # the axes of the positioner cross in a point that its place moves; the part is 50 mm higher over the plate
    np.testing.assert_allclose((T[:3, 3] - before[:3, 3])[2], 0.02 + 0.05, atol=1e-9)
    bare = prepare(with_changes(load_case(make_case()), support=None))
    lifted = variant_of(bare, Pose(0, 0, height_mm=70.0))
    step = lifted.scene.T_base_part(0.0, 0.0) - bare.scene.T_base_part(0.0, 0.0)
    assert np.linalg.norm(step[:3, 3]) == pytest.approx(0.07)


@pytest.mark.slow
def test_a_row_of_a_variant_is_that_of_a_case_that_says_so(make_case, tmp_path):
    case = load_case(make_case())
    pose = Pose(90.0, 180.0, "fixed:-60", (1480.0, 0.0, 0.0, -90.0), 110.0)
    log = tmp_path / "log.jsonl"
    row = sweep(case, [pose], processes=1, log=str(log))[0]
    same = load_case(
        make_case(
            "same",
            roll={"fixed_deg": -60},
            positioner={"position_mm": [1480, 0, 0]},
            support={"height_mm": 110},
        )
    )
    plain = sweep(same, [(90.0, 180.0)], processes=1)[0]
    assert {k: v for k, v in row.items() if k not in pose.columns()} == {
        k: v for k, v in plain.items() if "_deg" not in k[:6]
    }
    # the same table angles in another cell are another pose in the log
    again = sweep(case, [pose, pose._replace(height_mm=100.0)], processes=1, log=str(log))
    assert again[0] == row
    assert len(log.read_text().splitlines()) == 3


def test_rolls_are_read_as_they_are_written():
    for text in ("free", "fixed:-60", "range:-90:90"):
        assert roll_text(parse_roll(text)) == text


def test_an_interrupted_sweep_goes_on_where_it_stopped(make_case, tmp_path, monkeypatch):
    case = load_case(make_case())
    log = tmp_path / "sweep.jsonl"
    whole = sweep(case, POSES, processes=1, log=str(log))
    lines = log.read_text().splitlines()
    log.write_text("\n".join(lines[:2]) + "\n" + lines[2][:20])  # cut off while writing
    seen = []
    import cell.pose_sweep.sweep as module

    real = module.screen_all
    monkeypatch.setattr(module, "screen_all", lambda job, poses: seen.extend(poses) or real(job, poses))
    assert sweep(case, POSES, processes=1, log=str(log)) == whole
    assert len(seen) == len(POSES) - 1
    assert len(log.read_text().splitlines()) == 1 + len(POSES)


def test_a_log_of_another_case_is_refused(make_case, tmp_path):
    log = tmp_path / "sweep.jsonl"
    hopeless = [(0.0, 0.0)]
    sweep(load_case(make_case()), hopeless, processes=1, log=str(log))
    other = load_case(make_case("other", checks={"clearance_mm": 7}))
    with pytest.raises(InputError, match="another case"):
        sweep(other, hopeless, processes=1, log=str(log))
    log.write_bytes(b"\xff\xfe something else")
    with pytest.raises(InputError, match="not the log of a sweep"):
        sweep(other, hopeless, processes=1, log=str(log))


def test_a_log_ends_with_the_files_the_case_names(make_case, tmp_path):
    from cell.shipped import MODELS_DIR

    path = make_case(part={"sub_volumes": ["boss.stl"]})
    before = fingerprint(load_case(path))
    mesh = tmp_path / "boss.stl"
    mesh.write_bytes(mesh.read_bytes() + b" ")
    after = fingerprint(load_case(path))
    assert before != after
    torch = tmp_path / "torch.xml"
    torch.write_bytes((MODELS_DIR / "cmt_torch" / "cmt_torch.xml").read_bytes())
    own = make_case("own", tool={"model": "torch.xml"})
    before = fingerprint(load_case(own))
    torch.write_text(torch.read_text() + "<!-- -->")
    assert fingerprint(load_case(own)) != before


def test_a_unit_of_work_is_small(make_case):
    case = load_case(make_case())
    assert len(pickle.dumps(SweepTask(fingerprint(case), case, Pose(90, 180)))) < 10_000


def row_of(e1, e2=0, **more):
    base = {"verdict": "feasible", "infeasible": 0, "searched": True, "gravity_max_deg": 20, "least_clearance_mm": 8.0}
    reasons = dict.fromkeys(REASONS, 0)
    return {"E1_deg": e1, "E2_deg": e2, "reasons": reasons, "least_margin_share": 2.0, "time_s": 9.0, **base, **more}


def test_the_best_pose_is_feasible_and_closest_to_upright(make_case):
    case = load_case(make_case())
    rows = [
        row_of(0, gravity_max_deg=50, least_clearance_mm=9),
        row_of(1, least_clearance_mm=6),
        row_of(2, least_clearance_mm=8),
        row_of(3, verdict="infeasible", infeasible=3),
        row_of(4, least_clearance_mm=8.2, least_margin_share=3.0),
        row_of(5, least_clearance_mm=None, gravity_max_deg=60),
    ]
    document = sweep_document(case, rows)
    assert document["best"]["E1_deg"] == 4
    assert [row["rank"] for row in document["poses"]] == [4, 3, 2, None, 1, 5]
    assert sweep_document(case, rows[3:4])["best"] is None
    shuffled = sweep_document(case, rows[::-1])
    assert [row["rank"] for row in shuffled["poses"]] == [5, 1, None, 2, 3, 4]
    json.dumps(document)


def test_the_terminal_shows_a_map_for_every_cell_or_the_best_one(make_case):
    case = load_case(make_case())
    rows = [row_of(e1, e2, height_mm=h) for h in (1.0, 2.0) for e1 in (0.0, 10.0) for e2 in (0.0, 5.0)]
    rows[0].update(verdict="infeasible", infeasible=7, looked_at=32, searched=False)
    text = text_of(sweep_document(case, rows))
    assert "7+" in text
    assert text.count("yes") == 8  # seven and the legend
    assert "height 1 mm" in text
    tilts = [line.split()[0] for line in text.splitlines() if line.endswith(("yes", "+")) and "of" not in line]
    assert tilts == ["10", "0"] * 2  # E1 up, as in the picture
    many = [row_of(0.0, 0.0, height_mm=float(h), gravity_max_deg=90 - h) for h in range(6)]
    text = text_of(sweep_document(case, many))
    assert text.count("yes") == 2
    assert "height 5 mm" in text


def test_the_command_writes_json_and_csv_and_tries_several_rolls(make_case, tmp_path, capsys):
    out, table = tmp_path / "s.json", tmp_path / "s.csv"
    angles = ["--e1", "90", "--e2", "0:180:180", "--jobs", "1"]
    code = main(["sweep", str(make_case()), *angles, "--roll", "fixed:-60", "--roll", "fixed:0",
                 "--height", "100", "--json", str(out), "--csv", str(table)])  # fmt: skip
    document = json.loads(out.read_text())
    assert code == (0 if document["best"] else 1)
    assert document["axes"] == ["roll", "height_mm"]
    assert len(document["poses"]) == 4
    assert "roll fixed:-60" in capsys.readouterr().out
    with table.open() as file:
        rows = list(csv.DictReader(file))
    assert [r["verdict"] for r in rows] == [p["verdict"] for p in document["poses"]]
    assert [float(r["E2_deg"]) for r in rows] == [0.0, 180.0, 0.0, 180.0]
    assert {r["roll"] for r in rows} == {"fixed:-60", "fixed:0"}
    assert sweep_columns(document)[0] == list(rows[0])
    for r in rows:
        assert sum(int(r[reason]) for reason in REASONS) == int(r["infeasible"])


BAD = [
    (["--roll", "free", "--roll", "some"], "--roll"),
    (["--positioner", "1,2"], "--positioner"),
    (["--positioner", "1,2,x"], "--positioner"),
    (["--positioner", "-1,nan,0"], "--positioner"),
    (["--height", "-5:5:5"], "height of the support must be above 0"),
    (["--height", "0:a"], "--height"),
    (["--picture", "no/such/folder/m.png"], "does not exist"),
    (["--csv", "no/such/folder/m.csv"], "does not exist"),
    (["--dask", "tcp://127.0.0.1:9", "--jobs", "2"], "give either"),
]


@pytest.mark.parametrize(("argv", "says"), BAD, ids=[" ".join(argv) for argv, _ in BAD])
def test_bad_input_is_one_line(argv, says, make_case, capsys):
    assert main(["sweep", str(make_case()), "--e1", "90", "--e2", "0", *argv]) == 2
    captured = capsys.readouterr()
    assert says in captured.err
    assert captured.err.count("\n") == 1
    assert captured.out == ""


def test_nothing_is_printed_in_a_pipe(make_case):
    out = io.StringIO()
    sweep(load_case(make_case()), [(0.0, 0.0)], processes=1, progress=Bars(out))
    assert out.getvalue() == ""


def test_a_table_that_moves_along_is_not_swept(make_case, capsys):
    path = make_case()
    content = yaml.safe_load(path.read_text())
    path.write_text(yaml.safe_dump({**content, "table": {"mode": "coordinated"}}))
    assert main(["sweep", str(path), "--e1", "90", "--e2", "0"]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "this one is coordinated" in said
    assert "--table fixed" in said
    with pytest.raises(InputError, match="this one is coordinated"):
        sweep(load_case(path), [(90, 0)])
    # what it says helps
    assert main(["sweep", str(path), "--table", "fixed", "--e1", "90", "--e2", "0", "--jobs", "1"]) in (0, 1)


@pytest.mark.slow
def test_of_a_table_that_indexes_the_map_is_of_what_is_built_first(tmp_path):
    poses = [(-90.0, 0.0), (0.0, 0.0), (90.0, 180.0), (90.0, 60.0)]
    case = three_case(tmp_path, checks={"gravity_max_deg": 60})
    found = sweep(case, poses, processes=1)
    assert {row["verdict"] for row in found} == {"feasible", "infeasible"}
    # as if there were nothing else
    alone = with_table(case, {"mode": "fixed"}, part={**case.part.model_dump(exclude_unset=True), "take": ["SV1"]})
    for row, other in zip(found, sweep(alone, poses, processes=1), strict=True):
        assert (row.pop("sub_volume"), row.pop("layers")) == ("SV1", [0, 1])
        assert row == other
    # another first group is another map, and so is the whole part at one pose
    poses_given = [{"sub_volume": name, "E1_deg": 90, "E2_deg": 0} for name in ("SV2", "SV1", "SV3")]
    given = with_table(case, {"mode": "indexed", "poses": poses_given})
    second = sweep(given, poses, processes=1)
    assert {row["sub_volume"] for row in second} == {"SV2"}
    assert [row["verdict"] for row in second] != [row["verdict"] for row in found]
    marks = {sweep_fingerprint(one) for one in (case, given, with_table(case, {"mode": "fixed"}))}
    assert len(marks) == 3
    assert "of SV2 layers 0 to 1, built first" in text_of(sweep_document(given, second))
