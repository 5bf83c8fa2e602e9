"""The way that a program's moves go, as a controller interpolates them: samples with all axes, no times yet.

    path = interpolate_program(program, job)
    path.axes, path.move, path.share          # (m, j + 2) rad, (m,), (m,)
    path.failures                                 # moves whose end or way the arm does not reach, and why

Between two samples all axes move on straight lines, so close to the programmed way as ``OFF`` and ``TURNED`` say.
Metres and radians.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ik.chain import Floats

from ...arrays import Ints, repeat_with_index
from ...errors import InputError
from ...failure import IN_ROWS, Failure, Kind
from ...job.job import Job
from ...motion.motion import JUMP
from ...rigid import inverse
from ...scene.site_frames import T_flange_tcp
from ..cell_frames import tables_seen_from_base
from ..orientation import frames_of_poses
from ..program import MoveKind, Program
from .configuration_tracking import ConfigurationTracker
from .external_axes import table_ends
from .interpolation import Circles, angles_between, on_lines, unsure_circles

OFF, TURNED = 4e-6, np.deg2rad(0.004)  # m and rad that a straight line of the axes is off the programmed way at most
STEP, TURN = 2e-3, np.deg2rad(1.0)  # between the samples that are begun with
HALVINGS = 9  # of a step between them
HALF_TURN = np.deg2rad(0.5)  # from half a turn, within which either way may be the shorter one
AS_GIVEN = np.deg2rad(0.05)  # a turn of the tool that is rounding
POSE_NUMBERS = 6  # of X Y Z A B C
STATUS_BITS = 7  # of S, which say the configuration; more say how the point was taught
AXES_STEP = np.deg2rad(1.0)  # between samples of a move of axes


@dataclass(frozen=True, eq=False)
class ProgramPath:
    """Samples of a program's way.

    Attributes:
        axes: the arm's joints, E1, E2, (m, j + 2), rad; the first row is where the first move ends.
        move: number of the move each sample is on, (m,).
        share: of its way, (m,), 0 to 1; the last sample of every move has 1.
        Ts_frame_tcp: the programmed TCP in the move's base, (m, 4, 4), m; NaN on moves of axes.
        failures: what the arm cannot do, by the number of the move: the way ends there, as the controller would.
        turned: greatest turn of the TCP from one end of a Cartesian move to the other, rad.
        begins: the programmed TCP in the move's base where the move begins, (k, 4, 4), m; NaN of moves of axes.
    """

    axes: Floats
    move: Ints
    share: Floats
    Ts_frame_tcp: Floats
    failures: dict[int, Failure]
    turned: float
    begins: Floats


def interpolate_program(program: Program, job: Job) -> ProgramPath:
    """Interpolate a program.

    Args:
        program: the program.
        job: names the arm, its torch and its table.

    Returns:
        Its way.

    Raises:
        InputError: it cannot be begun: no moves, the first leads nowhere, a move lacks its tool or base, or leads an
            arm of seven joints to a pose; one line.
    """
    check_poses_say_all(program, job)
    return _Walk(program, job).path()


def check_poses_say_all(program: Program, job: Job) -> None:
    """Refuse a program whose poses leave joints of the arm open.

    Args:
        program: the program.
        job: names the arm.

    Raises:
        InputError: a move leads an arm of more joints than a pose has numbers to a pose; one line.
    """
    moves, n = program.moves, job.scene.chain.n
    to_poses = np.flatnonzero(np.isfinite(moves.pose[:, 0]))
    if n > POSE_NUMBERS and len(to_poses):
        raise InputError(
            f"{move_label(program, int(to_poses[0]))}: the arm has {n} joints: X Y Z A B C leave one of them to the "
            "controller, and nothing says how it moves; only moves to axis angles (PTP) can be run"
        )


class _Walk:
    """Goes through the moves in order."""

    def __init__(self, program: Program, job: Job) -> None:
        self.program, self.job, self.moves = program, job, program.moves
        self.tracker = ConfigurationTracker(job.solver)
        self.n = job.scene.chain.n
        self.external = table_ends(self.moves, job)
        self.to_tool = [inverse(T_flange_tcp(job.scene)) @ tool.T_flange_tcp for tool in program.tools]
        self.failures: dict[int, Failure] = {}
        self.parts: list[tuple[Floats, Ints, Floats, Floats]] = []
        self.turned = 0.0
        self.begins = np.full((len(self.moves), 4, 4), np.nan)

    def path(self) -> ProgramPath:
        moves = self.moves
        if not len(moves):
            raise InputError(f"{self.program.name}: has no moves")
        q = self._first()
        self._put(np.append(q, self.external[0])[None], 0, np.ones(1))
        i = 1
        while i < len(moves) and not self.failures:
            j = i + 1
            if moves.kind[i] == MoveKind.AXES:
                q = self._axes(i, q)
            else:
                while j < len(moves) and moves.kind[j] != MoveKind.AXES:
                    j += 1
                q = self._cartesian(i, j, q)
            i = j
        axes, move, share, T = (np.concatenate(some) for some in zip(*self.parts, strict=True))
        return ProgramPath(axes, move, share, T, self.failures, self.turned, self.begins)

    def _put(self, axes: Floats, move: int, share: Floats) -> None:
        self.parts.append((axes, np.full(len(axes), move), share, np.full((len(axes), 4, 4), np.nan)))

    def _first(self) -> Floats:
        """Where the arm stands after the first move."""
        moves, scene = self.moves, self.job.scene
        where = move_label(self.program, 0)
        if moves.kind[0] != MoveKind.AXES:
            raise InputError(f"{where}: the first move is a line; a program must begin with a PTP")
        q = self._target(0, scene.home)
        if q is None:
            raise InputError(f"{where}: the first move leads to a pose that the arm cannot reach")
        return q

    def _target(self, i: int, q: Floats) -> Floats | None:
        """Where a move of axes ends: at its axes, or at its pose in the configuration that is nearest."""
        joints = self.moves.joints[i]
        if np.isfinite(joints).all():
            return joints
        self._needs_frames(i)
        T = self._in_arm_base(np.array([i]), self.external[[i]], frames_of_poses(self.moves.pose[[i]]))
        status, turn = int(self.moves.status[i]), int(self.moves.turn[i])
        if status >= 0 and not self.tracker.is_sole(T[0], turn):
            given = f"S {status}, T {turn}" if turn >= 0 else f"S {status} without T"
            raise InputError(
                f"{move_label(self.program, i)}: {given}: the pose has several such configurations; give axes"
            )
        found = self.tracker.nearest(T[0], q, turn)
        held = None if found is None or status < 0 else self.tracker.status(found)
        if held is not None and held != status & STATUS_BITS:
            raise InputError(
                f"{move_label(self.program, i)}: S {status} and T {turn} are of different configurations: the "
                f"axes with the signs of T have S {held}; give S and T of one, or axes"
            )
        if found is not None and status < 0 and not self.tracker.keeps(T[0], q, found):
            raise InputError(
                f"{move_label(self.program, i)}: without S the arm may keep its configuration or take a nearer one; "
                "give S and T, or axes"
            )
        return found

    def _needs_frames(self, i: int) -> None:
        for name, index in (("tool", self.moves.tool[i]), ("base", self.moves.base[i])):
            if index < 0:
                raise InputError(f"{move_label(self.program, i)}: moves to a pose, and no {name} is set")

    def _frames(self, move: Ints, external: Floats) -> Floats:
        """The moves' bases in the arm's base frame, (m, 4, 4)."""
        table = tables_seen_from_base(self.job.scene, external)
        coupled = np.array([base.coupled for base in self.program.bases])
        T = np.stack([base.T for base in self.program.bases])
        at = self.moves.base[move]
        out: Floats = np.where(coupled[at][:, None, None], table @ T[at], T[at])
        return out

    def _in_arm_base(self, move: Ints, external: Floats, T: Floats) -> Floats:
        """The cell's own TCP in the arm's base where the programmed one is at T (m, 4, 4) in the moves' bases."""
        to_own = np.stack([inverse(T_own_tool) for T_own_tool in self.to_tool])[self.moves.tool[move]]
        return self._frames(move, external) @ T @ to_own

    def _axes(self, i: int, q: Floats) -> Floats:
        end = self._target(i, q)
        if end is None:
            self.failures[i] = Failure(Kind.OUT_OF_REACH, place=IN_ROWS)
            return q
        a, b = np.append(q, self.external[i - 1]), np.append(end, self.external[i])
        count = max(int(np.ceil(np.abs(b - a).max() / AXES_STEP)), 1)
        share = np.arange(1, count + 1) / count
        self._put(a + share[:, None] * (b - a), i, share)
        return end

    def _cartesian(self, i: int, j: int, q: Floats) -> Floats:
        """Lines and circles i .. j - 1, from the axes q on; where the arm stands after them."""
        for k in range(i, j):
            self._needs_frames(k)
        line = _CartesianMoves(self, np.arange(i, j), q)
        self.begins[i:j] = line.T_start
        self.turned = max(self.turned, float(line.turn.max()))
        count = np.maximum(np.ceil(np.maximum(line.length / STEP, line.turn / TURN)), 1).astype(np.int64)
        at, place = repeat_with_index(count)
        share = (place + 1) / count[at]
        at, share, axes = line.refined(at, share)
        turn = np.abs(np.diff(np.concatenate([q[None], axes[:, : self.n]]), axis=0)).max(axis=1)
        ends = np.flatnonzero(~(turn <= JUMP))  # or where it is not known
        if len(ends):
            k = int(ends[0])
            why = Failure(Kind.OUT_OF_REACH, place=IN_ROWS)
            if np.isfinite(turn[k]):
                why = Failure(Kind.NO_CONFIGURATION, round(float(np.rad2deg(turn[k])), 3), place=IN_ROWS)
            self.failures[i + int(at[k])] = why
            at, share, axes = at[:k], share[:k], axes[:k]
            if not k:
                return q
        self.parts.append((axes, i + at, share, line.poses(at, share)))
        return axes[-1, : self.n]


class _CartesianMoves:
    """Cartesian moves that follow one another."""

    def __init__(self, walk: _Walk, move: Ints, q: Floats) -> None:
        self.walk, self.move, self.q = walk, move, q
        moves, n = walk.moves, walk.n
        self.T_end = frames_of_poses(moves.pose[move])
        self.ext_start, self.ext_end = walk.external[move - 1], walk.external[move]
        own = walk.job.scene.chain.forward(q[None])
        own = np.concatenate([own, walk._in_arm_base(move, self.ext_end, self.T_end)[:-1]])
        # where the last move ended, seen by the next one's base and tool
        tool = np.stack(walk.to_tool)[moves.tool[move]]
        self.T_start = inverse(walk._frames(move, self.ext_start)) @ own @ tool
        self.circle = moves.kind[move] == MoveKind.CIRCULAR
        self.arcs = self._arcs()
        straight = np.linalg.norm(self.T_end[:, :3, 3] - self.T_start[:, :3, 3], axis=1)
        self.length = np.where(self.circle, self.arcs.length, straight)
        turn = angles_between(self.T_start[:, :3, :3], self.T_end[:, :3, :3])
        self._refuse_open_turns(turn)
        self.turn = np.maximum(turn, np.abs(self.ext_end - self.ext_start).max(axis=1))
        self.n = n

    def _refuse_open_turns(self, turn: Floats) -> None:
        """Refuse moves whose orientation may be another than the one that is known here.

        Raises:
            InputError: half a turn, or a circle that ends at an angle and turns the tool; one line.
        """
        at_angle = self.circle & np.isfinite(self.walk.moves.arc_angle[self.move])
        for k in np.flatnonzero((turn > np.pi - HALF_TURN) | (at_angle & (turn > AS_GIVEN))).tolist():
            degrees = float(np.rad2deg(turn[k]))
            why = f"turns the tool by {degrees:.6g} deg: it may go either way round; add a point in between"
            if at_angle[k]:
                why = (
                    f"a circle that ends at an angle (CA) and turns the tool, by {degrees:.6g} deg: whether the "
                    "orientation of its point holds there or at the angle is not known; keep the orientation"
                )
            raise InputError(f"{move_label(self.walk.program, int(self.move[k]))}: {why}")

    def _refuse_flat_circles(self, start: Floats, via: Floats, end: Floats) -> None:
        """Refuse circles whose three points lie so nearly in a line, or at one place, that they make no sure circle.

        A short arc that hardly leaves its chord is left: it is that chord.

        Raises:
            InputError: which; one line.
        """
        angle = self.walk.moves.arc_angle[self.move]
        for k in np.flatnonzero(self.circle & unsure_circles(start, via, end, np.isfinite(angle))).tolist():
            raise InputError(
                f"{move_label(self.walk.program, int(self.move[k]))}: where the circle begins, its auxiliary point and "
                "its end are nearly in a line, or two of them are at one place: they make no sure circle; a full "
                "circle takes two, or an angle (CA)"
            )

    def _arcs(self) -> Circles:
        """The circles; one that ends at an angle of its own (CA) ends there, and the next move begins there."""
        moves, start = self.walk.moves, self.T_start
        via = np.where(self.circle[:, None], moves.via[self.move, :3], start[:, :3, 3])
        programmed, angle = self.T_end[:, :3, 3].copy(), moves.arc_angle[self.move]
        turned = np.flatnonzero(self.circle & np.isfinite(angle)).tolist()
        for k in turned:  # one after the other: each begins where the one before ends
            own = Circles.through(start[[k], :3, 3], via[[k]], programmed[[k]]).turned(0, angle[k])
            self.T_end[k, :3, 3] = own.end[0]
            if k + 1 < len(start):
                if (moves.base[self.move[k]], moves.tool[self.move[k]]) != (
                    moves.base[self.move[k + 1]],
                    moves.tool[self.move[k + 1]],
                ):
                    raise InputError(
                        f"{move_label(self.walk.program, int(self.move[k + 1]))}: another tool or base right after a "
                        "circle that ends at an angle (CA) is not supported; add a point in between"
                    )
                start[k + 1, :3, 3] = own.end[0]
                via[k + 1] = via[k + 1] if self.circle[k + 1] else own.end[0]
        self._refuse_flat_circles(start[:, :3, 3], via, programmed)
        arcs = Circles.through(start[:, :3, 3], via, programmed)
        for k in turned:
            arcs = arcs.turned(k, angle[k])
        return arcs

    def poses(self, at: Ints, share: Floats) -> Floats:
        """Poses in the moves' bases, (m, 4, 4)."""
        T = on_lines(self.T_start[at], self.T_end[at], share)
        round_ = np.flatnonzero(self.circle[at])
        if len(round_):
            k = at[round_]
            arcs = Circles(*(getattr(self.arcs, name)[k] for name in ("centre", "x", "y", "angle", "start", "end")))
            T[round_, :3, 3] = arcs.at(share[round_])
        return T

    def external(self, at: Ints, share: Floats) -> Floats:
        """E1, E2, (m, 2), rad: in proportion to the way."""
        out: Floats = self.ext_start[at] + share[:, None] * (self.ext_end[at] - self.ext_start[at])
        return out

    def solved(self, at: Ints, share: Floats) -> Floats:
        """All axes, (m, j + 2), rad; NaN where a pose is out of reach."""
        external = self.external(at, share)
        T = self.walk._in_arm_base(self.move[at], external, self.poses(at, share))
        return np.concatenate([self.walk.tracker.along(T, self.q), external], axis=1)

    def refined(self, at: Ints, share: Floats) -> tuple[Ints, Floats, Floats]:
        """Samples between which a straight line of the axes is the programmed way, within ``OFF`` and ``TURNED``."""
        axes = self.solved(at, share)
        open_ = np.ones(len(at), dtype=bool)  # whether the step that ends here is still to be checked
        for _ in range(HALVINGS):
            before = np.concatenate([np.append(self.q, self.ext_start[0])[None], axes[:-1]])
            since = np.where(np.diff(at, prepend=-1) == 0, np.concatenate([[0.0], share[:-1]]), 0.0)
            look = np.flatnonzero(open_ & np.isfinite(before).all(axis=1) & np.isfinite(axes).all(axis=1))
            bad = look[self._off(at[look], (since[look] + share[look]) / 2, (before[look] + axes[look]) / 2)]
            open_[:] = False
            if not len(bad):
                break
            # a sample in the middle of each: both halves are checked again
            open_[bad] = True
            at, share = np.insert(at, bad, at[bad]), np.insert(share, bad, (since[bad] + share[bad]) / 2)
            open_ = np.insert(open_, bad, True)
            axes = self.solved(at, share)
        return at, share, axes

    def _off(self, at: Ints, share: Floats, axes: Floats) -> Floats:
        """Whether the axes are off the programmed way, (m,)."""
        wanted = self.walk._in_arm_base(self.move[at], axes[:, self.n :], self.poses(at, share))
        is_ = self.walk.job.scene.chain.forward(axes[:, : self.n])
        away = np.linalg.norm(wanted[:, :3, 3] - is_[:, :3, 3], axis=1)
        bad: Floats = (away > OFF) | (angles_between(wanted[:, :3, :3], is_[:, :3, :3]) > TURNED)
        return bad


def move_label(program: Program, move: int) -> str:
    """Where a move stands, as messages name it."""
    line = program.line_of(move)
    return f"{program.name}: move {move}" if line is None else str(line)
