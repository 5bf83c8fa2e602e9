"""Targets, indices and documents of sliced sub-volumes."""

from __future__ import annotations

import ast
import json
import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.layers.beads import break_points
from support.parts.meshes import BODY, R, blade, box, box_section, box_solid, from_manifold, ring, rotated, sector

import slicing
from slicing.document import TARGETS_HEADER, slices_document, targets_rows
from slicing.mesh.closest_point import closest_on_triangles
from slicing.mesh.solid import PartError
from slicing.paper.indices import Indices, indices, top_angle
from slicing.parameters import BeadParameters, SlicingParameters
from slicing.strategies.slice import slice_sub_volume
from slicing.targets.targets import sample_targets

STRATEGIES = ("planar", "cylindrical", "nonuniform")
H = 1.73
BORDERS = BeadParameters(thin_walls="border")  # beads are the layers' curves, however thin the walls


@pytest.fixture(scope="module", params=STRATEGIES)
def sliced(request):
    return [slice_sub_volume(mesh, BODY, SlicingParameters(request.param)) for mesh in (blade(), box())]


@pytest.fixture(scope="module")
def targets(sliced):
    return sample_targets(sliced, beads=BORDERS)


def beads(targets):
    for path in range(len(targets.closed)):
        yield path, np.flatnonzero(targets.bead == path)


def curve_error(chord, points) -> float:
    """Greatest distance of points from the segment chord[0] chord[1]."""
    along = chord[1] - chord[0]
    t = np.clip((points - chord[0]) @ along / (along @ along), 0, 1)
    return float(np.sqrt(((points - chord[0] - t[:, None] * along) ** 2).sum(axis=1)).max(initial=0.0))


def test_targets_lie_on_their_curves(sliced):
    targets = sample_targets(sliced, beads=BeadParameters(thin_walls="border"))  # else those of thin walls lie within
    for k, one in enumerate(sliced):
        for layer in one.layers:
            at = targets.position[(targets.sub_volume_index == k) & (targets.layer == layer.index)]
            assert np.abs(layer.surface.distance(at)).max() < 1e-6
            points = np.concatenate([c.points for c in layer.curves])
            away = np.sqrt(((at[:, None] - points[None]) ** 2).sum(axis=2)).min(axis=1)
            assert away.max() < 1e-9


def test_normals_and_tangents_are_unit_and_square(sliced, targets):
    assert np.allclose(np.linalg.norm(targets.normal, axis=1), 1)
    assert np.allclose(np.linalg.norm(targets.tangent, axis=1), 1)
    assert np.abs((targets.normal * targets.tangent).sum(axis=1)).max() < 1e-9
    for k, one in enumerate(sliced):
        for layer in one.layers:
            mine = (targets.sub_volume_index == k) & (targets.layer == layer.index)
            assert np.allclose(targets.normal[mine], layer.surface.normals(targets.position[mine]))
            assert np.allclose(targets.thickness_mm[mine], one.thickness_at(layer.index, targets.position[mine]))


def test_beads_end_where_they_start_and_keep_their_order(sliced, targets):
    paths = sum(len(layer.curves) for one in sliced for layer in one.layers)
    assert len(targets.closed) == paths
    assert targets.closed.all()
    for _, rows in beads(targets):
        assert (np.diff(rows) == 1).all()
        assert (targets.position[rows[0]] == targets.position[rows[-1]]).all()
        assert len(np.unique(targets.layer[rows])) == 1
    order = np.stack([targets.sub_volume_index, targets.layer, targets.bead], axis=1)
    assert (np.lexsort(order.T[::-1]) == np.arange(len(targets))).all()
    assert targets.sub_volume == ("blade", "box")


def test_least_segment_holds_wherever_the_bead_allows_it(targets):
    for _, rows in beads(targets):
        step = np.linalg.norm(np.diff(targets.position[rows], axis=0), axis=1)
        if step.sum() > 9.5:
            assert step.min() >= 3.0 - 1e-9


def test_chords_keep_to_the_curve_unless_the_least_segment_forbids(sliced):
    free = sample_targets(sliced, chord_tolerance_mm=0.3, min_segment_mm=0.01, beads=BORDERS)
    path = 0
    for one in sliced:
        for layer in one.layers:
            for curve in layer.curves:
                at = free.position[free.bead == path]
                number = [int(np.argmin(((curve.points - p) ** 2).sum(axis=1))) for p in at]
                for (a, b), chord in zip(pairwise(number), pairwise(at), strict=True):
                    between = curve.points[np.arange(a, b if b > a else b + len(curve.points)) % len(curve.points)]
                    assert curve_error(chord, between) <= 0.3
                path += 1


def test_a_box_needs_its_corners_and_no_more():
    one = slice_sub_volume(box(), BODY, SlicingParameters("planar"))
    targets = sample_targets([one])
    assert len(targets) == 5 * len(one.layers)  # four corners and the first again
    corners = np.array([[-6, -8], [6, -8], [6, 8], [-6, 8.0]])
    for _, rows in beads(targets):
        assert np.allclose(targets.position[rows[:4]][:, 1:], corners)
        # outgoing along the next side; the closing target keeps the direction of arrival
        assert np.allclose(targets.tangent[rows], [[0, 1, 0], [0, 0, 1], [0, -1, 0], [0, 0, -1], [0, 0, -1]], atol=1e-9)


def test_seams_follow_one_another(targets):
    seams = [targets.position[rows[0]] for _, rows in beads(targets) if targets.sub_volume_index[rows[0]] == 0]
    step = [np.linalg.norm(b - a) for a, b in pairwise(seams)]
    assert max(step) < 4.0


def test_outer_beads_run_counter_clockwise_and_holes_clockwise():
    tube = from_manifold(box_solid((10, -9, -9), (40, 9, 9)) - box_solid((0, -5, -5), (50, 5, 5)))
    one = slice_sub_volume(tube, BODY, SlicingParameters("cylindrical"))
    targets = sample_targets([one], beads=BORDERS)
    holes = [curve.hole for layer in one.layers for curve in layer.curves]
    assert any(holes)
    for path, rows in beads(targets):
        at, normal = targets.position[rows], targets.normal[rows].mean(axis=0)
        turned = np.cross(at[:-1] - at[0], at[1:] - at[0]).sum(axis=0) @ normal
        assert (turned < 0) == holes[path]


@pytest.mark.slow
def test_turning_the_part_turns_the_targets():
    for strategy in STRATEGIES:
        parameters = SlicingParameters(strategy)
        still = sample_targets([slice_sub_volume(blade(10, 10), BODY, parameters)])
        turned = sample_targets([slice_sub_volume(rotated(blade(10, 10), 0.8), BODY, parameters)])
        assert len(turned) == pytest.approx(len(still), rel=0.05)


@settings(max_examples=80, deadline=None)
@given(
    st.integers(0, 2**32 - 1),
    st.floats(0.5, 30.0),
    st.floats(0.05, 1.0),
    st.floats(0.05, 1.0),
    st.floats(0.2, 6.0),
)
def test_break_points_of_wobbly_loops(seed, size, flat, tolerance, least):
    rng = np.random.default_rng(seed)
    angle = np.sort(rng.uniform(0, 2 * np.pi, 150))
    wobble = 1 + 0.2 * sum(rng.normal() / k * np.cos(k * angle + rng.uniform(0, 6)) for k in range(2, 6))
    loop = size * wobble[:, None] * np.stack([np.cos(angle), flat * np.sin(angle), 0.1 * np.sin(2 * angle)], axis=1)
    seam = int(rng.integers(150))
    chosen = break_points(loop, seam, tolerance, least)
    assert chosen[0] == seam
    assert len(chosen) >= 3
    assert len(set(chosen.tolist())) == len(chosen)
    assert (np.diff((chosen - seam) % 150) > 0).all()
    closed = loop[np.append(chosen, seam)]
    step = np.linalg.norm(np.diff(closed, axis=0), axis=1)
    if len(chosen) > 3:
        assert step.min() >= least - 1e-9


def test_break_points_of_a_circle_are_about_as_few_as_can_be():
    t = np.arange(720) / 720 * 2 * np.pi
    for r, tolerance in ((50.0, 0.3), (10.0, 0.1)):
        loop = r * np.stack([np.cos(t), np.sin(t), 0 * t], axis=1)
        fewest = np.pi / np.arccos(1 - tolerance / r)
        assert fewest <= len(break_points(loop, 0, tolerance, 0.01)) <= fewest + 2


def test_a_loop_too_small_still_goes_round():
    t = np.arange(40) / 40 * 2 * np.pi
    loop = 0.6 * np.stack([np.cos(t), np.sin(t), 0 * t], axis=1)
    chosen = break_points(loop, 7, 0.3, 3.0)
    assert len(chosen) == 3
    step = np.linalg.norm(np.diff(loop[np.append(chosen, chosen[0])], axis=0), axis=1)
    assert step == pytest.approx(np.full(3, 0.6 * np.sqrt(3)), rel=0.1)


def test_sampling_parameters_are_checked():
    for key in ("chord_tolerance_mm", "min_segment_mm"):
        with pytest.raises(PartError, match=key):
            sample_targets([], **{key: 0.0})
    assert len(sample_targets([])) == 0


def test_indices_of_a_box():
    found = {}
    for strategy in STRATEGIES:
        one = slice_sub_volume(box((10, -15, -8), (40, 15, 8)), BODY, SlicingParameters(strategy))
        targets = sample_targets([one])
        found[strategy] = indices(one, targets)
        assert found[strategy] == indices(one, len(targets))
        assert len(one.layers) == found[strategy].NL
    footprint = box_section(30, 16, R)
    assert found["cylindrical"].A_mm2 == pytest.approx(footprint, rel=1e-7)
    assert found["nonuniform"].A_mm2 == pytest.approx(footprint, rel=1e-7)
    assert 0 < found["planar"].A_mm2 < footprint
    assert found["planar"].R_rad == pytest.approx(0, abs=1e-6)
    assert found["nonuniform"].R_rad == pytest.approx(0, abs=1e-6)
    assert found["cylindrical"].R_rad > 0.05
    assert found["planar"].NL > found["cylindrical"].NL - 2
    assert found["planar"].NV < found["cylindrical"].NV


def test_top_angle_by_hand():
    # the last cylinder round a box: directions at angle t against the top's normal x
    mesh = box((10, -15, -8), (40, 15, 8))
    one = slice_sub_volume(mesh, BODY, SlicingParameters("cylindrical", h_layer_mm=9.5, h_min_mm=1, h_max_mm=10))
    last = one.layers[-1]
    assert last.surface.radius == 39.0
    t = np.arcsin(15 / 39)
    arc, side = 2 * 39 * t, 16.0
    exact = (2 * arc * t / 2 + 2 * side * t) / (2 * arc + 2 * side)
    assert top_angle(one) == pytest.approx(exact, rel=0.02)
    # a sector's top follows the cylinder, but for its facets
    smooth = slice_sub_volume(sector(0.9, 20, 40, -5, 5, n=60), BODY, SlicingParameters("cylindrical"))
    assert top_angle(smooth) < 0.9 / 60 + 1e-6


def test_indices_know_their_sub_volume_by_name(sliced, targets):
    numbers = [indices(one, targets).NV for one in sliced]
    assert sum(numbers) == len(targets)
    with pytest.raises(ValueError, match="tuple"):
        indices(slice_sub_volume(ring(19.9, 30, -3, 3), BODY, SlicingParameters("cylindrical")), targets)


def test_closest_point_of_a_triangle_by_search():
    rng = np.random.default_rng(3)
    points, triangles = rng.normal(size=(50, 3)) * 2, rng.normal(size=(50, 3, 3))
    close = np.linalg.norm(points - closest_on_triangles(points, triangles), axis=1)
    s, t = (g.ravel() for g in np.meshgrid(np.linspace(0, 1, 201), np.linspace(0, 1, 201)))
    weights = np.stack([(1 - s) * (1 - t), s * (1 - t), t], axis=1)
    for point, triangle, d in zip(points, triangles, close, strict=True):
        searched = np.linalg.norm(weights @ triangle - point, axis=1).min()
        assert d <= searched + 1e-9
        assert d == pytest.approx(searched, abs=0.03)


def test_document_keeps_the_contract(sliced, targets):
    found = [indices(one, targets) for one in sliced]
    document = json.loads(json.dumps(slices_document(sliced, found, ["first of all"])))
    assert document["schema"] == "rbam-slices/1"
    assert document["units"] == "mm"
    assert document["warnings"][0] == "first of all"
    assert len(document["warnings"]) == 1 + sum(len(one.warnings) for one in sliced)
    for one, some, written in zip(sliced, found, document["sub_volumes"], strict=True):
        assert (written["name"], written["strategy"]) == (one.name, one.strategy)
        assert Indices(**written["indices"]) == some
        for layer, plain in zip(one.layers, written["layers"], strict=True):
            assert set(plain) == {"index", "surface", "curves", "area_mm2", "thickness_mm"}
            assert plain["surface"]["kind"] == layer.surface.kind
            keys = {"cylinder": {"kind", "axis_point", "radius"}, "plane": {"kind", "point", "normal"}}
            assert set(plain["surface"]) == keys[layer.surface.kind]
            assert plain["thickness_mm"] == list(layer.thickness_mm)
            for curve, points in zip(layer.curves, plain["curves"], strict=True):
                assert set(points) == {"closed", "hole", "points"}
                assert (np.array(points["points"]) == curve.points).all()


def test_target_rows_keep_the_contract(targets):
    header, rows = targets_rows(targets)
    expected = "index,sub_volume,layer,path,kind,x_mm,y_mm,z_mm,nx,ny,nz,tx,ty,tz,thickness_mm,speed_mm_s"
    assert ",".join(header) == expected
    assert header == TARGETS_HEADER
    assert len(rows) == len(targets)
    assert [row[0] for row in rows] == list(range(len(rows)))
    for row, position, thickness in zip(rows, targets.position, targets.thickness_mm, strict=True):
        assert len(row) == len(header)
        assert row[4] == "print"
        assert row[5:8] == tuple(position)
        assert row[14] == thickness
        assert row[15] == 8.0


def test_heavy_libraries_stay_out_until_a_file_is_read():
    code = (
        "import sys, slicing.strategies.slice, slicing.targets.targets, slicing.paper.indices, slicing.document\n"
        "print([m for m in ('trimesh', 'scipy', 'shapely', 'manifold3d', 'mujoco') if m in sys.modules])"
    )
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert ran.stdout.strip() == "[]"


def test_modules_of_slicing_build_on_one_another_one_way():
    """All imports stand at the top, and following them one never comes back."""
    folder, on = Path(slicing.__file__).parent, {}
    for file in folder.glob("*.py"):
        tree = ast.parse(file.read_text())
        every = [n for n in ast.walk(tree) if isinstance(n, ast.ImportFrom) and (n.module or "").startswith("slicing")]
        assert set(every) <= set(tree.body), file
        on[f"slicing.{file.stem}"] = {n.module for n in every}
    left = dict(on)
    while left:
        bottom = {name for name, below in left.items() if not below & set(left)}
        assert bottom, sorted(left)
        left = {name: below for name, below in left.items() if name not in bottom}


def test_slicing_is_a_leaf():
    for file in Path(slicing.__file__).parent.glob("*.py"):
        for node in ast.walk(ast.parse(file.read_text())):
            names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
            names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            assert not {n.split(".")[0] for n in names} & {"mujoco", "cell", "ik", "models"}, file
