"""The cell for the page's 3D view: bodies with their joints, surfaces with their colours, cameras.

    scene_json(pack, result)          # read by web/scene.js, which does the forward kinematics

World frame, metres, radians; quaternions wxyz.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import mujoco
import numpy as np

from ..collision.model_copies import discard_spare
from ..scene.composition import BodyOwner
from ..verdict.result import Result
from ..view.camera import camera, still, target_to_show
from ..view.stage_scene import PALE_RED, RED, VISIBLE, StagedScene
from .pack import Pack
from .shapes import geom_json, geom_triangles

MOST_NAMES = 150  # names of colliding geoms that get shapes to be shown in red
SQUARE = 1.0  # width over height for which the cameras are chosen; narrower views stand farther off


def scene_json(pack: Pack, result: Result) -> dict[str, Any]:
    """The cell as a document.

    Args:
        pack: where arrays go.
        result: the verdict.

    Returns:
        ``bodies``, ``geoms``, ``culprits`` (geom name to the drawn geoms that stand for it), ``part``, ``tcp``,
        ``floor``, ``cameras``.
    """
    discard_spare(result.job.scene.model)  # the page takes a copy of its own
    staged = StagedScene(result)
    model = staged.model
    hit = _culprits(result, staged)
    shown = (VISIBLE[model.geom_group] == 1) & (model.geom_type != mujoco.mjtGeom.mjGEOM_PLANE)
    extra = sorted({g for geoms in hit.values() for g in geoms if not shown[g]})
    drawn = [*np.flatnonzero(shown).tolist(), *extra]
    geoms: list[dict[str, Any]] = []
    number: dict[int, int] = {}
    for g in drawn:
        shape = geom_triangles(model, g)
        if shape is None:
            continue
        number[g] = len(geoms)
        geoms.append({**_look(result, staged, g, bool(shown[g])), **geom_json(pack, shape)})
    part, tcp = (result.job.scene.sites[name] for name in ("part", "tcp"))
    floor = np.flatnonzero(model.geom_type == mujoco.mjtGeom.mjGEOM_PLANE)
    return {
        "bodies": _bodies(result, model),
        "geoms": geoms,
        "culprits": {name: [number[g] for g in geoms if g in number] for name, geoms in hit.items()},
        "part": _site(model, part),
        "tcp": _site(model, tcp),
        "floor": float(model.geom_pos[floor[0], 2]) if len(floor) else None,
        "home": [round(float(v), 6) for v in result.job.scene.home],
        "cameras": _cameras(result, staged),
    }


def _bodies(result: Result, model: mujoco.MjModel) -> list[dict[str, Any]]:
    """The tree; ``angle`` is the number of an angle that turns a body, arm first, then E1 and E2."""
    scene = result.job.scene
    order = {int(q): i for i, q in enumerate([*scene.arm_qpos, *scene.table_qpos])}
    bodies = []
    for b in range(model.nbody):
        body: dict[str, Any] = {
            "name": model.body(b).name,
            "parent": int(model.body_parentid[b]),
            "pos": _numbers(model.body_pos[b]),
            "quat": _numbers(model.body_quat[b]),
            "joints": [],
        }
        first = int(model.body_jntadr[b])
        for j in range(first, first + int(model.body_jntnum[b])):
            at = int(model.jnt_qposadr[j])
            if at in order:
                body["joints"].append(
                    {
                        "angle": order[at],
                        "axis": _numbers(model.jnt_axis[j]),
                        "pos": _numbers(model.jnt_pos[j]),
                        "zero": float(model.qpos0[at]),
                    }
                )
        bodies.append(body)
    return bodies


def _site(model: mujoco.MjModel, site: int) -> dict[str, Any]:
    return {
        "body": int(model.site_bodyid[site]),
        "pos": _numbers(model.site_pos[site]),
        "quat": _numbers(model.site_quat[site]),
    }


def _numbers(values: Any) -> list[float]:
    return [round(float(v), 8) + 0.0 for v in values]


def _look(result: Result, staged: StagedScene, geom: int, shown: bool) -> dict[str, Any]:
    """Place, colour and role of a geom."""
    model = staged.model
    material = int(model.geom_matid[geom])
    colour = model.geom_rgba[geom] if material < 0 else model.mat_rgba[material]
    return {
        "name": staged.scene.geom_name(geom),
        "body": int(model.geom_bodyid[geom]),
        "pos": _numbers(model.geom_pos[geom]),
        "quat": _numbers(model.geom_quat[geom]),
        "colour": [round(float(v), 3) for v in colour[:3]],
        "role": _role(result, staged, geom) if shown else "culprit",
    }


def _role(result: Result, staged: StagedScene, geom: int) -> str:
    """What a geom belongs to: volume (a sub-volume), part, tool, arm or cell."""
    model, scene = staged.model, staged.scene
    body = int(model.geom_bodyid[geom])
    part = int(model.body("part").id)
    if model.geom(geom).name in {f"{name}_visual" for name in result.job.targets.sub_volume}:
        return "volume"
    if body in (part, int(model.body_parentid[part])):
        return "part"
    if not scene.arm_geom[geom]:
        return "cell"
    return "tool" if scene.piece_of_geom[geom] == BodyOwner.TOOL else "arm"


def _culprits(result: Result, staged: StagedScene) -> dict[str, list[int]]:
    """What is shown red where a geom collides: itself, or the visual geoms that stand for it."""
    names = dict.fromkeys(name for row in result.rows for name in row.pair)
    if result.clearance is not None:
        names.update(dict.fromkeys(result.clearance.what))
    frame = still(result, 0)
    tinted = {}
    red = np.array([RED, PALE_RED], dtype=np.float32)
    for name in list(names)[:MOST_NAMES]:
        staged.pose(replace(frame, pair=(name,)))
        rgba = staged.model.geom_rgba[:, None]
        tinted[name] = np.flatnonzero((np.abs(rgba - red) < 1e-6).all(axis=2).any(axis=1)).tolist()
    staged.pose(replace(frame, pair=()))
    return tinted


def _cameras(result: Result, staged: StagedScene) -> dict[str, Any]:
    """The best looks over the whole motion, as films choose them; the page fits the distance to its own shape."""
    n = len(result.rows)
    some = sorted({0, n // 4, target_to_show(result), 3 * n // 4, n - 1})
    known = [i for i in some if result.rows[i].q is not None or result.rows[i].attempt is not None]
    frames = [still(result, i) for i in known or [target_to_show(result)]]
    views = {}
    for name in ("cell", "torch"):
        found = camera(staged, "cell" if name == "cell" else "torch", SQUARE, frames)
        views[name] = {
            "azimuth": round(float(np.deg2rad(found.azimuth)), 5),
            "elevation": round(float(np.deg2rad(found.elevation)), 5),
            "distance": round(float(found.distance), 5),
            "lookat": _numbers(found.lookat),
        }
    return views
