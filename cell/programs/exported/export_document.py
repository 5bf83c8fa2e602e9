"""The document beside an exported program, "rbam-program/1": its files, points, frames, and what the check measured.

Use:

    document = export_document(job, files, written, gap, result, warnings)

``docs/formats.md`` describes its keys.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ik.chain import Floats
from slicing import Warning, typed

from ...job.job import Job
from ...units import METRES_PER_MM
from ..from_motion import ProgramOfMotion
from ..orientation import pose_of
from ..program import BaseFrame, MoveKind, Program, SourceLine, ToolFrame
from ..program_check import ProgramResult
from ..round_trip import OFF, TURNED, ProgramDeviation


def frame_document(T: Floats) -> dict[str, float]:
    """A frame as KUKA gives it."""
    row = pose_of(T)
    values = [*(row[:3] / METRES_PER_MM), *np.rad2deg(row[3:])]
    names = ("X_mm", "Y_mm", "Z_mm", "A_deg", "B_deg", "C_deg")
    return {name: round(float(v), 6) + 0.0 for name, v in zip(names, values, strict=True)}


def tool_document(tool: ToolFrame) -> dict[str, Any]:
    """A tool: its number, name and frame in the flange."""
    return {"number": tool.number, "name": tool.name or None, **frame_document(tool.T_flange_tcp)}


def base_document(base: BaseFrame) -> dict[str, Any]:
    """A base: its number, name and frame, and what it moves with."""
    what = {"number": base.number, "name": base.name or None, "coupled": base.coupled, "machine": base.machine}
    return {**what, **frame_document(base.T)}


def export_document(
    job: Job,
    files: dict[str, str],
    written: ProgramOfMotion,
    gap: ProgramDeviation,
    result: ProgramResult,
    warnings: Sequence[Warning],
) -> dict[str, Any]:
    """The document of schema "rbam-program/1".

    Args:
        job: whose program it is.
        files: text of each file by its name.
        written: what was made of the motion.
        gap: of the text's motion to the checked one.
        result: the check of the text.
        warnings: of what was written.

    Returns:
        The document.
    """
    run = result.run
    program, thinning = result.program, written.thinning
    kinds = np.bincount(program.moves.kind, minlength=len(MoveKind))
    worst = program.line_of(gap.move)
    return {
        "schema": "rbam-program/1",
        "case": job.case.title,
        "program": written.program.name,
        "language": "KRL",
        "files": [
            {"name": name, "lines": text.count("\n"), "bytes": len(text), "points": _points(program, name)}
            for name, text in files.items()
        ],
        "points": {"ptp": int(kinds[MoveKind.AXES]), "lin": int(kinds[MoveKind.LINEAR])},
        "tool": tool_document(program.tools[0]),
        "base": base_document(program.bases[0]),
        "thinning": {
            "rows": written.rows,
            "points": written.points,
            "chord_mm": round(thinning.chord / METRES_PER_MM, 6),
            "angle_deg": round(float(np.rad2deg(thinning.angle)), 6),
        },
        "points_a_second": round(written.points_a_second, 3),
        "deviation": {
            "position_mm": round(gap.position / METRES_PER_MM, 6),
            "angle_deg": round(float(np.rad2deg(gap.angle)), 6),
            "allowed_mm": round((OFF + thinning.chord) / METRES_PER_MM, 6),
            "allowed_deg": round(float(np.rad2deg(TURNED + thinning.angle)), 6),
            **line_document(worst),
        },
        "greatest_turn_deg": round(float(np.rad2deg(run.turned)), 4),
        "time_s": round(float(np.ptp(run.motion.t_s)), 3),
        "checked_time_s": round(float(np.ptp(run.motion.t_s)) - gap.seconds, 3),
        "arc_on_s": round(run.motion.arc_time, 3),
        "verdict": "feasible" if result.feasible else "infeasible",
        "beads": _beads(job, result),
        "warnings": [str(line) for line in (*warnings, *result.warnings)],
        "typed_warnings": [typed(line).document() for line in (*warnings, *result.warnings)],
    }


def _points(program: Program, name: str) -> int:
    names = list(program.files)
    return int((program.moves.file == names.index(name)).sum()) if name in names else 0


def line_document(line: SourceLine | None) -> dict[str, Any]:
    """Where a line stands; nulls where there is none."""
    return {"file": None, "line": None} if line is None else {"file": line.file, "line": line.number}


def _beads(job: Job, result: ProgramResult) -> list[dict[str, Any]]:
    """Where each bead stands in the text, and each of its targets."""
    run, t = result.run, job.targets
    out = []
    for k in range(int(run.weld.max(initial=-1)) + 1):
        rows = np.flatnonzero(run.weld == k)
        if len(rows) < 2:
            continue
        target = run.motion.target[rows]
        wanted = np.arange(int(target[0]), int(target[-1]) + 1)
        passed = rows[np.minimum(np.searchsorted(target, wanted), len(rows) - 1)]
        passed[0] = rows[0]
        lines = [result.program.line_of(int(run.move[row])) for row in passed]
        first, last = result.program.line_of(int(run.move[rows[1]])), result.program.line_of(int(run.move[rows[-1]]))
        i = int(target[0])
        out.append(
            {
                "bead": int(run.motion.called[0][rows[0]]),
                "layer": int(t.layer[i]),
                "sub_volume": t.sub_volume[t.sub_volume_index[i]],
                "target": int(run.motion.called[1][rows[0]]),
                "to_target": int(run.motion.called[1][rows[-1]]),
                **line_document(first),
                "to_line": None if last is None else last.number,
                "target_lines": [None if line is None else line.number for line in lines],
            }
        )
    return out
