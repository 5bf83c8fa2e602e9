"""The report on a robot program: its document, and lines for the terminal.

Use:

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

from ..programs.exported.export_document import base_document, line_document, tool_document
from ..programs.program import MoveKind
from ..programs.program_check import PROGRAM_REASONS, ProgramFinding, ProgramResult
from ..verdict.failure_words import failure_in_words
from ..verification.bead_order import REASONS
from .facts import facts_grid, headline
from .motion_report import SHOWN, motion_document, motion_facts

if TYPE_CHECKING:
    from rich.console import RenderableType


def program_report(result: ProgramResult, path: str) -> dict[str, Any]:
    """The document of schema "rbam-motion-report/1" of a program: as of a motion, with lines.

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
            "tools": [tool_document(tool) for tool in program.tools],
            "bases": [base_document(base) for base in program.bases],
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
        **line_document(f.line),
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
    yield facts_grid(_facts(result, program_report(result, path)))
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
    passed = ", ".join(f"{kind}: {n}" for kind, n in program.passed_over.items())
    files = max(len(program.files), 1)
    kinds = np.bincount(program.moves.kind, minlength=len(MoveKind))
    names = {"PTP": kinds[MoveKind.AXES], "LIN": kinds[MoveKind.LINEAR], "CIRC": kinds[MoveKind.CIRCULAR]}
    shown = ", ".join(f"{count} {name}" for name, count in names.items() if count)
    yield "program", f"{program.name}: {shown} in {files} file{'s' * (files != 1)}"
    yield from motion_facts(result.found, document)
    if passed:
        yield "not run", passed
