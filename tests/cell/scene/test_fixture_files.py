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
    return job_of(make_case, tmp_path / "fixture.obj").scene


def job_of(make_case, path, **more):
    fixture = {"name": "channel", "mesh": str(path), "position_mm": (PLACE * 1e3).tolist(), **more}
    return prepare(load_case(make_case(fixtures=[fixture])))


def told(job):
    return [getattr(line, "code", None) for line in job.warnings if "fixtures.channel" in str(line)]


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


KINDS = ("stl", "stl_ascii", "obj", "ply", "ply_ascii", "off", "glb", "3mf")
PLACED = trimesh.transformations.compose_matrix(angles=(0.3, -0.2, 1.1), translate=(120.0, -40.0, 30.0))


def written(folder, meshes, kind):
    """Meshes as a file; a GLB or 3MF has each at its place in a scene, turned and moved back in itself."""
    path = folder / f"fixture.{kind.split('_')[0]}"
    if kind in ("glb", "3mf"):
        scene = trimesh.Scene()
        for number, mesh in enumerate(meshes):
            back = mesh.copy().apply_transform(np.linalg.inv(PLACED))
            scene.add_geometry(back, transform=PLACED, node_name=f"node {number}", geom_name=f"mesh {number}")
        scene.export(path)
        return path
    one = trimesh.util.concatenate(meshes)
    if kind == "stl_ascii":
        path.write_text(one.export(file_type=kind))
    elif kind == "ply_ascii":
        path.write_bytes(one.export(file_type="ply", encoding="ascii"))
    else:
        one.export(path)
    return path


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_of_file_is_where_it_says_and_all_of_it(make_case, tmp_path, kind):
    """A scene's places count, and every point of every mesh is in a shape that collides."""
    walls, bar = channel()
    job = job_of(make_case, written(tmp_path, [walls, bar], kind))
    planes = list(pieces_of(job.scene))
    for mesh in (walls, bar):
        points = np.concatenate([mesh.vertices, mesh.sample(300, seed=1)]) * 1e-3 + PLACE
        held = np.any([(points @ p[:, :3].T + p[:, 3] <= 2e-6).all(axis=1) for p in planes], axis=0)
        assert held.all(), points[~held]
    assert not is_solid(job.scene, (200.0, 0.0, 0.0))
    assert not is_solid(job.scene, (0.0, 0.0, 200.0))
    assert told(job) == []


@pytest.mark.parametrize(("kind", "units"), [("stl_ascii", "m"), ("ply", "inch"), ("glb", "m"), ("off", "cm")])
def test_units_of_every_kind_of_file_count(make_case, tmp_path, kind, units):
    scale = {"m": 1000.0, "inch": 25.4, "cm": 10.0}[units]
    box = trimesh.creation.box(np.array((120.0, 60.0, 90.0)) / scale)
    scene = job_of(make_case, written(tmp_path, [box], kind), units=units).scene
    assert is_solid(scene, (59.9, 29.9, 44.9))
    assert not is_solid(scene, (60.1, 0.0, 0.0))


def test_a_3mf_has_its_own_unit(make_case, tmp_path):
    path = written(tmp_path, [trimesh.creation.box((120.0, 60.0, 90.0))], "3mf")
    with pytest.raises(InputError, match=r"fixtures\.channel\.mesh: .*unit is millimeter.*set units: mm"):
        job_of(make_case, path, units="m")


def test_a_mesh_in_a_plants_coordinates_is_as_exact(make_case, tmp_path):
    """Single precision, in which MuJoCo keeps meshes, has steps of 8 um at 90 m."""
    box = trimesh.creation.box((120.0, 60.0, 90.0))
    far = np.array((90001.234567, -80002.345678, 12.0))
    box.apply_translation(far)
    box.export(tmp_path / "fixture.off", digits=12)
    planes = list(
        pieces_of(job_of(make_case, tmp_path / "fixture.off", position_mm=(PLACE * 1e3 - far).tolist()).scene)
    )
    assert len(planes) == 1
    for point in trimesh.creation.box((0.12, 0.06, 0.09)).vertices:
        assert (planes[0][:, :3] @ (PLACE + point) + planes[0][:, 3]).max() == pytest.approx(0.0, abs=1e-7)


def test_open_meshes_and_those_turned_inside_out_are_solid(make_case, tmp_path):
    walls, _ = channel()
    inverted = walls.copy()
    inverted.invert()
    job = job_of(make_case, written(tmp_path, [inverted], "ply"))
    assert is_solid(job.scene, (0.0, 200.0, 0.0))
    assert not is_solid(job.scene, (0.0, 0.0, 0.0))
    assert told(job) == []
    walls.update_faces(np.arange(len(walls.faces)) > 0)
    job = job_of(make_case, written(tmp_path, [walls], "ply"))
    assert is_solid(job.scene, (0.0, 0.0, 0.0))  # its hull
    assert told(job) == [Code.CONCAVE_FIXTURE]


def test_faces_without_an_area_and_vertices_of_no_face_change_nothing(make_case, tmp_path):
    box = trimesh.creation.box((120.0, 60.0, 90.0))
    vertices = np.concatenate([box.vertices, [(5000.0, 0.0, 0.0)]])
    faces = np.concatenate([box.faces, [(0, 0, 1), (2, 2, 2)]])
    trimesh.Trimesh(vertices, faces, process=False).export(tmp_path / "fixture.ply")
    scene = job_of(make_case, tmp_path / "fixture.ply").scene
    assert is_solid(scene, (59.9, 29.9, 44.9))
    assert not is_solid(scene, (60.1, 0.0, 0.0))


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("OFF\n4 2 0\n0 0 0\n9 0 0\n9 9 0\n0 9 0\n3 0 1 2\n3 0 2 3\n", "all of the mesh is in one plane"),
        ("OFF\n4 2 0\n0 0 0\n9 0 nan\n9 9 5\n0 9 0\n3 0 1 2\n3 0 2 3\n", "a vertex is not a number"),
        ("OFF\n4 2 0\n0 0 0\n9 0 0\n9 9e9 5\n0 9 0\n3 0 1 2\n3 0 2 3\n", "a coordinate of 9e\\+09 mm"),
    ],
)
def test_meshes_that_are_none_are_refused_in_one_line(make_case, tmp_path, text, why):
    (tmp_path / "fixture.off").write_text(text)
    with pytest.raises(InputError, match=rf"fixtures\.channel\.mesh: .*fixture\.off: {why}") as raised:
        job_of(make_case, tmp_path / "fixture.off")
    assert "\n" not in str(raised.value)


def test_what_a_file_leaves_out_is_said(make_case, tmp_path):
    """Two binary STL files one after the other are both there; MuJoCo refused the file."""
    one, other = (trimesh.creation.box((50.0, 50.0, 50.0)).apply_translation((x, 0, 0)) for x in (0, 200))
    both = one.export(file_type="stl") + other.export(file_type="stl")
    (tmp_path / "fixture.stl").write_bytes(both)
    job = job_of(make_case, tmp_path / "fixture.stl")
    assert is_solid(job.scene, (0.0, 0.0, 0.0))
    assert is_solid(job.scene, (200.0, 0.0, 0.0))
    assert told(job) == [Code.MESH_FILE]


@pytest.mark.parametrize(("units", "said_so"), [("mm", True), ("m", False), ("inch", False)])
def test_a_fixture_that_is_rather_in_another_unit_is_told(make_case, tmp_path, units, said_so):
    trimesh.creation.box((0.6, 0.5, 0.4)).export(tmp_path / "box.stl")
    fixture = {"name": "box", "mesh": str(tmp_path / "box.stl"), "units": units, "position_mm": [0, 2000, 900]}
    job = prepare(load_case(make_case(fixtures=[fixture])))
    said = [str(line) for line in job.warnings if getattr(line, "code", None) is Code.MESH_UNITS]
    assert said == (["fixtures.box.mesh: largest extent 0.6 mm with units: mm; is it in another?"] if said_so else [])


@pytest.mark.parametrize(("scale", "said_so"), [("1e-6", True), ("1e-3", False)])
def test_a_link_whose_mesh_is_scaled_twice_is_told(tmp_path, scale, said_so):
    bar = trimesh.creation.box((800.0, 100.0, 100.0), trimesh.transformations.translation_matrix((400, -170, 0)))
    bar.export(tmp_path / "bar.stl")
    upper = '<geom name="upper" type="capsule" size="0.09" fromto="0.025 -0.17 0 0.825 -0.17 0"/>'
    assert upper in ARM
    heavy = '<inertial pos="0 0 0" mass="5" diaginertia="1 1 1"/><geom name="upper" type="mesh" mesh="bar"/>'
    mesh = f'<asset><mesh name="bar" file="bar.stl" scale="{scale} {scale} {scale}"/></asset><worldbody>'
    arm = ARM.replace("<worldbody>", mesh).replace(upper, heavy)
    job = prepare(load_case(write_case(tmp_path, "cell", arm=arm)))
    said = [str(line) for line in job.warnings if getattr(line, "code", None) is Code.LINK_WITHOUT_SHAPES]
    assert len(said) == said_so
    assert not said_so or "link_2 (0.84 of 890 mm)" in said[0]
