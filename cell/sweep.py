"""Which table angles work: the verdict at every pose of a grid, on all cores, resumable.

    poses = parse_grid(case, "-90:90:15", None)
    found = sweep(case, poses, workers=2, log="sweep.jsonl", progress=sys.stderr)
    document = sweep_document(case, found)            # "rbam-sweep/1"

Each pose is computed by itself, so that results do not depend on the number of workers. Poses at which some target has
no configuration at all are infeasible as they stand and are not searched for motions.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path
from typing import IO, Any

import numpy as np

from .check import check
from .errors import InputError
from .job import Job, prepare
from .nodes import evaluate
from .place import METRES_PER_MM, Placed, place
from .plan import FINER
from .progress import Bar
from .scene import table_angles
from .sections import REASONS, Case

SCHEMA = "rbam-sweep/1"
STEP_DEG = 45.0
MOST_POSES = 100_000
Pose = tuple[float, float]

_job: Job | None = None  # of a worker process, prepared once


def parse_grid(case: Case, e1: str | None, e2: str | None) -> list[Pose]:
    """The poses of a grid.

    Args:
        case: its positioner's ranges are the default.
        e1: "LO:HI:STEP" or one angle, deg; None for the axis' range by 45.
        e2: the same.

    Returns:
        (E1, E2) pairs, deg, E1 slowest.

    Raises:
        InputError: the text is no range, or an angle is outside the axis.
    """
    job = prepare(case)
    ranges = np.rad2deg(job.scene.table_range)
    axes = [_axis(name, text, limits) for name, text, limits in zip(("E1", "E2"), (e1, e2), ranges, strict=True)]
    if len(axes[0]) * len(axes[1]) > MOST_POSES:
        raise InputError(f"sweep: {len(axes[0])} x {len(axes[1])} poses; at most {MOST_POSES} at once")
    poses = [(a, b) for a in axes[0] for b in axes[1]]
    for pose in poses:
        table_angles(job.scene, *pose)
    return poses


def _axis(name: str, text: str | None, limits: np.ndarray) -> list[float]:
    if text is None:
        first = np.ceil(limits[0] / STEP_DEG) * STEP_DEG
        return [float(v) for v in np.arange(first, limits[1] + 1e-9, STEP_DEG)]
    try:
        values = [float(v) for v in text.split(":")]
    except ValueError:
        values = []
    if len(values) == 1:
        return values
    if len(values) != 3 or not np.isfinite(values).all() or not values[0] <= values[1] or not values[2] > 0:
        raise InputError(f"--{name.lower()}: {text!r} is neither one angle nor LO:HI:STEP with LO <= HI and STEP > 0")
    low, high, step = values
    count = int(np.floor((high - low) / step + 1e-9)) + 1
    if count > MOST_POSES:
        raise InputError(f"--{name.lower()}: {count} angles; at most {MOST_POSES} at once")
    return [low + i * step for i in range(count)]


def pose_outcome(job: Job, pose: Pose) -> dict[str, Any]:
    """The verdict at one pose, as the document has it.

    Args:
        job: the job.
        pose: E1, E2, deg.

    Returns:
        A row of "rbam-sweep/1".
    """
    table = table_angles(job.scene, *pose)
    placed = place(job.targets, job.scene.T_base_part(*table))
    dead, reasons = _without_configuration(job, placed)
    row: dict[str, Any] = {"E1_deg": pose[0], "E2_deg": pose[1]}
    if dead:
        return {**row, "verdict": "infeasible", "infeasible": dead, "reasons": reasons, "searched": False}
    result = check(job, *pose)
    clearance, margin = result.clearance, result.singularity
    return {
        **row,
        "verdict": "feasible" if result.feasible else "infeasible",
        "infeasible": result.infeasible,
        "reasons": result.reasons,
        "searched": True,
        "least_clearance_mm": None if clearance is None else round(clearance.value / METRES_PER_MM, 3),
        "least_margin": None if margin is None else {"kind": margin.what[0], "value": round(margin.value, 5)},
        "gravity_max_deg": round(float(np.rad2deg(result.gravity.max())), 3),
        "time_s": None if result.motion is None else round(float(result.motion.t_s[-1]), 2),
    }


def _without_configuration(job: Job, placed: Placed) -> tuple[int, dict[str, int]]:
    """How many targets have no configuration at any roll that a check would try, by reason."""
    step = np.deg2rad(job.case.ik.roll_step_deg)
    steps = [step] if job.window.is_fixed else [step, step / FINER]
    dead = np.arange(len(placed.position))
    for roll_step in steps:
        left = replace(placed, position=placed.position[dead], normal=placed.normal[dead])
        nodes = evaluate(job.solver, left, job.window, roll_step, job.singularity_limits)
        none = np.flatnonzero(~np.isfinite(nodes.cost).any(axis=(1, 2, 3)))
        dead = dead[none]
        if not len(dead):
            return 0, {}
    count = Counter(nodes.why_not(int(i))[0] for i in none)
    return len(dead), {reason: count[reason] for reason in REASONS}


def sweep(
    case: Case,
    poses: Sequence[Pose],
    *,
    workers: int | None = None,
    log: str | None = None,
    progress: IO[str] | None = None,
) -> list[dict[str, Any]]:
    """Verdicts at all poses.

    Args:
        case: the case.
        poses: E1, E2 pairs, deg.
        workers: processes; one a core where left out.
        log: file of finished poses, one JSON a line; what is in it already is not computed again.
        progress: where to show a bar, if that is a terminal.

    Returns:
        One row a pose, in the order of the poses.

    Raises:
        InputError: the log belongs to another case.
    """
    done = _read_log(case, log) if log else {}
    todo = [pose for pose in dict.fromkeys(poses) if pose not in done]
    workers = min(workers or os.cpu_count() or 1, max(len(todo), 1))
    with Bar(progress, "table poses", len(poses), len(poses) - len(todo)) as bar:
        for row in _computed(case, todo, workers):
            done[row["E1_deg"], row["E2_deg"]] = row
            if log:
                with open(log, "a", encoding="utf-8") as file:
                    file.write(json.dumps(row) + "\n")
            bar.advance()
    return [done[pose] for pose in poses]


def _computed(case: Case, todo: Sequence[Pose], workers: int) -> Iterator[dict[str, Any]]:
    if not todo:
        return
    if workers == 1:
        job = prepare(case)
        for pose in todo:
            yield pose_outcome(job, pose)
        return
    # spawned, not forked: the same on every system, and no thread of the parent is copied half-way
    pool = ProcessPoolExecutor(workers, mp_context=get_context("spawn"), initializer=_prepare_worker, initargs=(case,))
    try:
        futures = [pool.submit(_in_worker, pose) for pose in todo]
        for future in as_completed(futures):
            yield future.result()
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def _prepare_worker(case: Case) -> None:
    global _job
    import signal

    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent stops the sweep, workers finish their pose
    _job = prepare(case)


def _in_worker(pose: Pose) -> dict[str, Any]:
    if _job is None:
        raise RuntimeError("the worker was not prepared")
    return pose_outcome(_job, pose)


def fingerprint(case: Case) -> str:
    """What a sweep's results depend on, as a short hash: the case and the files it names."""
    digest = hashlib.sha256(case.model_dump_json(exclude={"table", "expect", "name", "description"}).encode())
    body = case.part.body.mesh if case.part.body else None
    for name in [*case.part.sub_volumes, body, *(f.mesh for f in case.fixtures)]:
        if name:
            path = case.path_of(name)
            digest.update(path.read_bytes() if path.is_file() else b"")
    return digest.hexdigest()[:16]


def _read_log(case: Case, log: str) -> dict[Pose, dict[str, Any]]:
    path = Path(log)
    mine = {"schema": "rbam-sweep-log/1", "case": fingerprint(case)}
    if not path.exists() or path.stat().st_size == 0:
        path.write_text(json.dumps(mine) + "\n", encoding="utf-8")
        return {}
    lines = path.read_text(encoding="utf-8").split("\n")
    try:
        head = json.loads(lines[0])
    except json.JSONDecodeError:
        head = None
    if not isinstance(head, dict) or head.get("schema") != mine["schema"]:
        raise InputError(f"{log}: is not the log of a sweep; name a new file")
    if head != mine:
        raise InputError(f"{log}: belongs to another case, or the case has changed since; name a new file")
    done = {}
    whole = [json.dumps(head)]
    for line in lines[1:]:
        try:
            row = json.loads(line)
        except json.JSONDecodeError:
            continue  # the line that was being written when the sweep was cut off
        done[row["E1_deg"], row["E2_deg"]] = row
        whole.append(line)
    path.write_text("\n".join(whole) + "\n", encoding="utf-8")
    return done


def sweep_document(case: Case, rows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """The contract "rbam-sweep/1".

    Args:
        case: the case.
        rows: from :func:`sweep`.

    Returns:
        The document; ``best`` is the feasible pose that deposits closest to upright (by 5 deg), then with the most
        clearance, or None.
    """
    feasible = [row for row in rows if row["verdict"] == "feasible"]
    best = min(feasible, key=_rank, default=None)
    return {"schema": SCHEMA, "case": case.title, "poses": list(rows), "best": best}


def _rank(row: dict[str, Any]) -> tuple[float, float, float, float]:
    clearance = row["least_clearance_mm"]
    return (
        round(row["gravity_max_deg"] / 5),
        -(np.inf if clearance is None else clearance),
        row["E1_deg"],
        row["E2_deg"],
    )
