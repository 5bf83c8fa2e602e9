"""A robot program from a file, checked: ``rbam check --program`` and ``rbam replay --program``.

code = check_program_file(args, case)
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from ..atomic_files import STDOUT, check_outputs
from ..case.files import case_files
from ..errors import InputError
from ..processes.worker_pool import working
from .console import put_json, say
from .exit_codes import FEASIBLE, INFEASIBLE
from .process_count import process_count

if TYPE_CHECKING:
    from ..case.sections import Case
    from ..job.job import Job
    from ..programs.program_check import ProgramResult


def program_files(path: str | None) -> list[str | Path]:
    """A program and what it may call: programs and data beside it, as far as the folder can be read; none of None."""
    if path is None:
        return []
    from ..programs.krl.sources import CALLED

    try:
        beside = [file for file in Path(path).parent.iterdir() if file.suffix.upper() in CALLED]
    except OSError:
        beside = []  # reading the program says so
    return [path, *sorted(beside)]


def checked_program(path: str, job: Job) -> ProgramResult:
    """Read a program, run it as the controller would, and judge it.

    Raises:
        InputError: it cannot be read or begun; one line with the file's line.
    """
    from ..programs.cell_controller import cell_controller
    from ..programs.krl_read import read_krl
    from ..programs.program_check import check_program

    return check_program(job, read_krl(path, cell_controller(job)))


def check_program_file(args: argparse.Namespace, case: Case) -> int:
    """Check a program from anybody in the cell.

    Args:
        args: of the command.
        case: the case.

    Returns:
        0 feasible, 1 infeasible.

    Raises:
        InputError: one line.
    """
    from ..atomic_files import write_text
    from ..job.cell_without_part import bare_job
    from ..job.job import prepare
    from ..report.program_document import program_lines, program_report

    check_outputs({"--json": args.json, "--html": args.html}, [*case_files(case), *program_files(args.program)])
    if case.part.absent and args.html:
        raise InputError("--html: shows a part being built; the case has none (part: none)")
    job = bare_job(case) if case.part.absent else prepare(case)
    with working(process_count(args)):
        result = checked_program(args.program, job)
    if args.json:
        put_json(args.json, program_report(result, args.program))
    if args.html:
        from ..html.check_page import html_report
        from ..view.shown_motion import played_program

        write_text(args.html, html_report(played_program(result.found.job, result)))
    say(program_lines(result, args.program), sys.stderr if args.json == STDOUT else sys.stdout)
    return FEASIBLE if result.feasible else INFEASIBLE
