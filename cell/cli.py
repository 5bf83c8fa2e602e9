"""The command ``rbam``: arguments in, exit code out.

    rbam check                                  # the shipped propeller
    rbam check blade.case.yaml --e1 -45 --e2 0 --json report.json

Exit codes: 0 feasible or done, 1 infeasible, 2 bad input or usage (one line on stderr). Documents go to files or, with
``-``, to stdout; the report to stdout; progress and errors to stderr.
"""

from __future__ import annotations

import argparse
import os
import re
import sys
from collections.abc import Callable, Sequence
from typing import IO, TYPE_CHECKING, Any, NoReturn

from .errors import InputError

if TYPE_CHECKING:
    from rich.console import Console

    from .sections import Case

STRATEGIES = ("planar", "cylindrical", "nonuniform", "conical", "revolved")
FEASIBLE, INFEASIBLE, BAD_INPUT, INTERRUPTED = 0, 1, 2, 130

DESCRIPTION = """Can the robot build the part?

rbam slices a part's sub-volumes onto their round body, puts the layers' targets on the table of a welding cell, and
says target by target whether the arm can weld them, bead by bead whether it can do so in one motion, and what stops
it where it cannot."""

EXAMPLES = """examples:
  rbam check                                     the shipped propeller, at its case's table angles
  rbam check my.case.yaml --e1 -45 --e2 0        another table pose
  rbam check --roll fixed:90 --json report.json  the wire's roll held at 90 deg; every target as data
  rbam slice my.case.yaml --targets targets.csv  the layers' targets
  rbam compare --paper                           the slicing strategies on the paper's four parts
  rbam sweep my.case.yaml --e1 -90:90:15         which table angles work
  rbam replay my.case.yaml                       watch the checked motion
  rbam scene my.case.yaml --xml cell.xml         the cell as one MJCF for plain MuJoCo

exit codes: 0 feasible or done, 1 infeasible, 2 bad input (one line says what and what is allowed)"""


class Parser(argparse.ArgumentParser):
    """A parser whose errors are one line."""

    def error(self, message: str) -> NoReturn:
        """Say what is wrong and where help is."""
        self.exit(BAD_INPUT, f"{self.prog}: {message} (see {self.prog} --help)\n")


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command.

    Args:
        argv: arguments; those of the process where left out.

    Returns:
        The exit code.
    """
    args = build_parser().parse_args(_joined_negatives(sys.argv[1:] if argv is None else argv))
    try:
        return int(args.run(args))
    except InputError as error:
        print(f"rbam: {error}", file=sys.stderr)  # noqa: T201 (the one place that speaks)
        return BAD_INPUT
    except KeyboardInterrupt:
        print("rbam: interrupted", file=sys.stderr)  # noqa: T201
        return INTERRUPTED
    except BrokenPipeError:
        # the reader has gone; Python would complain once more when it closes stdout
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return FEASIBLE


def _joined_negatives(argv: Sequence[str]) -> list[str]:
    """``--e1 -90:90:15`` as ``--e1=-90:90:15``: argparse takes what starts with a minus for an option."""
    out: list[str] = []
    for arg in argv:
        if out and out[-1] in ("--e1", "--e2") and re.match(r"-[\d.]", arg):
            out[-1] += "=" + arg
        else:
            out.append(arg)
    return out


def build_parser() -> argparse.ArgumentParser:
    """The command line."""
    formatter = argparse.RawDescriptionHelpFormatter
    parser = Parser(prog="rbam", description=DESCRIPTION, epilog=EXAMPLES, formatter_class=formatter)
    parser.add_argument("--version", action="version", version=f"rbam {_version()}")
    commands = parser.add_subparsers(metavar="COMMAND", required=True)

    def command(
        name: str, run: Callable[[argparse.Namespace], int], summary: str, text: str
    ) -> argparse.ArgumentParser:
        sub = commands.add_parser(
            name,
            help=summary,
            description=f"{summary[0].upper()}{summary[1:]}.\n\n{text}",
            formatter_class=formatter,
        )
        sub.set_defaults(run=run)
        return sub

    check = command("check", _check, "say whether the arm can weld the part, and what stops it", CHECK_TEXT)
    _case_arguments(check)
    check.add_argument("--json", metavar="F", help="write the report rbam-report/1 (- for stdout)")
    check.add_argument("--motion", metavar="F.csv", help="write the checked motion (feasible cases)")

    cut = command("slice", _slice, "cut the sub-volumes into layers and targets", SLICE_TEXT)
    cut.add_argument("input", metavar="MESH|CASE", help="a closed mesh (stl, obj, ply, ..) or a case file (.yaml)")
    cut.add_argument(
        "--body-radius",
        type=float,
        metavar="MM",
        help="the mesh is one sub-volume, on a cylinder of this radius about z",
    )
    cut.add_argument("--units", choices=("mm", "cm", "m", "inch"), default="mm", help="of a mesh (default mm)")
    cut.add_argument("--strategy", choices=STRATEGIES, help="instead of the case's")
    cut.add_argument("--h-layer", type=float, metavar="MM", help="layer height instead of the case's")
    cut.add_argument("--json", metavar="F", help="write the layers, rbam-slices/1 (- for stdout)")
    cut.add_argument("--targets", metavar="F.csv", help="write the targets")

    compare = command("compare", _compare, "hold the slicing strategies against one another", COMPARE_TEXT)
    compare.add_argument("case", nargs="?", metavar="CASE", help="case file (default: the shipped propeller)")
    compare.add_argument(
        "--paper", action="store_true", help="the paper's four parts, with its own figures beside ours"
    )
    compare.add_argument("--json", metavar="F", help="write the comparison, rbam-compare/1 (- for stdout)")

    sweep = command("sweep", _sweep, "try a grid of table angles and map which work", SWEEP_TEXT)
    sweep.add_argument("case", nargs="?", metavar="CASE", help="case file (default: the shipped propeller)")
    sweep.add_argument("--e1", metavar="LO:HI:STEP", help="tilts, deg (default: the axis' range by 45)")
    sweep.add_argument("--e2", metavar="LO:HI:STEP", help="turns, deg (default: the axis' range by 45)")
    sweep.add_argument("--roll", metavar="ROLL", help="free | fixed:DEG | range:LO:HI instead of the case's")
    sweep.add_argument("--workers", type=int, metavar="N", help="processes (default: one a core)")
    sweep.add_argument(
        "--out", metavar="F.jsonl", help="keep finished poses here; an interrupted sweep goes on from it"
    )
    sweep.add_argument("--json", metavar="F", help="write the map, rbam-sweep/1 (- for stdout)")

    replay = command("replay", _replay, "show the checked motion in MuJoCo's viewer", REPLAY_TEXT)
    _case_arguments(replay)
    replay.add_argument("--speed", type=float, default=5.0, metavar="X", help="times real time (default 5)")
    replay.add_argument("--loop", action="store_true", help="start again at the end")
    replay.add_argument("--picture", metavar="F.png", help="render a picture instead; needs no display")
    replay.add_argument("--view", choices=("cell", "torch"), default="cell", help="what the picture frames")
    replay.add_argument("--target", type=int, metavar="I", help="target the picture shows the arm at")

    scene = command(
        "scene",
        _scene,
        "write the composed cell as one MJCF",
        "Plain MuJoCo loads it; nothing else is needed.",
    )
    _case_arguments(scene)
    scene.add_argument("--xml", metavar="F.xml", required=True, help="where to")
    return parser


CHECK_TEXT = """\
Slices the part, puts its targets on the table, searches every configuration of the arm at every
roll about the wire that the case allows, and follows the arm along each bead and from bead to
bead, against joint limits, singularity margins and collisions. "feasible" is said of a motion
that was followed; every infeasible target carries a reason:
  unreachable   the wrist cannot get there            joint_limit   an axis would leave its range
  singular      a margin is too small                 collision     something is nearer than the clearance
  no_path       no motion leads there without a flip or a collision on the way
  speed         a joint is too slow for the deposition    gravity   deposited too far off upright (if limited)"""

SLICE_TEXT = """\
Strategies: planar (planes across the sub-volume's own direction), cylindrical (offsets of the
body), nonuniform (from the body's curvature to planes within h_min .. h_max; Lettori et al. 2024).
A mesh is a whole part, whose round body and sub-volumes are found; with --body-radius it is one
sub-volume on a cylinder about the z axis. Prints the paper's indices: layers NL, adhesion area A,
targets NV, top angle R."""

COMPARE_TEXT = """\
Slices every sub-volume by each strategy and prints the paper's indices (layers NL, adhesion area
A, targets NV, top angle R) with their normalised scores I1..I4 and the total F; higher is better."""

SWEEP_TEXT = """\
Every pose gets the verdict of rbam check at those angles. Poses at which some target has no
configuration at all are not searched further and are counted as they stand. The best pose is the
feasible one that deposits closest to upright and, among equals, with the most clearance."""

REPLAY_TEXT = """\
Space plays and pauses, left and right step by target, up and down by bead, + and - change the
speed, n goes to the next infeasible target, t shows targets. An infeasible case shows its
infeasible targets with what went wrong."""


def _version() -> str:
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version("rbam-cell")
    except PackageNotFoundError:
        return "(not installed)"


def _case_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("case", nargs="?", metavar="CASE", help="case file (default: the shipped propeller)")
    parser.add_argument("--e1", type=float, metavar="DEG", help="tilt of the table instead of the case's")
    parser.add_argument("--e2", type=float, metavar="DEG", help="turn of the table instead of the case's")
    parser.add_argument("--roll", metavar="ROLL", help="free | fixed:DEG | range:LO:HI instead of the case's")


def _load(args: argparse.Namespace) -> Case:
    from .config import DEFAULT_CASE, load_case, with_changes
    from .sections import Table

    case = load_case(args.case or DEFAULT_CASE)
    if getattr(args, "roll", None) is not None:
        case = with_changes(case, roll=parse_roll(args.roll))
    if isinstance(getattr(args, "e1", None), float) or isinstance(getattr(args, "e2", None), float):
        e1 = case.table.E1_deg if args.e1 is None else args.e1
        e2 = case.table.E2_deg if args.e2 is None else args.e2
        case = with_changes(case, table=Table(E1_deg=_finite("--e1", e1), E2_deg=_finite("--e2", e2)))
    return case


def _finite(name: str, value: float) -> float:
    if not abs(value) < float("inf"):
        raise InputError(f"{name}: {value} is not an angle")
    return value


def parse_roll(text: str) -> Any:
    """A roll as the command line writes it.

    Raises:
        InputError: it is none of free, fixed:DEG, range:LO:HI.
    """
    from pydantic import ValidationError

    from .sections import Roll

    kind, *numbers = text.split(":")
    try:
        values = [float(v) for v in numbers]
        if kind == "free" and not values:
            return "free"
        if kind == "fixed" and len(values) == 1:
            return Roll(fixed_deg=values[0])
        if kind == "range" and len(values) == 2:
            return Roll(range_deg=(values[0], values[1]))
    except (ValueError, ValidationError):
        pass
    raise InputError(f"--roll: {text!r} is none of free, fixed:DEG, range:LO:HI (LO <= HI, at most 360 apart)")


def _console(stream: IO[str]) -> Console:
    from rich.console import Console

    # in a pipe lines keep their length: whoever reads them breaks them as it likes
    width = None if stream.isatty() else 200
    return Console(file=stream, highlight=False, width=width, soft_wrap=not stream.isatty())


def _say(lines: Any, to: IO[str]) -> None:
    console = _console(to)
    for line in lines:
        console.print(line)


def _put_json(where: str, document: dict[str, Any]) -> None:
    if where == "-":
        import json

        sys.stdout.write(json.dumps(document, allow_nan=False) + "\n")
        return
    from .files import write_json

    write_json(where, document)


def _outputs(*paths: str | None) -> None:
    """Refuse output paths before the work rather than after it."""
    from .files import check_writable

    for path in paths:
        if path not in (None, "-"):
            check_writable(str(path))


def _check(args: argparse.Namespace) -> int:
    _outputs(args.json, args.motion)
    from .check import check
    from .job import prepare
    from .report import report_document, report_lines

    case = _load(args)
    result = check(prepare(case), case.table.E1_deg, case.table.E2_deg)
    if args.json:
        _put_json(args.json, report_document(result))
    if args.motion:
        if result.motion is None:
            sys.stderr.write(f"rbam: {args.motion} not written: an infeasible case has no motion\n")
        else:
            from .files import write_csv

            write_csv(args.motion, result.motion.columns(), result.motion.rows_deg())
    _say(report_lines(result), sys.stderr if args.json == "-" else sys.stdout)
    return FEASIBLE if result.feasible else INFEASIBLE


def _slice(args: argparse.Namespace) -> int:
    _outputs(args.json, args.targets)
    from slicing.document import slices_document, targets_rows
    from slicing.indices import indices
    from slicing.part import PartError
    from slicing.targets import sample_targets

    from .job import slice_part
    from .parts import read_part
    from .report import slice_lines

    case = _slice_input(args)
    part = read_part(case)
    sliced = slice_part(case, part)
    try:
        targets = sample_targets(sliced, case.sampling.chord_tolerance_mm, case.sampling.min_segment_mm)
    except PartError as error:
        raise InputError(str(error)) from None
    found = [indices(s, targets) for s in sliced]
    if args.json:
        _put_json(args.json, slices_document(sliced, found, part.warnings))
    if args.targets:
        from .files import write_csv

        write_csv(args.targets, *targets_rows(targets))
    _say(slice_lines(sliced, found, part.warnings), sys.stderr if args.json == "-" else sys.stdout)
    return FEASIBLE


def _slice_input(args: argparse.Namespace) -> Case:
    from pathlib import Path

    from .config import load_case, parse_case, with_changes

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
    if not changes:
        return case
    merged = {**case.slicing.model_dump(), **changes}
    if args.h_layer is not None:
        # the limits keep their share of the layer height, as when a process is scaled
        for key in ("h_min_mm", "h_max_mm"):
            merged[key] *= args.h_layer / case.slicing.h_layer_mm
    content = {**case.model_dump(exclude_none=True), "slicing": merged}
    return with_changes(case, slicing=parse_case(content, case.path).slicing)


def _compare(args: argparse.Namespace) -> int:
    _outputs(args.json)
    from .compare import compare_case, compare_document, compare_lines, compare_paper

    if args.paper and args.case:
        raise InputError("--paper compares the paper's own parts: give either it or a case")
    if args.paper:
        title, found = "the paper's parts", compare_paper()
    else:
        case = _load(args)
        title, found = case.title, compare_case(case)
    if args.json:
        _put_json(args.json, compare_document(title, found))
    _say(compare_lines(title, found), sys.stderr if args.json == "-" else sys.stdout)
    return FEASIBLE


def _sweep(args: argparse.Namespace) -> int:
    _outputs(args.json, args.out)
    from .report import sweep_lines
    from .sweep import parse_grid, sweep, sweep_document

    case = _load(args)
    poses = parse_grid(case, args.e1, args.e2)
    if args.workers is not None and args.workers < 1:
        raise InputError(f"--workers: {args.workers} is not a number of processes")
    found = sweep(case, poses, workers=args.workers, log=args.out, progress=sys.stderr)
    document = sweep_document(case, found)
    if args.json:
        _put_json(args.json, document)
    _say(sweep_lines(document), sys.stderr if args.json == "-" else sys.stdout)
    return FEASIBLE if document["best"] else INFEASIBLE


def _replay(args: argparse.Namespace) -> int:
    _outputs(args.picture)
    if not args.speed > 0:
        raise InputError(f"--speed: {args.speed} is not a number above 0")
    from .check import check
    from .job import prepare

    case = _load(args)
    if args.picture:
        from .files import write_bytes
        from .picture import picture

        result = check(prepare(case), case.table.E1_deg, case.table.E2_deg)
        write_bytes(args.picture, picture(result, view=args.view, target=args.target))
        return FEASIBLE
    from .replay import replay, require_display

    require_display()
    result = check(prepare(case), case.table.E1_deg, case.table.E2_deg)
    replay(result, speed=args.speed, loop=args.loop)
    return FEASIBLE


def _scene(args: argparse.Namespace) -> int:
    _outputs(args.xml)
    from .files import write_bytes
    from .job import prepare
    from .scene import standalone_xml

    write_bytes(args.xml, standalone_xml(prepare(_load(args)).scene).encode())
    return FEASIBLE
