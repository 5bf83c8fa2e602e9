"""Pictures of the cell, rendered without a window, and what replay draws as well.

    png = picture(check(prepare(case), 90, 180), view="torch")     # bytes of a PNG
    Path("torch.png").write_bytes(png)

The arm stands at one target with the beads laid by then; what is still to be laid is translucent. Where the
target cannot be welded, the arm is at its best attempt and what collides is red. Visual geoms are shown,
collision geoms are not. World frame, metres.
"""

from __future__ import annotations

import copy
import io
import os
import sys
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import mujoco
import numpy as np

from ik.chain import Floats

from .collision import Ints
from .errors import InputError
from .job import Job
from .place import METRES_PER_MM
from .robot import pose

if TYPE_CHECKING:
    from .check import Result

VISIBLE = np.array([1, 1, 1, 0, 0, 0], dtype=np.uint8)  # geom groups shown; 3 is what collides
UNLAID = 0.22  # opacity of what is still to be laid
PIECES = 6000  # bead pieces drawn at most
MARKS = 600  # target marks drawn at most
LARGEST = 8192  # pixels a side
FOVY = 34.0  # deg; a long lens keeps the arm's proportions
TWIN = 5e-3  # m: a visual geom this close in size to the geom that collides stands for it
HIDDEN = 4e-3  # m: what a ray meets this near to a point is the point itself
SHADED = 0.4  # m around the torch
ARROW = 0.18  # m; past the torch's bend, or the neck would hide it
RED, GREEN = (0.88, 0.08, 0.06, 1.0), (0.15, 0.65, 0.25, 1.0)
PALE_RED = (0.95, 0.62, 0.58, 1.0)
RAMP = np.array([(0.50, 0.10, 0.10), (0.87, 0.33, 0.09), (0.98, 0.78, 0.28)])  # first layer to last
NO_GL = (
    "cannot render a picture: no OpenGL ({why}); on Debian or Ubuntu install libegl1 and libgl1-mesa-dri "
    "and set MUJOCO_GL=egl"
)

View = Literal["cell", "torch"]


@dataclass(frozen=True, eq=False)
class Frame:
    """What is to be seen at a moment.

    Attributes:
        q: the arm, (j,), rad.
        table: E1, E2, (2,), rad.
        target: the target it is about.
        done: targets passed so far, with the fraction of the way to the next.
        laying: whether the arc burns, so that the bead ends at the wire.
        pair: names of the geoms that collide.
        marks: whether the targets are marked.
        arrow: whether the target's normal is shown.
    """

    q: Floats
    table: Floats
    target: int
    done: float
    laying: bool = False
    pair: tuple[str, ...] = ()
    marks: bool = False
    arrow: bool = False


@dataclass(frozen=True, eq=False)
class Beads:
    """Beads as straight pieces in the order in which they are laid, part frame, m.

    Attributes:
        target: the targets a piece leads from and to, (k, 2).
        ends: its ends, (k, 2, 3).
        radius: (k,).
        rgba: (k, 4).
    """

    target: Ints
    ends: Floats
    radius: Floats
    rgba: Floats


def beads_of(job: Job, most: int = PIECES) -> Beads:
    """The beads of a job as pieces to draw.

    Args:
        job: the job.
        most: how many pieces at most; beads of many targets are drawn in longer pieces, and where that is not
            enough some are left out evenly.

    Returns:
        The beads. A bead lies on its slicing surface, so its middle is half its thickness above it.
    """
    t = job.targets
    radius = t.thickness_mm * METRES_PER_MM / 2
    middle = t.position * METRES_PER_MM + t.normal * radius[:, None]
    first = np.flatnonzero(np.diff(t.path, prepend=-1))
    stride = max(1, -(-len(t) // most))
    knots = [
        np.unique(np.append(np.arange(a, b, stride), b - 1)) for a, b in zip(first, [*first[1:], len(t)], strict=True)
    ]
    target = np.concatenate([np.stack([k[:-1], k[1:]], axis=1) for k in knots])
    if len(target) > most:
        target = target[np.unique(np.linspace(0, len(target) - 1, most).astype(np.int64))]
    return Beads(target, middle[target], radius[target].mean(axis=1), _colours(job)[target[:, 0]])


def _colours(job: Job) -> Floats:
    """A colour for every target by its layer, (n, 4); neighbouring layers differ in lightness as well."""
    t = job.targets
    layers = np.array([max(len(s.layers) - 1, 1) for s in job.sliced])
    height = t.layer / layers[t.sub_volume_index]
    rgb = np.stack([np.interp(height, np.linspace(0, 1, len(RAMP)), channel) for channel in RAMP.T], axis=1)
    rgb *= np.where(t.layer % 2, 0.84, 1.0)[:, None]
    return np.column_stack([rgb, np.ones(len(rgb))])


class Staging:
    """A scene made ready to be looked at: its own copy of the model, and what is drawn on top of it."""

    def __init__(self, result: Result) -> None:
        """Prepare.

        Args:
            result: what is to be shown.
        """
        self.result, self.scene = result, result.job.scene
        self.model = copy.copy(self.scene.model)
        # nothing is to move but what is set
        self.model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
        self.model.vis.global_.fovy = FOVY
        self.model.vis.quality.offsamples = 8
        for name in result.job.targets.sub_volume:
            self.model.geom(f"{name}_visual").rgba[3] = UNLAID
        self.data = mujoco.MjData(self.model)
        self.beads = beads_of(result.job)
        self._names = {self.scene.geom_name(i): i for i in range(self.model.ngeom)}
        self._looks = self.model.geom_rgba.copy(), self.model.geom_group.copy()
        self._tinted: tuple[str, ...] = ()

    def pose(self, frame: Frame) -> bool:
        """Bring the cell to a frame.

        Args:
            frame: what is to be seen.

        Returns:
            Whether colours of the model changed.
        """
        self.data.qpos[self.scene.arm_qpos] = frame.q
        self.data.qpos[self.scene.table_qpos] = frame.table
        mujoco.mj_forward(self.model, self.data)
        if frame.pair == self._tinted:
            return False
        self._tinted = frame.pair
        self.model.geom_rgba[:], self.model.geom_group[:] = self._looks
        for geom in (self._names[name] for name in frame.pair if name in self._names):
            self._tint(geom)
        return True

    def _tint(self, geom: int) -> None:
        m = self.model
        if m.geom_type[geom] == mujoco.mjtGeom.mjGEOM_PLANE:
            m.geom_rgba[geom] = PALE_RED  # it fills the picture
            return
        # what is seen in its place is coloured: two faces in one place would flicker
        mates = (m.geom_bodyid == m.geom_bodyid[geom]) & (VISIBLE[self._looks[1]] == 1)
        away = np.linalg.norm(m.geom_pos - m.geom_pos[geom], axis=1)
        size = np.abs(m.geom_aabb[:, 3:] - m.geom_aabb[geom, 3:]).max(axis=1)
        seen = mates & (away + size < TWIN)
        if not seen.any() and self.scene.arm_geom[geom]:
            seen = mates & (away < 0.7 * np.maximum(m.geom_rbound, m.geom_rbound[geom]))
        m.geom_rgba[seen if seen.any() else geom] = RED
        m.geom_group[geom] = self._looks[1][geom] if seen.any() else 2

    def shade_closely(self) -> None:
        """Spend the whole shadow map on what is near the torch, or its shadows would be ragged there."""
        self.model.vis.map.shadowclip = SHADED / self.model.stat.extent
        directional = self.model.light_type == mujoco.mjtLightType.mjLIGHT_DIRECTIONAL
        self.data.light_xpos[directional] = self.tcp()[0] - self.data.light_xdir[directional] * 3 * SHADED

    def T_world_part(self) -> Floats:
        """Pose of the part as the table stands, (4, 4), m."""
        site = self.model.site("part").id
        return pose(self.data.site_xpos[site], self.data.site_xmat[site])

    def tcp(self) -> tuple[Floats, Floats]:
        """Where the wire ends and where it points, (3,) each, world, m."""
        site = self.model.site(self.scene.case.tool.tcp).id
        return self.data.site_xpos[site].copy(), self.data.site_xmat[site].reshape(3, 3)[:, 2].copy()

    def targets(self) -> tuple[Floats, Floats]:
        """Positions and normals of all targets as the table stands, (n, 3) each, world, m."""
        t, T = self.result.job.targets, self.T_world_part()
        return t.position * METRES_PER_MM @ T[:3, :3].T + T[:3, 3], t.normal @ T[:3, :3].T

    def laid(self, frame: Frame) -> int:
        """How many pieces of beads are laid."""
        return int(np.searchsorted(self.beads.target[:, 1], frame.done + 1e-9, side="right"))

    def draw(self, scn: mujoco.MjvScene, frame: Frame, laid: int = 0) -> int:
        """Add beads, marks and arrow to a scene that :meth:`pose` was called for.

        Args:
            scn: where to; what does not fit is left out.
            frame: what is to be seen.
            laid: pieces of beads that are in it already.

        Returns:
            How many pieces of beads are in it now; they are the last that stay where they are.
        """
        b, T = self.beads, self.T_world_part()
        ends = b.ends @ T[:3, :3].T + T[:3, 3]
        count = self.laid(frame)
        for i in range(laid, count):
            _rod(scn, mujoco.mjtGeom.mjGEOM_CAPSULE, b.radius[i], ends[i, 0], ends[i, 1], b.rgba[i])
        if frame.laying and count < len(b.target) and b.target[count, 0] <= frame.done:
            tip, wire = self.tcp()
            end = tip - wire * b.radius[count]
            _rod(scn, mujoco.mjtGeom.mjGEOM_CAPSULE, b.radius[count], ends[count, 0], end, b.rgba[count])
        if frame.marks or frame.arrow:
            self._draw_targets(scn, frame)
        return count

    def _draw_targets(self, scn: mujoco.MjvScene, frame: Frame) -> None:
        position, normal = self.targets()
        bad = np.array([row.reason is not None for row in self.result.rows])
        radius = self.result.job.targets.thickness_mm * METRES_PER_MM / 2
        if frame.arrow:
            i = frame.target
            tip = position[i] + normal[i] * ARROW
            colour = RED if bad[i] else (0.1, 0.3, 0.75, 1.0)
            there = self.result.rows[i].q is not None or self.result.rows[i].attempt is not None
            width = radius[i] * (0.6 if there else 2.0)  # thinner than the wire that it runs in
            _rod(scn, mujoco.mjtGeom.mjGEOM_ARROW, width, position[i], tip, np.array(colour))
        if not frame.marks:
            return
        # infeasible ones first: they are what is looked for
        order = np.concatenate([np.flatnonzero(bad), np.flatnonzero(~bad)])
        if len(order) > MARKS:
            order = order[np.unique(np.linspace(0, len(order) - 1, MARKS).astype(np.int64))]
        for i in order:
            middle = position[i] + normal[i] * radius[i]
            _ball(scn, radius[i] * (1.9 if i == frame.target else 1.3), middle, RED if bad[i] else GREEN)


def _next_geom(scn: mujoco.MjvScene) -> mujoco.MjvGeom | None:
    if scn.ngeom >= scn.maxgeom:
        return None
    scn.ngeom += 1
    return scn.geoms[scn.ngeom - 1]


def _rod(scn: mujoco.MjvScene, kind: int, radius: float, start: Floats, end: Floats, rgba: Floats) -> None:
    geom = _next_geom(scn)
    if geom is None or np.allclose(start, end, atol=1e-9):
        scn.ngeom -= geom is not None
        return
    mujoco.mjv_initGeom(geom, kind, np.zeros(3), np.zeros(3), np.eye(3).ravel(), rgba.astype(np.float32))
    mujoco.mjv_connector(geom, kind, radius, start, end)


def _ball(scn: mujoco.MjvScene, radius: float, centre: Floats, rgba: tuple[float, ...]) -> None:
    geom = _next_geom(scn)
    if geom is not None:
        colour = np.array(rgba, dtype=np.float32)
        mujoco.mjv_initGeom(geom, mujoco.mjtGeom.mjGEOM_SPHERE, np.full(3, radius), centre, np.eye(3).ravel(), colour)


def camera(staging: Staging, view: View, aspect: float) -> mujoco.MjvCamera:
    """The best look at a posed staging.

    Args:
        staging: posed.
        view: "cell" frames arm, positioner and part; "torch" the part and the torch's end.
        aspect: width over height of the picture.

    Returns:
        A free camera: of all sides the one from which most of torch and targets can be seen (by rays; nothing
        is rendered), the torch from its side and the light from behind.
    """
    focus = _focus(staging)
    points = _cell_points(staging) if view == "cell" else focus
    best, chosen = -np.inf, mujoco.MjvCamera()
    for elevation in (-8.0, -22.0, -36.0) if view == "torch" else (-16.0, -26.0):
        for azimuth in np.arange(-180.0, 180.0, 15.0):
            eye, looks = _fitted(points, azimuth, elevation, aspect)
            score = _score(staging, view, eye, looks, focus)
            if score > best + 1e-9:
                best = score
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
    fixtures = {f.name for f in staging.scene.case.fixtures}
    solid = (VISIBLE[m.geom_group] == 1) & (m.geom_type != mujoco.mjtGeom.mjGEOM_PLANE)
    signs = np.array(np.meshgrid(*[(-1, 1)] * 3)).reshape(3, 8).T
    corners = [
        d.geom_xpos[g] + (m.geom_aabb[g, :3] + signs * m.geom_aabb[g, 3:]) @ d.geom_xmat[g].reshape(3, 3).T
        for g in np.flatnonzero(solid)
        if m.geom(g).name.removesuffix("_visual") not in fixtures
    ]
    return np.concatenate(corners)


def _focus(staging: Staging) -> Floats:
    """What has to be seen: the wire's end and points up the torch (the first six), then targets; world, m."""
    tip, wire = staging.tcp()
    position = staging.targets()[0]
    some = np.unique(np.linspace(0, len(position) - 1, 30).astype(np.int64))
    reach = max(0.11, 0.8 * float(np.ptp(position, axis=0).max()))
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
    tool = int(m.site_bodyid[m.site(staging.scene.case.tool.tcp).id])
    # the torch may hide its own axis, and the part its own far side, but nothing else may hide them
    hit = np.where(geom >= 0, m.geom_bodyid[geom], -1)
    seen[1:6] |= hit[1:6] == tool
    seen[6:] |= hit[6:] == part
    side = float(np.linalg.norm(np.cross(looks[0], staging.tcp()[1])))
    light = float(looks[0] @ m.light_dir[0]) if m.nlight else 0.0
    score = 4.0 * seen[0] + 2.0 * seen[1:6].mean() + seen[6:].mean() + side + 0.5 * light
    if view == "cell":
        base = d.xpos[m.body(staging.scene.case.robot.base).id]
        across = (d.site_xpos[m.site("part").id] - base)[:2]
        score += 2.0 * abs(float(across @ looks[1, :2])) / max(float(np.linalg.norm(across)), 1e-9)
        score += 2.0 * min(1.0, 2.0 / far[0])
    return score


def picture(
    result: Result, *, width: int = 1600, height: int = 1000, target: int | None = None, view: View = "cell"
) -> bytes:
    """Render the arm at a target.

    Args:
        result: from ``cell.check.check``.
        width: pixels.
        height: pixels.
        target: which; by default one halfway through the motion, or the first infeasible one with an attempt.
        view: "cell" for the whole cell, "torch" for torch and part.

    Returns:
        A PNG.

    Raises:
        InputError: there is no such target, size or view, or no OpenGL; one line.
    """
    n = len(result.rows)
    if target is not None and not 0 <= target < n:
        raise InputError(f"target {target}: the targets are 0 .. {n - 1}")
    for name, value in (("width", width), ("height", height)):
        if not 16 <= value <= LARGEST:
            raise InputError(f"{name} {value}: 16 .. {LARGEST} pixels are allowed")
    if view not in ("cell", "torch"):
        raise InputError(f"view {view!r}: is cell or torch")
    frame = still(result, middle(result) if target is None else target)
    staging = Staging(result)
    staging.pose(frame)
    look = camera(staging, view, width / height)
    if view == "torch":
        staging.shade_closely()
    return _png(_rendered(staging, frame, look, width, height))


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


def _rendered(
    staging: Staging, frame: Frame, view: mujoco.MjvCamera, width: int, height: int
) -> np.ndarray[Any, np.dtype[np.uint8]]:
    model = staging.model
    model.vis.global_.offwidth, model.vis.global_.offheight = width, height
    option = mujoco.MjvOption()
    option.geomgroup[:] = VISIBLE
    _choose_backend()
    room = model.ngeom + len(staging.beads.target) + MARKS + 100
    # PyOpenGL is only there where EGL or OSMesa is used
    gl_error = getattr(sys.modules.get("OpenGL.error"), "Error", RuntimeError)
    try:
        renderer = mujoco.Renderer(model, height, width, max_geom=room)
    except (mujoco.FatalError, ImportError, RuntimeError, gl_error) as error:
        raise InputError(NO_GL.format(why=" ".join(str(error).split()) or type(error).__name__)) from None
    with renderer:
        renderer.update_scene(staging.data, view, option)
        staging.draw(renderer.scene, frame)
        return renderer.render().copy()


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


def _png(pixels: np.ndarray[Any, np.dtype[np.uint8]]) -> bytes:
    from PIL import Image

    out = io.BytesIO()
    Image.fromarray(pixels).save(out, format="PNG", optimize=True)
    return out.getvalue()
