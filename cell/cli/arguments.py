"""The arguments of ``rbam`` and the help that teaches them.

Use:

    args = build_parser().parse_args(["check", "--e1", "-45"])
    args.command, args.e1
"""

from __future__ import annotations

import argparse
import difflib
import sys
from typing import Any, NoReturn

from .exit_codes import BAD_INPUT

STRATEGIES = ("planar", "cylindrical", "nonuniform", "conical", "revolved")
PATTERNS = ("contour", "contour_parallel", "zigzag")
CASE_HELP = "case file, or the name of a shipped case (default: propeller)"
TABLE_MODES = ("fixed", "indexed", "coordinated", "best")
FORMATTER = argparse.RawDescriptionHelpFormatter
Commands = Any  # what argparse gives for subparsers has no name of its own

DESCRIPTION = """Can the robot build the part?

rbam slices a part's sub-volumes onto their round body and puts the targets on the table of a welding cell. It says
for every target whether the arm can weld it, for every bead whether it can be welded in one motion, and what is in the
way where it cannot."""

EXAMPLES = """examples:
  rbam check                                     the shipped propeller, at its case's table angles
  rbam check my.case.yaml --e1 -45 --e2 0        another table pose
  rbam check my.case.yaml --table indexed        a table pose for each sub-volume, searched if none is given
  rbam check --html report.html                  the report as a page in 3D, with the joints over time
  rbam check --roll fixed:90 --json report.json  the wire's roll held at 90 deg; every target as data
  rbam check my.case.yaml --motion-in their.csv  does a motion from another planner hold in this cell?
  rbam check my.case.yaml --program their.src    does a robot program hold in this cell?
  rbam export my.case.yaml --krl out             the checked motion as a KUKA program
  rbam slice my.case.yaml --targets targets.csv  the layers' targets
  rbam compare --paper                           the slicing strategies on the paper's four parts
  rbam sweep my.case.yaml --html map.html        which table angles work, as a map to click on
  rbam replay my.case.yaml                       watch the checked motion
  rbam replay my.case.yaml --video film.mp4      the same as a film
  rbam scene my.case.yaml                        what always touches, what does not collide, what is not planned
  rbam scene my.case.yaml --xml cell.xml         the cell as one MJCF for plain MuJoCo

exit codes: 0 feasible or done, 1 infeasible, 2 bad input (one line: what is wrong and what is allowed),
70 an error of rbam itself (one line; RBAM_TRACEBACK=1 or --verbose prints more), 130 interrupted"""


class Parser(argparse.ArgumentParser):
    """A parser whose errors are one line."""

    def error(self, message: str) -> NoReturn:
        """Say what is wrong and where help is."""
        self.exit(BAD_INPUT, f"{self.prog}: {message} (see {self.prog} --help)\n")

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> tuple[Any, list[str]]:
        """As argparse does, but a command refuses an option that it does not have, and names the one that is meant."""
        found, rest = super().parse_known_args(args, namespace)
        unknown = next((one.split("=")[0] for one in rest if one.startswith("--")), None)
        if unknown is not None and self.get_default("command"):
            known = [name for action in self._actions for name in action.option_strings]
            near = difflib.get_close_matches(unknown.lower(), known, n=1)
            self.error(f"no option {unknown}{f'; did you mean {near[0]}?' if near else ''}")
        return found, rest


class _Version(argparse.Action):
    """Say the version; it is looked up only then, which takes as long as all the rest of the parser."""

    def __call__(self, parser: argparse.ArgumentParser, *_: Any) -> NoReturn:
        """Print it and exit."""
        sys.stdout.write(f"rbam {_version()}\n")
        parser.exit()


def build_parser() -> argparse.ArgumentParser:
    """The command line."""
    parser = Parser(prog="rbam", description=DESCRIPTION, epilog=EXAMPLES, formatter_class=FORMATTER)
    parser.add_argument("--version", action=_Version, nargs=0, help="show program's version number and exit")
    commands = parser.add_subparsers(metavar="COMMAND", required=True)
    for add in (_add_check, _add_export, _add_slice, _add_compare, _add_sweep, _add_replay, _add_scene):
        add(commands)
    return parser


def _command(commands: Commands, name: str, summary: str, text: str) -> argparse.ArgumentParser:
    """A command with what all commands have."""
    sub: argparse.ArgumentParser = commands.add_parser(
        name, help=summary, description=f"{summary[0].upper()}{summary[1:]}.\n\n{text}", formatter_class=FORMATTER
    )
    sub.set_defaults(command=name)
    loud = sub.add_mutually_exclusive_group()
    loud.add_argument("-q", "--quiet", action="store_true", help="print only errors; the exit code is the answer")
    every = "all infeasible targets and " if name == "check" else ""
    loud.add_argument("-v", "--verbose", action="store_true", help=f"print {every}how long each step took")
    return sub


def _add_check(commands: Commands) -> None:
    check = _command(commands, "check", "say whether the arm can weld the part, and what stops it", CHECK_TEXT)
    _case_arguments(check)
    check.add_argument("--json", metavar="F", help="write the report rbam-report/1 (- for stdout)")
    check.add_argument("--html", metavar="F.html", help="write a page with the part in 3D: one file, works offline")
    check.add_argument(
        "--every-target",
        action="store_true",
        help="check every target of a part that cannot be built, however long that takes (checks.every_target)",
    )
    check.add_argument("--all", action="store_true", dest="every_target", help=argparse.SUPPRESS)  # its former name
    check.add_argument(
        "--all-reasons",
        action="store_true",
        help="for the worst infeasible targets (-v: all), count the configurations that each reason excludes",
    )
    check.add_argument(
        "--remedies",
        action=argparse.BooleanOptionalAction,
        help="search a change that makes an infeasible case feasible (default: at most 10 s of processor "
        "time and that of two checks; Ctrl-C ends it)",
    )
    check.add_argument("--motion", metavar="F.csv|F.npz", help="write the checked motion (only of a feasible case)")
    check.add_argument(
        "--motion-in",
        metavar="F.csv|F.npz",
        help="check this motion, from any planner, in the case's cell instead of searching one",
    )
    check.add_argument(
        "--program",
        metavar="F.src",
        help="check this robot program (KRL), run as the controller would, instead of searching a motion",
    )

    _process_count_argument(check)


def _add_export(commands: Commands) -> None:
    export = _command(commands, "export", "write the checked motion as a robot program", EXPORT_TEXT)
    _case_arguments(export)
    _process_count_argument(export)
    export.add_argument(
        "--motion-in", metavar="F.csv|F.npz", help="write this motion, once it is checked, instead of searching one"
    )
    export.add_argument("--krl", metavar="DIR", help="write KRL: NAME.src, the modules it calls, and NAME.json")
    export.add_argument(
        "--csv", metavar="F.csv", help="write every point: poses in base and part, axes, speed, arc, line"
    )
    export.add_argument(
        "--robodk", metavar="F.py", help="write a script that makes the program in RoboDK, for robots of any maker"
    )


def _add_slice(commands: Commands) -> None:
    cut = _command(commands, "slice", "cut the sub-volumes into layers and targets", SLICE_TEXT)
    cut.add_argument(
        "input",
        metavar="MESH|CASE",
        help="a closed mesh (stl, obj, ply, ..), a case file (.yaml), or the name of a shipped case",
    )
    cut.add_argument(
        "--body-radius",
        type=float,
        metavar="MM",
        help="the mesh is one sub-volume, on a cylinder of this radius about z",
    )
    cut.add_argument("--units", choices=("mm", "cm", "m", "inch"), help="unit of a mesh (default mm)")
    cut.add_argument("--strategy", choices=STRATEGIES, help="slicing strategy instead of the case's")
    cut.add_argument("--h-layer", type=float, metavar="MM", help="layer height instead of the case's")
    cut.add_argument("--pattern", choices=PATTERNS, help="pattern of the beads instead of the case's")
    cut.add_argument("--width", type=float, metavar="MM", help="width of a bead instead of the case's")
    cut.add_argument("--json", metavar="F", help="write the layers, rbam-slices/1 (- for stdout)")
    cut.add_argument("--targets", metavar="F.csv", help="write the targets and the travels between beads")
    cut.add_argument("--picture", metavar="F.png", help="draw the layers")
    cut.add_argument("--colour", choices=("thickness", "layer"), default="thickness", help="what the colours show")


def _add_compare(commands: Commands) -> None:
    compare = _command(commands, "compare", "compare the slicing strategies", COMPARE_TEXT)
    compare.add_argument("case", nargs="?", metavar="CASE", help=CASE_HELP)
    compare.add_argument(
        "--paper", action="store_true", help="compare on the paper's four parts, beside the paper's figures"
    )
    compare.add_argument("--json", metavar="F", help="write the comparison, rbam-compare/1 (- for stdout)")
    compare.add_argument("--html", metavar="F.html", help="write a page with tables and bars: one file, works offline")


def _add_sweep(commands: Commands) -> None:
    sweep = _command(commands, "sweep", "check a grid of table poses and map which are feasible", SWEEP_TEXT)
    sweep.add_argument("case", nargs="?", metavar="CASE", help=CASE_HELP)
    sweep.add_argument("--e1", metavar="LO:HI:STEP", help="tilts, deg (default: the axis' range in steps of 45)")
    sweep.add_argument("--e2", metavar="LO:HI:STEP", help="turns, deg (default: the axis' range in steps of 45)")
    sweep.add_argument(
        "--table",
        choices=TABLE_MODES,
        help="mode of the table instead of the case's; coordinated cannot be swept",
    )
    sweep.add_argument(
        "--roll",
        dest="rolls",
        action="append",
        metavar="ROLL",
        help="free | fixed:DEG | range:LO:HI instead of the case's; several times: a map for each",
    )
    sweep.add_argument(
        "--positioner",
        action="append",
        metavar="X,Y,Z[,RZ]",
        help="position of the positioner, mm and deg, instead of the case's; several times: a map for each",
    )
    sweep.add_argument(
        "--height", metavar="LO:HI:STEP", help="heights of the support (without one, of the part), mm: a map for each"
    )
    sweep.add_argument("--jobs", type=int, metavar="N", help="number of processes (default: one for each core)")
    sweep.add_argument("--dask", metavar="ADDRESS", help="compute on a Dask cluster, such as tcp://HOST:8786")
    sweep.add_argument("--out", metavar="F.jsonl", help="log of finished poses; an interrupted sweep goes on from it")
    sweep.add_argument("--json", metavar="F", help="write the map, rbam-sweep/1 (- for stdout)")
    sweep.add_argument("--csv", metavar="F.csv", help="write the poses as a table")
    sweep.add_argument("--picture", metavar="F.png", help="draw the map")
    sweep.add_argument("--html", metavar="F.html", help="write the map as a page to click on: one file, works offline")


def _add_replay(commands: Commands) -> None:
    replay = _command(commands, "replay", "show the checked motion: window, browser, picture or film", REPLAY_TEXT)
    _case_arguments(replay)
    _process_count_argument(replay)
    _replay_arguments(replay)


def _add_scene(commands: Commands) -> None:
    scene = _command(
        commands,
        "scene",
        "describe the composed cell, or write it as one MJCF",
        "Lists shapes that always touch or never collide, links without shapes, the home pose and joints that are not\n"
        "planned. With --xml it writes the cell as one file for plain MuJoCo.",
    )
    _case_arguments(scene)
    scene.add_argument("--xml", metavar="F.xml", help="write the cell to this file instead")


CHECK_TEXT = """\
Slices the part and puts its targets on the table. Searches the arm's configurations at every roll about the wire
that the case allows. Then follows the arm from home along each bead, from bead to bead and back home, and checks
joint limits, singularity margins and collisions. "feasible" means that one such motion was found and checked
all along. Every infeasible target has a reason:
  unreachable   the wrist cannot get there            joint_limit   an axis would leave its range
  singular      the arm is too near a singularity     collision     something is nearer than the clearance
  no_path       no motion leads there without a flip or a collision on the way
  speed         slower than allowed: an axis cannot keep up (process.least_speed_share)
  gravity       the bead is laid too far off upright (if the case sets a limit)
  overhang      the layer overhangs too far (if the case sets a limit)
Once a part is known to be infeasible, the search for infeasible targets is limited: 100 configurations (20,000 for
parts of up to 600 targets) and 1 more for each target, spread evenly over the part. Targets that were not checked
for this reason are counted. --every-target checks all of them.

For an infeasible case the smallest change that helps is searched and checked: the roll, E1, E2, the position of
the positioner, the height of the support or the position of the part, the stick-out, the deposition speed,
the rounding of corners, or the seams of closed beads.

Parts of 1,500 targets and more are checked in chunks of whole beads, on all cores unless --jobs limits them. The
verdict and the motion do not depend on the number of processes. Each process needs 250 to 800 MB.

--motion writes rows of t_s, A1_deg .. A6_deg, E1_deg, E2_deg, arc, bead, layer, target.
--motion-in reads such a file from any planner. It checks joint limits, speeds, accelerations, singularities, the
beads, and collisions with the part as it grows. Verdict, --json and exit codes are those of a check.
--program reads any KRL program, runs it as the controller would, and checks it in the same way. Findings name the
file and line."""

EXPORT_TEXT = """\
Checks the case like rbam check and writes its motion as a KUKA program. Beads are LIN moves in the part's
frame on the table ($BASE = EK(..)), with E1 and E2 in every point. Moves between beads are LIN and PTP. The
case's section controller sets names, numbers, hooks and speeds. The program is read back and run as the
controller would run it. Files are written only if that motion is feasible and is the checked one within 0.05 mm
and 0.05 deg (plus the thinning that the case allows); otherwise the exit code is 1 and one line names the wrong line.
No program has run on a controller yet: docs/programs.md describes the dry run.

examples:
  rbam export my.case.yaml --krl out
  rbam export my.case.yaml --krl out --csv points.csv --robodk station.py
  rbam check my.case.yaml --program out/MY.src"""

SLICE_TEXT = """\
Strategies: planar (planes across the sub-volume's own direction), cylindrical (offsets of the
body), nonuniform (from the body's curvature to planes within h_min .. h_max; Lettori et al. 2024),
conical and revolved (offsets of a cone or of a turned profile).
With slicing: {body: planar} in a case the body is sliced as well, across its axis, as BODY.
A mesh is a whole part, whose round body and sub-volumes are found; with --body-radius it is one
sub-volume on a cylinder about the z axis. Prints the paper's indices: layers NL, adhesion area A,
targets NV, top angle R. By default every border of a layer is one bead. --pattern fills the layer as well: with
rounds along the border (contour_parallel) or with parallel lines (zigzag). The case's section beads sets
the width of the beads, where they start, and their direction and order."""

COMPARE_TEXT = """\
Slices every sub-volume with each strategy that suits its body and prints the paper's indices
(layers NL, adhesion area A, targets NV, top angle R), their normalised scores I1..I4 and the
total score F. A higher score is better."""

SWEEP_TEXT = """\
Every pose gets the verdict of rbam check at those angles. Two kinds of poses are settled without a search: the
table collides, or some target by itself has no free configuration. Where not all targets were checked their count
is of those that were ("12+": at least 12). Feasible poses are ranked by the largest angle off upright (in steps of
5 deg), then by clearance (1 mm), singularity margin, distance to the joint limits, and time. The grid may also stand
in the case's section sweep.

examples:
  rbam sweep --e1 -135:135:15 --e2 -180:180:15 --picture map.png
  rbam sweep --roll free --roll fixed:-60 --roll fixed:-90 --html map.html
  rbam sweep my.case.yaml --positioner 1400,0,0 --positioner 1550,0,0 --height 80:160:40 --out map.jsonl"""

REPLAY_TEXT = """\
Opens MuJoCo's viewer. Without a display use --web, --picture or --video. Keys: space plays and pauses, left and
right step by target, up and down by bead, + and - change the speed, n goes to the next infeasible target, t shows
targets, o normals, c changes the colours, v the view. An infeasible case shows its infeasible targets and what is
wrong there. --motion-in shows a motion file, feasible or not, with the findings of a check. --program shows a robot
program with its lines.

examples:
  rbam replay --picture torch.png --view torch --target 40
  rbam replay --video film.mp4 --speed 20 --size 1920x1080
  rbam replay my.case.yaml --sweep map.json --pose best --web
  rbam replay my.case.yaml --motion-in theirs.csv"""


def _version() -> str:
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version("rbam-cell")
    except PackageNotFoundError:
        return "(not installed)"


def _replay_arguments(replay: argparse.ArgumentParser) -> None:
    instead = replay.add_mutually_exclusive_group()
    instead.add_argument("--web", action="store_true", help="show the motion in a browser; stop with Ctrl-C")
    instead.add_argument("--picture", metavar="F.png", help="write a picture; needs no display")
    instead.add_argument(
        "--video", metavar="F.mp4|F.gif", help="write a film; needs no display (mp4 needs the extra 'video')"
    )
    replay.add_argument(
        "--speed", type=float, metavar="X", help="seconds of motion in a second (default 5; of a film 10)"
    )
    replay.add_argument(
        "--motion-in", metavar="F.csv|F.npz", help="show this motion, feasible or not, instead of searching one"
    )
    replay.add_argument("--program", metavar="F.src", help="show the motion of a robot program, feasible or not")
    replay.add_argument("--loop", action="store_true", help="start again at the end")
    replay.add_argument(
        "--colour", choices=("layer", "thickness", "verdict"), default="layer", help="what the beads' colours show"
    )
    replay.add_argument("--sweep", metavar="F", help="take the table pose from a sweep's map (--json) or log (--out)")
    replay.add_argument("--pose", metavar="N|best", help="number of the sweep's pose, from 0 (default best)")
    replay.add_argument("--view", choices=("cell", "torch"), help="what a picture or film shows (default cell)")
    replay.add_argument("--size", metavar="WxH", help="pixels of a picture (1600x1000) or film (mp4 1280x720)")
    replay.add_argument("--fps", type=float, metavar="N", help="frames per second of a film (mp4 25, gif 12.5)")
    replay.add_argument("--target", type=int, metavar="I", help="target at which the picture shows the arm")
    replay.add_argument("--host", metavar="ADDRESS", help="interface of --web (default 127.0.0.1, only this machine)")
    replay.add_argument("--port", type=int, metavar="N", help="port of --web (default: the first free from 8080)")


def _process_count_argument(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--jobs",
        type=int,
        metavar="N",
        help="number of processes for a large part or a long motion (default: one for each core); the verdict does not"
        " depend on it",
    )


def _case_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("case", nargs="?", metavar="CASE", help=CASE_HELP)
    parser.add_argument("--e1", type=float, metavar="DEG", help="tilt of the table instead of the case's")
    parser.add_argument("--e2", type=float, metavar="DEG", help="turn of the table instead of the case's")
    parser.add_argument(
        "--table",
        choices=TABLE_MODES,
        help="mode of the table instead of the case's: one pose | one for each sub-volume | moving along the "
        "beads | the best pose",
    )
    parser.add_argument("--roll", metavar="ROLL", help="free | fixed:DEG | range:LO:HI instead of the case's")
