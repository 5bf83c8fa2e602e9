"""Case files: what is accepted, and that every error is one line that helps."""

from pathlib import Path

import pytest
import yaml

from cell.case.read import load_case, parse_case
from cell.case.yaml12 import Loader
from cell.errors import InputError
from cell.shipped import MODELS_DIR

MINIMAL = {"part": {"sub_volumes": ["a.stl"], "body": {"radius_mm": 20}}}


def test_a_short_case_has_every_section():
    case = parse_case(MINIMAL)
    assert case.slicing.strategy == "nonuniform"
    assert case.roll == "free"
    assert case.checks.clearance_mm == 5.0
    assert case.path_of("a.stl") == Path("a.stl")


def test_paths_are_relative_to_the_case_file():
    case = parse_case(MINIMAL, Path("cells") / "blade.case.yaml")
    assert case.path_of("a.stl") == Path("cells") / "a.stl"
    assert case.title == "blade"


BAD = [
    ({"prt": {}}, "prt: unknown key; did you mean part?"),
    ({"part": {"sub_volume": ["a"]}}, "part.sub_volume: unknown key; did you mean sub_volumes?"),
    ({**MINIMAL, "slicing": {"h_layer": 2}}, "slicing.h_layer: unknown key; did you mean h_layer_mm?"),
    ({**MINIMAL, "roll": {"fixd_deg": 3}}, "roll.fixd_deg: unknown key; did you mean fixed_deg?"),
    ({**MINIMAL, "roll": "fre"}, "roll: must be free, "),
    ({**MINIMAL, "roll": "fixed"}, "roll: must be free, {fixed_deg: -60} or "),
    ({**MINIMAL, "tool": {"stick_out_mm": 15}}, "did you mean tool.dimensions.stick_out_mm?"),
    ({**MINIMAL, "tool": {"neck_angle_deg": 45}}, "did you mean tool.dimensions.neck_angle_deg?"),
    ({**MINIMAL, "tool": {"held_degs": {}}}, "did you mean held_deg?"),
    ({**MINIMAL, "E2_deg": 45}, "E2_deg: unknown key; did you mean table.E2_deg?"),
    ({**MINIMAL, "roll": {"range_deg": [30, 10]}}, "low <= high"),
    ({**MINIMAL, "slicing": {"h_min_mm": 2}}, "h_min_mm <= h_layer_mm <= h_max_mm"),
    ({**MINIMAL, "slicing": {"h_layer_mm": float("nan")}}, "slicing.h_layer_mm"),
    ({**MINIMAL, "checks": {"clearance_mm": -1}}, "checks.clearance_mm"),
    ({**MINIMAL, "expect": "feasable"}, "'feasible' or 'infeasible'"),
    ({**MINIMAL, "expect": {"verdict": "infeasible", "reasons": ["colision"]}}, "unknown reason 'colision'"),
    ({**MINIMAL, "fixtures": [{"name": "x"}]}, "exactly one of box, cylinder, mesh"),
    ({**MINIMAL, "fixtures": [{"name": "x", "bax": {}}]}, "fixtures.0.bax: unknown key; did you mean box?"),
    ({"part": {"sub_volumes": ["a.stl"], "body": {"radius_mm": 0}}}, "radius_mm must be above 0"),
    ({"part": {"sub_volumes": ["a.stl"], "body": {"z_mm": [0, 1]}}}, "needs either radius_mm"),
    (
        {"part": {"sub_volumes": ["a.stl"], "body": {"profile_mm": [[1, 0]], "half_angle_deg": 3}}},
        "leave half_angle_deg and z_mm out",
    ),
    ({"part": {"sub_volumes": ["a.stl"]}}, "part.body: needs radius_mm"),
    ({"part": {"body": {"radius_mm": 2}}}, "needs mesh (the whole part), or sub_volumes"),
    ({"part": {"mesh": "a.stl", "sub_volumes": ["b.stl"]}}, "give either mesh"),
    ({**MINIMAL, "positioner": {"position_mm": [1, 2]}}, "positioner.position_mm: has too few values (is [1, 2])"),
    ({**MINIMAL, "positioner": {"position_mm": [1, 2, 3, 4]}}, "positioner.position_mm: has too many values"),
    ({**MINIMAL, "positioner": {"position_mm": [1, "x", 3]}}, "positioner.position_mm.1: must be a number (is 'x')"),
    ({**MINIMAL, "slicing": 5}, "slicing: must be a section of keys and values (is 5)"),
    ({**MINIMAL, "floor": "maybe"}, "floor: must be true or false (is 'maybe')"),
    ({"part": {"sub_volumes": 5, "body": {"radius_mm": 2}}}, "part.sub_volumes: must be a list (is 5)"),
    ({**MINIMAL, "checks": {"clearance_mm": False}}, "checks.clearance_mm: must be a number (is false)"),
    ({**MINIMAL, "slicing": {"h_min_mm": True}}, "slicing.h_min_mm: must be a number (is true)"),
    ({**MINIMAL, "positioner": {"position_mm": [1, True, 3]}}, "positioner.position_mm.1: must be a number (is true)"),
    ({**MINIMAL, "roll": {"fixed_deg": True}}, "roll.fixed_deg: must be a number (is true)"),
    ({**MINIMAL, "checks": {"clearance_mm": "2,5"}}, "checks.clearance_mm: must be a number: write 2.5 (is '2,5')"),
    ({**MINIMAL, "table": {"E1_deg": "90 deg"}}, "table.E1_deg: must be a number: write 90 without the unit"),
    ({**MINIMAL, "table": {"E1_deg": "pi/2"}}, "table.E1_deg: must be a number (is 'pi/2')"),
    ({**MINIMAL, "support": {"radius_mm": 0.025, "height_mm": 0.12}}, "support: is at most 0.12 mm large; lengths are"),
    ({**MINIMAL, "fixtures": [{"name": "x", "on": "Table"}]}, "fixtures.0.on: must be 'floor' or 'table' (is 'Table')"),
    ({"part": {"mesh:a.stl": None}}, "part.mesh:a.stl: unknown key; a blank is needed after the colon"),
    ({}, "part: missing"),
    ([1, 2], "mapping"),
]


@pytest.mark.parametrize(("content", "says"), BAD, ids=[says for _, says in BAD])
def test_bad_content_is_one_line(content, says):
    with pytest.raises(InputError) as caught:
        parse_case(content, "cell.case.yaml")
    message = str(caught.value)
    assert says in message
    assert message.startswith("cell.case.yaml: ")
    assert "\n" not in message


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(InputError, match=r"nowhere\.yaml: no such file"):
        load_case(tmp_path / "nowhere.yaml")


def test_a_shipped_case_is_known_by_its_name(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert load_case("boiler").path == MODELS_DIR / "cases" / "boiler.case.yaml"
    with pytest.raises(InputError, match=r"^nothing: no such file"):
        load_case("nothing")
    with pytest.raises(InputError, match="no such file"):
        load_case("./boiler")
    (tmp_path / "boiler").write_text("part: 3", encoding="utf-8")  # one's own file goes before it
    with pytest.raises(InputError, match=r"^boiler: part"):
        load_case("boiler")


def test_broken_yaml_names_the_line(tmp_path):
    path = tmp_path / "broken.case.yaml"
    path.write_text("part:\n  sub_volumes: [a.stl\n", encoding="utf-8")
    with pytest.raises(InputError, match="line 3: not YAML"):
        load_case(path)


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("support: {radius_mm: 2", "a comma is missing, or a { or [ that is opened before is not closed"),
        (" roll: free", "a line is indented otherwise than those of its section"),
        ("name: a: b", "a second : in a line"),
        ("positioner: {position_mm: 1550, 0, 0}", "the key '0' is given twice; numbers of a list stand in [ ]"),
    ],
)
def test_usual_slips_in_yaml_are_said_in_words(tmp_path, line, said):
    path = write(tmp_path / "case.yaml", f"part:\n  mesh: a.stl\n{line}\n")
    with pytest.raises(InputError, match=r"case\.yaml, line \d: not YAML") as caught:
        load_case(path)
    assert said in str(caught.value)


@pytest.mark.parametrize(
    ("text", "line"), [("part: {mesh: a.stl}\nname: Träger\n".encode("latin-1"), 2), ("a".encode("utf-16"), 1)]
)
def test_text_that_is_not_utf_8_is_refused_with_its_line(tmp_path, text, line):
    path = tmp_path / "case.yaml"
    path.write_bytes(text)
    with pytest.raises(InputError, match=rf"case\.yaml, line {line}: not UTF-8 text; save the file as UTF-8"):
        load_case(path)


def write(path, text):
    path.parent.mkdir(exist_ok=True)
    path.write_text(text, encoding="utf-8")
    return path


def test_a_case_changes_the_one_it_extends(tmp_path):
    base = "part: {sub_volumes: [a.stl], body: {radius_mm: 20}}\nroll: {fixed_deg: 3}\nexpect: feasible\nname: base\n"
    write(tmp_path / "cells" / "base.case.yaml", base)
    path = write(
        tmp_path / "turned.case.yaml",
        "extends: cells/base.case.yaml\npart: {rotation_deg: 90}\nroll: {range_deg: [0, 9]}\n",
    )
    case = load_case(path)
    assert case.part.body.radius_mm == 20
    assert case.part.rotation_deg == 90
    assert case.roll.range_deg == (0, 9)
    assert case.path_of(case.part.sub_volumes[0]) == tmp_path / "cells" / "a.stl"
    assert case.expect is None
    assert case.title == "turned"


def test_extending_in_a_circle_is_refused(tmp_path):
    write(tmp_path / "a.yaml", "extends: b.yaml\n")
    path = write(tmp_path / "b.yaml", "extends: a.yaml\n")
    with pytest.raises(InputError, match="a case file extends itself"):
        load_case(path)
    with pytest.raises(InputError, match=r"c\.yaml: extends: .*gone\.yaml: no such file"):
        load_case(write(tmp_path / "c.yaml", "extends: gone.yaml\n"))


def test_words_that_older_yaml_takes_for_true_and_false(tmp_path):
    path = tmp_path / "case.yaml"
    path.write_text(
        "name: no\npart: {sub_volumes: [a.stl], body: {radius_mm: 20}}\n"
        "fixtures:\n  - name: off\n    on: table\n    box: {size_mm: [1, 1, 1]}\n"
        "  - {name: y, on: floor, box: {size_mm: [1, 1, 1]}}\n",
        encoding="utf-8",
    )
    case = load_case(path)
    assert [(f.name, f.on) for f in case.fixtures] == [("off", "table"), ("y", "floor")]
    assert case.title == "no"


@pytest.mark.parametrize(("word", "value"), [("true", True), ("False", False), ("yes", "yes"), ("Off", "Off")])
def test_true_and_false_are_read_as_such(word, value):
    assert yaml.load(f"{word}: {word}", Loader=Loader) == {value: value}


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (
            "support: {radius_mm: 15,5, height_mm: 120}",
            "support.5: a key must be a name; of a number with a decimal",
        ),
        (
            "process:\n  deposition_speed_mm_s: 8,5",
            "process.deposition_speed_mm_s: must be a number: write 8.5 (is '8,5')",
        ),
        ('name: "C:\\Users\\me"', "line 2: not YAML (a backslash in double quotes; write paths with /"),
        ('name: "C:\\parts"', "line 2: not YAML (a backslash in double quotes; write paths with /"),
        ("table:\n\tE1_deg: 90", "line 3: not YAML (a tab"),
    ],
)
def test_what_newcomers_write_is_told_in_words(text, says, tmp_path):
    path = tmp_path / "new.case.yaml"
    path.write_text(f"part: {{mesh: part.stl}}\n{text}\n", encoding="utf-8")
    with pytest.raises(InputError) as caught:
        load_case(path)
    assert says in str(caught.value)
    assert "\n" not in str(caught.value)
