"""Films: as long as they should be, moving, whole or not there at all."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from cell.errors import InputError
from cell.verdict.result import Result
from cell.view import film as video
from cell.view.camera import _cell_points, camera
from cell.view.film import film, parse_size
from cell.view.picture import Canvas
from cell.view.player import Player
from cell.view.stage_scene import FOVY, StagedScene

SIZE = (96, 64)


def gif_frames(path: Path) -> tuple[list[np.ndarray], list[int]]:
    from PIL import Image, ImageSequence

    with Image.open(path) as image:
        frames = [(np.asarray(f.convert("RGB")).astype(int), f.info["duration"]) for f in ImageSequence.Iterator(image)]
    return [f for f, _ in frames], [d for _, d in frames]


@pytest.mark.slow
@pytest.mark.usefixtures("gl")
def test_a_gif_moves_and_lasts_as_long_as_it_should(little: Result, tmp_path: Path) -> None:
    path = tmp_path / "boss.gif"
    speed, fps = little.motion.t_s[-1] / 1.0, 3.0  # the motion in a second
    count = film(little, path, size=SIZE, fps=fps, speed=speed)
    assert count == 4  # at 0, 1/3, 2/3, 1 s
    frames, durations = gif_frames(path)
    assert frames[0].shape == (64, 96, 3)
    assert len(frames) == count
    assert sum(durations) == pytest.approx(1000 * count / fps, abs=5)
    assert all(np.abs(a - b).max() > 30 for a, b in pairwise(frames))
    assert [p.name for p in tmp_path.iterdir()] == ["boss.gif"]


@pytest.mark.slow
@pytest.mark.usefixtures("gl")
def test_an_mp4_moves_and_lasts_as_long_as_it_should(little: Result, tmp_path: Path) -> None:
    try:
        import imageio_ffmpeg
    except ImportError:
        if os.environ.get("CI"):
            raise
        pytest.skip("imageio-ffmpeg is not installed (extra 'video')")
    path = tmp_path / "boss.mp4"
    count = film(little, path, size=SIZE, fps=4, speed=little.motion.t_s[-1], view="torch")
    assert count == 5
    assert imageio_ffmpeg.count_frames_and_secs(str(path)) == (count, pytest.approx(count / 4, abs=0.02))
    reader = imageio_ffmpeg.read_frames(str(path))
    assert next(reader)["size"] == SIZE
    frames = [np.frombuffer(f, dtype=np.uint8).astype(int) for f in reader]
    assert all(np.abs(a - b).mean() > 0.5 for a, b in pairwise(frames))
    assert [p.name for p in tmp_path.iterdir()] == ["boss.mp4"]


@pytest.mark.parametrize("name", ["film.gif", "film.mp4"])
@pytest.mark.parametrize("error", [KeyboardInterrupt, pytest.param(RuntimeError, marks=pytest.mark.slow)])
def test_an_interrupted_film_leaves_nothing(
    little: Result, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, error: type[BaseException]
) -> None:
    if name.endswith("mp4"):
        pytest.importorskip("imageio_ffmpeg")
    drawn = []

    class Broken:
        def __init__(self, *_: object) -> None:
            pass

        def __enter__(self) -> Broken:
            return self

        def __exit__(self, *_: object) -> None:
            pass

        def render(self, *_: object) -> np.ndarray:
            drawn.append(1)
            if len(drawn) == 3:
                raise error
            return np.zeros((64, 96, 3), dtype=np.uint8)

    monkeypatch.setattr(video, "Canvas", Broken)
    monkeypatch.setattr(video, "require_gl", lambda: None)
    with pytest.raises(error):
        film(little, tmp_path / name, size=SIZE)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("name", "more", "says"),
    [
        ("film.avi", {}, ".mp4 or .gif"),
        ("missing/film.gif", {}, "does not exist"),
        ("film.gif", {"fps": 0}, "fps 0"),
        ("film.gif", {"fps": float("nan")}, "fps nan"),
        ("film.gif", {"fps": 100}, "fps 100"),
        ("film.gif", {"size": (8, 64)}, "width 8"),
        ("film.mp4", {"size": (97, 64)}, "even"),
        ("film.gif", {"speed": 1e-3}, "too many"),
        ("film.gif", {"speed": -1.0}, "speed"),
    ],
)
def test_bad_input_is_one_line(
    little: Result, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, more: dict, says: str
) -> None:
    monkeypatch.setattr(video, "require_gl", lambda: None)
    with pytest.raises(InputError) as caught:
        film(little, tmp_path / name, **more)
    assert says in str(caught.value)
    assert "\n" not in str(caught.value)
    assert list(tmp_path.iterdir()) == []


def test_without_an_encoder_one_line_says_what_to_install(
    little: Result, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    with pytest.raises(InputError, match=r"rbam-cell\[video\].*\.gif"):
        film(little, tmp_path / "film.mp4")


@pytest.mark.parametrize(
    ("free", "said"),
    [(0, r"cannot be written \(No space left on device\)$"), (2**30, r"stopped \(\[Errno 32\] Broken pipe\)$")],
)
def test_an_encoder_that_stops_is_one_short_line(
    free: int, said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def frames(*_: object, **__: object) -> Iterator[None]:
        yield
        raise OSError("[Errno 32] Broken pipe\n\nFFMPEG COMMAND:\nffmpeg -y -f rawvideo\n\nFFMPEG STDERR OUTPUT:\n")

    monkeypatch.setattr(video, "_encoder", lambda: SimpleNamespace(write_frames=frames))
    monkeypatch.setattr(video.shutil, "disk_usage", lambda _: SimpleNamespace(free=free))
    form = video.Format(tmp_path / "film.mp4", 4, 4, 25.0)
    with pytest.raises(InputError, match=said):
        video._write_mp4(tmp_path / ".film.mp4", iter([np.zeros((4, 4, 3), dtype=np.uint8)]), form, 1)


@pytest.mark.parametrize("text", ["1280", "x720", "1280x", "1280x72o", "-1x5", "1280x720x3", "99999x99999"])
def test_a_size_that_is_none_is_refused(text: str) -> None:
    with pytest.raises(InputError):
        parse_size(text)


def test_a_size_is_width_and_height() -> None:
    assert parse_size("1280x720") == (1280, 720)


@pytest.mark.parametrize("view", ["cell", "torch"])
def test_the_wires_end_is_in_view_all_the_way(little: Result, view: str) -> None:
    player, staged = Player(little), StagedScene(little)
    look = camera(staged, view, 1.5, video._moments(player))
    a, e = np.deg2rad([look.azimuth, look.elevation])
    forward = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    up = np.array([-np.sin(e) * np.cos(a), -np.sin(e) * np.sin(a), np.cos(e)])
    motion = little.motion
    for time in motion.t_s[motion.arc == 1][::25]:
        player.time = float(time)
        staged.pose(player.frame())
        out = staged.tcp()[0] - (look.lookat - forward * look.distance)
        tall = out @ forward * np.tan(np.deg2rad(FOVY) / 2)
        assert abs(out @ up) < tall
        assert abs(out @ np.cross(forward, up)) < 1.5 * tall


@pytest.mark.usefixtures("gl")
def test_the_floor_has_no_specks_where_the_shadows_end(little: Result) -> None:
    """An empty stretch of floor is as bright in one place as in the next."""
    staged = StagedScene(little)
    frame = replace(Player(little).frame(), arrow=False)
    staged.pose(frame)
    look = camera(staged, "cell", 1.5)
    look.azimuth += 180.0  # away from the cell
    look.lookat[:] += 3.0 * np.array([np.cos(np.deg2rad(look.azimuth)), np.sin(np.deg2rad(look.azimuth)), 0])
    look.lookat[2], look.elevation, look.distance = 0.0, -30.0, 1.0
    with Canvas(staged, 320, 200, "cell") as canvas:
        grey = canvas.render(frame, look).astype(int).sum(axis=2)
    floor = grey[120:]
    assert floor.min() > 0.75 * floor.max()


@pytest.mark.usefixtures("gl")
def test_the_floor_ends_in_haze_and_the_cell_is_clear_of_it(little: Result) -> None:
    """Where the floor ends neighbouring rows of pixels differ little, and what is in view is nearer than the haze."""
    staged = StagedScene(little)
    frame = replace(Player(little).frame(), arrow=False)
    staged.pose(frame)
    look = camera(staged, "cell", 1.5)
    start = staged.model.vis.map.fogstart * staged.model.stat.extent
    corners = _cell_points(staged)
    forward = np.array([np.cos(np.deg2rad(v)) for v in (look.azimuth, look.azimuth - 90.0)])
    away = np.append(forward * np.cos(np.deg2rad(look.elevation)), np.sin(np.deg2rad(look.elevation)))
    eye = look.lookat - away * look.distance
    assert ((corners - eye) @ away).max() < start
    # as it is seen by who looks past the cell
    look.azimuth += 25.0
    ahead = np.array([np.cos(np.deg2rad(look.azimuth)), np.sin(np.deg2rad(look.azimuth)), 0.0])
    look.lookat[:], look.elevation, look.distance = eye + ahead, 0.0, 1.0
    with Canvas(staged, 320, 200, "cell") as canvas:
        column = canvas.render(frame, look).astype(int).sum(axis=2)[:150, 160]
    assert np.abs(np.diff(column)).max() < 30
