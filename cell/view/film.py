"""Films of a checked motion, rendered without a window: the bead grows behind the torch.

    film(check(prepare(case), 90, 180), "blade.mp4", speed=10, progress=bars)

One camera sees torch and part all the way through. mp4 is written by ffmpeg (extra ``video``), gif by pillow. A film is
written beside its place and renamed when it is whole, so that an interrupted one leaves nothing.
"""

from __future__ import annotations

import math
import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..atomic_files import beside, check_writable
from ..errors import InputError
from ..progress import Progress, counted_progress, phase
from .camera import View, camera
from .picture import Canvas, Pixels, require_gl, require_picture_size
from .player import Player
from .stage_scene import Frame, StagedScene

if TYPE_CHECKING:
    from ..verdict.result import Result
    from .colours import Colouring

SIZE = {".mp4": (1280, 720), ".gif": (640, 360)}
FPS = {".mp4": 25.0, ".gif": 12.5}
SPEED = 10.0  # s of motion per s of film
MOMENTS = 5  # of the motion that the camera is chosen for
FASTEST_GIF = 50.0  # frames a second: browsers show faster ones slowly
MOST_FRAMES = {".mp4": 60_000, ".gif": 2_000}  # frames; pillow holds those of a gif in memory
SHADOWS, SAMPLES = 4096, 4  # half of a picture's: a frame is seen for a moment, and costs half as much
PALETTE_FRAMES = 8  # that a gif's colours are taken from
LEAST_FREE = 2**20  # bytes of a disk: with less free, that is why an encoder stopped
NO_ENCODER = "mp4 needs an encoder: pip install 'rbam-cell[video]' (imageio-ffmpeg), or give a .gif file"


@dataclass(frozen=True)
class Format:
    """What a film is to be.

    Attributes:
        path: where to.
        width: pixels.
        height: pixels.
        fps: frames a second.
    """

    path: Path
    width: int
    height: int
    fps: float

    @property
    def kind(self) -> str:
        """.mp4 or .gif."""
        return self.path.suffix.lower()


def parse_size(text: str) -> tuple[int, int]:
    """A size as the command line writes it.

    Args:
        text: WIDTHxHEIGHT, pixels.

    Returns:
        Width and height.

    Raises:
        InputError: it is none.
    """
    width, _, height = text.lower().partition("x")
    if not (width.isdecimal() and height.isdecimal()):
        raise InputError(f"--size: {text!r} is not WIDTHxHEIGHT, as 1280x720")
    require_picture_size(int(width), int(height))
    return int(width), int(height)


def film_format(path: str | Path, size: tuple[int, int] | None = None, fps: float | None = None) -> Format:
    """Refuse a film that cannot be written before the work rather than after it.

    Args:
        path: its ending says mp4 or gif.
        size: width and height, pixels; by default 1280 x 720 (mp4) or 640 x 360 (gif).
        fps: frames a second; by default 25 (mp4) or 12.5 (gif).

    Returns:
        The film's format.

    Raises:
        InputError: ending, folder, size, frame rate, encoder or OpenGL; one line.
    """
    path = Path(path)
    kind = path.suffix.lower()
    if kind not in SIZE:
        raise InputError(f"{path}: a film is .mp4 or .gif")
    check_writable(path)
    width, height = size or SIZE[kind]
    require_picture_size(width, height)
    if kind == ".mp4" and (width % 2 or height % 2):
        raise InputError(f"size {width}x{height}: mp4 needs an even width and height")
    fps = FPS[kind] if fps is None else fps
    most = FASTEST_GIF if kind == ".gif" else 240.0
    if not (math.isfinite(fps) and 0 < fps <= most):
        raise InputError(f"fps {fps:g}: above 0 and up to {most:g} is allowed for {kind}")
    if kind == ".mp4":
        _encoder()
    require_gl()
    return Format(path, width, height, fps)


@phase("filming", spins=False)
def film(
    result: Result,
    path: str | Path,
    *,
    size: tuple[int, int] | None = None,
    fps: float | None = None,
    speed: float = SPEED,
    view: View = "cell",
    colour: Colouring = "layer",
    progress: Progress | None = None,
) -> int:
    """Write a film of a result: its motion, or its infeasible targets one after the other.

    Args:
        result: from ``cell.check``.
        path: where to, .mp4 or .gif.
        size: width and height, pixels.
        fps: frames a second.
        speed: seconds of motion per second of film.
        view: "cell" for the whole cell, "torch" for torch and part.
        colour: what the beads' colours show.
        progress: called with how far it is.

    Returns:
        How many frames it has; its length is that over the frame rate.

    Raises:
        InputError: see :func:`film_format`, or there would be too many frames; one line.
    """
    form = film_format(path, size, fps)
    player = Player(result, speed)
    count = math.ceil(player.end / speed * form.fps - 1e-9) + 1  # the last one shows the end
    if count > MOST_FRAMES[form.kind]:
        raise InputError(
            f"{path}: {count} frames are too many for {form.kind} (at most {MOST_FRAMES[form.kind]}): "
            f"raise --speed or lower --fps"
        )
    staged = StagedScene(result)
    staged.model.vis.quality.shadowsize, staged.model.vis.quality.offsamples = SHADOWS, SAMPLES
    staged.colour(colour)
    look = camera(staged, view, form.width / form.height, _moments(player))
    canvas = Canvas(staged, form.width, form.height, view)
    with canvas, counted_progress(progress, "frames", count) as written, beside(path) as file:
        frames = (canvas.render(frame, look) for frame in _frames(player, count, form.fps))
        _WRITERS[form.kind](file, _counted(frames, written), form, count)
    return count


def _moments(player: Player) -> list[Frame]:
    """Frames evenly along the motion, or the infeasible targets."""
    moments = []
    for time in np.linspace(0.0, player.end, MOMENTS):
        player.time = float(time)
        moments.append(player.frame())
    return moments


def _frames(player: Player, count: int, fps: float) -> Iterator[Frame]:
    for k in range(count):
        player.time = min(k / fps * player.speed, player.end)
        frame = player.frame()
        # beside the wire of a moving torch a normal is one wire too many
        yield replace(frame, arrow=not player.result.feasible)


def _counted(frames: Iterator[Pixels], written: Callable[[], None]) -> Iterator[Pixels]:
    for frame in frames:
        yield frame
        written()


def _encoder() -> Any:
    try:
        import imageio_ffmpeg
    except ImportError:
        raise InputError(NO_ENCODER) from None
    try:
        imageio_ffmpeg.get_ffmpeg_exe()
    except RuntimeError as error:
        raise InputError(f"{NO_ENCODER}; {' '.join(str(error).split())}") from None
    return imageio_ffmpeg


def _write_mp4(file: Path, frames: Iterator[Pixels], form: Format, count: int) -> None:
    writer = _encoder().write_frames(
        str(file),
        (form.width, form.height),
        fps=form.fps,
        codec="libx264",
        pix_fmt_out="yuv420p",  # what every player plays
        macro_block_size=2,
        quality=None,
        ffmpeg_log_level="quiet",  # what stops it is reported below, in one line
        # the index in front, so that it plays while it loads
        output_params=["-crf", "20", "-preset", "medium", "-movflags", "+faststart"],
    )
    try:
        writer.send(None)
        for frame in frames:
            writer.send(np.ascontiguousarray(frame))
    except OSError as error:
        if shutil.disk_usage(file.parent).free < LEAST_FREE:
            raise InputError(f"{form.path}: cannot be written (No space left on device)") from None
        why = " ".join(str(error).split("FFMPEG COMMAND")[0].split())  # imageio puts the whole command behind it
        raise InputError(f"{form.path}: the encoder stopped ({why[:300]})") from None
    finally:
        writer.close()


def _write_gif(file: Path, frames: Iterator[Pixels], form: Format, count: int) -> None:
    from PIL import Image

    # one set of colours for all frames: chosen for each anew they would flicker
    images = [Image.fromarray(frame) for frame in frames]
    some = images[:: max(1, len(images) // PALETTE_FRAMES)]
    together = Image.new("RGB", (form.width, form.height * len(some)))
    for k, image in enumerate(some):
        together.paste(image, (0, k * form.height))
    palette = together.quantize(256, dither=Image.Dither.NONE)
    few = [image.quantize(palette=palette, dither=Image.Dither.NONE) for image in images]
    # a gif counts in hundredths of a second: what rounding takes from one frame the next one gets
    ends = np.rint(100 * np.arange(1, count + 1) / form.fps).astype(np.int64)
    durations = (10 * np.diff(ends, prepend=0)).tolist()
    few[0].save(file, save_all=True, append_images=few[1:], duration=durations, loop=0, optimize=False)


_WRITERS = {".mp4": _write_mp4, ".gif": _write_gif}
