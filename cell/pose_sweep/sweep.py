"""Which table angles work: the verdict at every pose of a grid, on all cores, resumable.

    poses = grid(case, "-90:90:15")
    found = sweep(case, poses, processes=2, log="sweep.jsonl")
    found = sweep(case, poses, executor=ThreadPoolExecutor(2))       # or any other of concurrent.futures
    document = sweep_document(case, found)                           # "rbam-sweep/1"

Hopeless poses are settled first, ``SCREENED_TOGETHER`` at once, by ``cell.table_poses.hopeless_poses``; each of the
others gets the whole check by itself. Of a table that indexes the poses are those of what is built first. Which are
taken together is a matter of the poses alone, so that results do not depend on who computes them.
"""

from __future__ import annotations

import logging
import os
import threading
from collections import OrderedDict
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import BrokenExecutor, Executor
from contextlib import closing
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain, groupby
from typing import Any

import numpy as np

from ik.singularity import KINDS

from ..case.fingerprint import fingerprint as fingerprint
from ..case.sections import REASONS, Case
from ..errors import InputError, WorkerKilledError
from ..job.job import Job, prepare
from ..job.table_groups import table_groups
from ..plain import plain
from ..progress import Progress, counted_progress
from ..scene.compose import compose
from ..table_poses.hopeless_poses import Screened, screen_all
from ..table_poses.suited_poses import alone
from ..units import METRES_PER_MM
from ..verdict.check import check_fixed
from ..verdict.result import Result
from .grid import Pose
from .log import Log
from .ranking import SCHEMA as SCHEMA
from .ranking import sweep_document as sweep_document
from .workers import completed, worker_processes

LOG = logging.getLogger(__name__)

MOST_JOBS = 8  # cells a worker keeps ready
SCREENED_TOGETHER = 32  # poses screened at once; fewer than that are left to one worker at the end
Row = dict[str, Any]
Rows = Generator[Row, None, None]
Compute = Callable[[Sequence[Callable[[], Any]]], Generator[Any, None, None]]


@dataclass(frozen=True)
class PoseScreening:
    """Poses of one cell to be screened together.

    Attributes:
        fingerprint: the case's fingerprint.
        case: the case.
        poses: what to try; they differ in the table's angles alone.
    """

    fingerprint: str
    case: Case
    poses: tuple[Pose, ...]

    def __call__(self) -> list[tuple[Pose, Row | None]]:
        """The poses, with the rows of those that are hopeless."""
        job = _job(SweepTask(self.fingerprint, self.case, self.poses[0]))
        found = screen_all(job, [(pose.E1_deg, pose.E2_deg) for pose in self.poses])
        return [
            (pose, None if one is None else _hopeless(job, pose, one))
            for pose, one in zip(self.poses, found, strict=True)
        ]


@dataclass(frozen=True)
class SweepTask:
    """What a worker is sent: a case as it was read, not what is made of it, so that it is small.

    Attributes:
        fingerprint: the case's fingerprint; a worker prepares each once.
        case: the case; its meshes are read from their files where the worker runs.
        pose: what to try.
    """

    fingerprint: str
    case: Case
    pose: Pose

    def __call__(self) -> Row:
        """The pose's row, from a whole check."""
        return pose_outcome(_job(self), self.pose)


_ready = threading.local()  # jobs of a worker's thread: MuJoCo's model is changed by checks and not to be shared


def _job(unit: SweepTask) -> Job:
    """The job of a pose's cell, prepared at most once."""
    jobs: OrderedDict[tuple[str, Pose | None], Job] = _ready.__dict__.setdefault("jobs", OrderedDict())
    key = unit.fingerprint, unit.pose.variant
    if key not in jobs:
        whole = unit.fingerprint, None
        if whole not in jobs:
            if sweep_fingerprint(unit.case) != unit.fingerprint:
                raise InputError(f"{unit.case.path}: a file of the case or the program changed while the sweep ran")
            jobs[whole] = prepare(unit.case)
        jobs[key] = first_group(variant_of(jobs[whole], unit.pose))
        jobs.move_to_end(whole)
    jobs.move_to_end(key)
    while len(jobs) > MOST_JOBS:
        jobs.popitem(last=False)
    return jobs[key]


def variant_of(job: Job, pose: Pose) -> Job:
    """A job with a pose's roll, placement and height; layers and targets stay.

    Args:
        job: of the case as it is.
        pose: its table angles do not matter.

    Returns:
        The job.

    Raises:
        InputError: the cell cannot be composed like that.
    """
    case = pose.applied(job.case)
    moved = pose.positioner is not None or pose.height_mm is not None
    return replace(job, case=case, scene=compose(case, job.shape) if moved else replace(job.scene, case=case))


def first_group(job: Job) -> Job:
    """The first group of a part whose table indexes, without the rest; any other part as a whole.

    Args:
        job: from ``cell.job.job.prepare``.
    """
    return alone(job, table_groups(job)[0]) if job.case.table.mode == "indexed" else job


def sweep_fingerprint(case: Case) -> str:
    """What a sweep's rows depend on, as a short hash: of a table that indexes on what it builds first as well."""
    found = fingerprint(case)
    if case.table.mode != "indexed":
        return found
    first = case.table.poses[:1]
    return "-".join([found, "indexed", *(f"{one.sub_volume}{list(one.layers or ())}" for one in first)])


def _builds(job: Job) -> Row:
    """What a row of a table that indexes is about; nothing of any other."""
    if job.case.table.mode != "indexed":
        return {}
    t = job.targets
    name = t.sub_volume[int(t.sub_volume_index[0])]
    return {"sub_volume": name, "layers": [int(t.layer.min()), int(t.layer.max())]}


def _hopeless(job: Job, pose: Pose, found: Screened) -> Row:
    return {
        **pose.columns(),
        **_builds(job),
        "verdict": "infeasible",
        "infeasible": found.infeasible,
        "reasons": {reason: found.reasons.get(reason, 0) for reason in REASONS},
        "searched": False,
        "looked_at": found.looked_at,
        "not_looked_at": len(job.targets) - found.looked_at,
    }


def pose_outcome(job: Job, pose: Pose) -> Row:
    """The verdict of a whole check at one pose, as the document has it.

    Args:
        job: the job, with the pose's roll, placement and height.
        pose: what is tried.

    Returns:
        A row of "rbam-sweep/1".
    """
    result = check_fixed(job, pose.E1_deg, pose.E2_deg)
    row: Row = plain(
        {
            **pose.columns(),
            **_builds(job),
            "verdict": "feasible" if result.feasible else "infeasible",
            "infeasible": result.infeasible,
            "reasons": result.reasons,
            "searched": True,
            "looked_at": result.looked_at,
            "not_looked_at": result.not_looked_at,
            **_measures(result),
        }
    )
    return row


def _measures(result: Result) -> dict[str, Any]:
    clearance, margin, motion = result.clearance, result.singularity, result.motion
    found: dict[str, Any] = {
        "least_clearance_mm": None if clearance is None else round(clearance.value / METRES_PER_MM, 3),
        "least_margin": None if margin is None else {"kind": margin.what[0], "value": round(margin.value, 5)},
        "least_margin_share": None,
        "least_joint_room_deg": None,
        "least_joint": None,
        "gravity_max_deg": round(float(np.rad2deg(result.gravity.max())), 3),
        "time_s": None if motion is None else round(float(motion.t_s[-1]), 2),
    }
    job = result.job
    if margin is not None:
        limits = job.singularity_limits.values(job.solver.geometry is not None)
        found["least_margin_share"] = round(margin.value / float(limits[KINDS.index(margin.what[0])]), 3)
    if motion is not None:
        arm = job.scene.chain
        room = np.minimum(motion.q - arm.lower, arm.upper - motion.q).min(axis=0)
        tightest = int(np.argmin(room))
        found["least_joint_room_deg"] = round(float(np.rad2deg(room[tightest])), 3)
        found["least_joint"] = arm.names[tightest]
    return found


def require_fixed_table(case: Case) -> None:
    """Refuse a table that moves along the beads: a map is of fixed poses.

    Args:
        case: to be swept.

    Raises:
        InputError: its table moves along; one line.
    """
    if case.table.mode == "coordinated":
        raise InputError(
            f"{case.path}: table.mode: a sweep maps poses of a table that stands, and this one is "
            "coordinated; add --table"
            " fixed for single poses, or --table indexed for the first sub-volume"
        )


def sweep(
    case: Case,
    poses: Sequence[Pose | tuple[float, float]],
    *,
    processes: int | None = None,
    log: str | None = None,
    progress: Progress | None = None,
    executor: Executor | None = None,
) -> list[dict[str, Any]]:
    """Check all poses.

    Args:
        case: the case.
        poses: from ``cell.grid``, or E1, E2 pairs, deg.
        processes: number of processes; default: one for each core.
        log: file of finished poses, one JSON a line; poses that it holds already are not computed again.
        progress: called with how far it is.
        executor: used instead of processes of the sweep's own; it is left running.

    Returns:
        One row a pose, in the order of the poses.

    Raises:
        InputError: the table moves along the beads, or the log belongs to another case.
        WorkerKilledError: a worker was killed (finished poses are in the log).
    """
    require_fixed_table(case)
    asked = [Pose(*pose) for pose in poses]
    found = sweep_fingerprint(case)
    with Log(log, found) as book:
        if book.damaged:
            LOG.warning("%s: %d damaged line(s) were left out; their poses are computed again", log, book.damaged)
        todo = [pose for pose in dict.fromkeys(asked) if pose not in book.done]
        work = SweepPlan(found, case, tuple(todo))
        with counted_progress(progress, "table poses", len(asked), len(asked) - len(todo)) as count:
            try:
                with closing(_outcomes(work, processes, executor)) as rows:
                    for row in rows:
                        book.add(row)
                        count()
            except BrokenExecutor:
                done = sum(pose in book.done for pose in asked)
                keep = (
                    (f"finished poses are in {log}; the same command goes on from there")
                    if log
                    else "--out F.jsonl keeps finished poses"
                )
                after = f"after {done} of {len(asked)} poses"
                text = f"sweep: a worker process was killed (too little memory?) {after}; {keep}"
                raise WorkerKilledError(text) from None
        return [book.done[pose] for pose in asked]


@dataclass(frozen=True)
class SweepPlan:
    """What a sweep comes to.

    Attributes:
        fingerprint: the case's fingerprint.
        case: the case.
        poses: what to try.
    """

    fingerprint: str
    case: Case
    poses: tuple[Pose, ...]

    def screenings(self) -> list[PoseScreening]:
        """Poses of one cell, a few together."""
        found: list[PoseScreening] = []
        for _, same in groupby(self.poses, key=lambda pose: pose.variant):
            some = tuple(same)
            parts = (some[i : i + SCREENED_TOGETHER] for i in range(0, len(some), SCREENED_TOGETHER))
            found += [PoseScreening(self.fingerprint, self.case, part) for part in parts]
        return found

    def rows(self, compute: Compute) -> Rows:
        """The rows of all poses, in any order.

        Args:
            compute: calls units and yields their results as they are done.

        Yields:
            A row a pose.
        """
        left: list[SweepTask] = []
        with closing(compute(self.screenings())) as screened:
            for pose, row in chain.from_iterable(screened):
                if row is None:
                    left.append(SweepTask(self.fingerprint, self.case, pose))
                else:
                    yield row
        # in the order of the poses, whichever part came first
        number = {pose: i for i, pose in enumerate(self.poses)}
        left.sort(key=lambda unit: number[unit.pose])
        with closing(compute(left)) as rows:
            yield from rows


def _outcomes(work: SweepPlan, processes: int | None, executor: Executor | None) -> Rows:
    if executor is not None:
        yield from work.rows(partial(completed, executor))
        return
    processes = min(processes or os.cpu_count() or 1, len(work.poses))
    if processes <= 1:
        yield from work.rows(lambda units: (unit() for unit in units))
        return
    with worker_processes(processes) as pool:
        yield from work.rows(partial(completed, pool))
