"""A boss of many thin layers, quickly planned, and what is found of it in so many chunks."""

from __future__ import annotations

import hashlib
import tempfile
from pathlib import Path
from typing import Any

import yaml

from cell.case.read import load_case
from cell.job.job import Job, prepare
from cell.part_chunks.chunking import Chunking
from cell.planning.context import Context
from cell.processes.worker_pool import working
from cell.scene.scene import table_angles
from cell.verdict.check import SpanVerdict, check_span, off_upright

from .cases import LITTLE, little_case

THIN = {"strategy": "planar", "h_layer_mm": 0.5, "h_min_mm": 0.5, "h_max_mm": 0.5}
# beside the boss, where no roll keeps the nozzle clear of it at one side
WALL = {"name": "wall", "box": {"size_mm": [4, 30, 60]}, "position_mm": [1518.0, 270.0, 348.0]}


def layered_job(**sections: Any) -> Job:
    """The little boss in ten layers of 0.5 mm, 44 targets, with a free roll; sections given replace its own."""
    with tempfile.TemporaryDirectory() as folder:
        path = little_case(Path(folder))
        content = {**yaml.safe_load(LITTLE), "slicing": THIN, "roll": "free", **sections}
        path.write_text(yaml.safe_dump(content), encoding="utf-8")
        return prepare(load_case(path))


def context_of(job: Job) -> Context:
    """What the case's own table pose is checked with."""
    return Context.of(job, table_angles(job.scene, job.case.table.E1_deg, job.case.table.E2_deg))


def found_in(job: Job, chunking: Chunking, jobs: int = 1) -> SpanVerdict:
    """The verdict of a fresh context in so many processes."""
    context = context_of(job)
    with working(jobs):
        return check_span(job, context, off_upright(job, context.placed), None, chunking)


def mark(found: SpanVerdict) -> str:
    """A digest of every bit that was found."""
    out = hashlib.sha256()
    for row in found.rows:
        out.update(repr((row.failure, row.looked_at)).encode())
        for q in (row.q, row.attempt):
            out.update(b"-" if q is None else q.tobytes())
    motion = found.motion
    if motion is not None and motion.held_speed is not None:
        columns = (motion.t_s, motion.q, motion.table, motion.arc, motion.bead, motion.layer, motion.target)
        held_speed = motion.held_speed
        for column in (
            *columns,
            held_speed.asked_s,
            held_speed.taken_s,
            held_speed.axis,
            held_speed.by,
            held_speed.least,
        ):
            out.update(column.tobytes())
        out.update(repr(motion.home_s).encode())
    out.update(repr((found.clearance, found.singularity, found.sigma, found.warnings)).encode())
    return out.hexdigest()
