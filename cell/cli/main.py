"""The command ``rbam``: arguments in, exit code out.

    rbam check                                  # the shipped propeller
    rbam check blade.case.yaml --e1 -45 --e2 0 --json report.json

Exit codes: 0 feasible or done, 1 infeasible, 2 bad input or usage (one line on stderr), 70 an error of the program
itself (one line; with ``--verbose`` or ``RBAM_TRACEBACK=1`` a traceback before it), 130 interrupted, 128 + n ended by
signal n. Documents go to files or, with ``-``, to stdout; the report to stdout; progress and errors to stderr. The exit
code is the verdict, whoever reads the report and however far.
"""

from __future__ import annotations

import argparse
import os
import re
import sys
from collections.abc import Callable, Sequence
from typing import IO, TYPE_CHECKING, Any

from ..atomic_files import STDOUT, check_outputs, discard_unfinished, write_bytes, write_csv, write_text
from ..errors import InputError
from ..printable import printable
from ..processes import WorkerTraceback, begin_own_process, working
from ..streams import standard_streams
from ..termination import Terminated, terminable
from .arguments import BAD_INPUT, build_parser
from .bar import Bars
from .console import put_json as _put_json
from .console import say as _say
from .jobs import jobs_of
from .speech import is_quiet, is_verbose, speaking

if TYPE_CHECKING:
    from ..case.sections import Case
    from ..remedy_search.search import Remedy
    from ..verdict.check import Result

FEASIBLE, INFEASIBLE, INTERRUPTED, ENDED_BY_SIGNAL = 0, 1, 130, 128
DRAWS = ("replay",)  # commands that MuJoCo draws for
PROGRAM_ERROR = 70  # EX_SOFTWARE of sysexits.h: never a verdict
TRACEBACK = "RBAM_TRACEBACK"  # set to 1, unexpected errors are told with a traceback
# of processor time that the search for remedies may take unless it is asked for, and that of so many whole checks
HELP_SECONDS, HELP_CHECKS = 10.0, 2


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command.

    Args:
        argv: arguments; those of the process where left out.

    Returns:
        The exit code.
    """
    own = argv is None
    argv = sys.argv[1:] if argv is None else argv
    with standard_streams():
        try:
            with terminable():
                code = _run(argv, own)
                sys.stdout.flush()
                return code
        except InputError as error:
            return _told(BAD_INPUT, printable(error))
        except KeyboardInterrupt:
            return _told(INTERRUPTED, "interrupted")
        except Terminated as ended:
            return _told(ENDED_BY_SIGNAL + ended.number, "terminated")
        except Exception as error:  # noqa: BLE001 (the one place: an error of the program is never a verdict)
            return _program_error(error, argv)
        finally:
            discard_unfinished()
            sys.stderr.flush()


def _run(argv: Sequence[str], own: bool) -> int:
    """Run the command; ``own``: the process is there for nothing else."""
    args = build_parser().parse_args(_joined_negatives(argv))
    if own:
        begin_own_process(draws=args.command in DRAWS)
    with speaking(args.quiet, args.verbose, sys.stderr):
        return COMMANDS[args.command](args)


def _told(code: int, line: str) -> int:
    sys.stderr.write(f"rbam: {line}\n")
    return code


def _program_error(error: Exception, argv: Sequence[str]) -> int:
    """Tell an error that no input should cause."""
    import traceback

    asked = os.environ.get(TRACEBACK, "") not in ("", "0") or not {"-v", "--verbose"}.isdisjoint(argv)
    if asked:
        sys.stderr.write("".join(traceback.format_exception(error)))
    if isinstance(error, MemoryError):
        return _told(PROGRAM_ERROR, "out of memory: no verdict; a coarser case needs less memory")
    where = traceback.extract_tb(error.__traceback__)[-1]
    what = printable(f"{type(error).__name__}: {error}")[:300]
    place = f"{os.path.basename(os.path.dirname(where.filename))}/{os.path.basename(where.filename)}:{where.lineno}"
    if isinstance(error.__cause__, WorkerTraceback):
        place = error.__cause__.place
    how = "the traceback above" if asked else f"what {TRACEBACK}=1 or --verbose prints"
    return _told(
        PROGRAM_ERROR, f"no verdict: an error of the program itself ({what}; at {place}); please report it with {how}"
    )


def _joined_negatives(argv: Sequence[str]) -> list[str]:
    """``--e1 -90:90:15`` as ``--e1=-90:90:15``: argparse takes what starts with a minus for an option."""
    out: list[str] = []
    for arg in argv:
        if out and out[-1] in ("--e1", "--e2", "--positioner", "--height") and re.match(r"-[\d.]", arg):
            out[-1] += "=" + arg
        else:
            out.append(arg)
    return out


def _load(args: argparse.Namespace) -> Case:
    from ..case.read import load_case, with_changes
    from ..shipped import DEFAULT_CASE

    case = load_case(args.case or DEFAULT_CASE)
    if getattr(args, "roll", None) is not None:
        case = with_changes(case, roll=parse_roll(args.roll))
    return _at_table(args, case)


def _at_table(args: argparse.Namespace, case: Case) -> Case:
    """The case with its table as the command line wants it."""
    from ..case.read import with_changes
    from ..case.sections import Table

    given = {
        key: _finite(option, value)
        for key, option in (("E1_deg", "--e1"), ("E2_deg", "--e2"))
        if isinstance(value := getattr(args, option.removeprefix("--"), None), float)
    }
    mode = getattr(args, "table", None) or case.table.mode
    if given and mode in ("indexed", "best"):
        option = "--e1" if "E1_deg" in given else "--e2"
        raise InputError(f"{option}: does not go with table mode {mode}, which has poses of its own; add --table fixed")
    if mode == case.table.mode and not given:
        return case
    kept = case.table.model_dump(exclude_unset=True) if mode == case.table.mode else {}
    own = {} if mode in ("indexed", "best") else {"E1_deg": case.table.E1_deg, "E2_deg": case.table.E2_deg}
    return with_changes(case, table=Table(**{**own, **kept, **given, "mode": mode}))


def _finite(name: str, value: float) -> float:
    if not abs(value) < float("inf"):
        raise InputError(f"{name}: {value} is not an angle; a finite number in degrees is needed")
    return value


def parse_roll(text: str) -> Any:
    """A roll as the command line writes it; see ``cell.case.roll_text``."""
    from ..case.roll_text import parse_roll as parsed

    return parsed(text)


def _outputs(args: argparse.Namespace, case: Case | None, *names: str, reads: Sequence[str | None] = ()) -> None:
    """Refuse outputs before the work rather than after it, and those that are inputs of the run."""
    outputs = {f"--{name.replace('_', '-')}": getattr(args, name) for name in names}
    if not any(path not in (None, STDOUT) for path in outputs.values()):
        return
    from ..case.files import case_files

    inputs = () if case is None else case_files(case)
    check_outputs(outputs, [*inputs, *(path for path in reads if path is not None)])


def _check(args: argparse.Namespace) -> int:
    if args.motion_in or args.program:
        return _check_given(args)
    if args.motion:
        from ..motion.motion_file import check_suffix

        check_suffix(args.motion)
    jobs = jobs_of(args)
    case = _load(args)
    if args.all:
        case = _with_every_target(case)
    _outputs(args, case, "json", "motion", "html")
    from ..report.check_report import report_lines
    from ..verdict.as_asked import prepare_and_check

    result = prepare_and_check(case, Bars(sys.stderr), jobs=jobs)
    if args.motion:
        if result.motion is None:
            sys.stderr.write(f"rbam: {args.motion} not written: an infeasible case has no motion\n")
        else:
            from ..motion.motion_file import write_motion

            write_motion(args.motion, result.motion)
    to = sys.stderr if args.json == STDOUT else sys.stdout
    _say(report_lines(result, every=is_verbose()), to)
    reasons = None
    if args.all_reasons:
        from ..report.remedy_lines import all_reasons_lines
        from ..verdict.all_reasons import all_reasons

        reasons = all_reasons(result)
        _say(all_reasons_lines(result, reasons, every=is_verbose()), to)
    unheard = is_quiet() and not (args.json or args.html)
    remedies = [] if unheard else _what_would_help(result, args.remedies, to)
    if args.html:
        from ..html.check_page import html_report

        write_text(args.html, html_report(result, remedies))
    if args.json:
        from ..report.check_document import streamed_report

        _put_json(args.json, streamed_report(result, remedies, reasons))
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
    _say(remedy_lines(result, found), to)  # after the bar, which has the terminal until then
    return found


def _check_given(args: argparse.Namespace) -> int:
    """A motion or a program from outside against the cell."""
    if args.motion_in and args.program:
        raise InputError("--program: does not go with --motion-in; check one after the other")
    kind = "--motion-in: the motion is checked" if args.motion_in else "--program: the program is checked"
    html = args.html if args.motion_in else None
    given = {
        "--all": args.all or None,
        "--motion": args.motion,
        "--html": html,
        "--e1": args.e1,
        "--e2": args.e2,
    }
    for name, value in given.items():
        if value is not None:
            raise InputError(f"{name}: does not go with {kind} as it stands in the file")
    jobs = jobs_of(args)
    case = _load(args)
    if args.program:
        from .program_command import check_program_file

        return check_program_file(args, case)
    _outputs(args, case, "json", reads=[args.motion_in])
    from ..job.job import prepare
    from ..motion.file_order import read_in_order
    from ..motion.motion_file import check_suffix
    from ..report.motion_report import motion_document, motion_lines
    from ..verification.motion_check import check_motion

    check_suffix(args.motion_in)
    job, read = read_in_order(args.motion_in, prepare(case))
    with working(jobs):
        result = check_motion(job, read)
    if args.json:
        _put_json(args.json, motion_document(result, args.motion_in))
    _say(motion_lines(result, args.motion_in), sys.stderr if args.json == STDOUT else sys.stdout)
    return FEASIBLE if result.feasible else INFEASIBLE


def _slice(args: argparse.Namespace) -> int:
    from slicing import indices, slices_document, targets_rows, travels

    from ..job.job import sample_part, slice_part
    from ..job.part_input import found_document, found_lines, read_part
    from ..report.slice_lines import slice_lines

    case = _slice_input(args)
    _outputs(args, case, "json", "targets", "picture", reads=[args.input])
    part = read_part(case)
    sliced = slice_part(case, part)
    laid, targets, told = sample_part(case, sliced)
    found = [indices(s, targets) for s in sliced]
    metal = case.process.density_g_cm3, case.process.wire_diameter_mm
    if args.json:
        document = slices_document(sliced, found, part.warnings, laid, *metal)
        _put_json(args.json, {**document, **found_document(part.T_part_input, part.evidence)})
    if args.targets:
        ways = travels(targets, case.process.retract_mm, sliced[0].body.surface.axis_point)
        write_csv(args.targets, *targets_rows(targets, ways, case.process.travel_speed_mm_s))
    if args.picture:
        from ..view.layer_picture import body_of, slice_picture

        png = slice_picture(sliced, body_of(part), title=case.title, colour=args.colour, laid=laid)
        write_bytes(args.picture, png)
    lines = [
        *slice_lines(sliced, found, part.warnings, told, laid, case.process),
        *found_lines(part.T_part_input, part.evidence),
    ]
    _say(lines, sys.stderr if args.json == STDOUT else sys.stdout)
    return FEASIBLE


def _slice_input(args: argparse.Namespace) -> Case:
    from pathlib import Path

    from ..case.read import load_case, parse_case, with_changes

    if args.input.endswith((".yaml", ".yml")):
        case = load_case(args.input)
    else:
        path = Path(args.input)
        part: dict[str, object] = {"mesh": path.name, "units": args.units}
        if args.body_radius is not None:
            part = {"sub_volumes": [path.name], "body": {"radius_mm": args.body_radius}, "units": args.units}
        case = parse_case({"part": part}, path.parent / "command line")
    changes = {"strategy": args.strategy, "h_layer_mm": args.h_layer}
    changes = {key: value for key, value in changes.items() if value is not None}
    beads = {"pattern": args.pattern, "width_mm": args.width}
    beads = {key: value for key, value in beads.items() if value is not None}
    if not changes and not beads:
        return case
    from dataclasses import asdict

    merged = {**asdict(case.slicing), **changes}
    if args.h_layer is not None:
        # the limits keep their share of the layer height, as when a process is scaled
        for key in ("h_min_mm", "h_max_mm"):
            merged[key] *= args.h_layer / case.slicing.h_layer_mm
    content = {**case.model_dump(exclude_none=True), "slicing": merged}
    content["beads"] = {**content.get("beads", {}), **beads}
    asked = parse_case(content, case.path)
    return with_changes(case, slicing=asked.slicing, beads=asked.beads)


def _compare(args: argparse.Namespace) -> int:
    from ..compare.compare import compare_case, compare_document, compare_paper
    from ..report.comparison_lines import compare_lines

    if args.paper and args.case:
        raise InputError("--paper: compares the paper's own parts; leave the case out")
    if args.paper:
        _outputs(args, None, "json", "html")
        title, found = "the paper's parts", compare_paper()
    else:
        case = _load(args)
        _outputs(args, case, "json", "html")
        title, found = case.title, compare_case(case)
    if args.json:
        _put_json(args.json, compare_document(title, found))
    if args.html:
        from ..html.comparison_page import html_compare

        write_text(args.html, html_compare(compare_document(title, found)))
    _say(compare_lines(title, found), sys.stderr if args.json == STDOUT else sys.stdout)
    return FEASIBLE


def _sweep(args: argparse.Namespace) -> int:
    from ..case.read import with_changes
    from ..pose_sweep.grid import grid
    from ..pose_sweep.ranking import sweep_document
    from ..pose_sweep.sweep import require_standing, sweep
    from ..report.sweep_lines import sweep_lines

    case = _load(args)
    require_standing(case)
    _outputs(args, case, "json", "out", "csv", "picture", "html")
    rolls = list(dict.fromkeys(args.rolls or ()))
    if len(rolls) == 1:  # nothing to tell poses apart by: the case's own roll is another one
        case = with_changes(case, roll=parse_roll(rolls.pop()))
        case = with_changes(case, sweep=case.sweep.model_copy(update={"roll": []}))
    poses = grid(case, args.e1, args.e2, rolls=rolls, placements=args.positioner or (), height=args.height)
    if args.workers is not None and args.workers < 1:
        raise InputError(f"--workers: {args.workers} is not a number of processes; 1 or more is needed")
    if args.dask is not None and args.workers is not None:
        raise InputError("--workers: the Dask cluster has workers of its own; give either --workers or --dask")
    with _executor(args.dask) as executor:
        found = sweep(case, poses, workers=args.workers, log=args.out, progress=Bars(sys.stderr), executor=executor)
    document = sweep_document(case, found)
    _put_sweep(args, case, document)
    _say(sweep_lines(document), sys.stderr if args.json == STDOUT else sys.stdout)
    return FEASIBLE if document["best"] else INFEASIBLE


def _executor(dask: str | None) -> Any:
    from contextlib import nullcontext

    if dask is None:
        return nullcontext()
    from ..pose_sweep.workers import dask_cluster

    return dask_cluster(dask)


def _put_sweep(args: argparse.Namespace, case: Case, document: dict[str, Any]) -> None:
    if args.json:
        _put_json(args.json, document)
    if args.csv:
        from ..pose_sweep.ranking import sweep_columns

        write_csv(args.csv, *sweep_columns(document))
    if args.picture:
        from ..view.sweep_map_picture import sweep_picture

        write_bytes(args.picture, sweep_picture(document))
    if args.html:
        from ..html.sweep_page import html_sweep

        write_text(args.html, html_sweep(case, document))


def _replay(args: argparse.Namespace) -> int:
    from .replay_command import show

    show(args, _load(args))
    return FEASIBLE


def _scene(args: argparse.Namespace) -> int:
    case = _load(args)
    _outputs(args, case, "xml")
    from ..job.job import prepare
    from ..report.scene_contents import look_into_scene, scene_lines
    from ..scene.scene import table_angles
    from ..scene.standalone import standalone_xml

    scene = prepare(case).scene
    if args.xml:
        write_text(args.xml, standalone_xml(scene))
        return FEASIBLE
    _say(scene_lines(look_into_scene(scene, table_angles(scene, case.table.E1_deg, case.table.E2_deg))), sys.stdout)
    return FEASIBLE


def _export(args: argparse.Namespace) -> int:
    from .program_command import export

    return export(args, _load(args))


COMMANDS: dict[str, Callable[[argparse.Namespace], int]] = {
    "check": _check,
    "export": _export,
    "slice": _slice,
    "compare": _compare,
    "sweep": _sweep,
    "replay": _replay,
    "scene": _scene,
}
