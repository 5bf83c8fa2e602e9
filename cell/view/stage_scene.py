"""What is to be seen at a moment, drawn into MuJoCo's scene: shared by pictures and replay.

    staged = StagedScene(result)
    frame = Frame(q, table, target=12, done=12.0)
    staged.pose(frame)
    staged.draw(scn, frame)                   # beads laid so far, marks, the target's normal

It has its own copy of the model, so that tinting and translucency never reach a check. World frame, metres.
"""

from __future__ import annotations

import copy
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import mujoco
import numpy as np

from ik.chain import Floats

from ..arrays import Ints
from ..job.job import Job
from ..rigid import pose
from ..units import METRES_PER_MM
from .colours import GREEN, GREY, PALE_RED, RED, Colouring, layer_colours, target_colours

if TYPE_CHECKING:
    from ..verdict.result import Result

VISIBLE = np.array([1, 1, 1, 0, 0, 0], dtype=np.uint8)  # geom groups shown; 3 is what collides
FOVY = 34.0  # deg; a long lens keeps the arm's proportions
UNLAID = 0.22  # opacity of what is still to be laid
PIECES = 6000  # bead pieces drawn at most
MARKS = 600  # target marks drawn at most
SAME_SIZE = 5e-3  # m: a visual geom this close in size to the geom that collides stands for it
FLOOR, MARGIN = 12.0, 4.0  # m: half the floor's side at least, and what it extends beyond the cell
SHADED = 1.2  # m around the torch
HAZE = (0.88, 0.905, 0.93, 1.0)  # the sky's colour where the floor ends
FARTHEST_CAMERA = 3.5  # a camera that has all of a cell in view is at most this many times the cell's size away
ARROW = 0.18  # m; past the torch's bend, or the neck would hide it
NORMALS = 14.0  # length of a normal in bead radii
BLUE = (0.1, 0.3, 0.75, 1.0)


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
        normals: whether those of all targets are.
    """

    q: Floats
    table: Floats
    target: int
    done: float
    laying: bool = False
    pair: tuple[str, ...] = ()
    marks: bool = False
    arrow: bool = False
    normals: bool = False


@dataclass(frozen=True, eq=False)
class DrawnBeads:
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


def beads_of(job: Job, most: int = PIECES) -> DrawnBeads:
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
    first = np.flatnonzero(np.diff(t.bead, prepend=-1))
    stride = max(1, -(-len(t) // most))
    knots = [
        np.unique(np.append(np.arange(a, b, stride), b - 1)) for a, b in zip(first, [*first[1:], len(t)], strict=True)
    ]
    target = np.concatenate([np.stack([k[:-1], k[1:]], axis=1) for k in knots])
    if len(target) > most:
        target = target[np.unique(np.linspace(0, len(target) - 1, most).astype(np.int64))]
    return DrawnBeads(target, middle[target], radius[target].mean(axis=1), layer_colours(job)[target[:, 0]])


class StagedScene:
    """A scene made ready to be looked at: its own copy of the model, and what is drawn on top of it."""

    def __init__(self, result: Result, pieces: int = PIECES) -> None:
        """Prepare.

        Args:
            result: what is to be shown.
            pieces: how many pieces of beads are drawn at most.
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
        self._light_the_floor()
        self.beads = beads_of(result.job, pieces)
        self._names: dict[str, list[int]] = {}
        for geom in np.flatnonzero(self.scene.contact_bits.any(axis=0)).tolist():
            self._names.setdefault(self.scene.geom_name(geom), []).append(geom)
        self._looks = self.model.geom_rgba.copy(), self.model.geom_group.copy()
        self._tinted: tuple[str, ...] = ()

    def _light_the_floor(self) -> None:
        """Have the whole floor inside the shadow map, whose border would show as specks, and its edge in haze."""
        m, centre = self.model, self.model.stat.center
        mujoco.mj_kinematics(m, self.data)
        planes = m.geom_type == mujoco.mjtGeom.mjGEOM_PLANE
        away = np.linalg.norm(self.data.geom_xpos[~planes, :2] - centre[:2], axis=1) + m.geom_rbound[~planes]
        half = max(FLOOR, float(away.max(initial=0.0)) + MARGIN)
        for geom in np.flatnonzero(planes & (m.geom_bodyid == 0)):
            m.geom_size[geom, :2] = half
            m.geom_sameframe[geom] = mujoco.mjtSameFrame.mjSAMEFRAME_NONE  # else its place is not read
            m.geom_pos[geom, :2] = centre[:2]
        m.vis.map.shadowclip = 1.5 * half / m.stat.extent
        # the floor's edge would look like a tilted horizon; nothing of the cell itself is to be in the haze
        start = max(0.65 * half, FARTHEST_CAMERA * float(away.max(initial=0.0)))
        m.vis.map.fogstart, m.vis.map.fogend = start / m.stat.extent, 1.5 * start / m.stat.extent
        m.vis.rgba.fog[:] = HAZE
        directional = m.light_type == mujoco.mjtLightType.mjLIGHT_DIRECTIONAL
        # seen along the light, the map is centred where the light stands
        m.light_pos[directional] = np.append(centre[:2], 0.0) - m.light_dir[directional] * 2 * half

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
        for geom in (geom for name in frame.pair for geom in self._names.get(name, ())):
            self._tint(geom)
        return True

    def colour(self, by: Colouring) -> str:
        """Colour the beads; what is in a scene already keeps its colours.

        Args:
            by: what their colours mean.

        Returns:
            The same in a few words.
        """
        rgba, legend = target_colours(self.result, by)
        self.beads = replace(self.beads, rgba=rgba[self.beads.target[:, 0]])
        return legend

    def _tint(self, geom: int) -> None:
        m = self.model
        if m.geom_type[geom] == mujoco.mjtGeom.mjGEOM_PLANE:
            m.geom_rgba[geom] = PALE_RED  # it fills the picture
            return
        # what is seen in its place is coloured: two faces in one place would flicker
        mates = (m.geom_bodyid == m.geom_bodyid[geom]) & (VISIBLE[self._looks[1]] == 1)
        away = np.linalg.norm(m.geom_pos - m.geom_pos[geom], axis=1)
        size = np.abs(m.geom_aabb[:, 3:] - m.geom_aabb[geom, 3:]).max(axis=1)
        seen = mates & (away + size < SAME_SIZE)
        if not seen.any() and self.scene.arm_geom[geom]:
            seen = mates & (away < 0.7 * np.maximum(m.geom_rbound, m.geom_rbound[geom]))
        m.geom_rgba[seen if seen.any() else geom] = RED
        m.geom_group[geom] = self._looks[1][geom] if seen.any() else 2

    def shade_closely(self) -> None:
        """Spend the whole shadow map on what is near the torch, or its shadows would be ragged there.

        A renderer takes the map's extent when it is made, the light's place at every frame.
        """
        self.model.vis.map.shadowclip = SHADED / self.model.stat.extent
        directional = self.model.light_type == mujoco.mjtLightType.mjLIGHT_DIRECTIONAL
        self.data.light_xpos[directional] = self.tcp()[0] - self.data.light_xdir[directional] * 3 * SHADED

    def T_world_part(self) -> Floats:
        """Pose of the part as the table stands, (4, 4), m."""
        site = self.scene.sites["part"]
        return pose(self.data.site_xpos[site], self.data.site_xmat[site])

    def tcp(self) -> tuple[Floats, Floats]:
        """Where the wire ends and where it points, (3,) each, world, m."""
        site = self.scene.sites["tcp"]
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
        if frame.marks or frame.arrow or frame.normals:
            self._draw_targets(scn, frame)
        return count

    def _draw_targets(self, scn: mujoco.MjvScene, frame: Frame) -> None:
        position, normal = self.targets()
        bad = np.array([row.failure is not None for row in self.result.rows])
        seen = np.array([row.looked_at for row in self.result.rows])
        radius = self.result.job.targets.thickness_mm * METRES_PER_MM / 2
        if frame.arrow:
            i = frame.target
            tip = position[i] + normal[i] * ARROW
            colour = RED if bad[i] else BLUE if seen[i] else GREY
            there = self.result.rows[i].q is not None or self.result.rows[i].attempt is not None
            width = radius[i] * (0.6 if there else 2.0)  # thinner than the wire that it runs in
            _rod(scn, mujoco.mjtGeom.mjGEOM_ARROW, width, position[i], tip, np.array(colour))
        if not (frame.marks or frame.normals):
            return
        # infeasible ones first: they are what is looked for
        order = np.concatenate([np.flatnonzero(bad), np.flatnonzero(~bad)])
        if len(order) > MARKS:
            order = order[np.unique(np.linspace(0, len(order) - 1, MARKS).astype(np.int64))]
        for i in order:
            if frame.marks:
                state = RED if bad[i] else GREEN if seen[i] else GREY
                middle = position[i] + normal[i] * radius[i]
                _ball(scn, radius[i] * (1.9 if i == frame.target else 1.3), middle, state)
            if frame.normals:
                tip, colour = position[i] + normal[i] * NORMALS * radius[i], RED if bad[i] else BLUE
                _rod(scn, mujoco.mjtGeom.mjGEOM_ARROW, radius[i] * 0.35, position[i], tip, np.array(colour))


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
