"""Deposits: pieces cover the layers they stand for, and leave room where there is room."""

import numpy as np
import pytest
import trimesh
from support.layers.deposits import inside

from slicing.beads.lay import lay_beads
from slicing.deposits import part_shape
from slicing.deposits.part_shape import beyond_borders
from slicing.layers.layer import CylindricalBody
from slicing.mesh.solid import mesh_from_arrays
from slicing.parameters import BeadParameters, SlicingParameters
from slicing.strategies.slice import slice_sub_volume

R = 20.0
BODY = ((R, -30.0), (R, 30.0))


def sliced(solid, strategy="cylindrical"):
    mesh = mesh_from_arrays("SV1", np.asarray(solid.vertices), np.asarray(solid.faces))
    return slice_sub_volume(mesh, CylindricalBody(R), SlicingParameters(strategy))


def boss():
    solid = trimesh.creation.box((20, 12, 16))
    solid.apply_translation([R + 5, 0, 0])
    return solid


def ring():
    return trimesh.creation.annulus(R - 3, R + 8, 10, sections=200)


def fine_ring():
    return trimesh.creation.annulus(R - 3, R + 4, 10, sections=720)


def tube():
    outer, inner = trimesh.creation.cylinder(12, 20, sections=96), trimesh.creation.cylinder(8, 30, sections=96)
    solid = outer.difference(inner)
    solid.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, [0, 1, 0]))
    solid.apply_translation([R + 6, 0, 0])
    return solid


def hulls(shape):
    return [trimesh.PointCloud(v).convex_hull for name, v in shape.hulls.items() if name.startswith("deposit/")]


@pytest.mark.parametrize("solid", [boss, ring, tube, pytest.param(fine_ring, marks=pytest.mark.slow)])
@pytest.mark.parametrize(
    ("strategy", "many"),
    [
        *[("cylindrical", part_shape.MANY_POINTS), ("nonuniform", 0)],
        *(
            pytest.param(*one, marks=pytest.mark.slow)
            for one in (("cylindrical", 0), ("nonuniform", part_shape.MANY_POINTS))
        ),
    ],
)
def test_every_layer_is_covered_by_its_pieces(solid, strategy, many):
    s = sliced(solid(), strategy)
    shape = part_shape.part_shape([s], None, BODY, most_points=many)
    assert shape.n_deposits == len(s.layers)
    for layer in s.layers:
        mine = {n: v for n, v in shape.hulls.items() if n.startswith(f"deposit/{layer.index}/")}
        solids = [trimesh.PointCloud(v).convex_hull for v in mine.values()]
        for curve in layer.curves:
            assert inside(solids, curve.points).all()
            # and the material above it, up to the next layer
            raised = curve.points + 0.9 * 1.39 * layer.surface.normals(curve.points)
            assert inside(solids, raised).all()


@pytest.mark.slow
@pytest.mark.parametrize("solid", [boss, ring, fine_ring, tube])
@pytest.mark.parametrize("strategy", ["cylindrical", "nonuniform"])
@pytest.mark.parametrize("many", [part_shape.MANY_POINTS, 0])
def test_beads_that_stand_out_of_their_layers_are_covered(solid, strategy, many):
    s, parameters = sliced(solid(), strategy), BeadParameters(width_mm=4.0)
    (laid,) = lay_beads([s], parameters)
    beyond = beyond_borders(laid, parameters)
    assert (beyond == 2.0).all()
    shape = part_shape.part_shape([s], None, BODY, [beyond], most_points=many)
    for layer in s.layers:
        mine = {n: v for n, v in shape.hulls.items() if n.startswith(f"deposit/{layer.index}/")}
        solids = [trimesh.PointCloud(v).convex_hull for v in mine.values()]
        for curve in layer.curves:
            normals = layer.surface.normals(curve.points)
            along = np.cross(normals, [0.0, 0.0, 1.0])
            along /= np.linalg.norm(along, axis=1)[:, None]
            angles = np.linspace(0, 2 * np.pi, 9)[:, None, None]
            way = np.cos(angles) * along + np.sin(angles) * np.cross(normals, along)
            # on the layer's surface, 1.9 mm from the centre line
            points = (curve.points + 1.9 * way).reshape(-1, 3)
            points -= layer.surface.distance(points)[:, None] * layer.surface.normals(points)
            assert inside(solids, points).all()


def test_beads_within_their_layers_do_not_stand_out():
    s = sliced(boss())
    wide = BeadParameters("zigzag", width_mm=4.0)
    assert not beyond_borders(lay_beads([s], wide)[0], wide).any()
    narrow = BeadParameters("contour_parallel", width_mm=14.0)  # the boss is 12 wide
    assert (beyond_borders(lay_beads([s], narrow)[0], narrow) == 7.0).all()


def test_a_boss_is_one_piece_a_layer_no_larger_than_it_must_be():
    s = sliced(boss())
    shape = part_shape.part_shape([s], None, BODY)
    pieces = hulls(shape)
    assert len(pieces) == len(s.layers)
    # a piece is the layer and what its underside's chord cuts off the layer below: nothing above, nothing beside
    for i, piece in enumerate(pieces[:-1]):
        y = np.linspace(-6, 6, 2001)
        top = np.sqrt((R + 1.73 * (i + 1)) ** 2 - y**2)
        chord = np.sqrt((R + 1.73 * i) ** 2 - 36)
        least = 16 * np.trapezoid(top - chord, y)
        assert least <= piece.volume <= 1.12 * least  # raised along the normals it widens a little


def test_the_hole_of_a_tube_stays_open():
    solids = hulls(part_shape.part_shape([sliced(tube())], None, BODY))
    middle = np.column_stack([np.linspace(R + 1, R + 12, 20), np.zeros(20), np.zeros(20)])
    assert not inside(solids, middle).any()
    wall = np.column_stack([np.linspace(R + 1, R + 12, 20), np.zeros(20), np.full(20, 10.0)])
    assert inside(solids, wall).all()


def test_a_ring_goes_round_the_body_and_not_through_it():
    solids = hulls(part_shape.part_shape([sliced(ring())], None, BODY))
    angle = np.linspace(0, 2 * np.pi, 181)
    for r, covered in ((R + 4, True), (R - 6, False)):
        points = np.column_stack([r * np.cos(angle), r * np.sin(angle), np.zeros(181)])
        assert (inside(solids, points) == covered).all()


def test_body_is_covered_by_its_hull():
    shape = part_shape.part_shape([sliced(boss())], None, ((R, -10.0), (R, 10.0)))
    hull = [trimesh.PointCloud(shape.hulls["body/0"]).convex_hull]
    angle = np.linspace(0, 2 * np.pi, 360)
    rim = np.column_stack([R * np.cos(angle), R * np.sin(angle), np.full(360, 9.99)])
    assert inside(hull, rim).all()
    assert not inside(hull, rim * [1.01, 1.01, 1]).any()


def test_a_stepped_body_is_covered_band_by_band():
    profile = ((20.0, 0.0), (20.0, 10.0), (10.0, 10.0), (10.0, 20.0), (15.0, 30.0))
    shape = part_shape.part_shape([sliced(boss())], None, profile)
    solids = [trimesh.PointCloud(v).convex_hull for n, v in shape.hulls.items() if n.startswith("body/")]
    assert len(solids) == 3
    rim = np.array([[19.99, 0, 9.9], [0, 9.99, 19.9], [14.9, 0, 29.9]])
    assert inside(solids, rim).all()
    assert not inside(solids, np.array([[15.0, 0, 15.0], [13.0, 0, 21.0]])).any()
    visual = shape.visual["body_visual"]
    assert trimesh.Trimesh(visual.vertices, visual.faces).is_watertight
