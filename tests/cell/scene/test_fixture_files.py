"""Fixtures from mesh files: all that a file holds is in the cell."""

import mujoco
import numpy as np
import pytest
import trimesh
from scipy.spatial import ConvexHull
from support.cells.cell_models import ARM, write_case

from cell.case.read import load_case
from cell.errors import InputError
from cell.job.job import prepare
from cell.scene.composition import BodyOwner
from slicing.warning import Code

PLACE = np.array([1.3, 0.9, 1.2])  # m


def channel():
    """A U of 10 mm sheet, and a bar across it whose ends stand in its walls: no corner of the bar is outside them."""
    walls = [trimesh.creation.box((600.0, 10.0, 300.0)) for _ in range(2)]
    for wall, y in zip(walls, (-200.0, 200.0), strict=True):
        wall.apply_translation((0.0, y, 0.0))
    floor = trimesh.creation.box((600.0, 410.0, 10.0))
    floor.apply_translation((0.0, 0.0, -150.0))
    bar = trimesh.creation.box((60.0, 400.0, 60.0))
    return trimesh.boolean.union([*walls, floor], engine="manifold"), bar


def as_obj(meshes, word="o"):
    lines, first = [], 1
    for number, mesh in enumerate(meshes):
        lines.append(f"{word} part_{number}")
        lines += [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in mesh.vertices]
        lines += ["f " + " ".join(str(k) for k in face + first) for face in mesh.faces]
        first += len(mesh.vertices)
    return "\n".join(lines) + "\n"


def pieces_of(scene):
    """Half spaces of every colliding piece of the fixture, world frame."""
    model, data = scene.model, mujoco.MjData(scene.model)
    mujoco.mj_kinematics(model, data)
    solid = scene.contact_bits.any(axis=0) & (scene.piece_of_geom == BodyOwner.FIXTURE)
    for geom in np.flatnonzero(solid).tolist():
        mesh = model.geom_dataid[geom]
        points = model.mesh_vert[model.mesh_vertadr[mesh] :][: model.mesh_vertnum[mesh]]
        yield ConvexHull(points @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom]).equations


def is_solid(scene, point_mm):
    point = PLACE + np.array(point_mm) * 1e-3
    return any(bool((planes[:, :3] @ point + planes[:, 3] <= 1e-6).all()) for planes in pieces_of(scene))


def cell_of(make_case, tmp_path, text):
    (tmp_path / "fixture.obj").write_text(text, encoding="utf-8")
    fixture = {"name": "channel", "mesh": str(tmp_path / "fixture.obj"), "position_mm": (PLACE * 1e3).tolist()}
    return prepare(load_case(make_case(fixtures=[fixture]))).scene


@pytest.mark.parametrize("word", ["o", "g"])
def test_all_objects_of_an_obj_are_there(make_case, tmp_path, word):
    walls, bar = channel()
    scene = cell_of(make_case, tmp_path, as_obj([walls, bar], word))
    for y in np.linspace(-190.0, 190.0, 9):
        assert is_solid(scene, (0.0, y, 0.0)), y
    assert not is_solid(scene, (200.0, 0.0, 0.0))  # beside the bar nothing is
    scene = cell_of(make_case, tmp_path, as_obj([walls], word))
    assert not is_solid(scene, (0.0, 0.0, 0.0))


def test_an_obj_whose_faces_share_no_vertices_is_as_solid(make_case, tmp_path):
    walls, _ = channel()
    walls.unmerge_vertices()
    scene = cell_of(make_case, tmp_path, as_obj([walls]))
    assert is_solid(scene, (0.0, 200.0, 0.0))
    assert not is_solid(scene, (0.0, 0.0, 0.0))


@pytest.mark.parametrize("text", ["", "v 0 0 0\nf 1 2 3\n", "v 0 0 zero\n", "# nothing\n"])
def test_an_obj_that_cannot_be_read_is_refused_in_one_line(make_case, tmp_path, text):
    with pytest.raises(InputError, match=r"fixtures\.channel\.mesh: .*fixture\.obj: ") as raised:
        cell_of(make_case, tmp_path, text)
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize(("units", "told"), [("mm", True), ("m", False), ("inch", False)])
def test_a_fixture_that_is_rather_in_another_unit_is_told(make_case, tmp_path, units, told):
    trimesh.creation.box((0.6, 0.5, 0.4)).export(tmp_path / "box.stl")
    fixture = {"name": "box", "mesh": str(tmp_path / "box.stl"), "units": units, "position_mm": [0, 2000, 900]}
    job = prepare(load_case(make_case(fixtures=[fixture])))
    said = [str(line) for line in job.warnings if getattr(line, "code", None) is Code.MESH_UNITS]
    assert said == (["fixtures.box.mesh: largest extent 0.6 mm with units: mm; is it in another?"] if told else [])


@pytest.mark.parametrize(("scale", "told"), [("1e-6", True), ("1e-3", False)])
def test_a_link_whose_mesh_is_scaled_twice_is_told(tmp_path, scale, told):
    bar = trimesh.creation.box((800.0, 100.0, 100.0), trimesh.transformations.translation_matrix((400, -170, 0)))
    bar.export(tmp_path / "bar.stl")
    upper = '<geom name="upper" type="capsule" size="0.09" fromto="0.025 -0.17 0 0.825 -0.17 0"/>'
    assert upper in ARM
    heavy = '<inertial pos="0 0 0" mass="5" diaginertia="1 1 1"/><geom name="upper" type="mesh" mesh="bar"/>'
    mesh = f'<asset><mesh name="bar" file="bar.stl" scale="{scale} {scale} {scale}"/></asset><worldbody>'
    arm = ARM.replace("<worldbody>", mesh).replace(upper, heavy)
    job = prepare(load_case(write_case(tmp_path, "cell", arm=arm)))
    said = [str(line) for line in job.warnings if getattr(line, "code", None) is Code.LINK_WITHOUT_SHAPES]
    assert len(said) == told
    assert not told or "link_2 (0.84 of 890 mm)" in said[0]
