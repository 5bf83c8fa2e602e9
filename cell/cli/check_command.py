"""What ``rbam check`` does."""

from __future__ import annotations

import argparse
import sys
from typing import IO, TYPE_CHECKING

from ..atomic_files import STDOUT, write_text
from ..errors import InputError
from ..processes.worker_pool import working
from .case_options import load, refuse_outputs
from .console import put_json, say
from .exit_codes import FEASIBLE, INFEASIBLE
from .process_count import process_count
from .progress_bar import Bars
from .verbosity import is_quiet, is_verbose

if TYPE_CHECKING:
    from ..case.sections import Case
    from ..remedy_search.search import Remedy
    from ..verdict.result import Result


# of processor time that the search for remedies may take unless it is asked for, and that of so many whole checks
HELP_SECONDS, HELP_CHECKS = 10.0, 2


def run(args: argparse.Namespace) -> int:
    """Check a case, a motion or a program, and write what is asked for.

    Returns:
        The exit code.

    Raises:
        InputError: one line.
    """
    if args.motion_in or args.program:
        return _check_given(args)
    if args.motion:
        from ..motion.motion_file import check_suffix

        check_suffix(args.motion)
    processes = process_count(args)
    case = load(args)
    if args.every_target:
        case = _with_every_target(case)
    refuse_outputs(args, case, "json", "motion", "html")
    from ..report.check_report import report_lines
    from ..verdict.by_table_mode import prepare_and_check

    result = prepare_and_check(case, Bars(sys.stderr), processes=processes)
    if args.motion:
        if result.motion is None:
            sys.stderr.write(f"rbam: {args.motion} not written: an infeasible case has no motion\n")
        else:
            from ..motion.motion_file import write_motion

            write_motion(args.motion, result.motion)
    to = sys.stderr if args.json == STDOUT else sys.stdout
    say(report_lines(result, every=is_verbose()), to)
    reasons = None
    if args.all_reasons:
        from ..report.remedy_lines import all_reasons_lines
        from ..verdict.all_reasons import all_reasons

        reasons = all_reasons(result)
        say(all_reasons_lines(result, reasons, every=is_verbose()), to)
    unheard = is_quiet() and not (args.json or args.html)
    remedies = [] if unheard else _what_would_help(result, args.remedies, to)
    if args.html:
        from ..html.check_page import html_report

        write_text(args.html, html_report(result, remedies))
    if args.json:
        from ..report.check_document import streamed_report

        put_json(args.json, streamed_report(result, remedies, reasons))
    return FEASIBLE if result.feasible else INFEASIBLE


def _with_every_target(case: Case) -> Case:
    from ..case.read import with_changes

    return with_changes(case, checks=case.checks.model_copy(update={"every_target": True}))


def _what_would_help(result: Result, asked: bool | None, to: IO[str]) -> list[Remedy]:
    """Search and say what would help an infeasible case; Ctrl-C ends the search, and the verdict stands."""
    if result.feasible or asked is False:
        return []
    from ..remedy_search.search import remedies
    from ..report.remedy_lines import remedy_lines

    found: list[Remedy] = []
    try:
        for remedy in remedies(
            result, Bars(sys.stderr), float("inf") if asked else HELP_SECONDS + HELP_CHECKS * result.seconds
        ):
            found.append(remedy)
    except KeyboardInterrupt:
        sys.stderr.write("rbam: the search for a change that helps was interrupted\n")
    say(remedy_lines(result, found), to)  # after the bar, which has the terminal until then
    return found


def _check_given(args: argparse.Namespace) -> int:
    """A motion or a program from outside against the cell."""
    if args.motion_in and args.program:
        raise InputError("--program: does not go with --motion-in; check one after the other")
    kind = "--motion-in: the motion is checked" if args.motion_in else "--program: the program is checked"
    html = args.html if args.motion_in else None
    given = {
        "--every-target": args.every_target or None,
        "--motion": args.motion,
        "--html": html,
        "--e1": args.e1,
        "--e2": args.e2,
    }
    for name, value in given.items():
        if value is not None:
            raise InputError(f"{name}: does not go with {kind} as it stands in the file")
    processes = process_count(args)
    case = load(args)
    if args.program:
        from .program_file import check_program_file

        return check_program_file(args, case)
    refuse_outputs(args, case, "json", reads=[args.motion_in])
    from ..job.job import prepare
    from ..motion.file_order import read_in_order
    from ..motion.motion_file import check_suffix
    from ..report.motion_report import motion_document, motion_lines
    from ..verification.motion_check import check_motion

    check_suffix(args.motion_in)
    job, read = read_in_order(args.motion_in, prepare(case))
    with working(processes):
        result = check_motion(job, read)
    if args.json:
        put_json(args.json, motion_document(result, args.motion_in))
    say(motion_lines(result, args.motion_in), sys.stderr if args.json == STDOUT else sys.stdout)
    return FEASIBLE if result.feasible else INFEASIBLE
