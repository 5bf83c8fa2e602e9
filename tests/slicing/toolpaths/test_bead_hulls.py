"""The metal of a path's beads as convex pieces: it holds every bead, and little else."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from scipy.spatial import ConvexHull, Delaunay

from slicing import Targets, Toolpath, read_toolpath, toolpath_shape
from slicing.toolpaths.bead_hulls import bead_hulls, hulls_mesh


def ring(n=90, radius=30.0, thickness=2.0):
    """A closed bead round the z axis, laid outwards."""
    a = np.linspace(0, 2 * np.pi, n + 1)
    out = np.stack([np.cos(a), np.sin(a), np.zeros(n + 1)], axis=1)
    along = np.stack([-np.sin(a), np.cos(a), np.zeros(n + 1)], axis=1)
    rows = np.zeros(n + 1, dtype=np.int64)
    return Targets(("SV1",), rows, rows, rows, radius * out, out, along, np.full(n + 1, thickness), np.array([True]))


@pytest.mark.parametrize("below", [False, True])
def test_the_pieces_hold_the_metal_and_hardly_more(below):
    targets = ring()
    pieces = [corners for _, corners in bead_hulls(targets, 4.0, below=below)]
    low, high = (28.0, 30.0) if below else (30.0, 32.0)
    rng = np.random.default_rng(1)
    a, r, z = rng.uniform(0, 2 * np.pi, 2000), rng.uniform(low, high, 2000), rng.uniform(-2, 2, 2000)
    # chords of the bead's own targets cut into its inner side by at most their sagitta
    r = np.clip(r, low, high - high * (1 - np.cos(np.pi / 90)))
    points = np.stack([r * np.cos(a), r * np.sin(a), z], axis=1)
    held = np.zeros(len(points), dtype=bool)
    for corners in pieces:
        held |= Delaunay(corners).find_simplex(points, tol=1e-9) >= 0
    assert held.all()
    volume = sum(ConvexHull(corners).volume for corners in pieces)
    exact = np.pi * (high**2 - low**2) * 4
    assert exact * 0.99 < volume < exact * 1.3
    assert len(pieces) < 60


BENT = {
    "a right angle": [(0, 0), (20, 0), (20, 20)],
    "a square": [(0, 0), (20, 0), (20, 20), (0, 20), (0, 0)],
    "lines that turn back": [(0, 0), (20, 0), (0, 3.75), (20, 7.5), (0, 11.25)],
    "lines with short joints": [(0, 0), (20, 0), (20, 3.75), (0, 3.75), (0, 7.5), (20, 7.5)],
    "there and back": [(0, 0), (20, 0), (0, 0)],
    "a gentle bend": [(0, 0), (20, 0), (38, 8), (52, 22)],
}


@pytest.mark.parametrize("way", BENT.values(), ids=BENT)
def test_the_pieces_hold_a_bead_round_its_corners(way, tmp_path):
    table = tmp_path / "bent.csv"
    rows = "".join(f"{x},{y},0,0,0,1,0\n" for x, y in way)
    table.write_text(f"x,y,z,nx,ny,nz,path\n{rows}")
    pieces = [corners for _, corners in bead_hulls(read_toolpath(table, width_mm=5.0, thickness_mm=1.7).targets, 5.0)]
    bead = shapely.LineString(way).buffer(2.5 - 1e-3)
    x, y = (each.ravel() for each in np.meshgrid(np.arange(-3, 56, 0.25), np.arange(-3, 26, 0.25)))
    inside = shapely.contains_xy(bead, x, y)
    points = np.stack([x, y, np.full(len(x), 0.85)], axis=1)
    held = np.any([Delaunay(corners).find_simplex(points, tol=1e-9) >= 0 for corners in pieces], axis=0)
    assert held[inside].all()
    # and none of them reaches further off than the corner of a square about a bead's end
    assert (
        shapely.distance(shapely.LineString(way), shapely.points(points[held][:, :2])).max() <= 2.5 * np.sqrt(2) + 1e-6
    )


def test_pieces_are_numbered_by_layer_and_sub_volume():
    one = ring(8)
    rows = np.repeat(np.arange(3), 9)
    three = Targets(
        ("A", "B"),
        np.repeat([0, 0, 1], 9),
        np.repeat([0, 1, 0], 9),
        rows,
        np.tile(one.position, (3, 1)),
        np.tile(one.normal, (3, 1)),
        np.tile(one.tangent, (3, 1)),
        np.full(27, 2.0),
        np.array([True] * 3),
    )
    names = [name for name, _ in bead_hulls(three, 4.0)]
    assert {name.rsplit("/", 1)[0] for name in names} == {"deposit/0/A", "deposit/1/A", "deposit/2/B"}
    assert len(set(names)) == len(names)
    shape = toolpath_shape(Toolpath(three), None, ((28.0, -5.0), (28.0, 5.0)))
    assert shape.first_deposit == (0, 2)
    assert shape.n_deposits == 3
    assert set(shape.visual) == {"A_visual", "B_visual", "body_visual"}
    assert "body/0" in shape.hulls


def test_the_mesh_to_look_at_points_outwards():
    pieces = [corners for _, corners in bead_hulls(ring(), 4.0)]
    mesh = hulls_mesh("SV1", pieces)
    np.testing.assert_allclose(mesh.volume, sum(ConvexHull(corners).volume for corners in pieces), rtol=1e-9)


def test_a_bead_that_rises_along_its_deposition_direction_is_a_column():
    rows = np.zeros(4, dtype=np.int64)
    place = np.array([[20.0, -10.0, 0.0], [20.0, 0.0, 0.0], [25.0, 0.0, 0.0], [25.0, 10.0, 0.0]])
    out, along = np.tile([1.0, 0.0, 0.0], (4, 1)), np.tile([0.0, 1.0, 0.0], (4, 1))
    targets = Targets(("SV1",), rows, rows, rows, place, out, along, np.full(4, 2.0), np.array([False]))
    pieces = [corners for _, corners in bead_hulls(targets, 4.0)]
    assert all(ConvexHull(corners).volume > 1.0 for corners in pieces)
    held = [Delaunay(corners).find_simplex(np.array([[24.0, 0.0, 1.9], [24.0, 1.9, 0.0]])) >= 0 for corners in pieces]
    assert np.any(held, axis=0).all()
    hulls_mesh("beads", pieces)
