"""What a composed cell is like before anything is asked of it: for a cell's first run.

    found = look_into_scene(scene, (E1, E2))
    for line in scene_lines(found): ...               # rich renderables

The arm is put at home and into random configurations within its limits; pairs of shapes that touch in all of them are
no collisions but shapes that are modelled too large, or an ``<exclude>`` that is missing.
"""

from __future__ import annotations

import copy
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import mujoco
import numpy as np

from slicing import Code, Warning

from ..scene.absent_shapes import link_of_body
from ..scene.composition import BodyOwner
from .facts import facts_grid

if TYPE_CHECKING:
    from rich.console import RenderableType

    from ..scene.scene import Scene

CONFIGURATIONS = 300
TURN = 2 * np.pi - 1e-9
MOST_PAIRS = 12  # pairs that are named
DIRECT = {int(mujoco.mjtJoint.mjJNT_HINGE): "hinge", int(mujoco.mjtJoint.mjJNT_SLIDE): "slide"}


@dataclass(frozen=True)
class SceneContents:
    """What was found.

    Attributes:
        links: of every link of the models its name, how many of its shapes collide, and how many are to look at only.
        always: pairs of shapes that touch in every configuration.
        at_home: pairs that touch at home, with the distance, mm; those that always touch are not repeated.
        often: share of the random configurations in which nothing touches.
        home_deg: the arm's home; None where none is known.
        turning: joints whose range is a whole turn or more, with the range, deg.
        standing: joints that are not planned, and where they stand, one line each.
        warnings: of the scene.
    """

    links: tuple[tuple[str, int, int], ...]
    always: tuple[tuple[str, str], ...]
    at_home: tuple[tuple[str, str, float], ...]
    often: float
    home_deg: tuple[float, ...] | None
    turning: tuple[tuple[str, float], ...]
    standing: tuple[Warning, ...]
    warnings: tuple[str, ...]


def look_into_scene(scene: Scene, table: tuple[float, float], count: int = CONFIGURATIONS) -> SceneContents:
    """Look a cell over.

    Args:
        scene: the composed cell.
        table: E1 and E2, rad.
        count: random configurations.

    Returns:
        What was found. Nothing is laid yet; distances are those of contacts, so that only what touches is named.
    """
    model = copy.copy(scene.model)
    there = scene.deposit_of_geom < 0
    model.geom_contype[:], model.geom_conaffinity[:] = np.where(there, scene.contact_bits, 0)
    data = mujoco.MjData(model)
    data.qpos[scene.table_qpos] = table
    chain = scene.chain
    q = np.random.default_rng(0).uniform(chain.lower, chain.upper, (count, chain.n))
    at_home = _touching(scene, model, data, scene.home)
    seen = [_touching(scene, model, data, row) for row in q]
    always = set.intersection(*map(set, [at_home, *seen])) if scene.has_home else set.intersection(*map(set, seen))
    free = [not (set(pairs) - always) for pairs in seen]
    names = {(a, b): (scene.geom_name(a), scene.geom_name(b)) for a, b in {*at_home, *always}}
    home_deg = np.rad2deg(scene.home) if scene.has_home else None
    turns = np.rad2deg(chain.upper - chain.lower)
    return SceneContents(
        links=tuple(_links(scene)),
        always=tuple(sorted(names[p] for p in always)),
        at_home=tuple(sorted((*names[p], round(d * 1e3, 2)) for p, d in at_home.items() if p not in always))
        if scene.has_home
        else (),
        often=float(np.mean(free)),
        home_deg=None if home_deg is None else tuple(round(float(v), 3) for v in home_deg),
        turning=tuple(
            (n, round(float(t), 3)) for n, t in zip(chain.names, turns, strict=True) if np.deg2rad(t) >= TURN
        ),
        standing=tuple(line for line in scene.warnings if line.code is Code.JOINT_HELD),
        warnings=scene.warnings,
    )


def _touching(scene: Scene, model: mujoco.MjModel, data: mujoco.MjData, q: np.ndarray) -> dict[tuple[int, int], float]:
    """Pairs of which one is the arm's that touch, with the signed distance, m."""
    data.qpos[scene.arm_qpos] = q
    mujoco.mj_kinematics(model, data)
    mujoco.mj_collision(model, data)
    found: dict[tuple[int, int], float] = {}
    for geoms, distance in zip(data.contact.geom.tolist(), data.contact.dist.tolist(), strict=True):
        pair = (min(geoms), max(geoms))
        if distance <= 0.0 and scene.arm_geom[list(pair)].any():
            found[pair] = min(distance, found.get(pair, np.inf))
    return found


def _links(scene: Scene) -> Iterator[tuple[str, int, int]]:
    model = scene.model
    link = link_of_body(model, (*scene.arm_joints.tolist(), *scene.table_joints.tolist()))[model.geom_bodyid]
    hard = scene.contact_bits.any(axis=0)
    last = int(model.jnt_bodyid[scene.arm_joints[-1]])
    first = {BodyOwner.ROBOT: "robot's base", BodyOwner.POSITIONER: "positioner's base"}
    joints = {BodyOwner.ROBOT: scene.arm_joints, BodyOwner.POSITIONER: scene.table_joints}
    for piece, base in first.items():
        bodies = list(dict.fromkeys(model.jnt_bodyid[joints[piece]].tolist()))
        for body in (0, *bodies):
            mine = (scene.piece_of_geom == piece) & (link == body)
            yield (model.body(body).name if body else base), int((mine & hard).sum()), int((mine & ~hard).sum())
        if piece is BodyOwner.ROBOT:
            mine = (scene.piece_of_geom == BodyOwner.TOOL) & (link == last)
            yield "tool", int((mine & hard).sum()), int((mine & ~hard).sum())


def scene_lines(found: SceneContents) -> Iterator[RenderableType]:
    """What was found, for the terminal.

    Yields:
        rich renderables, one a block.
    """
    from rich.table import Table

    table = Table(box=None, pad_edge=False, header_style="dim")
    table.add_column("link")
    table.add_column("shapes that collide", justify="right")
    table.add_column("visual only", justify="right")
    for name, hard, soft in found.links:
        table.add_row(name, str(hard) if hard else "none", str(soft))
    yield table
    yield facts_grid(_facts(found))


def _facts(found: SceneContents) -> Iterator[tuple[str, str]]:
    for a, b in found.always[:MOST_PAIRS]:
        yield (
            "always touch",
            f"{a} - {b}: add an <exclude> for two links of one model, or make the shapes of a torch that "
            "stands in a link smaller",
        )
    if len(found.always) > MOST_PAIRS:
        yield "always touch", f"and {len(found.always) - MOST_PAIRS} more"
    if not found.always:
        yield "always touch", "no pair"
    for a, b, distance in found.at_home[:MOST_PAIRS]:
        yield "touch at home", f"{a} - {b} {distance:g} mm"
    yield "nothing touches", f"in {100 * found.often:.0f} % of random configurations, apart from the pairs above"
    home = "none: a motion begins and ends at the part; set robot.home_deg, or give the MJCF a key home"
    yield "home", home if found.home_deg is None else ", ".join(f"{v:g}" for v in found.home_deg) + " deg"
    for name, turn in found.turning:
        yield "whole turns", f"{name} has a range of {turn:g} deg: it has the same direction at several angles"
    for held in found.standing:
        yield "not planned", held
    for line in found.warnings:
        if line not in found.standing:
            yield "warning", line
