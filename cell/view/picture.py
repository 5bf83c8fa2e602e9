"""Pictures of the cell, rendered without a window, and what replay draws as well.

    png = picture(check(prepare(case), 90, 180), view="torch")     # bytes of a PNG
    Path("torch.png").write_bytes(png)

The arm stands at one target with the beads laid by then; what is still to be laid is translucent. Where the
target cannot be welded, the arm is at its best attempt and what collides is red. Visual geoms are shown,
collision geoms are not. World frame, metres.
"""

from __future__ import annotations

import io
import os
import sys
from typing import TYPE_CHECKING

import mujoco
import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..progress import phase
from .camera import View, camera, still, target_to_show
from .colours import Colouring
from .stage_scene import MARKS, VISIBLE, Frame, StagedScene

if TYPE_CHECKING:
    from ..verdict.result import Result

LARGEST = 8192  # pixels a side
LITTLE, LITTLE_SHADOWS = 400, 2048  # pixels: a picture this small shows no more of its shadows
NO_GL = (
    "cannot render a picture: no OpenGL ({why}); on Debian or Ubuntu install libegl1 and libgl1-mesa-dri "
    "and set MUJOCO_GL=egl"
)

Pixels = NDArray[np.uint8]


@phase("rendering")
def picture(
    result: Result,
    *,
    width: int = 1600,
    height: int = 1000,
    target: int | None = None,
    view: View = "cell",
    colour: Colouring = "layer",
) -> bytes:
    """Render the arm at a target.

    Args:
        result: from ``cell.check``.
        width: pixels.
        height: pixels.
        target: its number; default: one halfway through the motion, or the first infeasible one with an attempt.
        view: "cell" for the whole cell, "torch" for torch and part.
        colour: what the beads' colours show.

    Returns:
        A PNG.

    Raises:
        InputError: there is no such target, size or view, or no OpenGL; one line.
    """
    n = len(result.rows)
    if target is not None and not 0 <= target < n:
        raise InputError(f"target {target}: the part has targets 0 .. {n - 1}")
    require_picture_size(width, height)
    if view not in ("cell", "torch"):
        raise InputError(f"view {view!r}: cell or torch is needed")
    frame = still(result, target_to_show(result) if target is None else target)
    staged = StagedScene(result)
    staged.colour(colour)
    staged.pose(frame)
    look = camera(staged, view, width / height)
    with Canvas(staged, width, height, view) as canvas:
        return _png(canvas.render(frame, look))


class Canvas:
    """Where frames of a staged scene are rendered, one after another.

    with Canvas(staged, 960, 540, "torch") as canvas:
        pixels = canvas.render(frame, camera(staged, "torch", 960 / 540))    # (540, 960, 3) bytes
    """

    def __init__(self, staged: StagedScene, width: int, height: int, view: View) -> None:
        """Open it.

        Args:
            staged: what is rendered.
            width: pixels.
            height: pixels.
            view: what is looked at.

        Raises:
            InputError: the size is not allowed, or there is no OpenGL; one line.
        """
        require_picture_size(width, height)
        model = staged.model
        model.vis.global_.offwidth, model.vis.global_.offheight = width, height
        if max(width, height) <= LITTLE:
            model.vis.quality.shadowsize = min(int(model.vis.quality.shadowsize), LITTLE_SHADOWS)
        self._staged, self._closely = staged, view == "torch"
        if self._closely:
            staged.shade_closely()
        self._option = mujoco.MjvOption()
        self._option.geomgroup[:] = VISIBLE
        # every mark may have a normal
        self._renderer = _renderer(model, width, height, model.ngeom + len(staged.beads.target) + 2 * MARKS + 100)

    def __enter__(self) -> Canvas:
        return self

    def __exit__(self, *_: object) -> None:
        self._renderer.close()

    def render(self, frame: Frame, look: mujoco.MjvCamera) -> Pixels:
        """Render a frame.

        Args:
            frame: what is to be seen.
            look: from where.

        Returns:
            (height, width, 3), 0 .. 255.
        """
        self._staged.pose(frame)
        if self._closely:
            self._staged.shade_closely()
        self._renderer.update_scene(self._staged.data, look, self._option)
        self._renderer.scene.flags[mujoco.mjtRndFlag.mjRND_FOG] = True
        self._staged.draw(self._renderer.scene, frame)
        return self._renderer.render().copy()


def require_picture_size(width: int, height: int) -> None:
    """Refuse a size that cannot be rendered.

    Raises:
        InputError: which, and what is allowed.
    """
    for name, value in (("width", width), ("height", height)):
        if not 16 <= value <= LARGEST:
            raise InputError(f"{name} {value}: 16 .. {LARGEST} pixels are allowed")


def require_gl() -> None:
    """Refuse to go on where nothing can be rendered, before the work rather than after it.

    Raises:
        InputError: one line that says what to install.
    """
    _renderer(mujoco.MjSpec().compile(), 16, 16, 10).close()


def _renderer(model: mujoco.MjModel, width: int, height: int, room: int) -> mujoco.Renderer:
    _choose_backend()
    # PyOpenGL is only there where EGL or OSMesa is used
    gl_error = getattr(sys.modules.get("OpenGL.error"), "Error", RuntimeError)
    try:
        return mujoco.Renderer(model, height, width, max_geom=room)
    except (mujoco.FatalError, ImportError, RuntimeError, gl_error) as error:
        raise InputError(NO_GL.format(why=" ".join(str(error).split()) or type(error).__name__)) from None


def _choose_backend() -> None:
    """Take EGL on a Linux without a display; MuJoCo has chosen GLFW by then, which needs one."""
    import importlib

    from mujoco.rendering.classic import gl_context

    context = getattr(gl_context, "GLContext", None)
    if context is None:
        raise InputError(NO_GL.format(why=f"MUJOCO_GL={os.environ.get('MUJOCO_GL', '')} turns it off"))
    if not sys.platform.startswith("linux") or os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"):
        return
    wanted = os.environ.setdefault("MUJOCO_GL", "egl")
    if wanted != "egl" or context.__module__.startswith("mujoco.egl"):
        return
    try:
        importlib.reload(gl_context)
    except (AttributeError, OSError) as error:  # PyOpenGL's way of saying that libEGL is missing
        raise InputError(NO_GL.format(why=" ".join(str(error).split()))) from None


def _png(pixels: Pixels) -> bytes:
    from PIL import Image

    out = io.BytesIO()
    Image.fromarray(pixels).save(out, format="PNG", optimize=True)
    return out.getvalue()
