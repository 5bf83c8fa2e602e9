"""From where the cell, or its torch, is seen best.

Use:

    camera(staged, "torch", aspect=1.6)      # mujoco.MjvCamera
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal

import mujoco
import numpy as np

from ik.chain import Floats

from ..scene.composition import BodyOwner
from .stage_scene import FOVY, VISIBLE, Frame, StagedScene

if TYPE_CHECKING:
    from ..verdict.result import Result


HIDDEN = 4e-3  # m: what a ray meets this near to a point is the point itself

View = Literal["cell", "torch"]


def camera(staged: StagedScene, view: View, aspect: float, frames: Sequence[Frame] = ()) -> mujoco.MjvCamera:
    """The best look at a staged scene.

    Args:
        staged: posed, where there are no frames.
        view: "cell" frames arm, positioner and part; "torch" the part and the torch's end.
        aspect: width over height of the picture.
        frames: moments that are all to be in view of one camera; the staged scene is left at the last of them.

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
            staged.pose(frame)
        focus = _focus(staged)
        moments.append((focus, _cell_points(staged) if view == "cell" else focus))
    points = np.concatenate([shown for _, shown in moments])
    fitted = [_fitted(points, azimuth, elevation, aspect) for azimuth, elevation in angles]
    scores = np.zeros(len(angles))
    for (focus, _), frame in zip(moments, frames or (None,), strict=True):
        if frame is not None:
            staged.pose(frame)
        scores += [_score(staged, view, eye, looks, focus) for eye, looks in fitted]
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


def _cell_points(staged: StagedScene) -> Floats:
    """Corners of all that is shown, but for the floor and what stands around."""
    m, d = staged.model, staged.data
    fixture = staged.scene.piece_of_geom == BodyOwner.FIXTURE
    solid = (VISIBLE[m.geom_group] == 1) & (m.geom_type != mujoco.mjtGeom.mjGEOM_PLANE)
    signs = np.array(np.meshgrid(*[(-1, 1)] * 3)).reshape(3, 8).T
    corners = [
        d.geom_xpos[g] + (m.geom_aabb[g, :3] + signs * m.geom_aabb[g, 3:]) @ d.geom_xmat[g].reshape(3, 3).T
        for g in np.flatnonzero(solid)
        if not fixture[g]
    ]
    return np.concatenate(corners)


def _focus(staged: StagedScene) -> Floats:
    """What has to be seen: the wire's end and points up the torch (the first six), then targets; world, m."""
    tip, wire = staged.tcp()
    position = staged.targets()[0]
    some = np.unique(np.linspace(0, len(position) - 1, 30).astype(np.int64))
    reach = max(0.08, 0.8 * float(np.ptp(position, axis=0).max()))
    return np.concatenate([tip - wire * np.linspace(0, reach, 6)[:, None], position[some]])


def _score(staged: StagedScene, view: View, eye: Floats, looks: Floats, focus: Floats) -> float:
    m, d = staged.model, staged.data
    if eye[2] < 0.05:
        return -np.inf
    way = focus - eye
    far = np.linalg.norm(way, axis=1)
    geom, met = np.full(len(way), -1, dtype=np.int32), np.full(len(way), -1.0)
    mujoco.mj_multiRay(m, d, eye, (way / far[:, None]).ravel(), VISIBLE, True, -1, geom, met, None, len(way), 1e3)
    seen = (geom < 0) | (met > far - HIDDEN)
    part = m.body("part").id
    tool = int(m.site_bodyid[staged.scene.sites["tcp"]])
    # the torch may hide its own axis, and the part its own far side, but nothing else may hide them
    hit = np.where(geom >= 0, m.geom_bodyid[geom], -1)
    seen[1:6] |= hit[1:6] == tool
    seen[6:] |= hit[6:] == part
    side = float(np.linalg.norm(np.cross(looks[0], staged.tcp()[1])))
    light = float(looks[0] @ m.light_dir[0]) if m.nlight else 0.0
    score = 4.0 * seen[0] + 2.0 * seen[1:6].mean() + seen[6:].mean() + side + 0.5 * light
    if view == "cell":
        base = d.xpos[staged.scene.base_body]
        across = (d.site_xpos[staged.scene.sites["part"]] - base)[:2]
        score += 2.0 * abs(float(across @ looks[1, :2])) / max(float(np.linalg.norm(across)), 1e-9)
        score += 2.0 * min(1.0, 2.0 / far[0])
    return score


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
    bad = row.failure is not None
    pair = row.pair if row.reason == "collision" else ()
    table = result.tables[target]
    return Frame(q, table, target, float(target), pair=pair, marks=bad, arrow=bad)


def target_to_show(result: Result) -> int:
    """The target halfway through the motion, or the first infeasible one, best with an attempt."""
    if result.motion is not None:
        return int(result.motion.target[np.searchsorted(result.motion.t_s, result.motion.t_s[-1] / 2)])
    bad = [i for i, row in enumerate(result.rows) if row.failure is not None]
    return next((i for i in bad if result.rows[i].attempt is not None), bad[0])
