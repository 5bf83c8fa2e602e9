"""What of a part in one mesh is neither its round body nor a sub-volume is in the cell all the same."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh
import yaml

from cell.case.read import load_case
from cell.job.beside_body import pieces_beside
from cell.job.job import Job, prepare
from slicing.mesh.solid import mesh_from_arrays

POST = ((-8.0, -8.0, 60.0), (8.0, 8.0, 200.0))  # on the end of the body
LOOSE = ((-10.0, 90.0, 20.0), (10.0, 110.0, 40.0))  # touches nothing


def box(low: tuple[float, ...], high: tuple[float, ...]) -> trimesh.Trimesh:
    made = trimesh.creation.box(np.subtract(high, low))
    made.apply_translation(np.add(low, high) / 2)
    return made


def part(folder: Path, *more: trimesh.Trimesh) -> Job:
    """A hub of radius 40 mm with a boss, and more in the same mesh."""
    hub = trimesh.creation.cylinder(40.0, 60.0, sections=256)
    hub.apply_translation((0, 0, 30))
    solid = trimesh.boolean.union([hub, box((35, -8, 22), (56, 8, 38)), *more], engine="manifold")
    solid.export(folder / "whole.stl")
    case = {"part": {"mesh": "whole.stl"}, "support": {"radius_mm": 20, "height_mm": 150}}
    path = folder / "whole.case.yaml"
    path.write_text(yaml.safe_dump(case), encoding="utf-8")
    return prepare(load_case(path))


def holds(job: Job, points: np.ndarray) -> np.ndarray:
    """Whether points (n, 3), mm, part frame, are in a piece that collides from the start."""
    held = np.zeros(len(points), dtype=bool)
    for name, corners in job.shape.hulls.items():
        if name.startswith("body/"):
            planes = trimesh.convex.convex_hull(corners)
            off = (points[:, None] - planes.triangles_center) * planes.face_normals
            held |= (off.sum(axis=-1) <= 1e-3).all(axis=1)
    return held


@pytest.mark.parametrize(("low", "high"), [POST, LOOSE])
def test_what_stands_on_an_end_or_touches_nothing_collides(
    low: tuple[float, ...], high: tuple[float, ...], tmp_path: Path
) -> None:
    job = part(tmp_path, box(low, high))
    assert job.targets.sub_volume == ("SV1",)
    rng = np.random.default_rng(1)
    points = rng.uniform(low, high, (500, 3))
    assert holds(job, points).all()
    # and as a shape of the cell, from the start
    names = [job.scene.model.geom(g).name for g in range(job.scene.model.ngeom)]
    beside = [g for g, name in enumerate(names) if name.startswith("body/beside_")]
    assert beside
    assert (job.scene.model.geom_contype[beside] > 0).all()
    assert (job.scene.deposit_of_geom[beside] == -1).all()


def test_a_concave_solid_is_not_filled(tmp_path: Path) -> None:
    """A bridge on the end: under it is nothing."""
    bridge = trimesh.boolean.difference(
        [box((-30, -8, 60), (30, 8, 120)), box((-20, -9, 60), (20, 9, 100))], engine="manifold"
    )
    job = part(tmp_path, bridge)
    assert holds(job, np.array([[0.0, 0.0, 110.0], [-25.0, 0.0, 80.0], [25.0, 0.0, 80.0]])).all()
    assert not holds(job, np.array([[0.0, 0.0, 80.0]])).any()


def test_a_sheet_without_volume_is_made_thick_enough_to_collide() -> None:
    sheet = box((0, 0, 0), (100, 50, 1e-5))
    (points,) = pieces_beside([mesh_from_arrays("sheet", sheet.vertices, sheet.faces, 0.0)]).values()
    assert np.ptp(points, axis=0)[2] > 0.05


def test_a_part_that_is_body_and_sub_volumes_alone_has_nothing_beside(tmp_path: Path) -> None:
    assert not [name for name in part(tmp_path).shape.hulls if name.startswith("body/beside_")]
