"""A seam elsewhere: seams of some layers' own, and a start that lets beads be run which could not be."""

import math
import shutil
from dataclasses import replace

import numpy as np
import pytest
import trimesh
import yaml
from support.parts.meshes import BODY, box

from cell.case.read import load_case, parse_case
from cell.errors import InputError
from cell.failure import Failure, Kind, Where
from cell.failure import FailurePlace as FailurePlace
from cell.job.job import prepare
from cell.remedy_search.seam_changes import reseamed, seam_places
from cell.remedy_search.search import remedies
from cell.shipped import MODELS_DIR
from cell.verdict.check import check_fixed
from slicing import SeamPlace
from slicing.beads.lay import lay_beads
from slicing.mesh.solid import PartError
from slicing.parameters import BeadParameters, SlicingParameters
from slicing.parameters import SeamPlace as Place
from slicing.strategies.slice import slice_sub_volume

HALF, R0 = -60.0, 70.0


@pytest.fixture(scope="module")
def boss():
    return slice_sub_volume(box((10, -15, -12), (38, 15, 12)), BODY, SlicingParameters("cylindrical"))


def starts(sliced, **how):
    return [bead.points[0] for bead in lay_beads([sliced], BeadParameters(**how))[0].beads]


def test_layers_have_seams_of_their_own_and_those_above_follow(boss):
    own = Place("body", (2, 3), angle_deg=7.0), Place(boss.name, (2, 3), angle_deg=-9.0)
    plain, placed = starts(boss), starts(boss, seams=own[1:])
    for k, (a, b) in enumerate(zip(plain, placed, strict=True)):
        if len(boss.layers[k].curves) > 1:
            break  # where the flat top begins: two beads a layer
        angle = math.degrees(math.atan2(b[1], b[0]))
        if k < 2:
            assert np.array_equal(a, b)
        elif k < 4:
            assert angle == pytest.approx(-9.0, abs=1e-6)
            assert b[2] == pytest.approx(-12.0)  # the lower of the two places at this angle
        else:
            assert np.linalg.norm(b - placed[k - 1]) < 3.0
    assert k > 5
    # the last that fits goes, and a point is as good as an angle
    point = (30.0, 15.0, 12.0)
    both = starts(boss, seams=(*own[1:], Place(xyz_mm=point)))
    assert np.array_equal(both, starts(boss, seam="chosen", seam_xyz_mm=point))
    with pytest.raises(PartError, match=f"named body; there are {boss.name}"):
        starts(boss, seams=own)
    with pytest.raises(PartError, match="one of angle_deg, xyz_mm"):
        Place(boss.name)


@pytest.mark.parametrize(
    ("entry", "named"),
    [
        ({"sub_volume": "SV1"}, "needs one of angle_deg, xyz_mm"),
        ({"layers": [3, 2], "angle_deg": 0}, "first <= last"),
        ({"angel_deg": 0}, "did you mean angle_deg"),
    ],
)
def test_entries_that_say_nothing_are_refused(entry, named):
    with pytest.raises(InputError, match=f"beads.seams.0.*{named}"):
        parse_case({"part": {"mesh": "x.stl"}, "beads": {"seams": [entry]}})


def ring_case(folder, turns_deg):
    """A ring all round a cone, the torch's neck always along the axis: the last joint goes round once with it."""
    n = np.array([np.cos(np.radians(HALF)), -np.sin(np.radians(HALF))])
    low, high = (np.array([R0 + z * np.tan(np.radians(HALF)), z]) for z in (10.0, 20.0))
    outline = np.array([low - 3 * n, low + 2 * n, high + 2 * n, high - 3 * n, low - 3 * n])
    mesh = trimesh.creation.revolve(outline, sections=96)
    mesh.fix_normals()
    mesh.export(folder / "ring.stl")
    shutil.copytree(MODELS_DIR / "kr70_r2100", folder / "arm", dirs_exist_ok=True)
    arm = folder / "arm" / "kr70_r2100.xml"
    text = arm.read_text()
    assert 'name="A6" axis="-1 0 0" range="-350 350"' in text
    arm.write_text(text.replace('range="-350 350"', f'range="{-turns_deg} {turns_deg}"'))
    path = folder / "ring.case.yaml"
    content = {
        "part": {"sub_volumes": ["ring.stl"], "body": {"radius_mm": R0, "half_angle_deg": HALF, "z_mm": [0, 24]}},
        "slicing": {"strategy": "conical", "h_layer_mm": 2.0},
        "sampling": {"chord_tolerance_mm": 2.0, "min_segment_mm": 8.0},
        "support": {"radius_mm": 30, "height_mm": 200},
        "robot": {"model": "arm/kr70_r2100.xml"},
        "roll": {"fixed_deg": 0},
    }
    path.write_text(yaml.safe_dump(content))
    return path


@pytest.mark.slow
def test_a_ring_whose_last_joint_runs_out_is_run_from_another_start(tmp_path):
    path = ring_case(tmp_path, 200.0)
    job = prepare(load_case(path))
    found = check_fixed(job, 0, 0)
    assert {row.reason for row in found.rows} == {None, "no_path"}
    assert all(row.reason is None or row.detail["on_the_way"] == "configuration change" for row in found.rows)
    best = next(iter(remedies(found, shown=1)))
    assert best.checked == "part"
    assert best.change["key"] == "beads.seams"
    assert best.change["from"] == []
    ((place,),) = (best.change["to"],)
    assert set(place) == {"sub_volume", "angle_deg"}
    assert best.sentence.startswith(f"seams of {place['sub_volume']} -> {place['angle_deg']:g} deg about the axis (ch")
    # the remedy's own setting, put into the case
    content = yaml.safe_load(path.read_text())
    path.write_text(yaml.safe_dump({**content, "beads": {"seams": best.change["to"]}}))
    mended = prepare(load_case(path))
    assert check_fixed(mended, 0, 0).feasible
    first = mended.targets.position[np.flatnonzero(np.diff(mended.targets.bead, prepend=-1))]
    np.testing.assert_allclose(np.degrees(np.arctan2(first[:, 1], first[:, 0])), place["angle_deg"], atol=1e-6)
    # with less than one turn no start helps, so that it was the turns that ran out
    short = prepare(load_case(ring_case(tmp_path, 175.0)))
    for angle in (-90.0, 0.0, 90.0):
        assert not check_fixed(reseamed(short, SeamPlace(angle_deg=angle)), 0, 0).feasible


def test_only_closed_beads_that_a_start_could_mend_get_other_seams(make_case):
    few = {"slicing": {"h_layer_mm": 3, "h_min_mm": 2, "h_max_mm": 4}}
    job = prepare(load_case(make_case(**few, positioner={"position_mm": [4000, 0, 0]})))
    rows = check_fixed(job, 90, 180).rows
    assert {row.reason for row in rows} == {"unreachable"}
    assert seam_places(job, rows) == {}
    k = int(np.searchsorted(job.targets.bead, 1)) + 3
    cut = replace(rows[k], failure=Failure(Kind.COLLISION, place=FailurePlace(Where.BEAD, k, k - 1)))
    mixed = [cut if i == k else row for i, row in enumerate(rows)]
    ((name, places),) = seam_places(job, mixed).items()
    # this bead does not go round the axis: points, the first of them where it was cut, all of them apart
    assert all(place.sub_volume == name and place.angle_deg is None for place in places)
    np.testing.assert_allclose(places[0].xyz_mm, job.targets.position[k - 1], atol=0.051)
    at = np.array([place.xyz_mm for place in places])
    gaps = np.linalg.norm(at[:, None] - at[None], axis=2)[np.triu_indices(len(at), 1)]
    assert len(at) >= 15
    assert gaps.min() > 0.2
    open_ones = replace(job, targets=replace(job.targets, closed=np.zeros_like(job.targets.closed)))
    assert seam_places(open_ones, mixed) == {}
    assert isinstance(places[0], SeamPlace)
