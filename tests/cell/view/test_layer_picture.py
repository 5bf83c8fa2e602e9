"""Pictures of layers: what is drawn is as large as it is, what is behind is hidden, colours mean what the bar says."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest
import trimesh

from cell.cli.main import main
from cell.errors import InputError
from cell.view.colours import DEPTH, ramp
from cell.view.layer_picture import _Scale, slice_picture
from cell.view.print_raster import Raster
from slicing.mesh.load import load_mesh
from slicing.parameters import SlicingParameters
from slicing.strategies.slice import slice_sub_volume
from slicing.surfaces.bodies import CylindricalBody

GREY, RED, BLUE = (0.9, 0.9, 0.9), np.array([[0.9, 0.1, 0.1]]), np.array([[0.1, 0.1, 0.9]])


def inked(canvas: Raster) -> np.ndarray:
    return np.isfinite(canvas.depth)


def drawn_tube(canvas: Raster, ends: list[list[float]], radius: float, rgb: np.ndarray) -> None:
    points = np.linspace(*np.array(ends, dtype=float), 9)
    canvas.tube(points, np.full(9, radius), np.repeat(rgb, 9, axis=0))


def test_a_rectangle_covers_its_pixels_once_and_faces_that_look_away_are_left_out() -> None:
    canvas = Raster(80, 60)
    a, b, c, d = [10, 5, 0], [50, 5, 0], [50, 35, 0], [10, 35, 0]
    # counter-clockwise seen from the eye, where y points down
    canvas.triangles(np.array([[a, c, b], [a, d, c]], dtype=float), GREY)
    assert inked(canvas)[5:35, 10:50].all()
    assert inked(canvas).sum() == 40 * 30
    away = Raster(80, 60)
    away.triangles(np.array([[a, b, c]], dtype=float), GREY)
    assert not inked(away).any()


@pytest.mark.parametrize("seed", range(3))
def test_triangles_cover_their_areas(seed: int) -> None:
    rng = np.random.default_rng(seed)
    for corners in rng.uniform(0, 300, (20, 3, 3)):
        normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
        canvas = Raster(300, 300)
        canvas.triangles(corners[None] if normal[2] < 0 else corners[None, ::-1], GREY)
        around = sum(np.linalg.norm((corners[k] - corners[k - 1])[:2]) for k in range(3))
        assert abs(inked(canvas).sum() - abs(normal[2]) / 2) < 0.6 * around + 3


def test_depth_is_that_of_the_plane() -> None:
    canvas = Raster(40, 40)
    canvas.triangles(np.array([[[0, 0, 0], [0, 40, 80], [40, 0, 40]]], dtype=float), GREY)
    y, x = np.nonzero(inked(canvas))
    np.testing.assert_allclose(canvas.depth[y, x], (x + 0.5) + 2 * (y + 0.5), atol=1e-3)


def test_a_tube_is_as_wide_as_its_bead_and_round_at_its_ends() -> None:
    canvas = Raster(200, 100)
    drawn_tube(canvas, [[40, 50, 0], [160, 50, 0]], 12.0, RED)
    area = 2 * 12 * 120 + np.pi * 12**2
    assert inked(canvas).sum() == pytest.approx(area, rel=0.02)
    assert np.flatnonzero(inked(canvas)[:, 100]).size == 24
    assert canvas.depth[50, 100] == pytest.approx(12.0, abs=0.3)


@pytest.mark.parametrize("first", [0, 1])
def test_the_nearer_tube_hides_the_other_whichever_is_drawn_first(first: int) -> None:
    canvas = Raster(100, 100)
    tubes = [([[10, 50, 0], [90, 50, 0]], RED), ([[50, 10, 40], [50, 90, 40]], BLUE)]
    for ends, rgb in (tubes[first], tubes[1 - first]):
        drawn_tube(canvas, ends, 8.0, rgb)
    assert canvas.image[50, 50].argmax() == 2
    assert canvas.image[50, 20].argmax() == 0


def test_ticks_are_round_numbers_inside_the_bar() -> None:
    assert _Scale(1.39, 2.2, DEPTH, "thickness, mm").ticks() == pytest.approx([1.4, 1.6, 1.8, 2.0, 2.2])
    assert _Scale(0, 21, DEPTH, "layer").ticks() == [0, 5, 10, 15, 20]
    np.testing.assert_allclose(ramp(np.array([0.0, 1.0]), DEPTH), DEPTH[[0, -1]])


@pytest.fixture(scope="module")
def boss(tmp_path_factory: pytest.TempPathFactory) -> Path:
    box = trimesh.creation.box((16.0, 14.0, 12.0))
    box.apply_translation([-22.0, 0.0, 20.0])
    path = tmp_path_factory.mktemp("boss") / "boss.stl"
    box.export(path)
    return path


def drawn(boss: Path, strategy: str, **more: object) -> np.ndarray:
    from PIL import Image

    sliced = slice_sub_volume(load_mesh(boss, "mm", "SV1"), CylindricalBody(20.0), SlicingParameters(strategy))
    png = slice_picture([sliced], None, title="boss", width=420, height=300, **more)
    return np.asarray(Image.open(io.BytesIO(png)).convert("RGB")).astype(int)


def test_pictures_are_light_and_differ_by_strategy_and_colouring(boss: Path) -> None:
    pictures = [
        drawn(boss, "planar"),
        drawn(boss, "cylindrical"),
        drawn(boss, "cylindrical", colour="layer"),
        drawn(boss, "nonuniform"),
    ]
    for image in pictures:
        assert image.shape == (300, 420, 3)
        assert (image[[0, -1]][:, [0, -1]] == 255).all()
        assert (image.min(axis=2) < 200).mean() > 0.05
    assert all(np.abs(a - b).mean() > 1 for k, a in enumerate(pictures) for b in pictures[:k])


@pytest.mark.slow
def test_the_command_draws_a_whole_part_with_its_body(boss: Path, tmp_path: Path) -> None:
    from PIL import Image

    path = tmp_path / "layers.png"
    assert main(["slice", str(boss), "--body-radius", "20", "--picture", str(path), "--colour", "layer"]) == 0
    assert Image.open(path).size == (1400, 1000)


def test_bad_input_is_one_line(boss: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for more in ({"colour": "heat"}, {"width": 0}, {"height": 10**6}):
        with pytest.raises(InputError):
            drawn(boss, "planar", **{"colour": "layer", **more}) if "colour" in more else slice_picture(
                [], None, title="", **more
            )
    assert main(["slice", str(boss), "--body-radius", "20", "--picture", str(tmp_path / "no" / "x.png")]) == 2
    assert "does not exist" in capsys.readouterr().err
