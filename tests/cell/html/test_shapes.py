"""Shapes as triangles: closed, their normals outward, and no finer than is worth sending."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from cell.html import shapes as html_shapes
from cell.verdict.result import Result


def enclosed(shape: html_shapes.DrawnTriangles) -> float:
    """Volume within a closed surface whose faces are counter-clockwise seen from outside."""
    a, b, c = (shape.vertices[shape.faces[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)


@pytest.mark.parametrize(
    ("geom", "volume"),
    [
        ('type="box" size="0.1 0.2 0.3"', 8 * 0.1 * 0.2 * 0.3),
        ('type="cylinder" size="0.1 0.3"', np.pi * 0.1**2 * 0.6),
        ('type="capsule" size="0.1 0.3"', np.pi * 0.1**2 * 0.6 + 4 / 3 * np.pi * 0.1**3),
        ('type="sphere" size="0.2"', 4 / 3 * np.pi * 0.2**3),
        ('type="ellipsoid" size="0.1 0.2 0.3"', 4 / 3 * np.pi * 0.1 * 0.2 * 0.3),
        ('type="mesh" mesh="m"', 0.5 * 0.4 * 0.3),
    ],
)
def test_a_geoms_surface_is_closed_and_its_normals_point_outward(geom: str, volume: float) -> None:
    corners = " ".join(f"{x} {y} {z}" for x in (0, 0.5) for y in (0, 0.4) for z in (0, 0.3))
    xml = f'<mujoco><asset><mesh name="m" vertex="{corners}"/></asset><worldbody><geom {geom}/></worldbody></mujoco>'
    shape = html_shapes.geom_triangles(mujoco.MjModel.from_xml_string(xml), 0)
    assert shape is not None
    assert enclosed(shape) == pytest.approx(volume, rel=0.03)
    np.testing.assert_allclose(np.linalg.norm(shape.normals, axis=1), 1, atol=1e-9)
    a, b, c = (shape.vertices[shape.faces[:, k]] for k in range(3))
    out = np.cross(b - a, c - a)
    size = np.linalg.norm(out, axis=1)
    for k in range(3):  # a corner's normal is its face's, give or take its roundness
        along = np.einsum("ij,ij->i", out, shape.normals[shape.faces[:, k]])
        assert (along >= np.cos(np.deg2rad(30)) * size - 1e-12).all()


def name_of_mesh(model: mujoco.MjModel, geom: int) -> str:
    mesh = int(model.geom_dataid[geom])
    return "" if mesh < 0 else model.mesh(mesh).name


def test_a_plane_has_no_surface_and_a_fine_mesh_is_coarsened(good: Result) -> None:
    model = good.job.scene.model
    assert html_shapes.geom_triangles(model, model.geom("floor").id) is None
    geom = next(g for g in range(model.ngeom) if name_of_mesh(model, g) == "robot/link_2_orange")
    fine = html_shapes.geom_triangles(model, geom)
    coarse = html_shapes.geom_triangles(model, geom, 1000)
    assert fine is not None
    assert coarse is not None
    assert len(coarse.faces) <= 1000 < len(fine.faces)
    assert enclosed(coarse) == pytest.approx(enclosed(fine), rel=0.15)
