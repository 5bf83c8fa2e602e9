"""A motion from outside against the cell: everything that ``rbam check`` asks of its own.

    found = check_motion(job, read_motion("blade.csv", job))    # or check_motion(job, result.motion)
    found.feasible, found.findings[0].reason, found.findings[0].failure

Between its rows all axes, E1 and E2 among them, move on straight lines. The part grows as the rows say. Findings are
data: stretches of rows with a reason and the worst measure on them. Radians, metres, seconds.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ik.chain import Floats
from ik.singularity import KINDS, margins, sides, smallest_singular_value

from ..case.sections import Checks
from ..collision.clearances import Clearances
from ..failure import IN_ROWS, Failure, Kind
from ..job.job import Job
from ..job.overhang_check import past_horizontal, unsupported_targets
from ..job.table_winding import upright_of
from ..motion.deposition_speed import HeldSpeed
from ..motion.given_motion import given
from ..motion.motion import Motion
from ..motion.motion_file import ReadMotion
from ..units import MARGIN_UNITS, METRES_PER_MM
from .arm_clearances import arm_along_motion, nearest_along_motion
from .bead_order import Finding, order_findings, skips
from .bead_samples import COARSE, FINE, OnBead, SampledMotion, against_beads, dense, rows_of
from .blended_motion import blend_collisions, sampled_runs, table_blend_collisions
from .collisions import collisions, stretches_of, table_collisions
from .drive_use import acceleration_use, degrees, drive_findings, speed_use
from .laid_deposits import LaidDeposits

SLACK = 1e-7  # rad: angles come from files with six decimals
ROLL_SLACK = np.deg2rad(0.05)


@dataclass(frozen=True, eq=False)
class MotionResult:
    """Result of the check of a motion.

    Attributes:
        job: the job that it was checked against.
        read: the motion and what was repaired in it.
        findings: what is wrong, in the order of the rows.
        welded: which targets are welded.
        samples: number of configurations checked.
        clearance: least clearance, m, with the row and the geoms; None where nothing is nearer than 50 mm.
        singularity: the margin that is smallest relative to its limit, with its kind and row; None without an arc.
        sigma: smallest singular value while welding.
        bead_distance: greatest distance from the bead's nearest place, m, and the row.
        wire_angle: greatest angle of the wire off its direction at the place that fits best, rad, and the row.
        use: greatest share of its speed, and of its acceleration, that any axis needs, (2, j + 2).
        held_speed: how well the deposition speed is held.
        warnings: one line each, the job's first.
    """

    job: Job
    read: ReadMotion
    findings: tuple[Finding, ...]
    welded: int
    samples: int
    clearance: tuple[float, int, tuple[str, ...]] | None
    singularity: tuple[float, int, str] | None
    sigma: float | None
    bead_distance: tuple[float, int]
    wire_angle: tuple[float, int]
    use: Floats
    held_speed: HeldSpeed
    warnings: tuple[str, ...] = ()

    def __repr__(self) -> str:
        verdict = "feasible" if self.feasible else "infeasible"
        rows = len(self.read.motion.t_s)
        return f"<MotionResult {self.job.case.title!r}: {verdict}, {rows} rows, {len(self.findings)} findings>"

    @property
    def feasible(self) -> bool:
        """Whether nothing was found."""
        return not self.findings


def check_motion(job: Job, motion: Motion | ReadMotion) -> MotionResult:
    """Check a motion in the cell, as ``rbam check --motion-in`` does.

    Args:
        job: from ``cell.prepare``, or the job of a result. Where its table indexes or moves along and the case gives no
            poses, the order of its layers is the motion's.
        motion: from ``cell.read_motion``, of a result, or of arrays.

    Returns:
        What was found; its job has the layers in the motion's order.

    Raises:
        InputError: there is no motion (None, of an infeasible result), or one of arrays is none: values are not finite,
            rows are out of order or too far apart, or a bead or target does not exist; one line.
    """
    job, read = given(job, motion)
    return _judged(job, read)


def _judged(job: Job, read: ReadMotion) -> MotionResult:
    """What is found in a motion, of a job with its layers in its order."""
    if not len(job.targets):
        return _check_in_the_cell(job, read)
    motion = read.motion
    rows = rows_of(job, motion)
    use = np.stack([speed_use(job, motion), acceleration_use(job, read, rows)])
    fine = dense(job, motion, rows, FINE, motion.welding)
    on = against_beads(job, fine, motion.target[fine.row])
    margin = margins(job.scene.chain, job.solver.geometry, fine.q[:, : job.scene.chain.n])
    coarse = dense(job, motion, rows, COARSE, np.ones(len(motion.t_s) - 1, dtype=bool))
    hits, clearance = _in_the_way(job, read, rows, coarse)
    order = order_findings(job, motion, against_beads(job, rows, motion.target).progress)
    findings = [
        *_limit_findings(job, motion, rows.q),
        *drive_findings(job, use),
        *_bead_findings(job, fine, on),
        *_singular_findings(job, fine, margin),
        *hits,
        *order.findings,
        *skips(fine, on, motion.bead[fine.row]),
        *_gravity_findings(job, fine, on),
        *_hanging_findings(job, motion),
    ]
    findings.sort(key=lambda f: (f.row, f.reason))
    return MotionResult(
        job=job,
        read=read,
        findings=tuple(replace(f, row=int(read.row[f.row]), to_row=int(read.row[f.to_row])) for f in findings),
        welded=order.welded,
        samples=len(fine.q) + len(coarse.q),
        clearance=clearance,
        singularity=_least_margin(job, read, fine, margin),
        sigma=_least_sigma(job, fine),
        bead_distance=_most(on.bead_distance, fine, read),
        wire_angle=_most(on.wire_angle, fine, read),
        use=np.nanmax(use, axis=1),
        held_speed=order.held_speed,
        warnings=(*job.warnings, *_past_horizontal(job, motion, rows)),
    )


def _check_in_the_cell(job: Job, read: ReadMotion) -> MotionResult:
    """Hold a motion against a cell without a part: everything but what asks for beads."""
    motion = read.motion
    rows = rows_of(job, motion)
    use = np.stack([speed_use(job, motion), acceleration_use(job, read, rows)])
    fine = dense(job, motion, rows, FINE, motion.welding)
    margin = margins(job.scene.chain, job.solver.geometry, fine.q[:, : job.scene.chain.n])
    coarse = dense(job, motion, rows, COARSE, np.ones(len(motion.t_s) - 1, dtype=bool))
    hits, clearance = _in_the_way(job, read, rows, coarse)
    found = [
        *_limit_findings(job, motion, rows.q),
        *drive_findings(job, use),
        *_singular_findings(job, fine, margin),
        *hits,
    ]
    found.sort(key=lambda f: (f.row, f.reason))
    return MotionResult(
        job=job,
        read=read,
        findings=tuple(replace(f, row=int(read.row[f.row]), to_row=int(read.row[f.to_row])) for f in found),
        welded=0,
        samples=len(fine.q) + len(coarse.q),
        clearance=clearance,
        singularity=_least_margin(job, read, fine, margin),
        sigma=_least_sigma(job, fine),
        bead_distance=(0.0, int(read.row[0])),
        wire_angle=(0.0, int(read.row[0])),
        use=np.nanmax(use, axis=1),
        held_speed=HeldSpeed.unknown(0),
        warnings=job.warnings,
    )


def _most(values: Floats, sampled: SampledMotion, read: ReadMotion) -> tuple[float, int]:
    if not len(values):
        return 0.0, int(read.row[0])
    k = int(np.argmax(values))
    return float(values[k]), int(read.row[sampled.row[k]])


def _limit_findings(job: Job, motion: Motion, q: Floats) -> list[Finding]:
    chain, table = job.scene.chain, job.scene.table_range
    lower, upper = np.concatenate([chain.lower, table[:, 0]]), np.concatenate([chain.upper, table[:, 1]])
    over = np.maximum(lower - q, q - upper)
    row = np.arange(len(q))
    return [
        Finding(Failure(Kind.JOINT_LIMIT, measure=degrees(over[k, j]), axis=name, place=IN_ROWS), a, b)
        for j, name in enumerate(job.drives.names)
        for a, b, k in stretches_of(over[:, j] > SLACK, row, over[:, j])
    ]


def _bead_findings(job: Job, sampled: SampledMotion, on: OnBead) -> list[Finding]:
    """Rows and what lies between them that are not on the bead."""
    checks, window = job.case.checks, job.window
    off_bead, off_wire = _off_as_reported(checks, on)
    found = []
    for kind, values, limit in (
        (Kind.OFF_BEAD, off_bead, checks.off_bead_mm),
        (Kind.OFF_WIRE, off_wire, checks.off_wire_deg),
        (Kind.ROLL_OUTSIDE, np.rad2deg(np.abs(window.excess(on.roll))), np.rad2deg(ROLL_SLACK)),
    ):
        for a, b, k in stretches_of(values > _with_rounding(limit), sampled.row, values):
            failure = Failure(kind, round(float(values[k]), 4), round(float(limit), 4), place=IN_ROWS)
            found.append(Finding(failure, a, b))
    return found


def _off_as_reported(checks: Checks, on: OnBead) -> tuple[Floats, Floats]:
    """Distances from the bead, mm, and angles off its direction, degrees, to be compared with the limits.

    A sample that is too far from the place that fits it best is wrong. It is reported by its distance from the nearest
    place; if that is within its limit, by the angle there; if both are, by the distance from the place that fits best.
    """
    distance, judged = on.bead_distance / METRES_PER_MM, on.judged_distance / METRES_PER_MM
    angle, there = np.rad2deg(on.wire_angle), np.rad2deg(on.nearest_angle)
    near = distance <= _with_rounding(checks.off_bead_mm)
    turned = there > _with_rounding(checks.off_wire_deg)
    wrong = judged > _with_rounding(checks.off_bead_mm)
    return np.where(near & ~turned, judged, distance), np.where(near & wrong, np.maximum(there, angle), angle)


def _with_rounding(limit: float) -> float:
    """A limit in mm or degrees with what rounding may add to it."""
    return limit * (1 + 1e-9) + 1e-6


def _singular_findings(job: Job, sampled: SampledMotion, margin: Floats) -> list[Finding]:
    """Margins that are too small while welding, and configurations that change inside a bead."""
    geometry = job.solver.geometry
    least = job.singularity_limits.values(geometry is not None)
    found = []
    for j, kind in enumerate(KINDS):
        _, factor = MARGIN_UNITS[kind]
        if not np.isfinite(least[j]):
            continue
        for a, b, k in stretches_of(margin[:, j] < least[j] - SLACK, sampled.row, -margin[:, j]):
            failure = Failure(
                Kind.SINGULAR,
                measure=round(float(margin[k, j]) * factor, 3),
                limit=round(float(least[j]) * factor, 3),
                singularity=kind,
                place=IN_ROWS,
            )
            found.append(Finding(failure, a, b))
    return [*found, *_changes(job, sampled)]


def _changes(job: Job, sampled: SampledMotion) -> list[Finding]:
    """Configurations that change inside a bead: a singularity between two samples that no sample need be near to."""
    chain, geometry = job.scene.chain, job.solver.geometry
    q = sampled.q[:, : chain.n]
    kinds: tuple[str, ...] = KINDS
    if geometry is not None:
        side = sides(geometry, q)
    elif chain.n == 6:
        side, kinds = np.linalg.det(chain.jacobian(q))[:, None] >= 0, ("sigma",)
    else:
        return []
    crossed = side[1:] != side[:-1]
    found = []
    for at in np.flatnonzero(crossed.any(axis=1) & (np.diff(sampled.row) <= 1)).tolist():
        kind = kinds[int(np.argmax(crossed[at]))]
        change = Failure(Kind.CONFIGURATION_CHANGE, singularity=kind, place=IN_ROWS)
        found.append(Finding(change, int(sampled.row[at]), int(sampled.row[at + 1])))
    return found


def _off_upright(job: Job, sampled: SampledMotion, on: OnBead) -> Floats:
    """Angle (n,) between the deposition direction and up, rad."""
    normal = (job.scene.T_world_base()[:3, :3] @ sampled.T_base_part[:, :3, :3] @ on.normal[:, :, None])[:, :, 0]
    return np.asarray(np.arccos(np.clip(normal[:, 2], -1.0, 1.0)))


def _past_horizontal(job: Job, motion: Motion, rows: SampledMotion) -> tuple[str, ...]:
    """As of a check of the part: every target with the table as it is where the arc comes to it."""
    on = np.flatnonzero(np.asarray(motion.arc) == 1)
    target, first = np.unique(motion.target[on], return_index=True)
    up = job.scene.T_world_base()[2, :3] @ rows.T_base_part[on[first], :3, :3]  # part frame
    off_upright = np.zeros(len(job.targets))
    off_upright[target] = np.arccos(np.clip((up * job.targets.normal[target]).sum(axis=1), -1.0, 1.0))
    return past_horizontal(job.case, off_upright)


def _gravity_findings(job: Job, sampled: SampledMotion, on: OnBead) -> list[Finding]:
    asked = job.case.checks.gravity_max_deg
    limits = [] if asked is None else [asked]
    if job.case.table.mode == "coordinated":
        limits.append(float(np.rad2deg(upright_of(job.case))))
    if not limits:
        return []
    steepest = min(limits)
    angle = np.rad2deg(_off_upright(job, sampled, on))
    return [
        Finding(Failure(Kind.GRAVITY, round(float(angle[k]), 3), steepest, place=IN_ROWS), a, b)
        for a, b, k in stretches_of(angle > steepest + 1e-6, sampled.row, angle)
    ]


def _hanging_findings(job: Job, motion: Motion) -> list[Finding]:
    """Rows on which what is welded overhangs, by the case's limit."""
    found, row = unsupported_targets(job), np.arange(len(motion.t_s))
    over = np.isin(motion.target, list(found)) & (np.asarray(motion.arc) == 1)
    return [
        Finding(replace(found[int(motion.target[a])], place=IN_ROWS, proved=False), a, b)
        for a, b, _ in stretches_of(over, row, np.ones(len(row)))
    ]


def _in_the_way(
    job: Job, read: ReadMotion, rows: SampledMotion, sampled: SampledMotion
) -> tuple[list[Finding], tuple[float, int, tuple[str, ...]] | None]:
    """What a motion collides with, and the nearest the arm comes to anything, with the row and the pair."""
    laid = LaidDeposits.of(job, read.motion, sampled.row)
    runs = list(sampled_runs(job, read, rows, sampled))
    seen = arm_along_motion(job, sampled, laid, runs)
    hits = collisions(job, read.motion, sampled, laid, seen)
    hits += blend_collisions(job, runs, seen)
    laid_for_table = LaidDeposits.of(job, read.motion, sampled.row, for_table=True)
    hits += table_collisions(job, sampled, laid_for_table)
    hits += table_blend_collisions(job, runs, sampled, laid_for_table)
    return hits, _nearest(job, read, sampled, nearest_along_motion(job, sampled, laid, seen.clear, runs))


def _nearest(
    job: Job, read: ReadMotion, sampled: SampledMotion, found: tuple[int, Clearances]
) -> tuple[float, int, tuple[str, ...]] | None:
    at, nearest = found
    if not np.isfinite(nearest.distance[0]):
        return None
    pair = tuple(job.scene.geom_name(int(g)) for g in nearest.pair[0])
    return float(nearest.distance[0]), int(read.row[sampled.row[at]]), pair


def _least_margin(job: Job, read: ReadMotion, sampled: SampledMotion, margin: Floats) -> tuple[float, int, str] | None:
    if not len(margin):
        return None
    limits = job.singularity_limits.values(job.solver.geometry is not None)
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(limits > 0, margin / limits, np.inf)
    k, kind = np.unravel_index(int(np.argmin(share)), share.shape)
    if not np.isfinite(share[k, kind]):
        return None
    return float(margin[k, kind]), int(read.row[sampled.row[k]]), KINDS[kind]


def _least_sigma(job: Job, sampled: SampledMotion) -> float | None:
    if not len(sampled.row):
        return None
    rows = np.flatnonzero(np.diff(sampled.row, prepend=-1))
    return float(smallest_singular_value(job.scene.chain, sampled.q[rows, : job.scene.chain.n]).min())
