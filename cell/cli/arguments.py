"""The arguments of ``rbam`` and the help that teaches them.

Use:

    args = build_parser().parse_args(["check", "--e1", "-45"])
    args.command, args.e1
"""

from __future__ import annotations

import argparse
import sys
from typing import Any, NoReturn

BAD_INPUT = 2
STRATEGIES = ("planar", "cylindrical", "nonuniform", "conical", "revolved")
PATTERNS = ("contour", "contour_parallel", "zigzag")
CASE_HELP = "case file, or the name of a shipped case (default: propeller)"
TABLE_MODES = ("fixed", "indexed", "coordinated", "best")

DESCRIPTION = """Can the robot build the part?

rbam slices a part's sub-volumes onto their round body, puts the layers' targets on the table of a welding cell, and
says target by target whether the arm can weld them, bead by bead whether it can do so in one motion, and what stops
it where it cannot."""

EXAMPLES = """examples:
  rbam check                                     the shipped propeller, at its case's table angles
  rbam check my.case.yaml --e1 -45 --e2 0        another table pose
  rbam check my.case.yaml --table indexed        a table pose for each sub-volume, searched where none is given
  rbam check --html report.html                  the same in 3D, with the joints over time
  rbam check --roll fixed:90 --json report.json  the wire's roll held at 90 deg; every target as data
  rbam check my.case.yaml --motion-in their.csv  does a motion from another planner hold in this cell?
  rbam check my.case.yaml --program their.src    does a robot program?
  rbam export my.case.yaml --krl out             the checked motion as a KUKA program
  rbam slice my.case.yaml --targets targets.csv  the layers' targets
  rbam compare --paper                           the slicing strategies on the paper's four parts
  rbam sweep my.case.yaml --html map.html        which table angles work, as a map to click on
  rbam replay my.case.yaml                       watch the checked motion
  rbam replay my.case.yaml --video film.mp4      the same as a film
  rbam scene my.case.yaml                        what always touches, what does not collide, what is not planned
  rbam scene my.case.yaml --xml cell.xml         the cell as one MJCF for plain MuJoCo

exit codes: 0 feasible or done, 1 infeasible, 2 bad input (one line says what and what is allowed),
70 an error of the program itself (one line; RBAM_TRACEBACK=1 or --verbose says more), 130 interrupted"""


class Parser(argparse.ArgumentParser):
    """A parser whose errors are one line."""

    def error(self, message: str) -> NoReturn:
        """Say what is wrong and where help is."""
        self.exit(BAD_INPUT, f"{self.prog}: {message} (see {self.prog} --help)\n")


class _Version(argparse.Action):
    """Say the version; it is looked up only then, which takes as long as all the rest of the parser."""

    def __call__(self, parser: argparse.ArgumentParser, *_: Any) -> NoReturn:
        """Print it and exit."""
        sys.stdout.write(f"rbam {_version()}\n")
        parser.exit()


def build_parser() -> argparse.ArgumentParser:
    """The command line."""
    formatter = argparse.RawDescriptionHelpFormatter
    parser = Parser(prog="rbam", description=DESCRIPTION, epilog=EXAMPLES, formatter_class=formatter)
    parser.add_argument("--version", action=_Version, nargs=0, help="show program's version number and exit")
    commands = parser.add_subparsers(metavar="COMMAND", required=True)

    def command(name: str, summary: str, text: str) -> argparse.ArgumentParser:
        sub = commands.add_parser(
            name,
            help=summary,
            description=f"{summary[0].upper()}{summary[1:]}.\n\n{text}",
            formatter_class=formatter,
        )
        sub.set_defaults(command=name)
        loud = sub.add_mutually_exclusive_group()
        loud.add_argument(
            "-q", "--quiet", action="store_true", help="say nothing but errors: the exit code is the answer"
        )
        every = "all infeasible targets, and " if name == "check" else ""
        loud.add_argument("-v", "--verbose", action="store_true", help=f"say {every}what took how long")
        return sub

    check = command("check", "say whether the arm can weld the part, and what stops it", CHECK_TEXT)
    _case_arguments(check)
    check.add_argument("--json", metavar="F", help="write the report rbam-report/1 (- for stdout)")
    check.add_argument("--html", metavar="F.html", help="write a report to look at and to send: one file, no network")
    check.add_argument(
        "--all",
        action="store_true",
        help="look at every target of a part that is lost, however long that takes (checks.every_target)",
    )
    check.add_argument(
        "--all-reasons",
        action="store_true",
        help="of the worst infeasible targets (-v: all), how many candidates each reason excludes",
    )
    check.add_argument(
        "--remedies",
        action=argparse.BooleanOptionalAction,
        help="search what would make an infeasible case feasible (default: 10 s and two checks; Ctrl-C ends it)",
    )
    check.add_argument("--motion", metavar="F.csv|F.npz", help="write the checked motion (feasible cases)")
    check.add_argument(
        "--motion-in",
        metavar="F.csv|F.npz",
        help="check this motion, from whatever planner, against the case's cell instead of searching one",
    )
    check.add_argument(
        "--program",
        metavar="F.src",
        help="check this robot program (KRL), run as the controller would, instead of searching a motion",
    )

    _jobs_argument(check)

    export = command("export", "write the checked motion as a robot program", EXPORT_TEXT)
    _case_arguments(export)
    _jobs_argument(export)
    export.add_argument(
        "--motion-in", metavar="F.csv|F.npz", help="of this motion, checked, instead of one that is searched"
    )
    export.add_argument("--krl", metavar="DIR", help="write it in KRL: NAME.src, what it calls, and NAME.json")
    export.add_argument(
        "--csv", metavar="F.csv", help="write every point: poses in base and part, axes, speed, arc, line"
    )
    export.add_argument(
        "--robodk", metavar="F.py", help="write a script that makes the program in RoboDK, for any brand"
    )

    cut = command("slice", "cut the sub-volumes into layers and targets", SLICE_TEXT)
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
    cut.add_argument("--pattern", choices=PATTERNS, help="of the beads in a layer instead of the case's")
    cut.add_argument("--width", type=float, metavar="MM", help="of a bead instead of the case's")
    cut.add_argument("--json", metavar="F", help="write the layers, rbam-slices/1 (- for stdout)")
    cut.add_argument("--targets", metavar="F.csv", help="write the targets, and the ways between beads")
    cut.add_argument("--picture", metavar="F.png", help="draw the layers, to look at and to print")
    cut.add_argument(
        "--colour", choices=("thickness", "layer"), default="thickness", help="what colours mean in the picture"
    )

    compare = command("compare", "hold the slicing strategies against one another", COMPARE_TEXT)
    compare.add_argument("case", nargs="?", metavar="CASE", help=CASE_HELP)
    compare.add_argument(
        "--paper", action="store_true", help="the paper's four parts, with its own figures beside ours"
    )
    compare.add_argument("--json", metavar="F", help="write the comparison, rbam-compare/1 (- for stdout)")
    compare.add_argument("--html", metavar="F.html", help="write the tables and bars as one page, no network")

    sweep = command("sweep", "try a grid of table angles and map which work", SWEEP_TEXT)
    sweep.add_argument("case", nargs="?", metavar="CASE", help=CASE_HELP)
    sweep.add_argument("--e1", metavar="LO:HI:STEP", help="tilts, deg (default: the axis' range by 45)")
    sweep.add_argument("--e2", metavar="LO:HI:STEP", help="turns, deg (default: the axis' range by 45)")
    sweep.add_argument(
        "--table",
        choices=TABLE_MODES,
        help="instead of the case's; a sweep maps poses that serve a whole run: fixed and best alone go with it",
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
        help="place of the positioner, mm and deg, instead of the case's; several times: a map for each",
    )
    sweep.add_argument(
        "--height", metavar="LO:HI:STEP", help="heights of the support (of the part, without one), mm: a map for each"
    )
    sweep.add_argument("--workers", type=int, metavar="N", help="processes (default: one a core)")
    sweep.add_argument("--dask", metavar="ADDRESS", help="compute on a Dask cluster, such as tcp://HOST:8786")
    sweep.add_argument(
        "--out", metavar="F.jsonl", help="keep finished poses here; an interrupted sweep goes on from it"
    )
    sweep.add_argument("--json", metavar="F", help="write the map, rbam-sweep/1 (- for stdout)")
    sweep.add_argument("--csv", metavar="F.csv", help="write the poses as a table")
    sweep.add_argument("--picture", metavar="F.png", help="draw the map")
    sweep.add_argument("--html", metavar="F.html", help="write the map to click on as one page, no network")

    replay = command("replay", "show the checked motion: window, browser, picture or film", REPLAY_TEXT)
    _case_arguments(replay)
    _jobs_argument(replay)
    _replay_arguments(replay)

    scene = command(
        "scene",
        "look a composed cell over, or write it as one MJCF",
        "Shapes that always touch or never collide, links without shapes, home, joints that are not planned. "
        "With --xml the cell for plain MuJoCo; nothing else is needed.",
    )
    _case_arguments(scene)
    scene.add_argument("--xml", metavar="F.xml", help="write the cell here instead")
    return parser


CHECK_TEXT = """\
Slices the part and puts its targets on the table. Searches every configuration of the arm at every roll about the
wire that the case allows. Then follows the arm from its home along each bead, from bead to bead and home again, and
looks at joint limits, singularity margins and collisions. "feasible" means that such a motion was found and followed
all along. Every infeasible target has a reason:
  unreachable   the wrist cannot get there            joint_limit   an axis would leave its range
  singular      a margin is too small                 collision     something is nearer than the clearance
  no_path       no motion leads there without a flip or a collision on the way
  speed         a joint is too slow for the deposition    gravity   deposited too far off upright (if limited)
A part that is lost is not searched without end: about what cannot be welded 2,000 configurations (20,000 of up
to 600 targets) and 4 for each target are asked, spread evenly over the part. Targets that this leaves out are told,
and counted, as not looked at; --all looks at every one.

Where the case is infeasible, the smallest change that helps is searched and checked. It may be one of the roll, E1,
E2, the place of the positioner, the support's height or the part's place, the stick-out, the
deposition speed, or the seams of closed beads.

Parts of 1,500 targets and more are checked in chunks of whole layers, on all cores unless --jobs says otherwise. The
verdict and the motion are the same with any number of processes, each of which takes some 350 MB.

--program reads a KRL program, ours or anybody's, runs it as the controller would and holds it against
the same; findings carry file and line.
--motion writes rows of t_s, A1_deg .. A6_deg, E1_deg, E2_deg, arc, bead, layer, target; --motion-in takes the same
columns and holds them against joint limits, speeds and accelerations, singularities, collisions with the
part growing as the rows say, and the beads themselves. Its verdict, --json and exit codes are those of a check."""

EXPORT_TEXT = """\
Checks the case as rbam check does and writes its motion as a KUKA program: beads as LIN in the
part's frame on the table ($BASE = EK(..)), with E1 and E2 in every point, ways between them as LIN
and PTP, the case's section controller says names, numbers, hooks and speeds. Nothing is left
unless what was written, read back and run as the controller would, is the checked motion within
0.05 mm and 0.05 deg (plus what thinning was allowed) and feasible itself; else exit code 1 with the
line that is wrong. What was never run on a controller, and how to dry-run it, says docs/programs.md.

examples:
  rbam export my.case.yaml --krl out
  rbam export my.case.yaml --krl out --csv points.csv --robodk station.py
  rbam check my.case.yaml --program out/MY.src"""

SLICE_TEXT = """\
Strategies: planar (planes across the sub-volume's own direction), cylindrical (offsets of the
body), nonuniform (from the body's curvature to planes within h_min .. h_max; Lettori et al. 2024).
In a case, slicing: {body: planar} slices the body as well, across its axis, as BODY.
A mesh is a whole part, whose round body and sub-volumes are found; with --body-radius it is one
sub-volume on a cylinder about the z axis. Prints the paper's indices: layers NL, adhesion area A,
targets NV, top angle R. Every border of a layer is one bead. --pattern fills the layer as well: with rounds
along the border (contour_parallel), or with lines to and fro (zigzag). The case's beads section says
how wide beads are, where they start, and in which direction and order they are laid."""

COMPARE_TEXT = """\
Slices every sub-volume by each strategy that suits what it stands on and prints the paper's indices
(layers NL, adhesion area A, targets NV, top angle R) with their normalised scores I1..I4 and the
total F; higher is better."""

SWEEP_TEXT = """\
Every pose gets the verdict of rbam check at those angles. Some poses cannot be feasible: the table is
in the way, or some target by itself has no free configuration. These are settled without a search,
and count such targets only ("12+": 12 of those looked at). Feasible poses are ranked by
how far off upright they deposit (in steps of 5 deg), then by clearance (1 mm), singularity margin,
room to the joint limits, and time. The case's section sweep may hold the grid instead.

examples:
  rbam sweep --e1 -135:135:15 --e2 -180:180:15 --picture map.png
  rbam sweep --roll free --roll fixed:-60 --roll fixed:-90 --html map.html
  rbam sweep my.case.yaml --positioner 1400,0,0 --positioner 1550,0,0 --height 80:160:40 --out map.jsonl"""

REPLAY_TEXT = """\
Opens MuJoCo's viewer; without a display there are --web, --picture and --video. Space plays and
pauses, left and right step by target, up and down by bead, + and - change the speed, n goes to the
next infeasible target, t shows targets, o normals, c changes what colours mean, v the view. An
infeasible case shows its infeasible targets with what went wrong. --motion plays a motion file as
it is, feasible or not, with what a check of it finds; --program a robot program, with its lines.

examples:
  rbam replay --picture torch.png --view torch --target 40
  rbam replay --video film.mp4 --speed 20 --size 1920x1080
  rbam replay my.case.yaml --sweep map.json --pose best --web
  rbam replay my.case.yaml --motion theirs.csv"""


def _version() -> str:
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version("rbam-cell")
    except PackageNotFoundError:
        return "(not installed)"


def _replay_arguments(replay: argparse.ArgumentParser) -> None:
    instead = replay.add_mutually_exclusive_group()
    instead.add_argument("--web", action="store_true", help="show it in a browser; stop with Ctrl-C")
    instead.add_argument("--picture", metavar="F.png", help="render a picture instead; needs no display")
    instead.add_argument(
        "--video", metavar="F.mp4|F.gif", help="render a film instead; needs no display (mp4: extra 'video')"
    )
    replay.add_argument(
        "--speed", type=float, metavar="X", help="seconds of motion per second (default 5; of a film 10)"
    )
    replay.add_argument("--motion", metavar="F", help="show the motion of a .csv or .npz file, feasible or not")
    replay.add_argument("--program", metavar="F.src", help="show a robot program as it is run, feasible or not")
    replay.add_argument("--loop", action="store_true", help="start again at the end")
    replay.add_argument(
        "--colour", choices=("layer", "thickness", "verdict"), default="layer", help="what the beads' colours mean"
    )
    replay.add_argument("--sweep", metavar="F", help="take the table pose from a sweep's map (--json) or log (--out)")
    replay.add_argument("--pose", metavar="N|best", help="which pose of the sweep, from 0 (default best)")
    replay.add_argument("--view", choices=("cell", "torch"), help="what a picture or film frames (default cell)")
    replay.add_argument("--size", metavar="WxH", help="pixels of a picture (1600x1000) or film (mp4 1280x720)")
    replay.add_argument("--fps", type=float, metavar="N", help="frames per second of a film (mp4 25, gif 12.5)")
    replay.add_argument("--target", type=int, metavar="I", help="target the picture shows the arm at")
    replay.add_argument("--host", metavar="ADDRESS", help="interface of --web (default 127.0.0.1, this machine alone)")
    replay.add_argument("--port", type=int, metavar="N", help="port of --web (default: the first free from 8080)")


def _jobs_argument(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--jobs",
        type=int,
        metavar="N",
        help="processes that a large part or a long motion is checked in (default: one a core); the verdict does not"
        " depend on it",
    )


def _case_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("case", nargs="?", metavar="CASE", help=CASE_HELP)
    parser.add_argument("--e1", type=float, metavar="DEG", help="tilt of the table instead of the case's")
    parser.add_argument("--e2", type=float, metavar="DEG", help="turn of the table instead of the case's")
    parser.add_argument(
        "--table",
        choices=TABLE_MODES,
        help="instead of the case's: one pose | one for each sub-volume | moving along the beads | the best one pose",
    )
    parser.add_argument("--roll", metavar="ROLL", help="free | fixed:DEG | range:LO:HI instead of the case's")
