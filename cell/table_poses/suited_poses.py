"""Poses of the table that suit a group of targets: of those that pass the screening, those nearest to upright.

    for suited in suited_poses(job, group): ...      # suited.pose: E1, E2 in rad; the best first

Checked are poses on a grid of 5 degrees over both axes' ranges, endless axes once round; poses that hold the part
alike with the tilt to the other side, (E1, E2) and (-E1, E2 +- 180), are both among them. They are taken by the
greatest angle off upright, in steps of 5 degrees, then by the room that the arm has at single targets, in steps of 5
mm. What no motion can help excludes a pose, as in a sweep.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from ik.chain import Floats

from ..arrays import Ints
from ..collision.checker import Checker
from ..collision.clearances import CLEARANCE_REACH
from ..job.job import Job
from ..job.table_groups import TableGroup
from ..planning.configurations import nodes_at_rolls
from ..planning.context import settings_of
from ..scene.placement import place_targets
from ..scene.scene import Scene
from .hopeless_poses import screen, targets_far_apart
from .table_turn import Angles

GRID_DEG = 5.0
BAND_DEG = 5.0  # steps in which angles off upright count as alike
ROOM = 5e-3  # m: steps in which clearances count as alike
APART = np.deg2rad(14.0)  # poses nearer to one another than this are not both checked
MOST_SCREENED = 40
SURVIVORS = 5  # poses that pass the screening are enough
ROOM_TARGETS = 8  # targets whose room is checked
CHEAP = 6  # configurations of each
ABSENT = np.iinfo(np.int64).max // 2  # number of a deposit that is never there


@dataclass(frozen=True)
class SuitedPose:
    """A pose that passed the screening.

    Attributes:
        band: step of the greatest angle off upright.
        room: step of the arm's room at single targets.
        pose: E1, E2, rad.
    """

    band: int
    room: int
    pose: Angles


@dataclass(frozen=True, eq=False)
class Uprightness:
    """How far off upright a group's targets are laid at any pose of the table.

    Attributes:
        scene: the cell.
        normal: deposition directions, part frame, (t, 3).
    """

    scene: Scene
    normal: Floats

    @cached_property
    def _axes(self) -> tuple[Floats, Floats]:
        """Axes of E1 and E2 with both at 0, world, (2, 3), and the directions there, (t, 3)."""
        model = self.scene.model
        data = mujoco.MjData(model)
        data.qpos[self.scene.table_qpos] = 0.0
        mujoco.mj_kinematics(model, data)
        R = data.site_xmat[self.scene.sites["part"]].reshape(3, 3)
        return data.xaxis[self.scene.table_joints].copy(), self.normal @ R.T

    def angles(self, poses: Floats) -> Floats:
        """Angles off upright of all targets at poses (p, 2), rad: (p, t), rad."""
        axes, n = self._axes
        tilt = Rotation.from_rotvec(poses[:, :1] * axes[0]).as_matrix()
        turn = Rotation.from_rotvec(poses[:, 1:] * axes[1]).as_matrix()
        up = np.einsum("pj,pjk,tk->pt", tilt[:, 2], turn, n)
        return np.asarray(np.arccos(np.clip(up, -1.0, 1.0)))


def pose_grid(scene: Scene) -> Floats:
    """Poses over both axes' ranges, (p, 2), rad; an axis that is not there stands at 0."""
    step = np.deg2rad(GRID_DEG)
    values = []
    for (low, high), there in zip(scene.table_range, scene.has_axis, strict=True):
        if not there:
            values.append(np.zeros(1))
        elif not np.isfinite([low, high]).all():
            values.append(np.arange(-np.pi, np.pi - step / 2, step))
        else:
            values.append(np.arange(np.ceil(low / step - 1e-9), np.floor(high / step + 1e-9) + 1) * step)
    grid = np.meshgrid(*values, indexing="ij")
    return np.column_stack([axis.ravel() for axis in grid])


def with_targets_of(job: Job, group: TableGroup) -> Job:
    """The job with a group's targets alone; deposits are numbered as usual."""
    t, mine = job.targets, slice(group.first, group.stop)
    names = ("sub_volume_index", "layer", "bead", "position", "normal", "tangent", "thickness_mm", "speed_mm_s")
    return replace(job, targets=replace(t, **{name: getattr(t, name)[mine] for name in names}))


def upright_poses(job: Job, group: TableGroup) -> tuple[Floats, Ints]:
    """All poses of the grid, the most upright first.

    Args:
        job: from ``cell.job.job.prepare``.
        group: whose targets.

    Returns:
        E1, E2, (p, 2), rad; and the step of the greatest angle off upright of each, (p,).
    """
    grid = pose_grid(job.scene)
    off = Uprightness(job.scene, job.targets.normal[group.first : group.stop]).angles(grid)
    band = np.round(np.rad2deg(off.max(axis=1)) / BAND_DEG).astype(np.int64)
    tilt = np.abs(grid).sum(axis=1)
    order = np.lexsort((np.round(tilt, 6), np.round(off.mean(axis=1), 6), np.round(off.max(axis=1), 6)))
    return grid[order], band[order]


def alone(job: Job, group: TableGroup) -> Job:
    """The job with a group's targets alone, and nothing of other sub-volumes there."""
    own = with_targets_of(job, group)
    number = np.concatenate(job.deposits)
    names = np.repeat(np.array(job.targets.sub_volume), job.layers)
    others = number[names != group.sub_volume]
    absent = np.isin(job.scene.deposit_of_geom, others)
    deposit = np.where(absent, ABSENT, job.scene.deposit_of_geom)
    return replace(own, scene=replace(job.scene, deposit_of_geom=deposit))


def suited_poses(job: Job, group: TableGroup) -> list[SuitedPose]:
    """Poses for a group that pass the screening as long as no other sub-volume is there, the best first.

    Args:
        job: from ``cell.job.job.prepare``.
        group: whose targets.

    Returns:
        The poses; none where everything checked is excluded.
    """
    own = alone(job, group)
    poses, band = upright_poses(job, group)
    taken: list[Angles] = []
    found: list[SuitedPose] = []
    for p, how in zip(poses.tolist(), band.tolist(), strict=True):
        pose = (float(p[0]), float(p[1]))
        if any(max(abs(pose[0] - a), abs(pose[1] - b)) < APART for a, b in taken):
            continue
        if len(taken) == MOST_SCREENED or len(found) == SURVIVORS:
            break
        taken.append(pose)
        E1_deg, E2_deg = np.rad2deg(pose).tolist()
        if screen(own, E1_deg, E2_deg, int(own.laid.max())) is None:
            found.append(SuitedPose(how, round(_room(own, pose) / ROOM), pose))
    return sorted(found, key=lambda one: (one.band, -one.room))


def upright_band(job: Job, group: TableGroup, pose: Angles) -> int:
    """The step of the greatest angle off upright that a group is laid at in a pose."""
    off = Uprightness(job.scene, job.targets.normal[group.first : group.stop]).angles(np.array([pose]))
    return int(np.round(np.rad2deg(off.max()) / BAND_DEG))


def serves(job: Job, group: TableGroup, pose: Angles) -> bool:
    """Whether a pose suits a group, with everything there that is built before it."""
    own = with_targets_of(job, group)
    E1_deg, E2_deg = np.rad2deg(pose).tolist()
    return screen(own, E1_deg, E2_deg, int(own.laid.max())) is None


def _room(job: Job, pose: Angles) -> float:
    """The least clearance of a few targets far from one another, each in the best of its cheap configurations, m."""
    some = targets_far_apart(job.targets.position, job.targets.normal, ROOM_TARGETS)
    placed = place_targets(job.targets, job.scene.T_base_part(*pose)).rows(some)
    nodes = nodes_at_rolls(job.solver, placed, job.window, settings_of(job).roll_step, job.singularity_limits)
    checker = Checker(job.scene, pose, CLEARANCE_REACH)
    least = CLEARANCE_REACH
    for k, i in enumerate(some.tolist()):
        cost = nodes.cost[k]
        allowed = np.isfinite(cost)
        q = nodes.q[k][allowed][np.argsort(cost[allowed], kind="stable")][:CHEAP]
        if not len(q):
            return 0.0
        found = checker.clearances(q, np.full(len(q), job.deposits_before[i]))
        least = min(least, float(np.minimum(found.distance, CLEARANCE_REACH).max()))
    return least
