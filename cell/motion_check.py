"""A motion from outside against the cell: everything that ``rbam check`` asks of its own.

    found = check_motion(job, read_motion("blade.csv", job))
    found.feasible, found.findings[0].reason, found.findings[0].detail

Between its rows all axes, E1 and E2 among them, move on straight lines. The part grows as the rows say. Findings are
data: stretches of rows with a reason and the worst measure on them. Radians, metres, seconds.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from ik.chain import Floats
from ik.singularity import KINDS, margins, sides, smallest_singular_value

from .between import radii, unproved
from .check import CLEARANCE_REACH
from .collision import Checker, Clearances, Ints
from .job import Job
from .motion import STANDING, Motion
from .motion_bead import COARSE, FINE, OnBead, Way, against_beads, dense, rows_of
from .motion_file import ReadMotion
from .motion_order import Finding, order_findings
from .pace import Pace
from .place import METRES_PER_MM
from .scene import Scene
from .timing import TRAVEL_ZONE, rounded

SLACK = 1e-7  # rad: angles come from files with six decimals
SPEED_SLACK = 1.001
ACCELERATION_SLACK = 1.02
WINDOW = 0.05  # s to either side over which accelerations are measured: files have few decimals
ROLL_SLACK = np.deg2rad(0.05)
UNITS = {"wrist": (180 / np.pi, "deg"), "elbow": (180 / np.pi, "deg"), "shoulder": (1e3, "mm"), "sigma": (1.0, "1")}


@dataclass(frozen=True, eq=False)
class MotionResult:
    """What was found of a motion.

    Attributes:
        job: what it was held against.
        read: the motion and what was repaired in it.
        findings: what is wrong, in the order of the rows.
        welded: targets that are welded.
        samples: configurations looked at.
        clearance: least clearance, m, with the row and the geoms; None where nothing is nearer than 50 mm.
        singularity: the margin that is smallest against its limit, with its kind and row; None without an arc.
        sigma: smallest singular value while welding.
        off: greatest distance from the bead, m, and the row.
        askew: greatest angle of the wire off its direction, rad, and the row.
        use: greatest share of its speed, and of its acceleration, that any axis needs, (2, j + 2).
        pace: how far the deposition speed is held.
    """

    job: Job
    read: ReadMotion
    findings: tuple[Finding, ...]
    welded: int
    samples: int
    clearance: tuple[float, int, tuple[str, ...]] | None
    singularity: tuple[float, int, str] | None
    sigma: float | None
    off: tuple[float, int]
    askew: tuple[float, int]
    use: Floats
    pace: Pace

    @property
    def feasible(self) -> bool:
        """Whether nothing was found."""
        return not self.findings


def check_motion(job: Job, read: ReadMotion) -> MotionResult:
    """Hold a motion against the cell.

    Args:
        job: from ``cell.job.prepare``.
        read: from ``cell.motion_file.read_motion``.

    Returns:
        What was found.
    """
    motion = read.motion
    rows = rows_of(job, motion)
    use = np.stack([_speed_use(job, motion), _acceleration_use(job, motion, rows)])
    fine = dense(job, motion, rows, FINE, motion.welding)
    on = against_beads(job, fine, motion.target[fine.row])
    margin = margins(job.scene.chain, job.solver.geometry, fine.q[:, : job.scene.chain.n])
    coarse = dense(job, motion, rows, COARSE, np.ones(len(motion.t_s) - 1, dtype=bool))
    stage = _stage(job, motion, coarse.row)
    clear, hits = _collisions(job, coarse, stage)
    order = order_findings(job, motion, against_beads(job, rows, motion.target).progress)
    findings = [
        *_limit_findings(job, motion, rows.q),
        *_drive_findings(job, use),
        *_bead_findings(job, fine, on),
        *_singular_findings(job, fine, margin),
        *hits,
        *order.findings,
        *_gravity_findings(job, fine, on),
    ]
    findings.sort(key=lambda f: (f.row, f.reason))
    return MotionResult(
        job=job,
        read=read,
        findings=tuple(replace(f, row=int(read.row[f.row]), to_row=int(read.row[f.to_row])) for f in findings),
        welded=order.welded,
        samples=len(fine.q) + len(coarse.q),
        clearance=_nearest(job, read, coarse, clear),
        singularity=_least_margin(job, read, fine, margin),
        sigma=_least_sigma(job, fine),
        off=_most(on.off, fine, read),
        askew=_most(on.askew, fine, read),
        use=np.nanmax(use, axis=1),
        pace=order.pace,
    )


def _most(values: Floats, way: Way, read: ReadMotion) -> tuple[float, int]:
    k = int(np.argmax(values))
    return float(values[k]), int(read.row[way.row[k]])


def stretches_of(bad: NDArray[np.bool_], row: Ints, measure: Floats) -> list[tuple[int, int, int]]:
    """Stretches of samples that are bad, as first row, last row and the worst sample.

    Args:
        bad: (m,).
        row: of each sample, ascending, (m,).
        measure: greater is worse, (m,).

    Returns:
        One a stretch.
    """
    index = np.flatnonzero(bad)
    if not len(index):
        return []
    groups = np.split(index, np.flatnonzero((np.diff(index) > 1) & (np.diff(row[index]) > 1)) + 1)
    return [(int(row[g[0]]), int(row[g[-1]]), int(g[np.argmax(measure[g])])) for g in groups]


def _deg(angle: float, digits: int = 3) -> float:
    return round(float(np.rad2deg(angle)), digits)


def _limit_findings(job: Job, motion: Motion, q: Floats) -> list[Finding]:
    chain, table = job.scene.chain, job.scene.table_range
    lower, upper = np.concatenate([chain.lower, table[:, 0]]), np.concatenate([chain.upper, table[:, 1]])
    over = np.maximum(lower - q, q - upper)
    row = np.arange(len(q))
    return [
        Finding("joint_limit", a, b, {"axis": name, "over_deg": _deg(over[k, j])})
        for j, name in enumerate(job.drives.names)
        for a, b, k in stretches_of(over[:, j] > SLACK, row, over[:, j])
    ]


def _axes(motion: Motion) -> Floats:
    return np.concatenate([motion.q, motion.table], axis=1)


def _speed_use(job: Job, motion: Motion) -> Floats:
    """Share of its speed that each axis needs from row to row, (m, j + 2)."""
    speed = np.abs(np.diff(_axes(motion), axis=0)) / np.diff(motion.t_s)[:, None] / job.drives.speed
    return np.concatenate([speed, np.zeros((1, speed.shape[1]))])


def _acceleration_use(job: Job, motion: Motion, rows: Way) -> Floats:
    """Share of its acceleration that each axis needs about each row, (m, j + 2).

    Of the motion with its corners rounded; a second difference over ``WINDOW`` or more is a mean of the accelerations
    in it.
    """
    q, t = _rounded(job, motion, rows), motion.t_s
    i = np.arange(1, len(t) - 1)
    a = np.clip(np.searchsorted(t, t[i] - WINDOW, side="right") - 1, 0, i - 1)
    b = np.clip(np.searchsorted(t, t[i] + WINDOW), i + 1, len(t) - 1)
    ahead = (q[b] - q[i]) / (t[b] - t[i])[:, None]
    behind = (q[i] - q[a]) / (t[i] - t[a])[:, None]
    out = np.zeros_like(q)
    out[1:-1] = np.abs(ahead - behind) / ((t[b] - t[a]) / 2)[:, None] / job.drives.acceleration
    return out


def _rounded(job: Job, motion: Motion, rows: Way) -> Floats:
    """All axes with corners rounded as a controller does; not where the arc goes on or off, nor where all stand."""
    q = _axes(motion).copy()
    away = np.linalg.norm(np.diff(rows.Ts_part_tcp[:, :3, 3], axis=0), axis=1)
    turn = np.linalg.norm(np.diff(q, axis=0), axis=1)
    way = np.where(motion.welding, away, turn)
    zones = {True: job.case.process.blend_mm * METRES_PER_MM, False: TRAVEL_ZONE}
    kind = np.where(way <= STANDING, -1, motion.welding)
    starts = np.flatnonzero(np.diff(kind, prepend=-2))
    for a, b in zip(starts, [*starts[1:], len(kind)], strict=True):
        if kind[a] >= 0 and b - a > 1:
            s = np.concatenate([[0.0], np.cumsum(way[a:b])])
            q[a : b + 1] = rounded(q[a : b + 1], s, zones[bool(kind[a])])
    return q


def _drive_findings(job: Job, use: Floats) -> list[Finding]:
    """Axes that would have to be faster than they are."""
    drives, row = job.drives, np.arange(use.shape[1])
    found = []
    for kind, limit, slack, unit in (
        ("speed", drives.speed, SPEED_SLACK, "deg_s"),
        ("acceleration", drives.acceleration, ACCELERATION_SLACK, "deg_s2"),
    ):
        share = use[0 if kind == "speed" else 1]
        for j, name in enumerate(drives.names):
            for a, b, k in stretches_of(share[:, j] > slack, row, share[:, j]):
                most = float(limit[j])
                measure = {f"needed_{unit}": _deg(share[k, j] * most), f"limit_{unit}": _deg(most)}
                found.append(Finding("speed", a, b, {"axis": name, "by": kind, **measure}))
    return found


def _bead_findings(job: Job, way: Way, on: OnBead) -> list[Finding]:
    """Rows and what lies between them that are not on the bead."""
    checks, window = job.case.checks, job.window
    found = []
    for name, values, limit, unit in (
        ("off_mm", on.off / METRES_PER_MM, checks.off_bead_mm, "mm"),
        ("off_wire_deg", np.rad2deg(on.askew), checks.off_wire_deg, "deg"),
        ("roll_outside_deg", np.rad2deg(np.abs(window.excess(on.roll))), np.rad2deg(ROLL_SLACK), "deg"),
    ):
        for a, b, k in stretches_of(values > limit * (1 + 1e-9) + 1e-6, way.row, values):
            measure = {name: round(float(values[k]), 4), "limit": round(float(limit), 4), "unit": unit}
            found.append(Finding("off_bead", a, b, measure))
    return found


def _singular_findings(job: Job, way: Way, margin: Floats) -> list[Finding]:
    """Margins that are too small while welding, and configurations that change inside a bead."""
    geometry = job.solver.geometry
    least = job.singularity_limits.values(geometry is not None)
    found = []
    for j, kind in enumerate(KINDS):
        factor, unit = UNITS[kind]
        if not np.isfinite(least[j]):
            continue
        for a, b, k in stretches_of(margin[:, j] < least[j] - SLACK, way.row, -margin[:, j]):
            measure = {"singularity": kind, "margin": round(float(margin[k, j]) * factor, 3)}
            found.append(
                Finding("singular", a, b, {**measure, "limit": round(float(least[j]) * factor, 3), "unit": unit})
            )
    q = way.q[:, : job.scene.chain.n]
    together = np.diff(way.row) <= 1
    if geometry is not None:
        side = sides(geometry, q)
        for at in np.flatnonzero((side[1:] != side[:-1]).any(axis=1) & together).tolist():
            crossed = KINDS[int(np.argmax(side[at + 1] != side[at]))]
            what = {"on_the_way": "configuration change", "singularity": crossed}
            found.append(Finding("no_path", int(way.row[at]), int(way.row[at + 1]), what))
    return found


def _stage(job: Job, motion: Motion, row: Ints) -> Ints:
    """Deposits there are at samples after each row: what the rows say has been laid by then."""
    welding = motion.arc == 1
    done = np.maximum.accumulate(np.where(welding, job.laid[motion.target], 0))
    at_row = np.where(welding, job.stage[motion.target], done)
    after = np.minimum(row + 1, len(at_row) - 1)
    inside = motion.welding[np.minimum(row, len(motion.welding) - 1)]
    return np.where(inside, at_row[row], np.maximum(at_row[row], at_row[after]))


def _collisions(job: Job, way: Way, stage: Ints) -> tuple[Clearances, list[Finding]]:
    """Clearances at samples, and where they are too small or what lies between is not proved free."""
    scene = job.scene
    least = job.case.checks.clearance_mm * METRES_PER_MM
    table = (float(way.q[0, -2]), float(way.q[0, -1]))
    # the table's axes are moved like the arm's
    eight = replace(scene, arm_qpos=np.concatenate([scene.arm_qpos, scene.table_qpos]))
    checker = Checker(eight, table, max(CLEARANCE_REACH, 2 * least))
    clear = checker.clearances(way.q, stage)
    found = [
        Finding("collision", a, b, _hit(scene, clear, k, least))
        for a, b, k in stretches_of(clear.distance < least, way.row, -clear.distance)
    ]
    radius = np.concatenate([radii(scene), table_radii(scene)])
    step, nearest = unproved(checker, radius, way.q, stage, clear)
    for n, at in enumerate(step.tolist()):
        if clear.distance[at] >= least and clear.distance[at + 1] >= least:
            between = {"between_rows": True, **_hit(scene, nearest, n, least)}
            found.append(Finding("collision", int(way.row[at]), int(way.row[at + 1]), between))
    return clear, found


def _hit(scene: Scene, clear: Clearances, k: int, least: float) -> dict[str, Any]:
    return {
        "pair": [scene.geom_name(int(g)) for g in clear.pair[k] if g >= 0],
        "distance_mm": round(float(clear.distance[k]) / METRES_PER_MM, 3) if np.isfinite(clear.distance[k]) else None,
        "required_mm": round(least / METRES_PER_MM, 3),
    }


def table_radii(scene: Scene) -> Floats:
    """How far anything on the table can be from E1 and from E2, (2,), m; see ``cell.between.radii``."""
    model = scene.model
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    joint = [model.joint(name).id for name in scene.case.positioner.joints]
    body = [int(model.jnt_bodyid[j]) for j in joint]
    out = np.zeros(2)
    for g in np.flatnonzero(scene.contact_bits.any(axis=0)):
        b = int(model.geom_bodyid[g])
        while b not in (0, *body):
            b = int(model.body_parentid[b])
        if b in body:
            axis = body.index(b)
            reach = float(np.linalg.norm(data.geom_xpos[g] - data.xanchor[joint[axis]]) + model.geom_rbound[g])
            out[axis] = max(out[axis], reach)
    apart = float(np.linalg.norm(data.xanchor[joint[1]] - data.xanchor[joint[0]]))
    out[0] = max(out[0], apart + out[1])
    return out


def _gravity_findings(job: Job, way: Way, on: OnBead) -> list[Finding]:
    steepest = job.case.checks.gravity_max_deg
    if steepest is None:
        return []
    normal = (job.scene.T_world_base()[:3, :3] @ way.T_base_part[:, :3, :3] @ on.normal[:, :, None])[:, :, 0]
    angle = np.rad2deg(np.arccos(np.clip(normal[:, 2], -1.0, 1.0)))
    return [
        Finding("gravity", a, b, {"angle_deg": round(float(angle[k]), 3), "limit_deg": steepest})
        for a, b, k in stretches_of(angle > steepest + 1e-6, way.row, angle)
    ]


def _nearest(job: Job, read: ReadMotion, way: Way, clear: Clearances) -> tuple[float, int, tuple[str, ...]] | None:
    k = int(np.argmin(clear.distance))
    if not np.isfinite(clear.distance[k]):
        return None
    pair = tuple(job.scene.geom_name(int(g)) for g in clear.pair[k])
    return float(clear.distance[k]), int(read.row[way.row[k]]), pair


def _least_margin(job: Job, read: ReadMotion, way: Way, margin: Floats) -> tuple[float, int, str] | None:
    limits = job.singularity_limits.values(job.solver.geometry is not None)
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(limits > 0, margin / limits, np.inf)
    k, kind = np.unravel_index(int(np.argmin(share)), share.shape)
    if not np.isfinite(share[k, kind]):
        return None
    return float(margin[k, kind]), int(read.row[way.row[k]]), KINDS[kind]


def _least_sigma(job: Job, way: Way) -> float:
    rows = np.flatnonzero(np.diff(way.row, prepend=-1))
    return float(smallest_singular_value(job.scene.chain, way.q[rows, : job.scene.chain.n]).min())
