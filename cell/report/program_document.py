"""What is said of a robot program: the document beside an export, and the report of one that is checked.

Use:

    document = export_document(job, exported)             # "rbam-program/1"
    document = program_report(result, "blade.src")        # "rbam-motion-report/1", findings with file and line
    for line in program_lines(result, "blade.src"): ...
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from ik.chain import Floats
from slicing import typed

from ..job.job import Job
from ..programs.export import Exported
from ..programs.orientation import pose_of
from ..programs.program import BaseFrame, MoveKind, Program, SourceLine, ToolFrame
from ..programs.program_check import PROGRAM_REASONS, ProgramFinding, ProgramResult
from ..programs.round_trip import OFF, TURNED
from ..units import METRES_PER_MM
from ..verdict.failure_words import failure_in_words
from ..verification.bead_order import REASONS
from .facts import facts_table, headline
from .motion_report import SHOWN, motion_document, motion_facts

if TYPE_CHECKING:
    from rich.console import RenderableType


def frame_document(T: Floats) -> dict[str, float]:
    """A frame as KUKA gives it."""
    row = pose_of(T)
    values = [*(row[:3] / METRES_PER_MM), *np.rad2deg(row[3:])]
    names = ("X_mm", "Y_mm", "Z_mm", "A_deg", "B_deg", "C_deg")
    return {name: round(float(v), 6) + 0.0 for name, v in zip(names, values, strict=True)}


def _tool(tool: ToolFrame) -> dict[str, Any]:
    return {"number": tool.number, "name": tool.name or None, **frame_document(tool.T_flange_tcp)}


def _base(base: BaseFrame) -> dict[str, Any]:
    what = {"number": base.number, "name": base.name or None, "coupled": base.coupled, "machine": base.machine}
    return {**what, **frame_document(base.T)}


def export_document(job: Job, made: Exported) -> dict[str, Any]:
    """The contract "rbam-program/1".

    Args:
        job: whose program it is.
        made: without a fault.

    Returns:
        The document.
    """
    assert made.result is not None
    assert made.gap is not None
    written, gap, run = made.written, made.gap, made.result.run
    program, thinning = made.result.program, made.written.thinning
    kinds = np.bincount(program.moves.kind, minlength=len(MoveKind))
    worst = program.line_of(gap.move)
    return {
        "schema": "rbam-program/1",
        "case": job.case.title,
        "program": written.program.name,
        "language": "KRL",
        "files": [
            {"name": name, "lines": text.count("\n"), "bytes": len(text), "points": _points(program, name)}
            for name, text in made.files.items()
        ],
        "points": {"ptp": int(kinds[MoveKind.AXES]), "lin": int(kinds[MoveKind.LINEAR])},
        "tool": _tool(program.tools[0]),
        "base": _base(program.bases[0]),
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
            **_place(worst),
        },
        "greatest_turn_deg": round(float(np.rad2deg(run.turned)), 4),
        "time_s": round(float(np.ptp(run.motion.t_s)), 3),
        "checked_time_s": round(float(np.ptp(run.motion.t_s)) - gap.seconds, 3),
        "arc_on_s": round(run.motion.arc_time, 3),
        "verdict": "feasible" if made.result.feasible else "infeasible",
        "beads": _beads(job, made.result),
        "warnings": [str(line) for line in (*made.warnings, *made.result.warnings)],
        "typed_warnings": [typed(line).document() for line in (*made.warnings, *made.result.warnings)],
    }


def _points(program: Program, name: str) -> int:
    names = list(program.files)
    return int((program.moves.file == names.index(name)).sum()) if name in names else 0


def _place(line: SourceLine | None) -> dict[str, Any]:
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
                **_place(first),
                "to_line": None if last is None else last.number,
                "target_lines": [None if line is None else line.number for line in lines],
            }
        )
    return out


def program_report(result: ProgramResult, path: str) -> dict[str, Any]:
    """The contract "rbam-motion-report/1" of a program: as of a motion, with lines.

    Args:
        result: what was found.
        path: the program's file.

    Returns:
        The document; rows count from 1 and are those of the program as it is run.
    """
    document = motion_document(result.found, path)
    count = Counter(f.reason for f in result.findings)
    program, run = result.program, result.run
    t = run.motion.t_s
    return {
        **document,
        "verdict": "feasible" if result.feasible else "infeasible",
        "reasons": {reason: count[reason] for reason in (*REASONS, *PROGRAM_REASONS)},
        "program": {
            "name": program.name,
            "files": list(program.files),
            "points": len(program.moves),
            "tools": [_tool(tool) for tool in program.tools],
            "bases": [_base(base) for base in program.bases],
            "greatest_turn_deg": round(float(np.rad2deg(run.turned)), 4),
            "passed_over": dict(program.passed_over),
        },
        "warnings": [str(line) for line in result.warnings],
        "typed_warnings": [typed(line).document() for line in result.warnings],
        "findings": [_finding(f, t) for f in result.findings],
    }


def _finding(f: ProgramFinding, t: Floats) -> dict[str, Any]:
    last = f.to_line if f.to_line is not None and f.line is not None and f.to_line.file == f.line.file else None
    return {
        "reason": f.reason,
        **_place(f.line),
        "to_line": None if last is None else last.number,
        "to_file": None if f.to_line is None else f.to_line.file,
        "move": f.move,
        "row": f.row,
        "to_row": f.to_row,
        "t_s": round(float(t[f.row - 1]), 6),
        "detail": f.detail,
    }


def lines_in_words(f: ProgramFinding) -> str:
    """The lines of a finding."""
    if f.line is None:
        return f"move {f.move}"
    if f.to_line is None or f.to_line == f.line:
        return str(f.line)
    return f"{f.line} .. {f.to_line.number if f.to_line.file == f.line.file else f.to_line}"


def program_lines(result: ProgramResult, path: str) -> Iterator[RenderableType]:
    """The terminal report.

    Args:
        result: what was found.
        path: the program's file.

    Yields:
        rich renderables, one a block.
    """
    from rich.table import Table

    yield headline(result.found.job.case.title, path, feasible=result.feasible)
    yield facts_table(_facts(result, program_report(result, path)))
    if result.feasible:
        return
    table = Table(box=None, pad_edge=False, header_style="dim")
    table.add_column("line")
    table.add_column("reason")
    table.add_column("what is wrong")
    for f in result.findings[:SHOWN]:
        table.add_row(lines_in_words(f), f.reason, failure_in_words(f.failure))
    if len(result.findings) > SHOWN:
        table.caption = f"and {len(result.findings) - SHOWN} more; all of them with --json"
        table.caption_justify = "left"
    yield table


def _facts(result: ProgramResult, document: dict[str, Any]) -> Iterator[tuple[str, str]]:
    program = result.program
    passed = ", ".join(f"{n} {kind}" for kind, n in program.passed_over.items())
    kinds = np.bincount(program.moves.kind, minlength=len(MoveKind))
    names = {"PTP": kinds[MoveKind.AXES], "LIN": kinds[MoveKind.LINEAR], "CIRC": kinds[MoveKind.CIRCULAR]}
    shown = ", ".join(f"{count} {name}" for name, count in names.items() if count)
    yield "program", f"{program.name}: {shown} in {max(len(program.files), 1)} file(s)"
    yield from motion_facts(result.found, document)
    if passed:
        yield "not run", passed
