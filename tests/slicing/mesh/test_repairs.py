"""Meshes that are not quite solids: what is put right, that it is said, and what is refused in one line."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from support.parts.meshes import box, subdivided

from slicing.curves.intersect import intersect
from slicing.mesh import solid as part
from slicing.mesh.load import load_mesh, solid_from_arrays
from slicing.mesh.solid import Mesh, PartError, mesh_from_arrays
from slicing.surfaces.surfaces import Cylinder, Plane


def joined(*solids: Mesh | tuple) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and faces of several, as one file would hold them."""
    points, faces, n = [], [], 0
    for solid in solids:
        v, f = (solid.vertices, solid.faces) if isinstance(solid, Mesh) else solid
        points.append(v)
        faces.append(np.asarray(f) + n)
        n += len(v)
    return np.concatenate(points), np.concatenate(faces)


def reversed_(mesh: Mesh) -> tuple[np.ndarray, np.ndarray]:
    return mesh.vertices, mesh.faces[:, ::-1]


def sound(points, faces, **kwargs) -> Mesh:
    return solid_from_arrays("x", points, faces, **kwargs)


def refusal(points, faces) -> str:
    with pytest.raises(PartError) as caught:
        sound(points, faces)
    line = str(caught.value)
    assert "\n" not in line
    assert len(line) < 250
    return line


def said(mesh: Mesh, words: str) -> None:
    assert any(words in line for line in mesh.warnings), mesh.warnings


BOX = box((0, 0, 0), (10, 20, 30))
SMALL = box((3, 3, 3), (7, 7, 7))
FINE = subdivided(BOX, 2)


def test_a_clean_solid_is_taken_as_it_is():
    mesh = sound(BOX.vertices, BOX.faces)
    assert mesh.warnings == ()
    assert np.array_equal(mesh.vertices, BOX.vertices)
    assert np.array_equal(mesh.faces, BOX.faces)


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("roll", [0, 1, 2])
@pytest.mark.parametrize("which", [[0], [0, 5, 9], list(range(192))])
def test_duplicate_faces(which, roll, turned):
    extra = np.roll(FINE.faces[which][:, ::-1] if turned else FINE.faces[which], roll, axis=1)
    mesh = sound(FINE.vertices, np.concatenate([FINE.faces, extra]))
    said(mesh, "duplicate faces")
    assert mesh.volume == pytest.approx(6000)
    assert len(mesh.faces) == len(FINE.faces)


@pytest.mark.parametrize("roll", [0, 1, 2])
def test_a_fold_of_no_width_is_dropped(roll):
    """Two faces back to back on a solid's border: with both gone it is closed, with one of them it is not."""
    tip = np.array([[5.0, 10.0, 40.0]])
    top = FINE.faces[(FINE.vertices[FINE.faces][:, :, 2] == 30.0).all(axis=1)][0]
    n = len(FINE.vertices)
    fold = np.array([[top[0], top[1], n], [top[1], top[0], n]])
    mesh = sound(np.concatenate([FINE.vertices, tip]), np.concatenate([FINE.faces, np.roll(fold, roll, axis=1)]))
    said(mesh, "dropped 2 duplicate faces")
    assert mesh.volume == pytest.approx(6000)


def test_the_wall_between_two_solids_that_share_it_is_no_wall():
    right = box((10, 0, 0), (14, 20, 30))
    points, faces = joined(BOX, right)
    points, number = np.unique(points, axis=0, return_inverse=True)
    mesh = sound(points, number.reshape(-1)[faces])
    assert len(mesh.warnings) > 0
    assert mesh.volume == pytest.approx(14 * 600)
    (curve,) = intersect(mesh, Plane((0, 0, 13.0), (0.0, 0.0, 1.0)))
    assert curve.area_mm2 == pytest.approx(14 * 20)


def test_faces_without_area_and_vertices_without_faces():
    a, b = FINE.faces[0, :2]
    faces = np.concatenate([FINE.faces, [[a, a, b]]])
    mesh = sound(np.concatenate([FINE.vertices, [[500.0, 0, 0], [np.nan, 0, 0]]]), faces)
    said(mesh, "dropped 1 faces that use a vertex twice")
    said(mesh, "dropped 2 vertices that no face uses")
    assert np.allclose(mesh.bounds, BOX.bounds)
    assert mesh.volume == pytest.approx(6000)


def test_a_face_at_no_number_is_dropped_where_the_rest_is_closed():
    points = np.concatenate([FINE.vertices, [[np.inf, 0, 0]]])
    mesh = sound(points, np.concatenate([FINE.faces, [[0, 1, len(FINE.vertices)]]]))
    said(mesh, "dropped 1 faces with vertices that are not finite numbers")
    points = FINE.vertices.copy()
    points[7] = np.nan
    assert "1 vertices are not finite numbers" in refusal(points, FINE.faces)


def split_side(share: float = 0.5) -> tuple[np.ndarray, np.ndarray]:
    """The box with a vertex on one of its edges that splits one of the two faces there, closed by a collinear face."""
    start, end = BOX.faces[0, 0], BOX.faces[0, 1]
    middle = BOX.vertices[start] + share * (BOX.vertices[end] - BOX.vertices[start])
    n = len(BOX.vertices)
    a, b, c = BOX.faces[0]
    faces = np.concatenate([[[a, n, c], [n, b, c], [a, b, n]], BOX.faces[1:]])
    return np.concatenate([BOX.vertices, [middle]]), faces


@pytest.mark.parametrize("share", [0.5, 0.123456])
def test_collinear_faces_that_close_a_mesh_are_kept_and_cut_as_nothing(share):
    mesh = sound(*split_side(share))
    assert len(mesh.faces) == 14
    assert mesh.warnings == ()
    for surface in (Plane((0, 0, 13.0), (0.0, 0.0, 1.0)), Cylinder((5.0, 10.0), 7.0), Cylinder((-20.0, 1.0), 25.0)):
        plain, odd = intersect(BOX, surface), intersect(mesh, surface)
        assert [c.area_mm2 for c in odd] == pytest.approx([c.area_mm2 for c in plain])


@settings(max_examples=25, deadline=None)
@given(st.floats(0, 0.004), st.integers(0, 2**31))
def test_cracks_are_joined(apart, seed):
    """Every face with its own vertices, these a little off: an STL written with rounding."""
    rng = np.random.default_rng(seed)
    points = FINE.vertices[FINE.faces].reshape(-1, 3)
    points = points + rng.uniform(-0.5, 0.5, points.shape) * apart / np.sqrt(3)
    mesh = sound(points, np.arange(len(points)).reshape(-1, 3))
    said(mesh, "open edges by joining vertices")
    assert mesh.volume == pytest.approx(6000, rel=1e-3)
    assert len(mesh.vertices) == len(FINE.vertices)


def test_wide_cracks_are_refused_with_their_place():
    points = FINE.vertices[FINE.faces].reshape(-1, 3) * [1, 1, 1.0]
    points[:3] += 0.3
    line = refusal(points, np.arange(len(points)).reshape(-1, 3))
    assert "open edges" in line
    assert "mm)" in line


def test_pinholes_are_filled_and_larger_holes_are_not():
    fine = subdivided(box((0, 0, 0), (0.4, 0.4, 0.4)), 4)
    mesh = sound(fine.vertices, fine.faces[1:])
    said(mesh, "filled 1 holes of at most 0.025 mm across")
    assert mesh.volume == pytest.approx(0.064)
    line = refusal(FINE.vertices, np.delete(FINE.faces, [3, 100], axis=0))
    assert "6 open edges round 2 holes" in line
    assert "the widest 7.5 mm, at (" in line


def test_a_sheet_is_refused():
    grid = trimesh.creation.box((10, 10, 10)).submesh([[0, 1]], append=True)
    assert "not closed" in refusal(grid.vertices, grid.faces)


@pytest.mark.parametrize("seed", range(5))
def test_faces_that_disagree_are_turned_whatever_their_number(seed):
    turn = np.random.default_rng(seed).random(len(FINE.faces)) < 0.15 * (seed + 1)
    mesh = sound(FINE.vertices, np.where(turn[:, None], FINE.faces[:, ::-1], FINE.faces))
    assert mesh.volume == pytest.approx(6000)
    said(mesh, "turned")


def test_a_klein_bottle_has_no_outside():
    n = 8
    i, j = np.meshgrid(np.arange(n), np.arange(n), indexing="ij")

    def number(a, b):
        return np.where(a == n, (n - b) % n, (a % n) * n + b % n)

    quad = [number(i, j), number(i + 1, j), number(i + 1, j + 1), number(i, j + 1)]
    faces = np.concatenate([np.stack([quad[0], quad[1], quad[2]], -1), np.stack([quad[0], quad[2], quad[3]], -1)])
    points = np.random.default_rng(1).uniform(size=(n * n, 3))
    assert "disagree about which side is outside" in refusal(points, faces.reshape(-1, 3))


def test_solids_that_share_an_edge_get_one_each():
    other = box((10, 20, 0), (15, 28, 30))
    points, faces = joined(BOX, other)
    points, number = np.unique(points, axis=0, return_inverse=True)
    assert len(points) == 14
    mesh = sound(points, number.reshape(-1)[faces])
    said(mesh, "divided 1 edge shared by four faces or more")
    assert len(mesh.vertices) == 16
    assert mesh.volume == pytest.approx(6000 + 5 * 8 * 30)
    curves = intersect(mesh, Plane((0, 0, 13.0), (0.0, 0.0, 1.0)))
    assert sorted(c.area_mm2 for c in curves) == pytest.approx([40, 200])
    points, number = np.unique(joined(BOX, other, box((10, 5, 30), (12, 20, 33)))[0], axis=0, return_inverse=True)
    faces = joined(BOX, other, box((10, 5, 30), (12, 20, 33)))[1]
    assert sound(points, number.reshape(-1)[faces]).volume == pytest.approx(6000 + 1200 + 90)


def test_a_mesh_inside_out_is_turned_with_its_cavities():
    hollow = joined(BOX, reversed_(SMALL))
    assert sound(*hollow).warnings == ()
    mesh = sound(hollow[0], hollow[1][:, ::-1])
    assert mesh.volume == pytest.approx(6000 - 64)
    assert mesh.warnings == ("x: turned the mesh, which was inside out (-5936 mm³ before, 5936 mm³ now)",)


def test_one_shell_inside_out_among_several_is_turned():
    far = box((40, 0, 0), (50, 5, 5))
    for first, second in ((BOX, reversed_(far)), (reversed_(BOX), far)):
        mesh = sound(*joined(first, second))
        assert mesh.volume == pytest.approx(6000 + 250)
        said(mesh, "x: turned 1 of 2 shells that were inside out (")
        said(mesh, "750 mm³ before, 6250 mm³ now)")
        assert len(mesh.warnings) == 1


def test_nested_shells():
    island = box((4, 4, 4), (6, 6, 6))
    kept = sound(*joined(BOX, reversed_(SMALL), island))
    assert kept.volume == pytest.approx(6000 - 64 + 8)
    assert kept.warnings == ()
    wrong_island = sound(*joined(BOX, reversed_(SMALL), reversed_(island)))
    assert wrong_island.volume == pytest.approx(6000 - 64 + 8)
    said(wrong_island, "1 of 3 shells that were inside out")
    filled = sound(*joined(BOX, SMALL))
    assert filled.volume == pytest.approx(6000)
    said(filled, "overlap")
    said(filled, "dropped 1 shell that faces outward within the material of others")
    filled = sound(*joined(BOX, SMALL, reversed_(box((1, 1, 20), (2, 2, 21)))))
    assert filled.volume == pytest.approx(6000 - 1)
    said(filled, "dropped 1 shell that faces outward within the material of others")
    assert "is not clear" in refusal(*joined(reversed_(BOX), reversed_(SMALL)))


def test_a_small_shell_within_a_large_one_is_no_rounding():
    """In coordinates so coarse (a file in metres) that touching shells may overlap by more than it holds."""
    large = box((0, 0, 0), (200, 200, 200))
    mesh = sound(*joined(large, box((50, 50, 50), (52, 52, 52))), noise_mm=1e-3)
    assert mesh.volume == pytest.approx(8e6, rel=1e-12)
    said(mesh, "dropped 1 shell that faces outward within the material of others")


def test_a_shell_that_sticks_out_of_a_recess_is_united_whatever_else_there_is():
    """Most of it lies in the other's material, all of it in the other's box; a cavity far off changes nothing."""
    recess = trimesh.creation.box(bounds=[(-1, 10, 10), (11, 21, 20)])
    u = trimesh.boolean.difference([trimesh.creation.box(bounds=[(0, 0, 0), (10, 20, 30)]), recess])
    bar = box((4, 12, 2), (6, 14, 11))
    cavity = reversed_(box((1, 1, 1), (2, 2, 2)))
    for more, volume in (((), 0.0), ((cavity,), 1.0)):
        mesh = sound(*joined((u.vertices, u.faces), bar, *more))
        assert mesh.volume == pytest.approx(5000 + 4 - volume)
        said(mesh, "shells that overlap")


def test_sheets_alone_and_coordinates_of_no_part_are_refused(tmp_path):
    flat = BOX.vertices * [1, 1, 0]
    assert "encloses no volume" in refusal(flat, BOX.faces)
    assert "encloses no volume" in refusal(*joined((flat, BOX.faces), (flat + np.array([0, 0, 9.0]), BOX.faces)))
    assert "at most 1e+09 mm" in refusal(BOX.vertices * 1e200, BOX.faces)
    huge = tmp_path / "huge.obj"
    huge.write_text("v 0 0 1e300\nv 1 0 0\nv 0 1 0\nv 0 0 0\nf 1 2 3\nf 1 4 2\nf 2 4 3\nf 1 3 4\n")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(PartError, match="coordinates up to 1e\\+300 mm"):
            load_mesh(huge)


@pytest.mark.parametrize(
    ("kind", "says"), [("stl", "its text is not UTF-8|not readable"), ("3mf", "not readable|needs")]
)
def test_rubbish_is_one_line(kind, says, tmp_path):
    file = tmp_path / f"rubbish.{kind}"
    file.write_bytes(np.random.default_rng(1).integers(0, 256, 4000, dtype=np.uint8).tobytes())
    with pytest.raises(PartError, match=says) as caught:
        load_mesh(file)
    assert "\n" not in str(caught.value)


def test_a_sheet_with_two_sides_encloses_nothing():
    flat = BOX.vertices * [1, 1, 0] + [0, 0, 50.0]
    mesh = sound(*joined(BOX, (flat, BOX.faces)))
    assert mesh.volume == pytest.approx(6000)
    said(mesh, "dropped 1 shell without volume")


@pytest.mark.slow
@settings(max_examples=25, deadline=None)
@given(st.tuples(*(st.integers(-12, 12) for _ in range(3))), st.tuples(*(st.integers(1, 14) for _ in range(3))))
def test_shells_that_overlap_are_one_solid(corner, size):
    """On whole numbers, so that faces lie in one plane and edges on one another."""
    low = np.array(corner, dtype=float)
    high = low + np.array(size)
    common = np.prod(np.maximum(np.minimum(high, [10, 20, 30]) - np.maximum(low, 0), 0))
    mesh = sound(*joined(BOX, box(low, high)))
    assert mesh.volume == pytest.approx(6000 + np.prod(size) - common)
    if common > 0:
        said(mesh, "shells that overlap")
    else:
        assert mesh.warnings == ()  # they may touch


def test_a_cavity_is_kept_when_shells_are_united():
    mesh = sound(*joined(BOX, reversed_(SMALL), box((-5, 2, 20), (5, 8, 25))))
    assert mesh.volume == pytest.approx(6000 - 64 + 5 * 6 * 5)
    covered = sound(*joined(BOX, reversed_(SMALL), box((5, -5, 5), (6, 25, 6))))  # a rod through the cavity
    assert covered.volume == pytest.approx(6000 - 64 + 4 + 10)


def test_a_cavity_that_breaks_out_is_refused():
    line = refusal(*joined(BOX, reversed_(box((5, 5, 5), (12, 9, 9)))))
    assert "two shells cross and one of them faces inward" in line


def crossed(depth: float) -> tuple[np.ndarray, np.ndarray]:
    """A block with a corner of its top pulled down through the inside of its bottom."""
    points = BOX.vertices.copy()
    points[np.argmax(points @ [1, 1, 1.0])] = [4, 9, -depth]
    return points, BOX.faces


@pytest.mark.parametrize("finer", [0, 3])
def test_a_face_that_passes_through_its_own_solid_is_refused_with_a_place(finer):
    points, faces = crossed(4.0)
    clean = mesh_from_arrays("x", points, faces)
    if finer:
        clean = subdivided(clean, finer)
    line = refusal(clean.vertices, clean.faces)
    assert "of faces cross, up to" in line
    place = np.array([float(v) for v in line.split("at (")[1].split(")")[0].split(",")])
    assert (np.abs(place - [5, 10, 0]) <= [5, 10, 4]).all()


def test_crossings_shallower_than_the_tolerance_are_said_and_left():
    points, faces = crossed(0.004)
    mesh = sound(points, faces)
    said(mesh, "left as they are")
    said(mesh, "pair")


def test_too_many_faces_are_refused_before_they_are_read(tmp_path, monkeypatch):
    monkeypatch.setattr(part, "MOST_FACES", 100)
    solid = trimesh.Trimesh(FINE.vertices, FINE.faces, process=False)
    assert "192 faces; at most 100 are taken" in refusal(FINE.vertices, FINE.faces)
    monkeypatch.setattr(trimesh, "load", lambda *a, **k: pytest.fail("read all the same"))
    for kind in ("stl", "ply"):
        solid.export(tmp_path / f"x.{kind}")
        with pytest.raises(PartError, match="192 faces; at most 100"):
            load_mesh(tmp_path / f"x.{kind}")


def test_what_is_read_from_a_file_is_looked_at_shell_by_shell(tmp_path):
    points, faces = joined(BOX, reversed_(box((40, 0, 0), (50, 5, 5))))
    trimesh.Trimesh(points, faces, process=False).export(tmp_path / "two.stl")
    mesh = load_mesh(tmp_path / "two.stl", name="SV1")
    assert mesh.name == "SV1"
    assert mesh.volume == pytest.approx(6250)
    said(mesh, "two.stl: turned 1 of 2 shells that were inside out")


@pytest.mark.parametrize("section", ["sub_volumes", "body", "mesh"])
def test_a_wrong_unit_is_said_whichever_way_a_mesh_comes_in(section, tmp_path, capsys, make_case):
    from cell.cli.main import main

    trimesh.creation.cylinder(20, 60, sections=96).export(tmp_path / "hub.stl")
    case = make_case()
    text = case.read_text()
    tiny = tmp_path / "tiny.stl"
    solid = trimesh.creation.cylinder(0.02, 0.06, sections=96)
    solid = trimesh.boolean.union([solid, trimesh.creation.box((0.02, 0.01, 0.012)).apply_translation((0.025, 0, 0))])
    solid.export(tiny)
    if section == "mesh":
        command = ["slice", str(tiny)]
    else:
        if section == "sub_volumes":
            text = text.replace("boss.stl", "tiny.stl")
        else:
            text = text.replace("body:\n", "body:\n    mesh: tiny.stl\n")
        case.write_text(text)
        command = ["slice", str(case)]
    main(command)
    out, err = capsys.readouterr()
    assert "units: m would make it" in out + err
