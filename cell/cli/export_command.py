"""What ``rbam export`` does: the checked motion as a robot program."""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from ..atomic_files import check_outputs
from ..case.files import case_files
from ..errors import InputError
from .case_options import load
from .exit_codes import FEASIBLE, INFEASIBLE
from .process_count import process_count
from .progress_bar import Bars
from .verbosity import is_quiet

if TYPE_CHECKING:
    from ..case.sections import Case
    from ..job.job import Job
    from ..motion.motion import Motion
    from ..programs.exported.exported import Exported


def run(args: argparse.Namespace) -> int:
    """Check a case and write its motion as a program, which is read back, run and checked before files are written.

    Returns:
        The exit code; 1 also where the program does not hold.

    Raises:
        InputError: one line.
    """
    case = load(args)
    if not (args.krl or args.csv or args.robodk):
        raise InputError("export: no output; give --krl DIR, --csv F.csv or --robodk F.py")
    processes = process_count(args)
    if args.motion_in and args.jobs is not None:
        raise InputError("--jobs: leave it out with --motion-in: no motion is searched")
    folder = None if args.krl is None else _folder(args.krl)
    read = [*case_files(case), *([args.motion_in] if args.motion_in else [])]
    check_outputs({"--csv": args.csv, "--robodk": args.robodk}, read)
    from ..programs.export import export_program

    job, motion = _checked_motion(args.motion_in, case, processes)
    if motion is None:
        what, how = (args.motion_in, " --motion-in") if args.motion_in else (case.path, "")
        sys.stderr.write(f"rbam: {what}: infeasible: no program is written; rbam check{how} says why\n")
        return INFEASIBLE
    made = export_program(job, motion)
    if made.fault is not None:
        sys.stderr.write(f"rbam: no program: {made.fault}\n")
        return INFEASIBLE
    paths = made.write(folder, csv=args.csv, robodk=args.robodk, reads=read)
    if not is_quiet():
        _say_what_was_written(made, paths, _left_over(made, folder))
    return FEASIBLE


def _checked_motion(path: str | None, case: Case, processes: int) -> tuple[Job, Motion | None]:
    """The motion that is searched, or a file's, and whose it is: layers in the order of building; None: infeasible."""
    if path is None:
        from ..verdict.by_table_mode import prepare_and_check

        result = prepare_and_check(case, Bars(sys.stderr), processes=processes)
        return result.job, result.motion
    from ..job.job import prepare
    from ..motion.file_order import read_in_order
    from ..motion.motion_file import check_suffix
    from ..verification.motion_check import check_motion

    check_suffix(path)
    job, read = read_in_order(path, prepare(case))
    return job, read.motion if check_motion(job, read).feasible else None


def _left_over(made: Exported, folder: Path | None) -> list[str]:
    """Modules of an earlier program of this name that this one does not call."""
    if folder is None:
        return []
    ours = re.compile(rf"{re.escape(made.written.program.name)}_[LP]\d{{3}}(_\d+)?\.src", re.IGNORECASE)
    return sorted(path.name for path in folder.iterdir() if ours.fullmatch(path.name) and path.name not in made.files)


def _folder(name: str) -> Path:
    """The folder that ``--krl`` names, before the work rather than after it.

    Raises:
        InputError: it is none, or cannot be made.
    """
    from ..programs.exported.written_files import checked_folder

    try:
        return checked_folder(name)
    except InputError as error:
        raise InputError(f"--krl: {error}") from None


def _say_what_was_written(made: Exported, paths: Sequence[Path], left_over: list[str]) -> None:
    """What was written, on stdout."""
    import numpy as np

    from ..units import METRES_PER_MM

    assert made.gap is not None
    assert made.result is not None
    written, gap = made.written, made.gap
    files = f"{len(made.files)} file{'s' * (len(made.files) != 1)}"
    sys.stdout.write(
        f"{written.program.name}: {written.points} points of {written.rows} rows, in {files}, "
        f"{np.ptp(made.result.run.motion.t_s):.0f} s; read back, run and checked: feasible, within "
        f"{gap.position / METRES_PER_MM:.4f} mm and {np.rad2deg(gap.angle):.4f} deg of the checked motion\n"
    )
    for path in paths:
        sys.stdout.write(f"  {path}\n")
    for line in made.warnings:
        sys.stdout.write(f"  warning: {line}\n")
    if left_over:
        names = ", ".join(left_over[:3]) + (f" and {len(left_over) - 3} more" if len(left_over) > 3 else "")
        sys.stdout.write(f"  warning: left over from another program of this name, and not called: {names}\n")
