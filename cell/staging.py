"""What is to be seen at a moment, drawn into MuJoCo's scene: shared by pictures and replay.

    staging = Staging(result)
    staging.pose(Frame(q, table, target=12, done=12.0))
    staging.draw(scn)                          # beads laid so far, marks, the target's normal

A staging has its own copy of the model, so that tinting and translucency never reach a check. World frame, metres.
"""

from __future__ import annotations

import copy
from dataclasses import dataclass
from typing import TYPE_CHECKING

import mujoco
import numpy as np

from ik.chain import Floats

from .collision import Ints
from .job import Job
from .place import METRES_PER_MM
from .robot import pose

if TYPE_CHECKING:
    from .check import Result

VISIBLE = np.array([1, 1, 1, 0, 0, 0], dtype=np.uint8)  # geom groups shown; 3 is what collides
FOVY = 34.0  # deg; a long lens keeps the arm's proportions
UNLAID = 0.22  # opacity of what is still to be laid
PIECES = 6000  # bead pieces drawn at most
MARKS = 600  # target marks drawn at most
TWIN = 5e-3  # m: a visual geom this close in size to the geom that collides stands for it
SHADED = 0.4  # m around the torch
ARROW = 0.18  # m; past the torch's bend, or the neck would hide it
RED, GREEN = (0.88, 0.08, 0.06, 1.0), (0.15, 0.65, 0.25, 1.0)
PALE_RED = (0.95, 0.62, 0.58, 1.0)
RAMP = np.array([(0.50, 0.10, 0.10), (0.87, 0.33, 0.09), (0.98, 0.78, 0.28)])  # first layer to last


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
