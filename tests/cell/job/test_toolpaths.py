"""A job made of beads that were laid elsewhere: the same verdict, motion and growing part as of beads laid here."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

import cell
import slicing
from cell.cli.main import main
from cell.errors import InputError
from cell.job.overhang_check import unsupported_targets
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


def beads_below_one_another(layers, z=40.0):
    """Two beads on a shaft of radius 20, one a layer or both of one: the second lies 4 mm below the first."""
    rows = []
    for bead, r in enumerate((24.0, 20.0)):
        for a in np.radians(np.linspace(-20, 20, 9)):
            rows.append((bead, r * np.cos(a), r * np.sin(a), z, np.cos(a), np.sin(a), 0.0))
    return "bead,layer,x,y,z,nx,ny,nz\n" + "".join(
        f"{r[0]},{r[0] * (layers - 1)}," + ",".join(f"{v:.6f}" for v in r[1:]) + "\n" for r in rows
    )


@pytest.mark.parametrize("layers", [1, 2])
def test_another_slicers_beads_given_in_python_are_taken_for_what_they_are(make_case, layers):
    """The wire runs through a bead laid earlier, of its own layer too, whatever part of the case the beads replace."""
    of_meshes = cell.load_case(make_case())
    file = of_meshes.path.parent / "below.csv"
    file.write_text(beads_below_one_another(layers), encoding="utf-8")
    of_table = cell.load_case(make_case("table", part={"toolpath": "below.csv", "sub_volumes": []}))
    path = slicing.read_toolpath(file, width_mm=5, thickness_mm=2)
    jobs = [cell.prepare(of_table), cell.prepare(of_meshes, path)]
    for job in jobs:
        assert job.deposits_before.tolist() == [0] * 9 + [1] * 9
        assert sorted(job.wires_in_metal) == list(range(9, 18))
    assert not cell.check(jobs[1], 90, 180).feasible


def test_beads_laid_here_keep_to_the_cases_overhang(tmp_path):
    """A block that is 2 mm wider from 26 mm off the axis on: less than half a bead, more than the case allows."""
    blocks = [trimesh.creation.box((12, 12, 12)), trimesh.creation.box((8, 12, 14))]
    blocks[0].apply_translation((21, 0, 36))
    blocks[1].apply_translation((30, 0, 37))
    made = trimesh.boolean.union(blocks, engine="manifold")
    made.export(tmp_path / "step.stl")
    data = {
        "part": {"sub_volumes": ["step.stl"], "body": {"radius_mm": 20, "z_mm": [0, 80]}},
        "slicing": {"strategy": "planar", "h_layer_mm": 2, "h_min_mm": 1, "h_max_mm": 3},
    }
    sliced = slicing.slice(
        slicing.load(tmp_path / "step.stl", units="mm"), slicing.CylindricalBody(20), "planar", h_layer_mm=2
    )
    path = slicing.lay([sliced], width_mm=5)
    for limit, refused in ((None, False), (3.0, False), (1.0, True)):
        case = cell.parse_case({**data, "checks": {"overhang_mm": limit}}, tmp_path / "step.case.yaml")
        job = cell.prepare(case, path)
        assert bool(unsupported_targets(job)) == refused
        assert set(unsupported_targets(job)) == set(unsupported_targets(cell.prepare(case))), limit


def test_what_stands_beside_beads_given_in_python_is_there_or_told(make_case):
    """Sub-volumes of the case that are built stand in the cell; those that nobody lays are told."""
    made = make_case()
    job = cell.prepare(cell.load_case(made))
    path = slicing.Toolpath(job.targets, slicing.BeadParameters(width_mm=5))
    case = cell.load_case(make_case("two", part={"sub_volumes": ["boss.stl", "boss.stl"], "built": ["SV2"]}))
    beside = cell.prepare(case, path)
    assert any(name.startswith("built/SV2/") for name in beside.shape.hulls)
    case = cell.load_case(make_case("gone", part={"sub_volumes": ["boss.stl", "boss.stl"]}))
    gone = cell.prepare(case, path)
    assert not any(name.startswith("built/") for name in gone.shape.hulls)
    assert any(str(line).startswith("SV2: neither in part.take nor in part.built") for line in gone.warnings)
    case = cell.load_case(make_case("both", part={"sub_volumes": ["boss.stl"], "built": []}))
    assert not any("neither in part.take" in str(line) for line in cell.prepare(case, path).warnings)
    for built, says in ((["SV1"], "the toolpath lays SV1 as well"), (["SV9"], "no sub-volume 'SV9'")):
        bad = cell.with_changes(case, part={**case.part.model_dump(exclude_unset=True), "built": built})
        with pytest.raises(InputError, match=says):
            cell.prepare(bad, path)
