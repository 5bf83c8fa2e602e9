"""Files that a case names and that are not there."""

import pytest

from cell.case.files import require_cell_files, require_part_files
from cell.case.read import parse_case
from cell.errors import InputError

BODY = {"radius_mm": 20}


@pytest.mark.parametrize(
    ("part", "said"),
    [
        ({"mesh": "brackte.stl"}, "part.mesh: {folder}/brackte.stl: no such file; did you mean bracket.stl?"),
        ({"mesh": "parts\\bracket.stl"}, "; folders are separated by /"),
        ({"mesh": "parts/bracket.stl"}, "no such file; there is no folder {folder}/parts"),
        ({"mesh": "."}, "part.mesh: {folder}: is not a file"),
        ({"sub_volumes": ["bracket.stl", "no.stl"], "body": BODY}, "part.sub_volumes.1: {folder}/no.stl: no such file"),
        (
            {"sub_volumes": ["bracket.stl"], "body": {**BODY, "mesh": "x.stl"}},
            "part.body.mesh: {folder}/x.stl: no",
        ),
        ({"toolpath": "beads.csv", "body": BODY}, "part.toolpath: {folder}/beads.csv: no such file"),
        ({"toolpath": "bracket.stl", "body": BODY}, "part.toolpath: {folder}/bracket.stl is a mesh; part.mesh"),
    ],
)
def test_a_missing_file_of_the_part_is_said_with_its_key_and_what_may_be_meant(tmp_path, part, said):
    (tmp_path / "bracket.stl").write_text("")
    case = parse_case({"part": part}, tmp_path / "my.case.yaml")
    with pytest.raises(InputError) as caught:
        require_part_files(case)
    message = str(caught.value)
    assert message.startswith(f"{tmp_path}/my.case.yaml: part.")
    assert said.format(folder=tmp_path) in message
    assert "\n" not in message


@pytest.mark.parametrize(
    ("section", "said"),
    [
        (
            {"robot": {"model": "kr_70_r2100"}},
            "robot.model: kr_70_r2100 is neither a file nor a shipped model; did you",
        ),
        ({"tool": {"model": "burner"}}, "shipped are cmt_torch, kp2_hv500, kr70_r2100"),
        ({"positioner": {"model": "models/table.xml"}}, "positioner.model: "),
        ({"fixtures": [{"name": "clamp", "mesh": "clmp.stl"}]}, "fixtures.clamp.mesh: "),
        ({"tool": {"model": "torch.STL"}}, "torch.STL is a mesh; an MJCF is needed"),
    ],
)
def test_a_missing_model_or_fixture_is_said_before_anything_is_sliced(tmp_path, section, said):
    (tmp_path / "torch.STL").write_text("")
    case = parse_case({"part": {"mesh": "a.stl"}, **section}, tmp_path / "my.case.yaml")
    with pytest.raises(InputError) as caught:
        require_cell_files(case)
    assert said in str(caught.value)


def test_files_that_are_there_and_shipped_models_are_accepted(tmp_path):
    (tmp_path / "Träger 1.stl").write_text("")
    case = parse_case({"part": {"mesh": "Träger 1.stl"}, "positioner": {"model": "none"}}, tmp_path / "my.case.yaml")
    require_part_files(case)
    require_cell_files(case)
