"""A job made of beads that were laid elsewhere: the same verdict, motion and growing part as of beads laid here."""

from __future__ import annotations

import numpy as np
import pytest

import cell
import slicing
from cell.cli.main import main
from cell.errors import InputError
from slicing.document import targets_rows


@pytest.fixture
def theirs(make_case):
    """A case of our own beads as another slicer's table."""
    path = make_case()
    job = cell.prepare(cell.load_case(path))
    header, rows = targets_rows(job.targets)
    lines = [",".join(header), *(",".join(str(v) for v in row) for row in rows)]
    (path.parent / "theirs.csv").write_text("\n".join(lines), encoding="utf-8")
    other = make_case("theirs", part={"toolpath": "theirs.csv", "sub_volumes": []})
    return job, other


def test_beads_of_a_table_are_judged_as_beads_laid_here(theirs):
    ours, path = theirs
    job = cell.prepare(cell.load_case(path))
    np.testing.assert_array_equal(job.deposits_before, ours.deposits_before)
    np.testing.assert_array_equal(job.laid, ours.laid)
    assert job.layers == ours.layers
    one, other = cell.check(ours, 90, 180), cell.check(job, 90, 180)
    assert one.feasible
    assert other.feasible
    np.testing.assert_allclose(other.motion.q, one.motion.q, atol=1e-9)
    assert abs(one.clearance.value - other.clearance.value) < 1e-3
    frame = other.to_frame()
    np.testing.assert_allclose(np.stack([frame[f"{a}_mm"] for a in "xyz"], axis=1), ours.targets.position)
    assert {len(column) for column in frame.values()} == {len(job.targets)}
    assert frame["feasible"].all()


def test_metal_of_a_table_that_stands_in_the_way_is_hit(theirs):
    """A bead of an earlier sub-volume, twenty times as thick, where the torch has to go later."""
    _, path = theirs
    table = path.parent / "theirs.csv"
    lines = table.read_text(encoding="utf-8").splitlines()
    first = [line for line in lines[1:] if line.split(",")[2] == "0"]
    wall = []
    for line in first:
        cells = line.split(",")
        cells[1], cells[7], cells[14] = "wall", str(float(cells[7]) + 9.0), "60"
        wall.append(",".join(cells))
    shifted = []
    for line in lines[1:]:
        cells = line.split(",")
        cells[3] = str(int(cells[3]) + 1)
        shifted.append(",".join(cells))
    table.write_text("\n".join([lines[0], *wall, *shifted]), encoding="utf-8")
    result = cell.check(cell.prepare(cell.load_case(path)), 90, 180)
    assert not result.feasible
    assert any("deposit/0/wall" in str(row.detail) for row in result.rows)


def test_what_does_not_go_with_a_toolpath_is_refused(theirs, make_case, capsys):
    _, path = theirs
    base = {"toolpath": "theirs.csv", "sub_volumes": []}
    for part, says in (
        ({"sub_volumes": ["boss.stl"]}, "give either toolpath or meshes"),
        ({"toolpath": "none.csv"}, "no such file"),
        ({"units": "inch"}, "part.units: leave it out: a toolpath's columns are in mm"),
        ({"take": ["SV1"]}, "part.take: leave it out: a toolpath is laid whole"),
    ):
        with pytest.raises(InputError, match=says):
            cell.prepare(cell.load_case(make_case("bad", part={**base, **part})))
    assert main(["slice", str(path)]) == 2
    assert "nothing to slice" in capsys.readouterr().err


def test_the_body_ends_where_the_beads_do_where_nothing_says_so(make_case):
    job = cell.prepare(cell.load_case(make_case()))
    path = slicing.Toolpath(job.targets, slicing.BeadParameters(width_mm=5))
    again = cell.prepare(cell.load_case(make_case("open", part={"body": {"radius_mm": 20}})), toolpath=path)
    z = np.concatenate([hull[:, 2] for name, hull in again.shape.hulls.items() if name.startswith("body/")])
    np.testing.assert_allclose([z.min(), z.max()], path.z_mm)
