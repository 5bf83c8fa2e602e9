"""A robot program against the cell: run as the controller would, and judged as any motion is.

    result = check_program(job, read_krl("blade.src", controller))
    result.feasible, result.findings[0].reason, str(result.findings[0].line)

The motion goes to ``cell.verification.motion_check``, the one judge. What only a program can have wrong is found here:
a tool or a base that is not the cell's, corners rounded further than the case has them checked, an arc that is left on,
poses that the arm does not reach. Every finding has the line of the move that it begins on.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from ik.chain import Floats
from slicing import Code, Warning

from ..arrays import Ints
from ..failure import IN_ROWS, Failure, Kind
from ..job.job import Job
from ..motion.file_order import in_motion_order
from ..motion.motion_file import ReadMotion
from ..printable import counted
from ..scene.site_frames import T_flange_tcp
from ..units import METRES_PER_MM
from ..verification.bead_order import Finding
from ..verification.motion_check import MotionResult, check_motion
from .bead_match import on_beads
from .cell_frames import T_base_root
from .program import ANYWHERE, EventKind, MoveKind, Program, SourceLine
from .running.external_axes import half_turns, shorter_turns
from .running.interpolation import angles_between
from .running.program_path import move_label
from .running.simulate import EXACT_STOP, SimulatedProgram, run_program

PROGRAM_REASONS = ("unreachable", "tool", "base", "external", "blend", "arc")
TOOL_OFF, TOOL_TURNED = 5e-5, np.deg2rad(0.05)  # m and rad that a program's tool may differ from the torch
ROOT_ARM = 1.0  # m from a table's root to the part, by which a turn of it counts
STILL = np.deg2rad(0.001)  # of the table
MOST_TCP_SPEED = 3.0  # m/s: no arm's TCP is led faster
WIDER = 1e-9  # beyond a limit: rounding alone


@dataclass(frozen=True)
class ProgramFinding(Finding):
    """Something that is wrong with a program: with the motion that it makes, or with what it says.

    Its reason is one of ``cell.verification.bead_order.REASONS`` or ``PROGRAM_REASONS``; rows count from 1.

    Attributes:
        move: first move concerned.
        to_move: last.
        line: where the first move stands, None where the program is not read from text.
        to_line: where the last stands.
    """

    move: int
    to_move: int
    line: SourceLine | None
    to_line: SourceLine | None


@dataclass(frozen=True, eq=False)
class ProgramResult:
    """Result of the check of a program.

    Attributes:
        run: the program as it is run.
        found: the check of its motion.
        findings: everything that is wrong, in the order of the rows.
        warnings: one line each, the motion's first.
    """

    run: SimulatedProgram
    found: MotionResult
    findings: tuple[ProgramFinding, ...]
    warnings: tuple[str, ...]

    @property
    def program(self) -> Program:
        """The program."""
        return self.run.program

    @property
    def feasible(self) -> bool:
        """Whether nothing was found."""
        return not self.findings


def check_program(job: Job, program: Program) -> ProgramResult:
    """Run a program as the controller would and check it in the cell.

    Args:
        job: from ``cell.prepare``.
        program: from ``cell.read_krl``.

    Returns:
        What was found.

    Raises:
        InputError: it cannot be begun; one line.
    """
    run = on_beads(job, run_program(program, job))
    again = in_motion_order(job, run.motion)
    if again is not job:  # the order of layers is the program's
        job, run = again, on_beads(again, run)
    read = ReadMotion(run.motion, np.arange(1, len(run.move) + 1), (), (0.0, 0.0), run.runs)
    found = check_motion(job, read)
    findings = [
        *(_of_moves(run, *one) for one in _program_findings(run, job)),
        *(_of_rows(run, f) for f in found.findings),
    ]
    findings.sort(key=lambda f: (f.row, f.move, f.reason))
    return ProgramResult(run, found, tuple(findings), (*found.warnings, *_warnings(run, job)))


def _of_rows(run: SimulatedProgram, f: Finding) -> ProgramFinding:
    """Of rows of the motion: what is between a row and the next is on the next one's move."""
    step = 0 if f.reason == "joint_limit" else 1
    at = np.minimum(np.array([f.row, f.to_row]) - 1 + step, len(run.move) - 1)
    moves = int(run.move[at[0]]), int(run.move[at[1]])
    lines = run.program.line_of(moves[0]), run.program.line_of(moves[1])
    return ProgramFinding(f.failure, f.row, f.to_row, *moves, *lines)


def _of_moves(run: SimulatedProgram, failure: Failure, first: int, last: int) -> ProgramFinding:
    begins, ends = np.searchsorted(run.move, [first, last + 1]).tolist()
    a = min(begins + 1, len(run.move))
    lines = run.program.line_of(first), run.program.line_of(last)
    return ProgramFinding(failure, a, max(ends, a), first, last, *lines)


Found = tuple[Failure, int, int]


def _program_findings(run: SimulatedProgram, job: Job) -> Iterator[Found]:
    """What is wrong, and the first and last move that it is wrong with."""
    for move, failure in (*run.failures.items(), *run.arc_faults.items()):
        yield failure, move, move
    yield from _tools(run, job)
    yield from _bases(run)
    yield from _roots(run.program, job)
    yield from _externals(run.program, job)
    yield from _welding_moves(run, job)
    if job.case.process.least_speed_share > 0:
        for move in run.program.stands:
            yield Failure(Kind.STANDSTILL, limit=0.0, place=IN_ROWS), move - 1, move - 1
    yield from _stretches(Failure(Kind.PATH_SPEED, limit=MOST_TCP_SPEED, place=IN_ROWS), run.program.moves.speed)


def _tools(run: SimulatedProgram, job: Job) -> Iterator[Found]:
    """Tools that are not the cell's torch."""
    moves, own = run.program.moves, T_flange_tcp(job.scene)
    for k, tool in enumerate(run.program.tools):
        used = np.flatnonzero((moves.tool == k) & np.isfinite(moves.pose[:, 0]))
        off = float(np.linalg.norm(tool.T_flange_tcp[:3, 3] - own[:3, 3]))
        turned = float(angles_between(tool.T_flange_tcp[:3, :3], own[:3, :3]))
        if len(used) and off > TOOL_OFF:
            measures = round(off / METRES_PER_MM, 3), TOOL_OFF / METRES_PER_MM
            yield Failure(Kind.TOOL_OFF, *measures, place=IN_ROWS), int(used[0]), int(used[-1])
        if len(used) and turned > TOOL_TURNED:
            measures = round(float(np.rad2deg(turned)), 3), round(float(np.rad2deg(TOOL_TURNED)), 6)
            yield Failure(Kind.TOOL_TURNED, *measures, place=IN_ROWS), int(used[0]), int(used[-1])


def _bases(run: SimulatedProgram) -> Iterator[Found]:
    """Bases that stay where they are while the table moves under the work."""
    moves = run.program.moves
    for k, base in enumerate(run.program.bases):
        used = np.flatnonzero((moves.base == k) & np.isfinite(moves.pose[:, 0]))
        if base.coupled or not len(used):
            continue
        table = run.motion.table[np.isin(run.move, used)]
        turned = float(np.ptp(table, axis=0).max()) if len(table) else 0.0
        if turned > STILL:
            measure = round(float(np.rad2deg(turned)), 3)
            yield Failure(Kind.BASE_STANDS, measure, place=IN_ROWS), int(used[0]), int(used[-1])


def _roots(program: Program, job: Job) -> Iterator[Found]:
    """Coupled bases whose table stands elsewhere than the case's, where the program or the case says where it does."""
    moves = program.moves
    for k, base in enumerate(program.bases):
        used = np.flatnonzero((moves.base == k) & np.isfinite(moves.pose[:, 0]))
        if not base.coupled or base.root is None or not len(used):
            continue
        own = T_base_root(job)
        off = float(np.linalg.norm(base.root[:3, 3] - own[:3, 3]))
        off += float(angles_between(base.root[:3, :3], own[:3, :3])) * ROOT_ARM
        if off > TOOL_OFF:
            measures = round(off / METRES_PER_MM, 3), TOOL_OFF / METRES_PER_MM
            yield Failure(Kind.BASE_ROOT, *measures, place=IN_ROWS), int(used[0]), int(used[-1])


def _externals(program: Program, job: Job) -> Iterator[Found]:
    """Axes of the table that are not given, and have been given by no point before."""
    missing = ~np.isfinite(program.moves.external) & job.scene.has_axis
    for k, name in enumerate(("E1", "E2")):
        rows = np.flatnonzero(missing[:, k])
        if len(rows):
            yield Failure(Kind.NOT_GIVEN, axis=name, place=IN_ROWS), int(rows[0]), int(rows[-1])
    for axis, move, turn in half_turns(program.moves, job):
        failure = Failure(Kind.HALF_TURN, round(float(np.rad2deg(turn)), 3), axis=f"E{axis + 1}", place=IN_ROWS)
        yield failure, move, move


def _welding_moves(run: SimulatedProgram, job: Job) -> Iterator[Found]:
    """Corners inside beads that are rounded too far, and moves of axes with the arc on."""
    moves, limit = run.program.moves, job.case.process.blend_mm
    welding = np.zeros(len(moves), dtype=bool)
    inside = (run.weld[1:] >= 0) & (run.weld[1:] == run.weld[:-1])
    welding[np.unique(run.move[1:][inside])] = True
    wide = np.where(welding, np.where(moves.blend < ANYWHERE, moves.blend, 0.0), 0.0)
    wide = np.maximum(wide, np.where(welding, run.rounded, 0.0)) / METRES_PER_MM
    yield from _stretches(Failure(Kind.BLEND, limit=limit, place=IN_ROWS), wide)
    yield from _stretches(Failure(Kind.ARC_CORNER, limit=0.0, place=IN_ROWS), _at_the_arc(run))
    axes = np.where(welding & (moves.kind == MoveKind.AXES), np.inf, 0.0)
    yield from _stretches(Failure(Kind.PTP_WITH_ARC, place=IN_ROWS), axes)


def _at_the_arc(run: SimulatedProgram) -> Floats:
    """Distances over which corners are rounded at which the arc goes on or off, (k,), mm; 0 of others."""
    moves = run.program.moves
    at = {event.before for event in run.program.events if event.kind in (EventKind.ARC_ON, EventKind.ARC_OFF)}
    before = np.array([k - 1 for k in sorted(at) if 0 < k < len(moves)], dtype=np.int64)
    out = np.zeros(len(moves))
    # of a PTP the share counts, whose distance is not known
    known = np.where(moves.kind == MoveKind.AXES, np.where(moves.blend_share > 0, np.inf, 0.0), run.rounded)
    out[before] = known[before] / METRES_PER_MM
    return np.where(out > EXACT_STOP / METRES_PER_MM, out, 0.0)


def _stretches(failure: Failure, value: Floats) -> Iterator[Found]:
    """Stretches of moves on which a value is above a failure's limit, with the greatest of it."""
    limit = failure.limit or 0.0
    over = np.flatnonzero(np.nan_to_num(value, nan=0.0, posinf=np.inf) > limit + WIDER)
    if not len(over):
        return
    for group in np.split(over, np.flatnonzero(np.diff(over) > 1) + 1):
        most = float(value[group].max())
        yield replace(failure, measure=round(most, 6) if np.isfinite(most) else None), int(group[0]), int(group[-1])


def _warnings(run: SimulatedProgram, job: Job) -> Iterator[Warning]:
    """What is no fault by itself, and may be another's mistake."""
    program, moves = run.program, run.program.moves
    for move in run.failures:
        text = f"{move_label(program, move)}: the arm cannot go on: nothing after this line was run or checked"
        yield Warning(Code.PROGRAM_CUT, text)
    for k, base in enumerate(program.bases):
        used = np.flatnonzero((moves.base == k) & np.isfinite(moves.pose[:, 0]))
        if len(used) and not base.coupled:
            on = ", not on the table" if bool(job.scene.has_axis.any()) else ""
            text = f"{move_label(program, int(used[0]))}: its base stands in the world{on}: "
            yield Warning(Code.PROGRAM_FRAME, f"{text}taken in the arm's base ($WORLD = $ROBROOT)")
    yield from _table_warnings(run, job)
    given = np.flatnonzero(moves.status >= 0)
    if len(given) and job.solver.geometry is None:
        text = (
            "S of an arm without a spherical wrist is not known: the nearest configuration with the signs of T is taken"
        )
        yield Warning(Code.PROGRAM_DOUBT, f"{move_label(program, int(given[0]))}: {text}")
    if program.stands and job.case.process.least_speed_share <= 0:
        of = f" ({len(program.stands)} points)" if len(program.stands) > 1 else ""
        text = f"stands before it with the arc on, for an unknown time{of}"
        yield Warning(Code.PROGRAM_DOUBT, f"{move_label(program, program.stands[0])}: {text}")
    for doubt in program.doubts:
        of = f" ({doubt.count} points)" if doubt.count > 1 else ""
        yield Warning(Code.PROGRAM_DOUBT, f"{move_label(program, doubt.move)}: {doubt.kind}{of}")
    for kind, count in program.passed_over.items():
        if "taken as" in kind:
            yield Warning(
                Code.PROGRAM_PASSED_OVER, f"{program.name}: {count} {kind}: the controller may run them differently"
            )


def _table_warnings(run: SimulatedProgram, job: Job) -> Iterator[Warning]:
    """A table that goes the shorter way, moves inside a bead, or stands elsewhere than the case has it."""
    for axis, move, said, made in shorter_turns(run.program.moves, job)[:1]:
        yield Warning(
            Code.PROGRAM_TABLE,
            f"{move_label(run.program, move)}: E{axis + 1} is endless: it is run by the shorter way, "
            f"{np.rad2deg(made):.6g} deg, where the numbers say {np.rad2deg(said):.6g}; an axis that is not set as "
            "endless on the controller goes that way",
        )
    welding = np.flatnonzero((run.weld[1:] >= 0) & (run.weld[1:] == run.weld[:-1])) + 1
    if not len(welding):
        return
    mode = job.case.table.mode
    if mode == "coordinated":
        return  # it is to move
    table = run.motion.table
    turned = np.abs(table[welding] - table[welding - 1])
    for k, name in enumerate(("E1", "E2")):
        rows = welding[turned[:, k] > STILL / 100]
        if len(rows):
            first: Ints = np.unique(run.move[rows])
            sizes = float(np.ptp(table[rows, k]))
            yield Warning(
                Code.PROGRAM_TABLE,
                f"{move_label(run.program, int(first[0]))}: {name} moves with the arc on, by "
                f"{np.rad2deg(max(sizes, float(turned[:, k].max()))):.3g} deg (in {counted(len(first), 'move')})",
            )
    if mode != "fixed":
        return  # it is to stand where each group of layers has it
    E = np.rad2deg(table[welding[0]])
    asked = np.array([job.case.table.E1_deg, job.case.table.E2_deg])
    off = np.abs((E - asked + 180) % 360 - 180)
    if off.max() > 0.01:
        yield Warning(
            Code.PROGRAM_TABLE,
            f"{move_label(run.program, int(run.move[welding[0]]))}: welds at E1 {E[0]:g}, E2 {E[1]:g} deg; "
            f"the case has E1 {asked[0]:g}, E2 {asked[1]:g}",
        )
