"""A sub-volume that is built already is in the cell as its mesh is, not only as layers of it would be laid."""

import numpy as np
import pytest
import shapely
import trimesh
import yaml

from cell.case.read import load_case
from cell.job.built_solids import SMALLEST_MM, rest_of_built
from cell.job.job import prepare
from slicing import Mesh, hull_planes

BODY_MM = 20.0


def box(low, high):
    made = trimesh.creation.box(np.subtract(high, low))
    made.apply_translation(np.add(low, high) / 2)
    return made


def joined(*pieces):
    return trimesh.boolean.union(pieces, engine="manifold")


def collar(turn_deg):
    """A collar round the body, part of a turn from the x axis on."""
    angle = np.deg2rad(np.linspace(0, turn_deg, 48))
    ends = [r * np.column_stack([np.cos(angle), np.sin(angle)]) for r in (30.0, 19.0)]
    return trimesh.creation.extrude_polygon(shapely.Polygon([*ends[0], *ends[1][::-1]]), 10.0, engine="manifold")


def mushroom():
    stem = trimesh.creation.cylinder(4, 36, sections=48)
    head = trimesh.creation.cylinder(14, 6, sections=48)
    head.apply_translation([0, 0, 15])
    made = joined(stem, head)
    made.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, [0, 1, 0]))
    made.apply_translation([35.5, 0, 40])
    return made


def hook():
    return joined(box((19, -4, 25), (41, 4, 35)), box((33, -4, 25), (41, 22, 35)), box((24, 16, 25), (38, 24, 35)))


def flare():
    narrow, wide = box((19, -3, 30), (20, 3, 36)), box((40, -15, 20), (41, 15, 46))
    return trimesh.convex.convex_hull(np.concatenate([narrow.vertices, wide.vertices]))


PARTS = {"hook": hook, "mushroom": mushroom, "collar": lambda: collar(300), "flare": flare}


def pieces_of(job):
    return [points for name, points in job.shape.hulls.items() if name.startswith(("built/", "body/"))]


def outside_mm(points, pieces):
    """How far points (n, 3) are outside all of some convex pieces, (n,)."""
    planes = [hull_planes(piece) for piece in pieces]
    return np.min([(points @ normals.T - offsets).max(axis=1) for normals, offsets in planes], axis=0)


# parts whose layers' shapes hold all of them
HELD_BY_LAYERS = {("collar", "nonuniform"), ("hook", "planar"), ("mushroom", "planar"), ("flare", "planar")}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    made = tmp_path_factory.mktemp("built")
    for name, part in PARTS.items():
        part().export(made / f"{name}.stl")
    box((-30, -3, 60), (-19, 3, 66)).export(made / "next.stl")
    return made


@pytest.mark.parametrize("name", PARTS)
@pytest.mark.parametrize(
    ("strategy", "pattern"), [pytest.param("planar", "contour", marks=pytest.mark.slow), ("nonuniform", "zigzag")]
)
def test_all_of_a_sub_volume_that_is_built_collides(name, strategy, pattern, folder):
    case = {
        "part": {
            "sub_volumes": [f"{name}.stl", "next.stl"],
            "built": ["SV1"],
            "body": {"radius_mm": BODY_MM, "z_mm": [-10, 80]},
        },
        "slicing": {"strategy": strategy},
        "beads": {"pattern": pattern},
    }
    path = folder / f"{name}_{strategy}.case.yaml"
    path.write_text(yaml.safe_dump(case), encoding="utf-8")
    job = prepare(load_case(path))
    solid = trimesh.load_mesh(folder / f"{name}.stl")
    points = np.concatenate([solid.vertices, trimesh.sample.sample_surface(solid, 4000, seed=1)[0]])
    points = points[np.hypot(points[:, 0], points[:, 1]) > BODY_MM]
    assert outside_mm(points, pieces_of(job)).max() < 1e-3
    layers = [points for key, points in job.shape.hulls.items() if "/rest/" not in key]
    if (name, strategy) not in HELD_BY_LAYERS:  # layers alone leave some of it out
        assert outside_mm(points, layers).max() > 0.2


def test_what_is_left_stays_near_the_solid():
    ring = trimesh.creation.annulus(40.0, 41.0, 10.0, sections=96)
    rest = rest_of_built([Mesh("SV1", ring.vertices, ring.faces)], {"body/0": box((-1, -1, -1), (1, 1, 1)).vertices})
    corners = np.concatenate([*rest.values()])
    assert all(name.startswith("built/SV1/rest/") for name in rest)
    assert np.hypot(corners[:, 0], corners[:, 1]).min() > 39.0 - SMALLEST_MM / 8  # nothing of the hole is filled
    assert outside_mm(ring.vertices, list(rest.values())).max() < 1e-3


def test_of_a_solid_that_is_held_nothing_is_left():
    block = box((20, -5, 0), (30, 5, 10))
    held = {"built/SV1/0/0": box((19, -6, -1), (31, 6, 11)).vertices}
    assert rest_of_built([Mesh("SV1", block.vertices, block.faces)], held) == {}
    assert rest_of_built([Mesh("SV2", block.vertices, block.faces)], held) != {}  # another's layers are not its own
