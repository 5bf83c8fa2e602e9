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
from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal

import mujoco
import numpy as np
from numpy.typing import NDArray

from ik.chain import Floats

from .colours import Colouring
from .composition import Piece
from .errors import InputError
from .staging import FOVY, MARKS, VISIBLE, Frame, Staging
from .terminal import stage

if TYPE_CHECKING:
    from .check import Result

LARGEST = 8192  # pixels a side
LITTLE, LITTLE_SHADOWS = 400, 2048  # pixels: a picture this small shows no more of its shadows
HIDDEN = 4e-3  # m: what a ray meets this near to a point is the point itself
NO_GL = (
    "cannot render a picture: no OpenGL ({why}); on Debian or Ubuntu install libegl1 and libgl1-mesa-dri "
    "and set MUJOCO_GL=egl"
)

View = Literal["cell", "torch"]
Pixels = NDArray[np.uint8]


def camera(staging: Staging, view: View, aspect: float, frames: Sequence[Frame] = ()) -> mujoco.MjvCamera:
    """The best look at a staging.

    Args:
        staging: posed, where there are no frames.
        view: "cell" frames arm, positioner and part; "torch" the part and the torch's end.
        aspect: width over height of the picture.
        frames: moments that are all to be in view of one camera; the staging is left at the last of them.

    Returns:
        A free camera: of all sides the one from which most of torch and targets can be seen (by rays; nothing
        is rendered), the torch from its side and the light from behind.
    """
    angles = [
        (azimuth, elevation)
        for elevation in ((-8.0, -22.0, -36.0) if view == "torch" else (-16.0, -26.0))
        for azimuth in np.arange(-180.0, 180.0, 15.0)
    ]
    moments = []
    for frame in frames or (None,):
        if frame is not None:
            staging.pose(frame)
        focus = _focus(staging)
        moments.append((focus, _cell_points(staging) if view == "cell" else focus))
    points = np.concatenate([shown for _, shown in moments])
    fitted = [_fitted(points, azimuth, elevation, aspect) for azimuth, elevation in angles]
    scores = np.zeros(len(angles))
    for (focus, _), frame in zip(moments, frames or (None,), strict=True):
        if frame is not None:
            staging.pose(frame)
        scores += [_score(staging, view, eye, looks, focus) for eye, looks in fitted]
    # of equals the first, whatever the rounding
    best = int(np.flatnonzero(scores >= scores.max() - 1e-9)[0])
    (azimuth, elevation), (eye, looks) = angles[best], fitted[best]
    chosen = mujoco.MjvCamera()
    distance = float((points.mean(axis=0) - eye) @ looks[0])
    chosen.azimuth, chosen.elevation, chosen.distance = azimuth, elevation, distance
    chosen.lookat[:] = eye + looks[0] * distance
    return chosen


def _directions(azimuth: float, elevation: float) -> Floats:
    """Rows: where a camera looks, its right, its up."""
    a, e = np.deg2rad([azimuth, elevation])
    forward = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    right = np.array([np.sin(a), -np.cos(a), 0.0])
    return np.stack([forward, right, np.cross(right, forward)])


def _fitted(points: Floats, azimuth: float, elevation: float, aspect: float) -> tuple[Floats, Floats]:
    """The nearest eye that has all points in the picture, and the camera's directions."""
    looks = _directions(azimuth, elevation)
    depth, x, y = looks @ points.T
    tall = np.tan(np.deg2rad(FOVY) / 2) * 0.92  # a margin around it
    wide = tall * aspect
    sides = [((v - s * depth).max(), (-v - s * depth).max(), s) for v, s in ((x, wide), (y, tall))]
    back = min(-(high + low) / (2 * s) for high, low, s in sides)
    across = [(high - low) / 2 for high, low, _ in sides]
    return np.array([back, *across]) @ looks, looks


def _cell_points(staging: Staging) -> Floats:
    """Corners of all that is shown, but for the floor and what stands around."""
    m, d = staging.model, staging.data
    fixture = staging.scene.piece_of_geom == Piece.FIXTURE
    solid = (VISIBLE[m.geom_group] == 1) & (m.geom_type != mujoco.mjtGeom.mjGEOM_PLANE)
    signs = np.array(np.meshgrid(*[(-1, 1)] * 3)).reshape(3, 8).T
    corners = [
        d.geom_xpos[g] + (m.geom_aabb[g, :3] + signs * m.geom_aabb[g, 3:]) @ d.geom_xmat[g].reshape(3, 3).T
        for g in np.flatnonzero(solid)
        if not fixture[g]
    ]
    return np.concatenate(corners)


def _focus(staging: Staging) -> Floats:
    """What has to be seen: the wire's end and points up the torch (the first six), then targets; world, m."""
    tip, wire = staging.tcp()
    position = staging.targets()[0]
    some = np.unique(np.linspace(0, len(position) - 1, 30).astype(np.int64))
    reach = max(0.08, 0.8 * float(np.ptp(position, axis=0).max()))
    return np.concatenate([tip - wire * np.linspace(0, reach, 6)[:, None], position[some]])


def _score(staging: Staging, view: View, eye: Floats, looks: Floats, focus: Floats) -> float:
    m, d = staging.model, staging.data
    if eye[2] < 0.05:
        return -np.inf
    way = focus - eye
    far = np.linalg.norm(way, axis=1)
    geom, met = np.full(len(way), -1, dtype=np.int32), np.full(len(way), -1.0)
    mujoco.mj_multiRay(m, d, eye, (way / far[:, None]).ravel(), VISIBLE, True, -1, geom, met, None, len(way), 1e3)
    seen = (geom < 0) | (met > far - HIDDEN)
    part = m.body("part").id
    tool = int(m.site_bodyid[staging.scene.sites["tcp"]])
    # the torch may hide its own axis, and the part its own far side, but nothing else may hide them
    hit = np.where(geom >= 0, m.geom_bodyid[geom], -1)
    seen[1:6] |= hit[1:6] == tool
    seen[6:] |= hit[6:] == part
    side = float(np.linalg.norm(np.cross(looks[0], staging.tcp()[1])))
    light = float(looks[0] @ m.light_dir[0]) if m.nlight else 0.0
    score = 4.0 * seen[0] + 2.0 * seen[1:6].mean() + seen[6:].mean() + side + 0.5 * light
    if view == "cell":
        base = d.xpos[staging.scene.base_body]
        across = (d.site_xpos[staging.scene.sites["part"]] - base)[:2]
        score += 2.0 * abs(float(across @ looks[1, :2])) / max(float(np.linalg.norm(across)), 1e-9)
        score += 2.0 * min(1.0, 2.0 / far[0])
    return score


@stage("rendering")
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
        result: from ``cell.check.check``.
        width: pixels.
        height: pixels.
        target: which; by default one halfway through the motion, or the first infeasible one with an attempt.
        view: "cell" for the whole cell, "torch" for torch and part.
        colour: what the beads' colours mean.

    Returns:
        A PNG.

    Raises:
        InputError: there is no such target, size or view, or no OpenGL; one line.
    """
    n = len(result.rows)
    if target is not None and not 0 <= target < n:
        raise InputError(f"target {target}: the targets are 0 .. {n - 1}")
    require_size(width, height)
    if view not in ("cell", "torch"):
        raise InputError(f"view {view!r}: is cell or torch")
    frame = still(result, middle(result) if target is None else target)
    staging = Staging(result)
    staging.colour(colour)
    staging.pose(frame)
    look = camera(staging, view, width / height)
    with Canvas(staging, width, height, view) as canvas:
        return _png(canvas.render(frame, look))


def still(result: Result, target: int) -> Frame:
    """The frame of a target: the arm there, or at its best attempt, or else at home.

    Args:
        result: the verdict.
        target: which.

    Returns:
        The frame.
    """
    row = result.rows[target]
    q = next((x for x in (row.q, row.attempt) if x is not None), result.job.scene.home)
    bad = row.reason is not None
    pair = tuple(row.detail.get("pair", ())) if row.reason == "collision" else ()
    table = np.array(result.table)
    return Frame(q, table, target, float(target), pair=pair, marks=bad, arrow=bad)


def middle(result: Result) -> int:
    """The target halfway through the motion, or the first infeasible one, best with an attempt."""
    if result.motion is not None:
        return int(result.motion.target[np.searchsorted(result.motion.t_s, result.motion.t_s[-1] / 2)])
    bad = [i for i, row in enumerate(result.rows) if row.reason is not None]
    return next((i for i in bad if result.rows[i].attempt is not None), bad[0])


class Canvas:
    """Where frames of a staging are rendered, one after another.

    with Canvas(staging, 960, 540, "torch") as canvas:
        pixels = canvas.render(frame, camera(staging, "torch", 960 / 540))    # (540, 960, 3) bytes
    """

    def __init__(self, staging: Staging, width: int, height: int, view: View) -> None:
        """Open it.

        Args:
            staging: what is rendered.
            width: pixels.
            height: pixels.
            view: what is looked at.

        Raises:
            InputError: the size is not allowed, or there is no OpenGL; one line.
        """
        require_size(width, height)
        model = staging.model
        model.vis.global_.offwidth, model.vis.global_.offheight = width, height
        if max(width, height) <= LITTLE:
            model.vis.quality.shadowsize = min(int(model.vis.quality.shadowsize), LITTLE_SHADOWS)
        self._staging, self._closely = staging, view == "torch"
        if self._closely:
            staging.shade_closely()
        self._option = mujoco.MjvOption()
        self._option.geomgroup[:] = VISIBLE
        # every mark may have a normal
        self._renderer = _renderer(model, width, height, model.ngeom + len(staging.beads.target) + 2 * MARKS + 100)

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
        self._staging.pose(frame)
        if self._closely:
            self._staging.shade_closely()
        self._renderer.update_scene(self._staging.data, look, self._option)
        self._renderer.scene.flags[mujoco.mjtRndFlag.mjRND_FOG] = True
        self._staging.draw(self._renderer.scene, frame)
        return self._renderer.render().copy()


def require_size(width: int, height: int) -> None:
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
