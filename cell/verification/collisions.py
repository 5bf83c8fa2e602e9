"""Collisions of a motion from outside: of the arm, its wire and the table, with the part growing as the rows say.

    findings = collisions(job, motion, sampled, laid, seen)       # laid: from laid_deposits; seen: from arm_clearances
    findings += table_collisions(job, sampled, laid_for_table)

What lies between samples is proved free as in ``between_samples``, with E1 and E2 as axes like any
other. Radians, metres.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ik.chain import Floats

from ..arrays import Ints
from ..collision.checker import NEVER, Checker
from ..collision.clearances import CLEARANCE_REACH, Clearances
from ..collision.proofs.between_samples import unproven_steps
from ..collision.proofs.reach_radii import all_radii, table_radii
from ..collision.table_clearances import TableChecker, with_table_axes
from ..collision.wire import WIRE_REACH, wire_scene
from ..failure import IN_ROWS, CollisionPlace, Contact, Failure, Kind
from ..job.job import Job
from ..job.wire_in_metal import Metal, wire_failure, wire_size, wires_at
from ..motion.motion import NO_MOVE, Motion
from ..scene.scene import Scene
from ..units import METRES_PER_MM
from .arm_clearances import ArmSeen
from .bead_order import Finding
from .bead_samples import SampledMotion
from .laid_deposits import LaidDeposits

PUSHED = 0.5e-3  # m along the wire beyond a bead's end: from there on it is pushed into what lies below
BESIDE = 5e-3  # m beside the line on which a wire comes off a bead: from there on it may touch nothing of the part
OUT_MM = 1.0  # beyond a layer's thickness: its shape as it collides is a little larger


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


def collisions(job: Job, motion: Motion, sampled: SampledMotion, laid: LaidDeposits, seen: ArmSeen) -> list[Finding]:
    """What the arm and its wire collide with in a motion.

    Args:
        job: the job.
        motion: the motion.
        sampled: samples of all of it.
        laid: the deposits there are.
        seen: what was seen of the arm.

    Returns:
        What was found.
    """
    found = _arm_collisions(job, sampled, seen)
    return [*found, *_wire_collisions(job, motion, sampled, laid), *_wires_in_metal(job, motion, sampled)]


def _arm_collisions(job: Job, sampled: SampledMotion, seen: ArmSeen) -> list[Finding]:
    """Where clearances at samples are too small, or what lies between is not proved free."""
    scene, clear = job.scene, seen.clear
    least = job.case.checks.clearance_mm * METRES_PER_MM
    found = [
        Finding(hit(scene, clear, k, least), a, b)
        for a, b, k in stretches_of(clear.distance < least, sampled.row, -clear.distance)
    ]
    step, nearest = seen.unproven
    for n, at in enumerate(step.tolist()):
        if clear.distance[at] >= least and clear.distance[at + 1] >= least:
            between = hit(scene, nearest, n, least, CollisionPlace.BETWEEN_ROWS)
            found.append(Finding(between, int(sampled.row[at]), int(sampled.row[at + 1])))
    return found


def _wire_collisions(job: Job, motion: Motion, sampled: SampledMotion, laid: LaidDeposits) -> list[Finding]:
    """A wire that is drawn through the part with the arc off; not where it comes off a bead or onto it."""
    scene = wire_scene(job.scene)
    index = np.flatnonzero(_across(job, motion, sampled))
    if scene is None or not len(index):
        return []
    q, deposits_laid, row = sampled.q[index], laid.at[index], sampled.row[index]
    checker = Checker(with_table_axes(scene), (float(q[0, -2]), float(q[0, -1])), WIRE_REACH, pair_gap=NEVER)
    clear = checker.clearances(q, deposits_laid)
    found = [
        Finding(hit(scene, clear, k, 0.0), a, b)
        for a, b, k in stretches_of(clear.distance <= 0.0, row, -clear.distance)
    ]
    radius = all_radii(job.scene)
    run = np.cumsum(np.diff(index, prepend=-2) != 1)
    step, nearest = unproven_steps(checker, radius, q, deposits_laid, clear, run)
    for n, at in enumerate(step.tolist()):
        if clear.distance[at] > 0.0 and clear.distance[at + 1] > 0.0:
            between = hit(scene, nearest, n, 0.0, CollisionPlace.BETWEEN_ROWS)
            found.append(Finding(between, int(row[at]), int(row[at + 1])))
    return found


def _wires_in_metal(job: Job, motion: Motion, sampled: SampledMotion) -> list[Finding]:
    """A wire that runs through metal between nozzle and bead while it stands in a bead, or is drawn off or put on."""
    size, index = wire_size(job.scene), np.flatnonzero(~_across(job, motion, sampled))
    if size is None or not len(job.targets) or not len(index):
        return []
    Ts, row = sampled.Ts_part_tcp[index], sampled.row[index]
    poses = Ts[:, :3, 3] / METRES_PER_MM, -Ts[:, :3, 2]
    metal = Metal.of(job.case, job.shape, job.targets, job.layers_lie_below)
    met, length = metal.met(wires_at(job.targets, job.laid_beside_the_wire, size, motion.target[row], poses))
    wire, found = job.case.tool.wire[0], []
    for a, b, k in stretches_of(met >= 0, row, length):
        failure = wire_failure(wire, metal.names[met[k]], float(length[k]))
        found.append(Finding(replace(failure, place=IN_ROWS, proved=False), a, b))
    return found


def _across(job: Job, motion: Motion, sampled: SampledMotion) -> NDArray[np.bool_]:
    """Samples with the arc off that are off the bead just welded, and not yet at the next one.

    So are those near a bead's end from where on the wire is pushed further on than it was there, or drawn sideways.
    """
    # out of the layer just laid at least, which stands about its tip
    layer = float(job.targets.thickness_mm.max(initial=0.0)) + OUT_MM
    near = max(job.case.process.retract_mm, layer) * METRES_PER_MM + NO_MOVE
    off = ~motion.welding[sampled.row]
    out = off.copy()
    p, feed = sampled.Ts_part_tcp[:, :3, 3], sampled.Ts_part_tcp[:, :3, 2]

    def at_end(here: Floats, end: int) -> NDArray[np.bool_]:
        """Whether places are near a sample at a bead's end, hardly beyond it along the wire, and hardly beside it."""
        off = here - p[end]
        along = off @ feed[end]
        beside = np.linalg.norm(off - along[:, None] * feed[end], axis=1)
        return (np.linalg.norm(off, axis=1) <= near) & (along <= PUSHED) & (beside <= BESIDE)

    ends = np.flatnonzero(np.diff(off, prepend=False, append=False))
    for a, b in zip(ends[::2], ends[1::2], strict=True):
        here = p[a:b]
        if motion.arc[sampled.row[a]]:
            out[a:b] &= ~np.logical_and.accumulate(at_end(here, a))
        last = min(b, len(p) - 1)
        if motion.arc[sampled.row[b - 1] + 1]:
            out[a:b] &= ~np.logical_and.accumulate(at_end(here, last)[::-1])[::-1]
    return out


def table_collisions(job: Job, sampled: SampledMotion, laid: LaidDeposits) -> list[Finding]:
    """What stands on the table against the cell around it and against the positioner.

    Args:
        job: the job.
        sampled: samples.
        laid: the deposits there are for the table.

    Returns:
        What was found; nothing is checked twice at one pose of the table.
    """
    scene = job.scene
    checker = TableChecker(scene, CLEARANCE_REACH)
    tables = sampled.q[:, scene.chain.n :]
    clear = checker.clearances(tables, laid.at)
    found = [
        Finding(hit(scene, clear, k, 0.0), a, b)
        for a, b, k in stretches_of(clear.distance < 0.0, sampled.row, -clear.distance)
    ]
    step, nearest = unproven_steps(checker, table_radii(scene), tables, laid.at, clear, laid_between=laid.between)
    # where nothing moves nothing has to be proved
    moves = (np.diff(tables, axis=0) != 0).any(axis=1)
    for n, at in enumerate(step.tolist()):
        if moves[at] and clear.distance[at] >= 0.0 and clear.distance[at + 1] >= 0.0:
            between = hit(scene, nearest, n, 0.0, CollisionPlace.BETWEEN_ROWS)
            found.append(Finding(between, int(sampled.row[at]), int(sampled.row[at + 1])))
    return found


def hit(
    scene: Scene, clear: Clearances, k: int, least: float, seen: CollisionPlace = CollisionPlace.AT_SAMPLE
) -> Failure:
    """A collision on rows of a motion.

    Args:
        scene: the cell.
        clear: clearances.
        k: the one that is too small.
        least: clearance asked for, m.
        seen: how it was found.
    """
    distance = float(clear.distance[k])
    return Failure(
        Kind.COLLISION,
        measure=round(distance / METRES_PER_MM, 3) if np.isfinite(distance) else None,
        limit=round(least / METRES_PER_MM, 3),
        contact=Contact(tuple(scene.geom_name(int(g)) for g in clear.pair[k] if g >= 0), seen=seen),
        place=IN_ROWS,
    )
