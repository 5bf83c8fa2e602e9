"""What the part stands on, and what is there of it from the start."""

import re

import mujoco
import numpy as np
import pytest
import trimesh
import yaml
from support.cells.cell_models import TABLE, write_case

from cell.case.read import load_case
from cell.collision.checker import Checker
from cell.errors import InputError
from cell.job.job import prepare
from cell.scene.part_contact import carriers_of
from slicing.warning import Code


def of_code(job, code):
    return [line for line in job.warnings if getattr(line, "code", None) is code]


@pytest.mark.parametrize(
    ("z_mm", "position_mm", "said"),
    [
        ([0, 40], [0, 0, 0], None),
        ([-30, 40], [0, 0, 30], None),
        ([0, 40], [0, 0, -12], "12.0 mm below"),
        ([-30, 40], [0, 0, 0], "30.0 mm below"),
        ([0, 40], [0, 0, 7], "7.0 mm above"),
        ([5, 40], [0, 0, 0], "5.0 mm above"),
        ([0, 40], [200, 0, 0], "it stands beside the surface"),
        ([0, 40], [200, 0, -300], "nothing carries the body: its lower end is 300.0 mm below"),
    ],
)
def test_a_body_in_or_above_its_support_is_said(z_mm, position_mm, said, make_case):
    part = {"body": {"radius_mm": 20, "z_mm": z_mm}, "position_mm": position_mm}
    found = of_code(prepare(load_case(make_case(part=part))), Code.PART_NOT_ON_SUPPORT)
    assert [said in line for line in found] == ([] if said is None else [True])


def test_a_body_in_the_faceplate_is_said_and_one_held_by_a_clamp_is_not_floating(make_case):
    path = make_case(part={"position_mm": [0, 0, -5]})
    content = yaml.safe_load(path.read_text())
    del content["support"]
    path.write_text(yaml.safe_dump(content))
    assert "inside faceplate" in of_code(prepare(load_case(path)), Code.PART_NOT_ON_SUPPORT)[0]
    clamp = {"name": "clamp", "on": "table", "box": {"size_mm": [20, 20, 200]}, "position_mm": [0, 30, 100]}
    path = make_case(part={"position_mm": [0, 0, 7]}, fixtures=[clamp])
    assert not of_code(prepare(load_case(path)), Code.PART_NOT_ON_SUPPORT)


def on_a_fixed_table(folder, **sections):
    table = re.sub(r"<joint [^>]*>", "", TABLE)
    path = write_case(folder, "fixed", table=table, positioner={"joints": []}, **sections)
    content = yaml.safe_load(path.read_text())
    del content["table"]
    path.write_text(yaml.safe_dump(content))
    return prepare(load_case(path))


@pytest.mark.parametrize(("z_mm", "said"), [(0, None), (-12, "is inside support"), (7, "7.0 mm above")])
def test_what_stands_on_a_table_without_axes_is_said_as_well(tmp_path, z_mm, said):
    found = of_code(on_a_fixed_table(tmp_path, part={"position_mm": [0, 0, z_mm]}), Code.PART_NOT_ON_SUPPORT)
    assert [said in line for line in found] == ([] if said is None else [True])


def test_a_table_without_axes_carries_the_part_with_its_own_shapes_and_the_support(tmp_path):
    scene = on_a_fixed_table(tmp_path).scene
    assert {scene.model.geom(geom).name for geom in carriers_of(scene).tolist()} >= {"plate", "support"}


@pytest.mark.parametrize("sunk", [False, True])
def test_a_fixture_sunk_into_a_table_without_axes_is_said(tmp_path, sunk):
    clamp = {
        "name": "clamp",
        "on": "table",
        "box": {"size_mm": [20, 20, 60]},
        "position_mm": [80, 0, 15 if sunk else 31],
    }
    found = of_code(on_a_fixed_table(tmp_path, fixtures=[clamp]), Code.FIXTURE_SUNK)
    assert ["into plate" in line for line in found] == ([True] if sunk else [])


@pytest.mark.parametrize(
    "shape", [{"box": {"size_mm": [0.3, 0.2, 0.1]}}, {"cylinder": {"radius_mm": 0.1, "height_mm": 0.3}}]
)
def test_a_fixture_with_its_lengths_in_metres_is_told_of(tmp_path, shape):
    found = of_code(on_a_fixed_table(tmp_path, fixtures=[{"name": "wall", **shape}]), Code.FIXTURE_SMALL)
    assert found == ["fixtures.wall: largest extent 0.3 mm; lengths are in mm, not in m"]


@pytest.fixture(scope="module")
def neighbours(tmp_path_factory):
    """Three boxes one above the other on a shaft, the middle one low and 5 mm from each of the others."""
    folder = tmp_path_factory.mktemp("neighbours")
    shaft = trimesh.creation.cylinder(20, 100, sections=64)
    shaft.apply_translation([0, 0, 50])
    boxes = []
    for z, height in ((30, 40), (50, 10), (70, 40)):
        box = trimesh.creation.box((20 + height, 14, 15))
        box.apply_translation([(20 + height) / 2, 0, z])
        boxes.append(box)
    trimesh.boolean.union([shaft, *boxes], engine="manifold").export(folder / "part.stl")

    def case(name, part, **sections):
        path = folder / f"{name}.case.yaml"
        path.write_text(f"part: {{mesh: part.stl, {part}}}\nsupport: {{radius_mm: 15, height_mm: 100}}\n")
        return path

    return case


def test_what_is_built_is_there_from_the_start_and_stops_the_torch(neighbours):
    job = prepare(load_case(neighbours("built", "take: [SV2], built: [SV1, SV3]")))
    scene, model = job.scene, job.scene.model
    built = [g for g in range(model.ngeom) if model.geom(g).name.startswith("built/")]
    assert {model.geom(g).name.split("/")[1] for g in built} == {"SV1", "SV3"}
    assert (scene.deposit_of_geom[built] == -1).all()
    # the torch's nozzle is brought into SV1: with nothing laid yet that is met
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    wanted = data.geom_xpos[built[len(built) // 4]]
    q = scene.home.copy()
    for _ in range(60):
        T = scene.T_world_base() @ scene.chain.forward(q[None])[0]
        q += np.linalg.pinv(scene.chain.jacobian(q[None])[0][:3]) @ (wanted - T[:3, 3]) * 0.5
    found = Checker(scene, (0.0, 0.0), 0.05).clearances(q[None], np.array([0]))
    assert found.distance[0] < 0
    assert not of_code(job, Code.SUB_VOLUME_ABSENT)


@pytest.mark.slow
def test_what_is_neither_taken_nor_built_is_said_to_be_absent(neighbours):
    job = prepare(load_case(neighbours("take", "take: [SV2], built: [SV1]")))
    (line,) = of_code(job, Code.SUB_VOLUME_ABSENT)
    assert "SV3" in line
    assert line.sub_volume == "SV3"
    assert [s.mesh.name for s in job.sliced] == ["SV2"]
    rest = prepare(load_case(neighbours("rest", "built: [SV2]")))
    assert [s.mesh.name for s in rest.sliced] == ["SV1", "SV3"]


@pytest.mark.parametrize(
    ("part", "said"),
    [
        ("built: [SV9]", "part.built: no sub-volume 'SV9'"),
        pytest.param("built: [SV1, SV1]", "SV1 is listed twice", marks=pytest.mark.slow),
        ("take: [SV1], built: [SV1]", "list it in one of them"),
        pytest.param("built: [SV1, SV2, SV3]", "nothing is left", marks=pytest.mark.slow),
        ("take: [SV1, SV1]", "part.take: SV1 is listed twice"),
    ],
)
def test_what_cannot_be_taken_or_built_is_refused(part, said, neighbours):
    with pytest.raises(InputError, match=said):
        prepare(load_case(neighbours("wrong", part)))


@pytest.mark.parametrize(
    ("position_mm", "size_mm", "said"),
    [
        ([120, 0, 40], 60, None),
        ([120, 0, 30], 60, None),
        ([120, 0, 20], 60, "10.0 mm into plate"),
        ([120, 0, -8], 10, "13.0 mm into plate"),  # wholly in it: out by its upper side, 20 mm thick
        ([30, 0, 60], 60, "8.0 mm into support"),
    ],
)
def test_a_fixture_within_what_never_moves_against_it_is_said(tmp_path, position_mm, size_mm, said):
    box = {"name": "block", "on": "table", "box": {"size_mm": [size_mm] * 3}, "position_mm": position_mm}
    job = prepare(load_case(write_case(tmp_path, "sunk", fixtures=[box])))
    lines = of_code(job, Code.FIXTURE_SUNK)
    assert len(lines) == (said is not None)
    assert said is None or f"fixtures.block.position_mm: it reaches {said}" in lines[0]


@pytest.mark.parametrize("hollow", [False, True])
def test_a_body_whose_hull_fills_its_hollows_is_said(tmp_path, hollow):
    body = trimesh.creation.cylinder(9, 40, sections=96).apply_translation((0, 0, 20))
    if hollow:
        body = trimesh.boolean.difference([body, trimesh.creation.cylinder(7, 60, sections=96)], engine="manifold")
    body.export(tmp_path / "body.stl")
    told = {"radius_mm": 9, "mesh": "body.stl"}
    job = prepare(load_case(write_case(tmp_path, "body", part={"body": told})))
    lines = of_code(job, Code.CONCAVE_BODY)
    assert len(lines) == hollow
    volume = body.convex_hull.volume / body.volume - 1
    assert not hollow or f"has {100 * volume:.0f} % more volume" in lines[0]
