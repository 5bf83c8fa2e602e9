"""What ``rbam replay`` does: a window, a browser, a picture or a film of a checked case, or of a motion from a file.

Whatever stands in the way (a folder, a display, an encoder, OpenGL) is reported before the check, not after it.
"""

from __future__ import annotations

import argparse
import sys
from typing import TYPE_CHECKING

from ..errors import InputError
from .case_options import load, refuse_outputs
from .exit_codes import FEASIBLE
from .process_count import process_count
from .program_file import checked_program, program_files
from .progress_bar import Bars
from .verbosity import is_quiet

if TYPE_CHECKING:
    from ..case.sections import Case
    from ..job.job import Job
    from ..verdict.result import Result

SPEED = 5.0


def run(args: argparse.Namespace) -> int:
    """Check a case and show it.

    Returns:
        The exit code.

    Raises:
        InputError: one line.
    """
    _show(args, load(args))
    return FEASIBLE


def _show(args: argparse.Namespace, case: Case) -> None:
    if args.speed is not None and not 0 < args.speed < float("inf"):
        raise InputError(f"--speed: {args.speed} is not a number above 0")
    if args.motion_in is not None or args.program is not None:
        _motion_alone(args)
    refuse_outputs(args, case, "picture", "video", reads=[args.motion_in, args.sweep, *program_files(args.program)])
    case = _at_pose(args, case)
    if args.picture:
        _picture(args, case)
    elif args.video:
        _video(args, case)
    elif args.web:
        _web(args, case)
    else:
        _needs(args, "--size", "--view", "--fps", "--target", "--host", "--port")
        from ..view.window import replay, require_display

        require_display()
        replay(_checked(args, case), speed=args.speed or SPEED, loop=args.loop, colour=args.colour)


def _motion_alone(args: argparse.Namespace) -> None:
    """Refuse what would put a motion from a file elsewhere, and a name that is none of a motion."""
    from ..motion.motion_file import check_suffix

    given = "--motion-in" if args.motion_in is not None else "--program"
    if args.motion_in is not None and args.program is not None:
        raise InputError("--program: does not go with --motion-in; show one after the other")
    for option in ("--e1", "--e2", "--sweep", "--pose"):
        if getattr(args, option.removeprefix("--")) is not None:
            raise InputError(f"{option}: does not go with {given}, which holds its own table angles")
    if args.jobs is not None:
        raise InputError(f"--jobs: does not go with {given}, with which no motion is searched")
    if args.motion_in is not None:
        check_suffix(args.motion_in)


def _at_pose(args: argparse.Namespace, case: Case) -> Case:
    if args.sweep is None:
        if args.pose is not None:
            raise InputError("--pose: names a pose of a sweep; give --sweep F as well")
        return case
    if args.e1 is not None or args.e2 is not None:
        raise InputError("--sweep: picks the table angles; leave --e1 and --e2 out")
    from ..case.read import with_changes
    from ..case.table_section import Table
    from ..pose_sweep.picked_pose import picked_pose

    pose = picked_pose(case, args.sweep, args.pose or "best")
    if args.roll is not None:
        pose = pose._replace(roll=None)  # the case has the one that is asked for
    return with_changes(pose.applied(case), table=Table(E1_deg=pose.E1_deg, E2_deg=pose.E2_deg))


def _needs(args: argparse.Namespace, *options: str) -> None:
    """Refuse options that would be left unheard."""
    wants = {
        **dict.fromkeys(("--size", "--view"), "--picture or --video"),
        **dict.fromkeys(("--host", "--port"), "--web"),
        **{"--fps": "--video", "--target": "--picture"},
        "--loop": "the window or --web",
        "--speed": "the window, --web or --video",
    }
    for option in options:
        if getattr(args, option.removeprefix("--")) not in (None, False):
            raise InputError(f"{option}: needs {wants[option]}")


def _checked(args: argparse.Namespace, case: Case) -> Result:
    from ..job.job import prepare
    from ..verdict.by_table_mode import check

    processes = process_count(args)
    job = prepare(case)
    if args.program is not None:
        return _checked_program(args, job)
    if args.motion_in is None:
        return check(job, processes=processes, progress=Bars(sys.stderr))
    from ..motion.file_order import read_in_order
    from ..verification.motion_check import check_motion
    from ..view.shown_motion import played

    job, read = read_in_order(args.motion_in, job)
    found = check_motion(job, read)
    if found.findings and not is_quiet():
        count = len(found.findings)
        sys.stderr.write(f"rbam: {args.motion_in}: infeasible, {count} finding(s); rbam check --motion-in lists them\n")
    return played(job, found, args.target)


def _checked_program(args: argparse.Namespace, job: Job) -> Result:
    from ..view.shown_motion import played_program

    found = checked_program(args.program, job)
    if found.findings and not is_quiet():
        count = len(found.findings)
        sys.stderr.write(f"rbam: {args.program}: infeasible, {count} finding(s); rbam check --program lists them\n")
    return played_program(found.found.job, found, args.target)


def _picture(args: argparse.Namespace, case: Case) -> None:
    _needs(args, "--fps", "--host", "--port", "--loop", "--speed")
    from ..atomic_files import write_bytes
    from ..view.camera import View
    from ..view.film import parse_size
    from ..view.picture import picture, require_gl

    width, height = parse_size(args.size) if args.size else (1600, 1000)
    require_gl()
    view: View = args.view or "cell"
    png = picture(_checked(args, case), width=width, height=height, view=view, target=args.target, colour=args.colour)
    write_bytes(args.picture, png)


def _video(args: argparse.Namespace, case: Case) -> None:
    _needs(args, "--target", "--host", "--port", "--loop")
    from ..view.film import SPEED as FILM_SPEED
    from ..view.film import film, film_format, parse_size

    size = parse_size(args.size) if args.size else None
    film_format(args.video, size, args.fps)
    film(
        _checked(args, case),
        args.video,
        size=size,
        fps=args.fps,
        speed=args.speed or FILM_SPEED,
        view=args.view or "cell",
        colour=args.colour,
        progress=Bars(sys.stderr),
    )


def _web(args: argparse.Namespace, case: Case) -> None:
    _needs(args, "--size", "--view", "--fps", "--target")
    from ..view.browser import LOOPBACK, listen, replay_in_browser

    with listen(args.host or LOOPBACK, args.port or 0) as place:
        replay_in_browser(_checked(args, case), place, speed=args.speed or SPEED, loop=args.loop, colour=args.colour)
