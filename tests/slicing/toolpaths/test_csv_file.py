"""Toolpaths of other slicers: what is read is what stands there, and what cannot be used is said in one line."""

from __future__ import annotations

import numpy as np
import pytest
from support.jobs.cases import boss_mesh

import slicing
from slicing import PartError, Toolpath, read_toolpath
from slicing.document import targets_rows

HEADER = "x_mm,y_mm,z_mm,nx,ny,nz,path,layer,thickness_mm,speed_mm_s"


def written(tmp_path, *rows, header=HEADER, name="theirs.csv"):
    path = tmp_path / name
    path.write_text("\n".join([header, *rows]) + "\n", encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def ours(tmp_path_factory) -> Toolpath:
    path = tmp_path_factory.mktemp("boss") / "boss.stl"
    boss_mesh().export(path)
    sliced = slicing.slice(slicing.load(path), slicing.CylindricalBody(radius_mm=20), h_layer_mm=1.73)
    return slicing.lay([sliced], pattern="zigzag", width_mm=4)


def test_what_is_written_here_is_read_back(ours, tmp_path):
    header, rows = targets_rows(ours.targets)
    path = written(tmp_path, *(",".join(str(v) for v in row) for row in rows), header=",".join(header))
    found = read_toolpath(path, width_mm=4)
    for name in ("position", "normal", "thickness_mm", "speed_mm_s"):
        np.testing.assert_allclose(getattr(found.targets, name), getattr(ours.targets, name), atol=1e-12)
    for name in ("sub_volume_index", "layer", "bead", "closed"):
        np.testing.assert_array_equal(getattr(found.targets, name), getattr(ours.targets, name))
    across = (found.targets.tangent * found.targets.normal).sum(axis=1)
    np.testing.assert_allclose(across, 0, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(found.targets.tangent, axis=1), 1)
    assert [w.code for w in found.warnings] == ["toolpath_not_sliced"]


def test_columns_are_found_by_name_in_any_order_and_with_a_decimal_comma(tmp_path):
    plain = read_toolpath(written(tmp_path, "0,0,1.5,0,0,2,0,0,1.7,8", "10.5,0,1.5,0,0,2,0,0,1.7,8"))
    other = written(tmp_path, "0;1,5;10,5;weave;0;0;1", "0;1,5;0;weave;0;0;1", header="Y;Z;X;mode;i;j;k")
    with pytest.raises(PartError, match="no column path"):
        read_toolpath(other, thickness_mm=1.7)
    other = written(tmp_path, "0;1,5;0;a;0;0;1;3", "0;1,5;10,5;a;0;0;1;3", header="Y;Z;X;mode;i;j;k;bead")
    found = read_toolpath(other, thickness_mm=1.7, speed_mm_s=8)
    np.testing.assert_allclose(found.targets.position, plain.targets.position)
    np.testing.assert_allclose(found.targets.normal, [[0, 0, 1], [0, 0, 1]])
    assert [w.code for w in found.warnings] == ["toolpath_not_sliced", "toolpath_columns"]
    assert "mode" in found.warnings[1]


def test_beads_are_runs_of_rows_on_which_the_arc_is_on(tmp_path):
    rows = [f"{x},0,{z},{on}" for x, z, on in [(0, 0, 1), (9, 0, 1), (9, 5, 0), (0, 2, 1), (9, 2, 1)]]
    path = written(tmp_path, *rows, header="x,y,z,on")
    with pytest.raises(PartError, match="up or radial"):
        read_toolpath(path, thickness_mm=2)
    found = read_toolpath(path, thickness_mm=2, normal="up").targets
    assert found.bead.tolist() == [0, 0, 1, 1]
    assert found.layer.tolist() == [0, 0, 1, 1]
    np.testing.assert_allclose(found.normal, [[0, 0, 1]] * 4)
    round_it = written(tmp_path, "3,4,0,1", "3,4,9,1", header="x,y,z,on")
    radial = read_toolpath(round_it, thickness_mm=2, normal="radial").targets
    np.testing.assert_allclose(radial.normal, [[0.6, 0.8, 0]] * 2)


@pytest.mark.parametrize(("column", "off"), [("on", ("1", "0")), ("kind", ("print", "travel"))])
def test_a_bead_ends_where_the_arc_is_off_whatever_its_number(column, off, tmp_path):
    rows = [f"{x},0,0,{bead},{off[x in (18, 27)]}" for bead in (4, 7) for x in range(0, 55, 9)]
    found = read_toolpath(written(tmp_path, *rows, header=f"x,y,z,path,{column}"), thickness_mm=2, normal="up").targets
    assert found.position[:, 0].tolist() == [0, 9, 36, 45, 54] * 2
    assert found.bead.tolist() == [0, 0, 1, 1, 1, 2, 2, 3, 3, 3]
    assert found.layer.tolist() == found.bead.tolist()


def test_layers_are_counted_from_beads_alone_and_what_is_welded_is_said(tmp_path):
    words = ["travel", "travel", "wall", "wall", "travel", "contour", "contour"]
    rows = [f"{9 * k},0,0,{word}" for k, word in enumerate(words)]
    found = read_toolpath(written(tmp_path, *rows, header="x,y,z,kind"), thickness_mm=2, normal="up")
    assert found.targets.layer.tolist() == [0, 0, 1, 1]
    (said,) = [str(line) for line in found.warnings if line.code == "toolpath_columns"]
    assert "rows of kind wall are welded" in said


@pytest.mark.parametrize(
    ("rows", "says"),
    [
        (
            [f"{x},0,0,0,0,1,0,{layer},1,8" for layer in (0, 1) for x in (0, 9)],
            "line 4: layer: '1': it changes within a bead",
        ),
        (["0,0,0,0,0,1,0,0,1.7,8", "a,0,0,0,0,1,0,0,1.7,8"], "line 3: x_mm: 'a': a number is needed"),
        (["0,0,0,0,0,1,0,0,1.7,8", "4_0,0,0,0,0,1,0,0,1.7,8"], "line 3: x_mm: '4_0': a number is needed"),
        (["0,0,0,0,0,1,0,0,1.7,8", "nan,0,0,0,0,1,0,0,1.7,8"], "line 3: x_mm: 'nan'"),
        (["0,0,0,0,0,1,0,0,1.7,8", "1e300,0,0,0,0,1,0,0,1.7,8"], "line 3: x_mm: '1e300'"),
        (["0,0,0,0,0,0,0,0,1.7,8", "9,0,0,0,0,1,0,0,1.7,8"], "line 2: its deposition direction has length 0"),
        (["0,0,0,0,0,1,0,0,-1,8", "9,0,0,0,0,1,0,0,1.7,8"], "line 2: thickness_mm: '-1'"),
        (["0,0,0,0,0,1,0,0.5,1,8", "9,0,0,0,0,1,0,0,1.7,8"], "line 2: layer: '0.5'"),
        (["0,0,0,0,0,1,0,0,1,8"], "line 2: a bead of one target"),
        (["0,0,0,0,0,1,1,0,1,8", "9,0,0,0,0,1,0,0,1.7,8"], "line 3: path: '0': numbers of beads must not fall"),
        (["0,0,0,0,0,1,0,0,1"], "line 2: has 9 columns, the header 10"),
        (
            [f"{x},0,0,0,0,1,{bead},{layer},1,8" for bead, layer in ((0, 1), (1, 0)) for x in (0, 9)],
            "line 4: layer 0 of SV1 comes after a later one",
        ),
        ([], "a header but no rows"),
    ],
)
def test_what_cannot_be_used_is_said_with_its_line(tmp_path, rows, says):
    with pytest.raises(PartError) as error:
        read_toolpath(written(tmp_path, *rows))
    assert says in str(error.value)
    assert "\n" not in str(error.value)
    assert "theirs.csv" in str(error.value)


@pytest.mark.parametrize("name", ["", "a/b", '"a\nb"', "a\x01b"])
def test_a_sub_volume_needs_a_name_on_one_line(tmp_path, name):
    rows = [f"{name},0,{x},0,0,0,0,1,0,1.7" for x in (0, 9)]
    path = written(tmp_path, *rows, header="sub_volume,path,x,y,z,nx,ny,nz,layer,thickness_mm")
    with pytest.raises(PartError, match="sub_volume: every row needs a name on one line"):
        read_toolpath(path)


def test_files_that_are_none_are_refused(tmp_path):
    for text, says in ((b"", "empty"), (b"\xff\xfe\x00", "as text"), (b"a,b\n1,2\n", "no column x_mm")):
        path = tmp_path / "t.csv"
        path.write_bytes(text)
        with pytest.raises(PartError, match=says):
            read_toolpath(path)
    with pytest.raises(PartError, match="no such file"):
        read_toolpath(tmp_path / "none.csv")
    with pytest.raises(PartError, match="x and x_mm mean the same"):
        read_toolpath(written(tmp_path, "1,2,3,4", header="x,x_mm,y,z"))


@pytest.mark.parametrize("columns", ["nx,ny", "nz", "i,k"])
def test_a_direction_of_less_than_three_columns_is_refused(tmp_path, columns):
    zeros = ",0" * len(columns.split(","))
    path = written(tmp_path, f"0,0,0,0{zeros}", f"9,0,0,0{zeros}", header=f"x,y,z,bead,{columns}")
    with pytest.raises(PartError, match="the deposition direction needs all three"):
        read_toolpath(path, thickness_mm=1.7, normal="up")
