"""What of another slicer's beads lies over nothing: told bead by bead, and refused where the case sets a limit."""

import math

import numpy as np
import pytest
import yaml

from cell.case.read import load_case
from cell.errors import InputError
from cell.job.job import prepare
from cell.job.overhang_check import targets_over_nothing, unsupported_targets
from cell.motion.motion_file import ReadMotion
from cell.verdict.check import check_fixed
from cell.verification.motion_check import check_motion
from slicing.document import targets_rows

WIDTH, H = 5.0, 2.0


def job_of(folder, lines, header="bead,layer,x,y,z,nx,ny,nz", **sections):
    """A job of beads on a shaft of radius 20, z 0 .. 80."""
    (folder / "beads.csv").write_text("\n".join([header, *(",".join(map(str, line)) for line in lines)]) + "\n")
    case = {
        "part": {"toolpath": "beads.csv", "body": {"radius_mm": 20, "z_mm": [0, 80]}, "rotation_deg": 180},
        "slicing": {"h_layer_mm": H},
        "beads": {"width_mm": WIDTH},
        "support": {"radius_mm": 15, "height_mm": 120},
        "positioner": {"position_mm": [1550, 0, 0], "rotation_deg": [0, 0, -90]},
        "table": {"E1_deg": 90, "E2_deg": 180},
    }
    for name, section in sections.items():
        case[name] = {**case.get(name, {}), **section} if isinstance(section, dict) else section
    (folder / "beads.case.yaml").write_text(yaml.safe_dump(case), encoding="utf-8")
    return prepare(load_case(folder / "beads.case.yaml"))


def rings(*radii, layers=None):
    """Arcs about the shaft at z = 40, one bead each."""
    for bead, r in enumerate(radii):
        for a in np.radians(np.linspace(-30, 30, 25)):
            c, s = math.cos(a), math.sin(a)
            layer = bead if layers is None else layers[bead]
            yield bead, layer, round(r * c, 5), round(r * s, 5), 40, round(c, 7), round(s, 7), 0


def wall(shift, count=6, below=False):
    """A wall that grows upwards from the shaft's upper end, every layer shifted across by so much."""
    for k in range(count):
        for x in (-10, 10):
            yield k, k, x, round(k * shift, 4), 80 + H * (k + below), 0, 0, 1


def said(job):
    return [line for line in job.warnings if getattr(line, "code", "") == "overhang"]


@pytest.mark.parametrize(
    ("radii", "layers", "hanging"),
    [
        ((20, 22, 24), None, {}),
        ((20, 22, 24), (0, 0, 0), {}),  # whatever the layers are called
        ((20.9, 22.9), None, {}),  # less than half a layer off
        ((21.1, 23.1), None, {0: 1.1}),
        ((40, 42), None, {0: 20.0}),
        ((20, 22, 30), None, {2: 6.0}),
        ((20, 22, 30), (0, 0, 0), {2: 6.0}),
        ((24, 22, 20), None, {0: 4.0, 1: 2.0}),
    ],
)
def test_beads_over_nothing_are_told(tmp_path, radii, layers, hanging):
    job = job_of(tmp_path, rings(*radii, layers=layers))
    found = {one.bead: one for one in job.overhanging_beads}
    assert set(found) == set(hanging)
    for bead, down in hanging.items():
        one = found[bead]
        assert one.down_mm == pytest.approx(down, abs=0.25)  # the metal below is made of chords
        assert one.hanging_mm == pytest.approx(one.length_mm)
        assert one.length_mm == pytest.approx(radii[bead] * math.pi / 3, rel=1e-3)
        assert set(one.targets) == set(np.flatnonzero(job.targets.bead == bead).tolist())
    assert len(said(job)) == len(hanging)
    assert unsupported_targets(job) == {}


def test_a_bead_beside_another_does_not_lie_on_it(tmp_path):
    """Two of a layer, side by side, high above the shaft; the second is told as well."""
    lines = [(bead, 0, 30, y, z, 1, 0, 0) for bead, z in enumerate((40, 43.75)) for y in (-10, 10)]
    assert [one.bead for one in job_of(tmp_path, lines).overhanging_beads] == [0, 1]


def test_the_part_of_a_bead_that_hangs_is_measured(tmp_path):
    """A bead along the shaft that runs 10 mm out over its end."""
    lines = [(0, 0, 20, 0, z, 1, 0, 0) for z in (50, 70, 90)]
    (one,) = job_of(tmp_path, lines).overhanging_beads
    assert one.length_mm == pytest.approx(40.0)
    assert one.hanging_mm == pytest.approx(10.0, abs=1.3)
    assert 80 < one.place_mm[2] < 90
    assert one.targets == (2,)


@pytest.mark.parametrize("below", [False, True])
@pytest.mark.parametrize(
    ("shift", "limit", "hangs"),
    [
        (2.4, None, False),  # by less than half a bead
        (2.7, None, True),
        (2.7, 3.0, False),
        (3.2, 3.0, True),
        (0.8, 1.0, False),
        (1.2, 1.0, True),
    ],
)
def test_a_wall_that_leans_stands_out_by_its_shift(tmp_path, shift, limit, hangs, below):
    part = {"toolpath_metal": "below" if below else "above"}
    checks = {} if limit is None else {"overhang_mm": limit}
    data = {"toolpath": "beads.csv", "body": {"radius_mm": 20, "z_mm": [0, 80]}, **part}
    job = job_of(tmp_path, wall(shift, below=below), part=data, checks=checks)
    assert [one.bead for one in job.overhanging_beads] == (list(range(1, 6)) if hangs else [])
    for one in job.overhanging_beads:
        assert one.out_mm == pytest.approx(shift, abs=0.5)
    refused = unsupported_targets(job)
    assert set(refused) == (set(range(2, 12)) if hangs and limit is not None else set())
    assert all(f.reason == "overhang" and f.limit == limit for f in refused.values())


def test_what_carries_the_part_carries_beads(tmp_path):
    """A bead beside the shaft: on a plate on the table, on the support, or on nothing."""
    lines = [(0, 0, 60, y, 0, 0, 0, 1) for y in (-10, 10)]
    plate = {
        "name": "plate",
        "box": {"size_mm": [200, 200, 20]},
        "position_mm": [0, 0, 110],
        "on": "table",
    }
    (one,) = job_of(tmp_path, lines).overhanging_beads
    assert one.down_mm == pytest.approx(120.0, abs=0.3)  # the faceplate
    assert job_of(tmp_path, lines, fixtures=[plate]).overhanging_beads == ()
    assert job_of(tmp_path, lines, support={"radius_mm": 70}).overhanging_beads == ()


def test_what_hangs_is_infeasible_where_the_case_limits_it(tmp_path):
    lines = list(rings(20, 22, 26))
    free = job_of(tmp_path, lines)
    result = check_fixed(free, 90.0, 180.0)
    assert result.feasible
    assert set(targets_over_nothing(free)) == set(range(50, 75))
    limited = job_of(tmp_path, lines, checks={"overhang_mm": 2.0})
    refused = check_fixed(limited, 90.0, 180.0)
    assert not refused.feasible
    assert {i for i, row in enumerate(refused.rows) if row.reason == "overhang"} == set(range(50, 75))
    read = ReadMotion(result.motion, np.arange(len(result.motion.t_s)) + 1, ())
    assert check_motion(free, read).feasible
    assert {f.reason for f in check_motion(limited, read).findings} == {"overhang"}


@pytest.mark.parametrize(("thickness", "told"), [(1.39, False), (2.2, False), (1.3, True), (2.3, True), (0.01, True)])
def test_beads_that_the_process_does_not_lay_are_told(tmp_path, thickness, told):
    lines = [(*line, thickness) for line in rings(20)]
    job = job_of(tmp_path, lines, "bead,layer,x,y,z,nx,ny,nz,thickness_mm")
    found = [line for line in job.warnings if getattr(line, "code", "") == "bead_thickness"]
    assert len(found) == told
    assert all(f"{thickness:g} mm thick" in line for line in found)


def test_own_beads_as_a_table_hang_where_their_layers_do(make_case, tmp_path):
    """The boss of the fixture lies on its hub: none of it hangs, sliced here or read back."""
    ours = prepare(load_case(make_case()))
    header, rows = targets_rows(ours.targets)
    assert targets_over_nothing(ours) == {}
    text = "\n".join([",".join(header), *(",".join(str(v) for v in row) for row in rows)])
    path = make_case("theirs", part={"toolpath": "theirs.csv", "sub_volumes": []})
    (path.parent / "theirs.csv").write_text(text, encoding="utf-8")
    assert prepare(load_case(path)).overhanging_beads == ()


def test_keys_that_a_table_makes_no_use_of_are_told(tmp_path):
    job = job_of(
        tmp_path,
        rings(20, 22),
        beads={"pattern": "zigzag", "lead_in_mm": 4},
        slicing={"strategy": "planar", "h_min_mm": 1.0},
        sampling={"min_segment_mm": 9},
        process={"speed_by_thickness": [[1, 5], [3, 9]], "retract_mm": 20},
    )
    (line,) = [line for line in job.warnings if getattr(line, "code", "") == "toolpath_keys"]
    named = "slicing.strategy, beads.pattern, beads.lead_in_mm, sampling.min_segment_mm, process.speed_by_thickness"
    assert line.endswith(f"unused keys: {named}")
    assert not [
        line for line in job_of(tmp_path, rings(20, 22)).warnings if getattr(line, "code", "") == "toolpath_keys"
    ]


@pytest.mark.parametrize(
    ("lines", "metal", "sunk"),
    [
        (list(rings(20, 22, 24)), "above", None),
        (list(rings(20.9, 22.9)), "above", None),
        (list(rings(19.1)), "above", None),  # less than half its thickness
        (list(rings(18.9)), "above", ("bead 0 (SV1 layer 0) lies", 0)),
        (list(rings(20, 22)), "below", ("bead 0 (SV1 layer 0) lies", 0)),  # the targets are not on its top
        (list(rings(20, 20.9, 23)), "above", ("bead 1 (SV1 layer 1) lies", 1)),  # layers nearer than they are thick
        (list(rings(20, 20)), "above", ("bead 1 (SV1 layer 1) lies", 1)),
        (list(rings(20, 20, layers=(0, 0))), "above", None),  # beads of one layer may cross
        (list(rings(17, 17.5)), "above", ("bead 0 (SV1 layer 0) and 1 more lie", 0)),
        (list(wall(0.0)), "above", None),
        (list(wall(0.0, below=True)), "below", None),
        (list(wall(0.0)), "below", ("bead 0 (SV1 layer 0) lies", 0)),  # the others lie on it
    ],
)
def test_beads_in_metal_that_is_there_are_told(tmp_path, lines, metal, sunk):
    job = job_of(tmp_path, lines, part={"toolpath_metal": metal})
    told = [line for line in job.warnings if getattr(line, "code", "") == "bead_sunk"]
    assert len(told) == (sunk is not None)
    if sunk is not None:
        assert told[0].startswith(f"part.toolpath: {sunk[0]} with more than half the thickness in metal")
        assert (told[0].sub_volume, told[0].layer) == ("SV1", sunk[1])


def test_a_bead_may_reach_into_another_by_a_width(tmp_path):
    flat = [(0, 0, x, 0, 80, 0, 0, 1) for x in (-10, 10)]
    across = [(1, 1, 0, y, 80, 0, 0, 1) for y in (0, 12)]  # from the middle of the other on
    along = [(1, 1, x, 1, 80, 0, 0, 1) for x in (-4, 10)]
    for other, told in ((across, []), (along, ["(bead 1 over 14.0 mm,"])):
        job = job_of(tmp_path, [*flat, *other])
        lines = [line for line in job.warnings if getattr(line, "code", "") == "bead_sunk"]
        assert len(lines) == len(told)
        assert all(words in line for words, line in zip(told, lines, strict=True))


@pytest.mark.parametrize(("name", "says"), [("support", "a shape support_visual"), ("body", "body is what the")])
def test_sub_volumes_that_are_called_as_shapes_of_the_cell_are_refused(tmp_path, name, says):
    lines = [(name, *line) for line in wall(0.0, count=1)]
    with pytest.raises(InputError, match=f"{says}.*give it another name"):
        job_of(tmp_path, lines, header="sub_volume,bead,layer,x,y,z,nx,ny,nz")
