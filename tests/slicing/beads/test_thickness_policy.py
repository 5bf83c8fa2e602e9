"""What becomes of beads thinner or thicker than the process can lay: limits that are known by hand."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from support.parts.meshes import BODY, R, blade, box, prism, subdivided

from slicing.beads.exact_points import point_between
from slicing.beads.lay import lay_beads
from slicing.document import slices_document
from slicing.mesh.closest_point import closest_on_triangles
from slicing.mesh.solid import PartError
from slicing.paper.indices import indices
from slicing.parameters import BeadParameters, SlicingParameters
from slicing.strategies.slice import slice_sub_volume
from slicing.targets.targets import sample_targets

H, H_MIN = 1.73, 1.39
# planes across x over the cylinder: the first is H above the root's lowest point, which is at |y| = 6
X0 = math.sqrt(R**2 - 6.0**2) + H
Y_MIN = math.sqrt(R**2 - (X0 - H_MIN) ** 2)  # where the first layer is H_MIN thick
THINNEST = X0 - R


def sliced_box(policy: str, h_max: float = 2.2, mesh=None):
    parameters = SlicingParameters("planar", H, H_MIN, h_max, thickness=policy)
    return slice_sub_volume(mesh or box(), BODY, parameters)


def laid_box(policy: str, h_max: float = 2.2, mesh=None, **how):
    return lay_beads([sliced_box(policy, h_max, mesh)], BeadParameters(**how))[0]


def test_report_leaves_the_beads_and_lists_the_places():
    laid = laid_box("report")
    assert all(bead.closed for bead in laid.beads)
    assert [place.done for place in laid.places] == ["reported", "reported"]
    for place in laid.places:
        assert place.layer == 0
        assert place.length_mm == pytest.approx(2 * Y_MIN, abs=1e-5)
        assert place.thickness_mm[0] == pytest.approx(THINNEST, abs=1e-3)
        ends = sorted([place.start_mm[1], place.end_mm[1]])
        assert ends == pytest.approx([-Y_MIN, Y_MIN], abs=1e-6)
    # the slicer's own line stands, and is not said twice
    assert len(laid.sliced.warnings) == 1
    assert [line.code for line in laid.warnings] == ["deposit_share"]  # borders alone do not fill


def test_trim_ends_the_bead_at_the_limit():
    laid = laid_box("trim")
    first = [bead for bead in laid.beads if bead.layer == 0]
    assert [bead.closed for bead in first] == [False, False]
    for bead in first:
        assert np.abs(bead.points[[0, -1], 1]) == pytest.approx([Y_MIN, Y_MIN], abs=1e-6)
        assert bead.length_mm == pytest.approx(16 + 2 * (6 - Y_MIN), abs=1e-5)
        assert laid.sliced.thickness_at(0, bead.points).min() >= H_MIN - 1e-9
    assert all(bead.closed for bead in laid.beads if bead.layer > 0)
    assert sum(p.length_mm for p in laid.places) == pytest.approx(4 * Y_MIN, abs=1e-4)
    assert {p.done for p in laid.places} == {"trimmed"}
    line, metal = laid.warnings
    assert metal.code == "deposit_share"
    assert "layer 0" in line
    assert "19.2 mm" in line or "19.1 mm" in line


def test_the_limit_does_not_hang_on_the_mesh():
    coarse, fine = (laid_box("trim", mesh=mesh) for mesh in (box(), subdivided(box(), 3)))
    ends = [
        np.sort(np.abs([bead.points[k, 1] for bead in one.beads if bead.layer == 0 for k in (0, -1)]))
        for one in (coarse, fine)
    ]
    assert ends[0] == pytest.approx(ends[1], abs=1e-6)


def test_trimmed_targets_end_where_the_beads_do():
    targets = sample_targets([sliced_box("trim")])
    assert targets.closed.tolist()[:2] == [False, False]
    for path in (0, 1):
        rows = np.flatnonzero(targets.bead == path)
        assert np.abs(targets.position[rows[[0, -1]], 1]) == pytest.approx([Y_MIN, Y_MIN], abs=1e-6)
        assert targets.thickness_mm[rows[[0, -1]]] == pytest.approx([H_MIN, H_MIN], abs=1e-6)
    assert targets.thickness_mm.min() >= H_MIN - 1e-6


def test_merge_hands_the_thin_part_to_the_layer_above():
    laid = laid_box("merge", h_max=3.2, width_mm=2.0)
    below = [bead for bead in laid.beads if bead.layer == 0]
    (above,) = [bead for bead in laid.beads if bead.layer == 1]
    assert {place.done for place in laid.places} == {"merged"}
    assert sum(bead.length_mm for bead in below) == pytest.approx(56 - 4 * Y_MIN, abs=1e-4)
    assert above.closed
    y, gained = above.points[:, 1], above.gained_mm
    sides = np.abs(np.abs(above.points[:, 2]) - 8.0) < 1e-6
    exact = X0 - np.sqrt(R**2 - y**2)
    inner = sides & (np.abs(y) < Y_MIN - 0.3)
    assert inner.sum() > 50
    assert np.abs(gained[inner] - exact[inner]).max() < 0.02
    assert (gained[(np.abs(y) > Y_MIN + 0.3)] == 0.0).all()
    # and the targets know
    targets = sample_targets([laid.sliced], beads=BeadParameters(width_mm=2.0))
    mine = targets.layer == 1
    assert targets.thickness_mm[mine].max() > H + THINNEST - 0.02
    y = targets.position[mine, 1]
    thick = targets.thickness_mm[mine] > H + 0.1
    assert np.abs(targets.thickness_mm[mine][thick] - H - (X0 - np.sqrt(R**2 - y[thick] ** 2))).max() < 0.02
    assert targets.closed[targets.bead[mine][0]]


def test_merge_keeps_material():
    # what is left out below is gained above: length times thickness
    laid = laid_box("merge", h_max=3.2, width_mm=2.0)
    (above,) = [bead for bead in laid.beads if bead.layer == 1]
    step = np.linalg.norm(np.roll(above.points, -1, axis=0) - above.points, axis=1)
    gained = float((0.5 * (above.gained_mm + np.roll(above.gained_mm, -1)) * step).sum())
    y = np.linspace(-Y_MIN, Y_MIN, 2001)
    t = X0 - np.sqrt(R**2 - y**2)
    lost = 2 * float((0.5 * (t[1:] + t[:-1]) * np.diff(y)).sum())
    assert gained == pytest.approx(lost, rel=0.03)


def test_what_the_layer_above_cannot_take_stays_and_is_reported():
    # H + t stays within h_max only near the middle
    h_max = H + 1.0
    y_max = math.sqrt(R**2 - (X0 - (h_max - H)) ** 2)
    laid = laid_box("merge", h_max=h_max, width_mm=2.0)
    merged = sum(p.length_mm for p in laid.places if p.done == "merged")
    reported = sum(p.length_mm for p in laid.places if p.done == "reported")
    assert merged == pytest.approx(4 * y_max, abs=1.1)
    assert merged + reported == pytest.approx(4 * Y_MIN, abs=1e-3)
    targets = sample_targets([laid.sliced], beads=BeadParameters(width_mm=2.0))
    assert targets.thickness_mm.max() <= h_max + 1e-6
    # nothing above is thick enough to take anything where h_max is near h_layer
    tight = laid_box("merge", h_max=1.75, width_mm=2.0)
    assert {p.done for p in tight.places} == {"reported"}
    assert all(bead.closed for bead in tight.beads)


def test_too_thick_beads_are_found_and_trimmed():
    # a first plane over a wide box: at its ends the body falls away, but never more than a layer below
    sliced = sliced_box("report", h_max=1.73)
    thick = lay_beads([slice_sub_volume(box(), BODY, SlicingParameters("planar", 1.5, 1.0, 1.5))])[0]
    assert all(p.thickness_mm[1] <= 1.5 + 1e-6 for p in thick.places)
    wedge = prism([(18.0, -10.0), (30.0, -10.0), (30.0, 10.0), (18.0, 10.0)], -8.0, 8.0)
    one = slice_sub_volume(wedge, BODY, SlicingParameters("nonuniform", 1.73, 1.0, 1.74, thickness="trim"))
    (laid,) = lay_beads([one])
    for bead in laid.beads:
        assert one.thickness_at(bead.layer, bead.points).max() <= 1.74 + 1e-6
    assert sliced.parameters.h_max_mm == 1.73


def test_beads_wholly_too_thin_are_left_out():
    parameters = SlicingParameters("planar", H, H, H, thickness="trim")
    flat = prism([(19.9, -1.0), (40.0, -1.0), (40.0, 1.0), (19.9, 1.0)], -8.0, 8.0)
    one = slice_sub_volume(flat, BODY, parameters)
    (laid,) = lay_beads([one])
    zero = [bead for bead in laid.beads if bead.layer == 0]
    assert all(one.thickness_at(0, bead.points).min() >= H - 1e-6 for bead in zero)
    assert len(sample_targets([one])) > 0


@pytest.mark.parametrize("strategy", ["planar", "nonuniform"])
def test_trimmed_beads_stay_on_surface_and_mesh(strategy):
    mesh = blade(12, 12)
    sliced = slice_sub_volume(mesh, BODY, SlicingParameters(strategy, 1.73, 1.39, 1.75, thickness="trim"))
    one = replace(sliced, parameters=replace(sliced.parameters, h_min_mm=1.5))
    (laid,) = lay_beads([one], BeadParameters(thin_walls="border"))
    triangles = mesh.vertices[mesh.faces]
    ends = [(bead.layer, bead.points[k]) for bead in laid.beads if not bead.closed for k in (0, -1)]
    assert ends
    for layer, point in ends:
        assert abs(one.layers[layer].surface.distance(point[None])[0]) < 1e-6
        held = np.broadcast_to(point, (len(triangles), 3))
        away = np.linalg.norm(closest_on_triangles(held, triangles) - held, axis=1).min()
        on_body = abs(one.body.surface.distance(point[None])[0])
        assert min(away, on_body) < 1e-6
        t = one.thickness_at(layer, point[None])[0]
        assert min(abs(t - 1.5), abs(t - 1.75)) < 1e-6


def test_points_between_lie_on_the_exact_curve():
    one = slice_sub_volume(box(), BODY, SlicingParameters("cylindrical"))
    curve = one.layers[2].curves[0]
    between = point_between(one, 2, curve.points[3], curve.points[4])(np.linspace(0, 1, 7))
    assert np.abs(one.layers[2].surface.distance(between)).max() < 1e-9
    on_side = np.minimum(np.abs(np.abs(between[:, 1]) - 6), np.abs(np.abs(between[:, 2]) - 8))
    assert on_side.max() < 1e-9


def test_infill_is_trimmed_as_well():
    laid = laid_box("trim", pattern="zigzag", width_mm=3.0)
    for bead in laid.beads:
        assert laid.sliced.thickness_at(bead.layer, bead.points).min() >= H_MIN - 1e-9
    assert any(p.kind == "infill" for p in laid.places)


def test_the_document_counts_and_locates():
    for policy, done in (("report", "reported"), ("trim", "trimmed")):
        laid = laid_box(policy)
        found = [indices(laid.sliced, 10)]
        document = slices_document([laid.sliced], found, (), [laid])
        told = document["sub_volumes"][0]["thickness_policy"]
        assert told["policy"] == policy
        assert [place["done"] for place in told["places"]] == [done, done]
        assert all(len(place["start_mm"]) == 3 for place in told["places"])
        beads = document["sub_volumes"][0]["beads"]
        assert len(beads) == len(laid.beads)
        assert all(line in document["warnings"] for line in laid.warnings)


def test_an_unknown_policy_is_refused():
    with pytest.raises(PartError, match="report, trim, merge"):
        SlicingParameters(thickness="guess")
