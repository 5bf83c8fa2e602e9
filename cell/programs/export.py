"""A checked motion as a program's text, believed only once it was read back, run and judged.

    made = export_program(job, motion)
    made.fault                                # one line, or None: made.write(folder) writes it
    made.files                                # texts by the names of their files, the main module first

What is judged is what stands in the text: it is read as anybody's program is.
"""

from __future__ import annotations

import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..errors import InputError
from ..job.job import Job
from ..motion.file_order import in_one_order
from ..motion.motion import Motion, required
from ..units import METRES_PER_MM
from .cell_controller import cell_controller, frames_of
from .controller import ReadLimits
from .exported.exported import Exported
from .from_motion import ProgramOfMotion, program_of_motion
from .krl_read import read_krl
from .krl_write import write_krl
from .program import SourceLine
from .program_check import ProgramResult, check_program
from .round_trip import OFF, TURNED, ProgramDeviation, compared, difference_of
from .running.program_path import POSE_NUMBERS


def export_program(job: Job, motion: Motion) -> Exported:
    """Make a program of a motion and verify that its text is that motion.

    Args:
        job: from ``cell.prepare``, or the job of a result.
        motion: a checked motion: of a feasible result, or ``.motion`` of ``cell.read_motion``.

    Returns:
        The program, and its fault if there is one. Nothing is written before its method ``write`` is called.

    Raises:
        InputError: there is no motion (None, of an infeasible result), the arm has seven joints, or what was made
            cannot be read; one line.
    """
    if job.scene.chain.n > POSE_NUMBERS:
        raise InputError(
            f"{job.case.path}: robot.joints: no program is written for an arm of {job.scene.chain.n} joints: a line of "
            "the TCP leaves one of them to the controller; --motion of rbam check writes all joints"
        )
    job, motion = in_one_order(job, required(motion))
    controller = replace(cell_controller(job), limits=ReadLimits())
    frames = frames_of(job, controller)
    written = program_of_motion(job, motion, frames)
    files = write_krl(written.program, controller)
    reported = (*frames.warnings, *written.warnings)
    with tempfile.TemporaryDirectory(prefix="rbam-krl-") as folder:
        for name, text in files.items():
            (Path(folder) / name).write_bytes(text.encode("ascii"))
        again = read_krl(Path(folder) / next(iter(files)), controller)
    other = difference_of(written.program, again)
    if other is not None:
        return Exported(job, files, written, None, None, f"{_line(again.line_of(other[0]))}: {other[1]}", reported)
    result = check_program(job, again)
    gap = compared(job, motion, written, result.run)
    return Exported(job, files, written, gap, result, _fault(gap, written, result), reported)


def _fault(gap: ProgramDeviation, written: ProgramOfMotion, result: ProgramResult) -> str | None:
    if gap.share(written.thinning) > 1:
        chord, angle = OFF + written.thinning.chord, TURNED + written.thinning.angle
        return (
            f"{_line(result.program.line_of(gap.move))}: {gap.position / METRES_PER_MM:.4f} mm and "
            f"{np.rad2deg(gap.angle):.4f} deg off the checked motion; allowed are {chord / METRES_PER_MM:.4f} mm and "
            f"{np.rad2deg(angle):.4f} deg"
        )
    if result.findings:
        first = result.findings[0]
        more = f" (and {len(result.findings) - 1} more)" if len(result.findings) > 1 else ""
        return f"{_line(first.line)}: {first.reason} {first.detail}{more}"
    return None


def _line(line: SourceLine | None) -> str:
    return "the program" if line is None else str(line)
