"""Pictures: the right size, something on them, and the torch in sight."""

from __future__ import annotations

import io
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest
from support.jobs.cases import little_case
from support.paths import ROOT

from cell.case.read import load_case
from cell.errors import InputError
from cell.failure import Contact, Failure, Kind
from cell.job.job import prepare
from cell.verdict.check import check_fixed
from cell.verdict.result import Result
from cell.view import picture as pictures
from cell.view.camera import camera, still
from cell.view.picture import picture
from cell.view.stage_scene import FOVY, VISIBLE, StagedScene, beads_of


@pytest.fixture
def result(little: Result) -> Result:
    return little


@pytest.fixture
def collided(result: Result) -> Result:
    """The same with one target said to collide."""
    contact = Contact(("torch_nozzle", "deposit/0/SV1/0"), (0.0, 0.0, 0.0))
    failure = Failure(Kind.COLLISION, -1.0, 5.0, contact=contact)
    rows = list(result.rows)
    rows[3] = replace(rows[3], failure=failure, q=None, attempt=rows[3].q)
    return replace(result, rows=tuple(rows), motion=None)


def pixels(png: bytes) -> np.ndarray:
    from PIL import Image

    return np.asarray(Image.open(io.BytesIO(png)).convert("RGB")).astype(int)


@pytest.mark.usefixtures("gl")
@pytest.mark.parametrize("view", ["cell", "torch"])
def test_a_picture_has_its_size_and_something_on_it(result: Result, view: str) -> None:
    png = picture(result, width=320, height=200, view=view)
    assert png.startswith(b"\x89PNG")
    image = pixels(png)
    assert image.shape == (200, 320, 3)
    assert image.std() > 10
    assert len(np.unique(image.reshape(-1, 3), axis=0)) > 500


@pytest.mark.slow
@pytest.mark.usefixtures("gl")
def test_another_target_is_another_picture(result: Result) -> None:
    first, again, other = (
        picture(result, width=160, height=100, view="torch", target=t) for t in (0, 0, len(result.rows) - 1)
    )
    assert first == again
    assert np.abs(pixels(first) - pixels(other)).max() > 50


@pytest.mark.usefixtures("gl")
def test_a_picture_may_be_larger_than_the_models_buffer(result: Result) -> None:
    width = int(result.job.scene.model.vis.global_.offwidth) + 40
    assert pixels(picture(result, width=width, height=64)).shape == (64, width, 3)


@pytest.mark.usefixtures("gl")
def test_what_collides_is_red(result: Result, collided: Result) -> None:
    def red(image: np.ndarray) -> int:
        return int(((image[..., 0] > 90) & (image[..., 1] < 40) & (image[..., 2] < 40)).sum())

    good, bad = (pixels(picture(r, width=320, height=200, view="torch", target=3)) for r in (result, collided))
    assert red(bad) > red(good) + 500


@pytest.mark.usefixtures("gl")
def test_the_infeasible_target_is_the_one_shown(collided: Result) -> None:
    assert pictures.target_to_show(collided) == 3
    assert picture(collided, width=64, height=64) == picture(collided, width=64, height=64, target=3)


def projected(view: mujoco.MjvCamera, point: np.ndarray, aspect: float) -> np.ndarray:
    """Where a point is in a picture, -1 .. 1 from edge to edge; independent of the code under test."""
    a, e = np.deg2rad([view.azimuth, view.elevation])
    forward = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    up = np.array([-np.sin(e) * np.cos(a), -np.sin(e) * np.sin(a), np.cos(e)])
    out = point - (view.lookat - forward * view.distance)
    assert out @ forward > 0
    tall = out @ forward * np.tan(np.deg2rad(FOVY) / 2)
    return np.array([out @ np.cross(forward, up) / (tall * aspect), out @ up / tall])


@pytest.mark.parametrize("view", ["cell", "torch"])
@pytest.mark.parametrize("table", [(90, 180), (90, 0), (-45, 0)])
def test_the_wires_end_is_in_the_picture_and_in_sight(result: Result, view: str, table: tuple[int, int]) -> None:
    turned = result if table == (90, 180) else check_fixed(result.job, *table)
    frame = still(turned, pictures.target_to_show(turned))
    staged = StagedScene(turned)
    staged.pose(frame)
    look = camera(staged, view, 1.6)
    tip = staged.tcp()[0]
    assert np.abs(projected(look, tip, 1.6)).max() < 1.0
    # nothing is between the camera and the wire's end but the wire and the bead
    a, e = np.deg2rad([look.azimuth, look.elevation])
    eye = look.lookat - look.distance * np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    way = tip - eye
    hit = np.array([-1], dtype=np.int32)
    met = mujoco.mj_ray(staged.model, staged.data, eye, way / np.linalg.norm(way), VISIBLE, True, -1, hit, None)
    assert met < 0 or met > np.linalg.norm(way) - 5e-3


def test_the_whole_arm_is_in_the_picture_of_the_cell(result: Result) -> None:
    staged = StagedScene(result)
    staged.pose(still(result, 0))
    look = camera(staged, "cell", 1.6)
    names = [*(f"link_{i}" for i in range(1, 7)), "base_link", "torch", "pedestal", "turn", "part"]
    for name in names:
        assert np.abs(projected(look, staged.data.body(name).xpos, 1.6)).max() < 1.0, name


def test_the_model_of_the_result_is_left_alone(tmp_path: Path) -> None:
    result = check_fixed(prepare(load_case(little_case(tmp_path))), 90, 180)
    model = result.job.scene.model
    before = model.geom_rgba.copy(), model.geom_group.copy(), model.opt.disableflags
    staged = StagedScene(result)
    good = still(result, 0)
    bad = replace(good, pair=("torch_nozzle", "deposit/0/SV1/0", "floor"))
    assert staged.pose(bad)
    assert not staged.pose(bad)
    assert staged.pose(good)
    np.testing.assert_array_equal(model.geom_rgba, before[0])
    np.testing.assert_array_equal(model.geom_group, before[1])
    assert model.opt.disableflags == before[2]


def test_beads_lead_from_target_to_target_and_are_thinned(result: Result) -> None:
    path = result.job.targets.bead
    every = beads_of(result.job)
    assert len(every.target) == len(path) - len(np.unique(path))
    assert (path[every.target[:, 0]] == path[every.target[:, 1]]).all()
    for most in (1, 5, 20):
        few = beads_of(result.job, most)
        assert 1 <= len(few.target) <= most
        assert (np.diff(few.target[:, 1]) > 0).all()


def test_a_full_scene_takes_no_more(result: Result) -> None:
    staged = StagedScene(result)
    frame = replace(still(result, len(result.rows) - 1), marks=True, arrow=True)
    staged.pose(frame)
    scn = mujoco.MjvScene(staged.model, maxgeom=10)
    staged.draw(scn, frame)
    assert scn.ngeom == 10


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"target": -1}, "target -1"),
        ({"target": 10**6}, "target 1000000"),
        ({"width": 0}, "width 0"),
        ({"height": 10**6}, "height 1000000"),
        ({"view": "top"}, "'top'"),
    ],
)
def test_bad_input_is_one_line(result: Result, wrong: dict, said: str) -> None:
    with pytest.raises(InputError) as error:
        picture(result, **wrong)
    assert said in str(error.value)
    assert "\n" not in str(error.value)


def test_without_opengl_one_line_says_what_to_install(result: Result, monkeypatch: pytest.MonkeyPatch) -> None:
    def nothing(*_: object, **__: object) -> None:
        raise mujoco.FatalError("gladLoadGL error")

    monkeypatch.setattr(mujoco, "Renderer", nothing)
    with pytest.raises(InputError, match=r"gladLoadGL.*libegl1.*MUJOCO_GL=egl") as error:
        picture(result, width=64, height=64)
    assert "\n" not in str(error.value)


@pytest.mark.usefixtures("gl")
@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="the choice of EGL is Linux' alone")
def test_no_setting_is_needed_without_a_display(tmp_path: Path) -> None:
    """In a process where mujoco was imported with neither MUJOCO_GL nor a display."""
    code = (
        "import sys, mujoco\n"
        "from cell.verdict.check import check_fixed\nfrom cell.case.read import load_case\n"
        "from cell.job.job import prepare\n"
        "from cell.view.picture import picture\n"
        "r = check_fixed(prepare(load_case(sys.argv[1])), 90, 180)\n"
        "assert picture(r, width=64, height=64).startswith(b'\\x89PNG')\n"
    )
    env = {k: v for k, v in os.environ.items() if k not in ("MUJOCO_GL", "DISPLAY", "WAYLAND_DISPLAY")}
    root = ROOT
    done = subprocess.run(
        [sys.executable, "-c", code, str(little_case(tmp_path))],
        env=env,
        cwd=root,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == 0, done.stderr
