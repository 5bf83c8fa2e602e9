"""The command line: exit codes, documents, and that nothing bad gets past it."""

import csv
import json
import subprocess
import sys

import numpy as np
import pytest
import trimesh
import yaml
from support.paths import ROOT

from cell.cli.case_options import roll_argument
from cell.cli.main import main
from cell.errors import InputError

REASONS = {"unreachable", "joint_limit", "singular", "collision", "no_path", "speed", "gravity"}


def test_check_writes_the_report_and_the_motion(make_case, tmp_path, capsys):
    report, motion = tmp_path / "r.json", tmp_path / "m.csv"
    code = main(["check", str(make_case()), "--json", str(report), "--motion", str(motion)])
    assert code == 0
    assert "feasible" in capsys.readouterr().out
    document = json.loads(report.read_text())
    assert document["schema"] == "rbam-report/1"
    assert document["verdict"] == "feasible"
    assert document["table"] == {"E1_deg": 90.0, "E2_deg": 180.0, "mode": "fixed", "poses": []}
    assert set(document["reasons"]) >= REASONS - {"gravity"}
    assert document["targets"] == len(document["rows"]) > 10
    assert document["infeasible"] == 0
    for row in document["rows"]:
        assert row["verdict"] == "feasible"
        assert len(row["q_deg"]) == 6
        assert np.linalg.norm(row["base_normal"]) == pytest.approx(1.0, abs=1e-6)
    with motion.open() as file:
        rows = list(csv.DictReader(file))
    angles = [f"A{i}_deg" for i in range(1, 7)]
    assert list(rows[0]) == ["t_s", *angles, "E1_deg", "E2_deg", "arc", "bead", "layer", "target"]
    t = np.array([float(r["t_s"]) for r in rows])
    assert (np.diff(t) >= 0).all()
    assert {r["arc"] for r in rows} == {"0", "1"}
    # every target's configuration is passed on the way
    for row in document["rows"]:
        here = [r for r in rows if int(r["target"]) == row["index"] and r["arc"] == "1"]
        gap = min(np.abs(np.array([float(r[a]) for a in angles]) - row["q_deg"]).max() for r in here)
        assert gap < 1e-5


def test_infeasible_is_exit_code_one_and_writes_no_motion(make_case, tmp_path, capsys):
    motion = tmp_path / "m.csv"
    far = make_case(positioner={"position_mm": [4000, 0, 0]})
    assert main(["check", str(far), "--no-remedies", "--json", "-", "--motion", str(motion)]) == 1
    captured = capsys.readouterr()
    document = json.loads(captured.out)
    assert document["verdict"] == "infeasible"
    assert document["reasons"]["unreachable"] == document["targets"] == document["infeasible"]
    assert all(row["detail"]["beyond_reach_mm"] > 1000 for row in document["rows"])
    assert all(row["q_deg"] is None for row in document["rows"])
    assert not motion.exists()
    assert "not written" in captured.err


BAD = [
    (["check", "missing.case.yaml"], "missing.case.yaml: no such file"),
    (["check", "CASE", "--e1", "500"], "E1 = 500 deg is outside"),
    (["check", "CASE", "--roll", "fixed"], "--roll"),
    (["check", "CASE", "--json", "no/such/folder/r.json"], "does not exist"),
    (["slice", "missing.stl", "--body-radius", "20"], "missing.stl"),
    (["slice", "missing.stl"], "missing.stl"),
    (["sweep", "CASE", "--e1", "10:0:5"], "--e1"),
    (["sweep", "CASE", "--e1", "-400:0:5"], "outside the positioner's range"),
    (["sweep", "CASE", "--jobs", "0"], "--jobs"),
    (["replay", "CASE", "--speed", "0"], "--speed"),
    (["check", "CASE", "--e1", "1e9"], "--e1: 1e+09 is not within -3600 to 3600 deg"),
    (["export", "CASE", "--csv", "p.csv", "--e2", "-3601"], "--e2: -3601 is not within"),
    (["scene", "CASE", "--e1", "inf"], "--e1: inf is not an angle"),
    (["slice", "CASE", "--units", "inch"], "--units: goes with a mesh; a case says it itself (part.units)"),
    (["slice", "CASE", "--body-radius", "20"], "--body-radius: goes with a mesh"),
    (["slice", "boiler", "--units", "mm"], "--units: goes with a mesh"),
    (["check", "part.stl"], "part.stl: is a mesh; a case file is needed, such as one with part: {mesh: part.stl}"),
    (["check", "boilr"], "boilr: no such file, and no shipped case of that name; there are boiler, boiler_coordinated"),
    (["export", "CASE", "--csv", "-"], "--csv: -: only --json goes to standard output"),
    (["check", "CASE", "--json", "-", "--html", "-"], "--html: -: only --json"),
    (["slice", "CASE", "--targets", "-"], "--targets: -: only --json"),
    (["sweep", "CASE", "--out", "-"], "--out: -: only --json"),
    (["scene", "CASE", "--xml", "-"], "--xml: -: only --json"),
    (["replay", "CASE", "--picture", "p.jpg"], "--picture: p.jpg: a picture is a .png"),
    (["slice", "CASE", "--picture", "p"], "--picture: p: a picture is a .png"),
]


@pytest.mark.parametrize(("argv", "says"), BAD, ids=[says for _, says in BAD])
def test_bad_input_is_one_line_and_exit_code_two(argv, says, make_case, capsys):
    argv = [str(make_case()) if a == "CASE" else a for a in argv]
    assert main(argv) == 2
    captured = capsys.readouterr()
    assert says in captured.err
    assert captured.err.count("\n") == 1
    assert captured.out == ""


def test_usage_errors_are_one_line(capsys):
    with pytest.raises(SystemExit) as caught:
        main(["check", "--no-such-option"])
    assert caught.value.code == 2
    assert capsys.readouterr().err.count("\n") == 1


@pytest.mark.parametrize(
    ("option", "meant"), [("--E1", "--e1"), ("--no-remedy", "--no-remedies"), ("--jsn=f", "--json")]
)
def test_an_unknown_option_is_said_with_the_one_that_is_meant(option, meant, capsys):
    with pytest.raises(SystemExit):
        main(["check", option, "90"])
    assert f"rbam check: no option {option.split('=')[0]}; did you mean {meant}? " in capsys.readouterr().err


@pytest.mark.parametrize("command", [[], ["check"], ["slice"], ["compare"], ["sweep"], ["replay"], ["scene"]])
def test_help_teaches(command, capsys):
    with pytest.raises(SystemExit) as caught:
        main([*command, "--help"])
    assert caught.value.code == 0
    assert len(capsys.readouterr().out) > 300


def test_models_and_dimensions_that_do_not_exist_are_named(make_case, capsys):
    assert main(["check", str(make_case(robot={"model": "kr71"}))]) == 2
    assert "kr70_r2100" in capsys.readouterr().err
    assert main(["check", str(make_case(tool={"dimensions": {"stickout_mm": 12}}))]) == 2
    assert "did you mean stick_out_mm?" in capsys.readouterr().err
    assert main(["check", str(make_case(robot={"joints": ["A1", "B2"]}))]) == 2
    assert "no joint named 'B2'" in capsys.readouterr().err
    assert main(["check", str(make_case(tool={"wire": ["string"]}))]) == 2
    assert "no geom named 'string'" in capsys.readouterr().err
    assert main(["check", str(make_case(positioner={"model": "kr70_r2100"}))]) == 2
    assert "positioner.table: kr70_r2100 has no site named 'table'" in capsys.readouterr().err
    box = {"name": "floor", "box": {"size_mm": [1, 1, 1]}}
    assert main(["check", str(make_case(fixtures=[box]))]) == 2
    assert "the name 'floor' is already used" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("mesh", "says"),
    [
        ("open", "not closed"),
        ("far", "touch"),
        ("inside", "inside"),
        ("empty", "boss.stl"),
        ("nan", "finite"),
        ("metres", "unit"),
    ],
)
def test_unusable_meshes_are_one_line(mesh, says, make_case, tmp_path, capsys):
    from support.jobs.cases import boss_mesh

    path = make_case()
    solid = boss_mesh()
    if mesh == "open":
        solid.update_faces(np.arange(len(solid.faces)) > 1)
    elif mesh == "far":
        solid.apply_translation([-30, 0, 0])
    elif mesh == "inside":
        solid.apply_scale(0.2)
    elif mesh == "metres":
        solid.apply_scale(1000)
    elif mesh == "nan":
        solid.vertices[0] = np.nan
    solid.export(tmp_path / "boss.stl")
    if mesh == "empty":
        (tmp_path / "boss.stl").write_bytes(b"")
    assert main(["check", str(path)]) == 2
    error = capsys.readouterr().err
    assert says in error
    assert error.count("\n") == 1


def test_roll_texts():
    assert roll_argument("free") == "free"
    assert roll_argument("fixed:-30").fixed_deg == -30
    assert roll_argument("range:-90:90").range_deg == (-90, 90)
    for bad in ("", "free:1", "fixed:x", "range:1", "range:90:-90", "range:0:999"):
        with pytest.raises(InputError):
            roll_argument(bad)


def test_slice_writes_the_contract(make_case, tmp_path):
    layers, targets = tmp_path / "l.json", tmp_path / "t.csv"
    assert main(["slice", str(make_case()), "--json", str(layers), "--targets", str(targets)]) == 0
    document = json.loads(layers.read_text())
    assert document["schema"] == "rbam-slices/1"
    assert document["units"] == "mm"
    one = document["sub_volumes"][0]
    assert one["indices"]["NL"] == len(one["layers"]) >= 3
    assert one["layers"][0]["surface"] == {"kind": "cylinder", "axis_point": [0.0, 0.0], "radius": 20.0}
    with targets.open() as file:
        rows = list(csv.DictReader(file))
    printed = [row for row in rows if row["kind"] == "print"]
    assert [int(row["index"]) for row in printed] == list(range(one["indices"]["NV"]))
    assert {(row["kind"], row["index"]) for row in rows if row not in printed} == {("travel", "")}
    named = ["index", "sub_volume", "layer", "path", "kind", "thickness_mm"]
    vectors = [f"{axis}_mm" for axis in "xyz"] + [f"{v}{axis}" for v in "nt" for axis in "xyz"]
    assert list(rows[0]) == [*named[:-1], *vectors, named[-1], "speed_mm_s"]
    assert rows[0]["kind"] == "print"


def test_slice_fills_layers_and_deals_with_thickness(make_case, tmp_path, capsys):
    layers = tmp_path / "l.json"
    extra = {
        "slicing": {"strategy": "planar", "thickness": "trim"},
        "process": {"speed_by_thickness": [[1, 10], [2, 5]]},
    }
    case = str(make_case(**extra))
    assert main(["slice", case, "--pattern", "zigzag", "--width", "2.5", "--json", str(layers)]) == 0
    one = json.loads(layers.read_text())["sub_volumes"][0]
    assert {bead["kind"] for bead in one["beads"]} == {"contour", "infill"}
    assert one["thickness_policy"]["policy"] == "trim"
    assert main(["slice", case, "--width", "0"]) == 2
    assert "beads.width_mm" in capsys.readouterr().err


def test_options_of_slice_go_with_a_table_of_any_mode(make_case, tmp_path):
    layers = tmp_path / "layers.json"
    path = make_case(beads={"seams": [{"angle_deg": 90}]})
    path.write_text(yaml.safe_dump({**yaml.safe_load(path.read_text("utf-8")), "table": {"mode": "indexed"}}))
    assert (
        main(["slice", str(path), "--pattern", "zigzag", "--width", "2.5", "--h-layer", "1.5", "--json", str(layers)])
        == 0
    )
    (found,) = json.loads(layers.read_text("utf-8"))["sub_volumes"]
    assert {bead["kind"] for bead in found["beads"]} == {"contour", "infill"}
    thickness = [v for layer in found["layers"] for v in layer["thickness_mm"]]
    assert max(thickness) == pytest.approx(1.5, rel=0.01)


def test_slice_takes_a_mesh_alone(make_case, tmp_path, capsys):
    make_case()
    for strategy in ("planar", "cylindrical", "nonuniform"):
        assert main(["slice", str(tmp_path / "boss.stl"), "--body-radius", "20", "--strategy", strategy]) == 0
        assert strategy in capsys.readouterr().out


def test_module_runs_as_a_command():
    done = subprocess.run([sys.executable, "-m", "cell", "--version"], capture_output=True, text=True, check=True)
    assert done.stdout.startswith("rbam ")


@pytest.mark.slow
def test_a_whole_part_is_taken_apart(tmp_path, capsys):
    whole = ROOT / "models" / "parts" / "support.stl"
    out = tmp_path / "l.json"
    assert main(["slice", str(whole), "--json", str(out)]) == 0
    assert [one["name"] for one in json.loads(out.read_text())["sub_volumes"]] == ["SV1", "SV2", "SV3"]
    case = tmp_path / "one.case.yaml"
    case.write_text(f"part: {{mesh: {whole}, take: [SV2]}}\n")
    assert main(["slice", str(case), "--json", str(out)]) == 0
    assert [one["name"] for one in json.loads(out.read_text())["sub_volumes"]] == ["SV2"]
    case.write_text(f"part: {{mesh: {whole}, take: [SV9]}}\n")
    capsys.readouterr()
    assert main(["slice", str(case)]) == 2
    assert "no sub-volume 'SV9'; there are SV1, SV2, SV3" in capsys.readouterr().err


def test_a_part_without_a_round_body_says_so(tmp_path, capsys):
    trimesh.creation.box((30, 20, 10)).export(tmp_path / "block.stl")
    assert main(["slice", str(tmp_path / "block.stl")]) == 2
    error = capsys.readouterr().err
    assert "body" in error
    assert error.count("\n") == 1


def test_the_html_report_is_written_whole(make_case, tmp_path, capsys):
    page = tmp_path / "r.html"
    assert main(["check", str(make_case()), "--html", str(page)]) == 0
    assert page.read_text(encoding="utf-8").rstrip().endswith("</html>")
    assert main(["check", str(make_case()), "--html", str(tmp_path / "no" / "r.html")]) == 2
    assert "does not exist" in capsys.readouterr().err


UNUSABLE = {
    "range_reversed": ('axis="0 1 0" range="-175 60"', 'axis="0 1 0" range="60 -175"', "A2's range"),
    "range_of_nothing": (
        'axis="0 1 0" range="-175 60"',
        'axis="0 1 0" range="20 20"',
        "is empty; low < high is needed",
    ),
    "no_range": ('axis="0 1 0" range="-175 60"', 'axis="0 1 0"', "A2 has no joint limits"),
    "no_hinge": ('<joint name="A2"', '<joint type="slide" name="A2"', "A2 is not a hinge"),
    "no_joint": ('<joint name="A2"', '<joint name="B2"', "no joint named 'A2'"),
}


@pytest.mark.parametrize("what", UNUSABLE)
def test_an_arm_whose_joints_cannot_be_bound_is_one_line(what, make_case, tmp_path, capsys):
    from cell.shipped import MODELS_DIR

    old, new, says = UNUSABLE[what]
    text = (MODELS_DIR / "kr70_r2100" / "kr70_r2100.xml").read_text()
    assert text.count(old) == 1
    text = text.replace('meshdir="', f'meshdir="{MODELS_DIR / "kr70_r2100"}/').replace(old, new)
    (tmp_path / "arm.xml").write_text(text)
    assert main(["check", str(make_case(robot={"model": "arm.xml"}))]) == 2
    error = capsys.readouterr().err
    assert says in error
    assert error.count("\n") == 1


BAD_SECTIONS = [
    ({"robot": {"joints": ["A1", "A2", "A2", "A4", "A5", "A6"]}}, "A2 is listed twice"),
    ({"robot": {"joints": []}}, "robot.joints: has too few values"),
    ({"robot": {"joints": ["A2", "A1", "A3", "A4", "A5", "A6"]}}, "from the base to the flange"),
    ({"positioner": {"joints": ["E1", "E1"]}}, "E1 does not turn the table"),
    ({"positioner": {"joints": ["A1", "E2"]}}, "A1 does not turn the table"),
    ({"tool": {"tcp": "tip"}}, "the wire's end, z along the wire"),
    ({"table": {"E1_deg": 200}}, "E1 = 200 deg is outside the positioner's range -135 .. 135"),
    ({"checks": {"wrist_deg": 95}}, "checks.wrist_deg: must be 0 to 90 (is 95)"),
    ({"roll": {"range_deg": [90, -90]}}, "range_deg needs low <= high"),
    ({"part": {"position_mm": [float("nan"), 0, 0]}}, "part.position_mm.0: must be a finite number"),
]


@pytest.mark.parametrize(("sections", "says"), BAD_SECTIONS, ids=[says for _, says in BAD_SECTIONS])
def test_bad_sections_are_one_line(sections, says, make_case, capsys):
    assert main(["check", str(make_case(**sections))]) == 2
    captured = capsys.readouterr()
    assert says in captured.err
    assert captured.err.count("\n") == 1
    assert captured.out == ""


def test_a_tool_whose_wire_is_not_along_the_tcp_is_one_line(make_case, tmp_path, capsys):
    from cell.shipped import MODELS_DIR

    text = (MODELS_DIR / "cmt_torch" / "cmt_torch.xml").read_text()
    assert text.count('name="tcp"') == 1
    (tmp_path / "torch.xml").write_text(text.replace('name="tcp"', 'name="tcp" euler="90 0 0"'))
    assert main(["check", str(make_case(tool={"model": "torch.xml"}))]) == 2
    error = capsys.readouterr().err
    assert "tool.tcp: the z axis of site tcp is 90 deg off the wire torch_wire" in error
    assert error.count("\n") == 1


@pytest.mark.parametrize(
    ("column", "value", "says"),
    [
        ("position", np.nan, "target 3: position"),
        ("normal", 0.0, "target 3: has no normal"),
        ("normal", np.nan, "normal"),
    ],
)
def test_targets_that_are_none_are_one_line(column, value, says, make_case, monkeypatch, capsys):
    from dataclasses import replace

    from cell.job import job

    def spoilt(*args):
        targets = sample_beads(*args)
        values = getattr(targets, column).copy()
        values[3] = value
        return replace(targets, **{column: values})

    sample_beads = job.sample_beads
    monkeypatch.setattr(job, "sample_beads", spoilt)
    assert main(["check", str(make_case())]) == 2
    error = capsys.readouterr().err
    assert says in error
    assert error.count("\n") == 1


def test_an_arm_without_a_closed_form_says_not_found_and_proves_nothing(make_case, tmp_path, capsys):
    from cell.shipped import MODELS_DIR

    text = (MODELS_DIR / "kr70_r2100" / "kr70_r2100.xml").read_text()
    text = text.replace('meshdir="', f'meshdir="{MODELS_DIR / "kr70_r2100"}/')
    (tmp_path / "arm.xml").write_text(text.replace('name="link_6" pos="0 0 0"', 'name="link_6" pos="0 0.06 0"'))
    few = {"slicing": {"h_layer_mm": 5, "h_min_mm": 4, "h_max_mm": 6}, "ik": {"seeds": 4}, "roll": {"fixed_deg": 0}}
    far = make_case(**few, robot={"model": "arm.xml"}, positioner={"position_mm": [3000, 0, 0]})
    assert main(["check", str(far), "--no-remedies"]) == 1
    said = capsys.readouterr().out
    assert "damped least squares" in said
    assert "not found from 4 seeds" in said
    assert "proved" not in said


def test_slice_takes_the_name_of_a_shipped_case(capsys):
    assert main(["slice", "propeller"]) == 0
    by_name = capsys.readouterr().out
    assert main(["slice", str(ROOT / "models" / "cases" / "propeller.case.yaml")]) == 0
    assert by_name == capsys.readouterr().out
    assert main(["slice", "no_such_case"]) == 2


@pytest.mark.parametrize("command", ["check", "slice", "scene"])
def test_no_line_of_a_report_ends_in_blanks(make_case, capsys, command):
    main([command, str(make_case(positioner={"position_mm": [4000, 0, 0]}))])
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) > 3
    assert [line for line in lines if line != line.rstrip()] == []
