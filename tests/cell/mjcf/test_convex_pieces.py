"""Concave fixtures: convex pieces that hold all of the solid, and little more."""

import mujoco
import numpy as np
import pytest
import trimesh

from cell.case.read import load_case
from cell.errors import InputError
from cell.job.job import prepare
from cell.mjcf.convex_pieces import convex_pieces, is_thick
from cell.scene.compose import put_together
from slicing.warning import Code


def without(solid, *holes):
    return trimesh.boolean.difference([solid, *holes], engine="manifold")


def gate():
    return without(trimesh.creation.box((100, 3000, 3000)), trimesh.creation.box((200, 2500, 2500)))


def bracket():
    solid = without(
        trimesh.creation.box((80, 60, 40)), trimesh.creation.box((60, 40, 50)).apply_translation([10, 10, 0])
    )
    return solid.apply_transform(trimesh.transformations.rotation_matrix(0.7, [1, 2, 3]))


def inside(pieces, points, slack):
    """Whether points are in any of the hulls of pieces."""
    found = np.zeros(len(points), dtype=bool)
    for piece in pieces:
        hull = trimesh.PointCloud(piece).convex_hull
        out = (points @ hull.face_normals.T - np.einsum("ij,ij->i", hull.face_normals, hull.triangles[:, 0])).max(
            axis=1
        )
        found |= out <= slack
    return found


@pytest.mark.parametrize("make", [gate, bracket], ids=["gate", "bracket"])
def test_the_pieces_of_a_solid_with_flat_faces_are_the_solid(make):
    solid = make()
    found = convex_pieces(solid)
    assert len(found.pieces) > 1
    assert found.excess < 1e-4
    volume = sum(trimesh.PointCloud(piece).convex_hull.volume for piece in found.pieces)
    assert volume == pytest.approx(solid.volume, rel=1e-4)


@pytest.mark.parametrize(
    "make",
    [
        gate,
        bracket,
        lambda: trimesh.creation.annulus(50, 60, 30, sections=24),
        lambda: trimesh.creation.torus(100, 20, major_sections=8, minor_sections=5),
        lambda: trimesh.util.concatenate([trimesh.creation.box((9, 9, 9)), gate()]),
    ],
    ids=["gate", "bracket", "ring", "torus", "two solids"],
)
def test_nothing_of_the_solid_is_outside_its_pieces(make):
    solid = make()
    points = np.concatenate([trimesh.sample.sample_surface(solid, 1500, seed=1)[0], solid.vertices])
    assert inside(convex_pieces(solid).pieces, points, 1e-6 * np.ptp(solid.vertices)).all()


def test_a_solid_turned_inside_out_is_there_beside_the_others():
    block, post = trimesh.creation.box((0.2, 0.2, 0.2)), trimesh.creation.box((0.1, 0.1, 0.3))
    points = np.random.default_rng(1).uniform((0.45, -0.05, -0.15), (0.55, 0.05, 0.15), (500, 3))
    post.apply_translation((0.5, 0, 0))
    post.invert()
    found = convex_pieces(trimesh.util.concatenate([block, post]))
    assert inside(found.pieces, points, 1e-9).all()
    assert found.excess < 1e-6


def test_of_a_mesh_that_crosses_itself_nothing_is_left_out():
    # a bow tie: of its two lobes one is turned inside out, of whichever the other makes up for
    outline = np.array([[-1, -1], [-1, 1], [2, -2], [2, 2]], dtype=float)
    corners = np.concatenate([np.column_stack([outline, np.full(4, z)]) for z in (0.0, 1.0)])
    faces = [[0, 1, 2], [0, 2, 3], [4, 6, 5], [4, 7, 6]]
    for a in range(4):
        b = (a + 1) % 4
        faces += [[a, 4 + a, b], [b, 4 + a, 4 + b]]
    tie = trimesh.Trimesh(corners, faces, process=False)
    assert tie.is_watertight
    lobes = np.random.default_rng(1).uniform((-1, -0.2, 0), (2, 0.2, 1), (2000, 3))
    lobes = lobes[np.abs(lobes[:, 0]) > 0.25]
    assert inside(convex_pieces(tie).pieces, lobes, 1e-9).all()


def test_a_fin_of_two_micrometres_is_among_the_pieces():
    solid = trimesh.boolean.union(
        [trimesh.creation.box((0.2, 0.2, 0.2)), trimesh.creation.box((2e-6, 3.0, 3.0))], engine="manifold"
    )
    points = np.random.default_rng(1).uniform((0, -1.5, -1.5), (0, 1.5, 1.5), (500, 3))
    found = convex_pieces(solid)
    assert inside(found.pieces, points, 1e-6).all()
    assert np.isfinite(found.excess)  # the box is a piece of its own, and not filled up to the fin's corners


@pytest.mark.parametrize("turned", [False, True], ids=["outwards", "inwards"])
def test_a_room_is_its_walls_and_not_what_is_between_them(turned):
    hollow = trimesh.creation.box((4, 5, 3))
    cavity = trimesh.creation.box((3.8, 4.8, 2.8))
    cavity.invert()
    room = trimesh.util.concatenate([hollow, cavity])
    if turned:
        room.invert()
    found = convex_pieces(room)
    assert found.excess < 0.1
    inner = np.random.default_rng(2).uniform((-1.2, -1.5, -0.8), (1.2, 1.5, 0.8), (500, 3))
    assert not inside(found.pieces, inner, 1e-3).any()
    walls = trimesh.sample.sample_surface(hollow, 1000, seed=1)[0]
    assert inside(found.pieces, walls, 1e-6).all()


def test_a_solid_whose_faces_are_all_turned_inwards_is_closed():
    solid = gate()
    solid.invert()
    assert convex_pieces(solid).excess < 1e-4


def test_a_convex_solid_is_one_piece_and_what_is_not_closed_its_hull():
    box = trimesh.creation.box((10, 20, 30))
    whole = convex_pieces(box)
    assert (len(whole.pieces), whole.excess) == (1, 0.0)
    opened = trimesh.Trimesh(gate().vertices, gate().faces[:-1])
    found = convex_pieces(opened)
    assert (len(found.pieces), found.excess) == (1, np.inf)


def scene_with(make_case, tmp_path, mesh, **fixture):
    mesh.export(tmp_path / "thing.stl")
    given = {"name": "thing", "mesh": "thing.stl", "position_mm": [900, 0, 1350], **fixture}
    job = prepare(load_case(make_case(fixtures=[given])))
    return job, [w for w in job.warnings if getattr(w, "code", None) is Code.CONCAVE_FIXTURE]


def test_what_goes_through_a_gate_does_not_touch_it(make_case, tmp_path):
    job, said = scene_with(make_case, tmp_path, gate())
    scene = job.scene
    model, data = scene.model, mujoco.MjData(scene.model)
    mujoco.mj_kinematics(model, data)
    pieces = [g for g in range(model.ngeom) if scene.geom_name(g) == "thing" and scene.contact_bits[:, g].any()]
    assert len(pieces) > 1
    assert not said
    # a ball of 40 mm in the opening is as far from the gate as from four walls
    spec = put_together(scene.case, scene.part).pieces.world
    body = spec.worldbody.add_body(name="ball body", pos=(0.9, 0, 1.35))
    body.add_geom(name="ball", size=(0.04, 0, 0))
    other = spec.compile()
    there = mujoco.MjData(other)
    mujoco.mj_kinematics(other, there)
    distances = [
        mujoco.mj_geomDistance(other, there, other.geom(model.geom(g).name).id, other.geom("ball").id, 9.0, np.zeros(6))
        for g in pieces
    ]
    assert min(distances) == pytest.approx(1.25 - 0.04, abs=1e-5)


def test_what_is_filled_of_a_fixture_is_said(make_case, tmp_path):
    _, said = scene_with(make_case, tmp_path, trimesh.Trimesh(gate().vertices, gate().faces[:-1]))
    assert len(said) == 1
    assert "convex hull" in said[0]


def test_a_fixture_that_is_no_mesh_is_refused_in_one_line(make_case, tmp_path):
    (tmp_path / "thing.stl").write_bytes(b"no mesh")
    with pytest.raises(InputError, match=r"fixtures\.thing\.mesh"):
        prepare(load_case(make_case(fixtures=[{"name": "thing", "mesh": "thing.stl"}])))


def test_a_sheet_too_thin_to_be_cut_up_is_refused_and_not_left_out(make_case, tmp_path):
    sheet = trimesh.creation.box((0.002, 4000, 4000))
    block = trimesh.creation.box((100, 100, 100)).apply_translation([500, 0, 0])
    for k, mesh in enumerate((sheet, trimesh.util.concatenate([block, sheet]))):
        mesh.export(tmp_path / f"sheet{k}.stl")
        path = make_case(fixtures=[{"name": "wall", "mesh": str(tmp_path / f"sheet{k}.stl")}])
        with pytest.raises(InputError, match=r"fixtures\.wall\.mesh: a part of the mesh is thinner than"):
            prepare(load_case(path))


def test_no_piece_is_too_thin_for_single_precision():
    """MuJoCo keeps corners in it: it refuses a hull of 60 um that is 6 nm thick as none."""
    corners = np.array([[0, 0, 0], [1e-4, 3e-5, 0], [2e-5, 1e-4, 0], [4e-5, 5e-5, 1e-7]])
    sliver = trimesh.Trimesh(
        corners + np.array((0.2, 0.3, 0.1)), np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
    )
    found = convex_pieces(trimesh.util.concatenate([trimesh.creation.box((0.5, 0.01, 0.01)), sliver]))
    assert len(found.pieces) == 2
    assert inside(found.pieces, sliver.vertices, 1e-9).all()
    assert all(is_thick(piece, 5e-7) for piece in found.pieces)
