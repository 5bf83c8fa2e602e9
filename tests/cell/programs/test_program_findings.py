"""What only a program can have wrong: each limit, just kept and just not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.programs.boss_program import boss_program

from cell.programs.bead_match import on_beads
from cell.programs.cell_frames import T_base_root
from cell.programs.program import Event, EventKind, MoveKind, Program
from cell.programs.program_check import _program_findings, _warnings
from cell.programs.running.simulate import run_program
from cell.verdict.failure_words import failure_in_words


def found(program: Program) -> set[tuple[str, int]]:
    """Reasons with the first move that they are found on."""
    job = boss_program().job
    run = on_beads(job, run_program(program, job))
    return {(failure.reason, first) for failure, first, _ in _program_findings(run, job)}


def told(program: Program) -> list[str]:
    job = boss_program().job
    return [line.code for line in _warnings(on_beads(job, run_program(program, job)), job)]


def changed(**columns: tuple[int | slice, object]) -> Program:
    """The boss' program with values put into its columns."""
    program = boss_program().made.written.program
    made = {name: getattr(program.moves, name).copy() for name in columns}
    for name, (where, value) in columns.items():
        made[name][where] = value
    return replace(program, moves=replace(program.moves, **made))


def first_line() -> int:
    return int(np.flatnonzero(boss_program().made.written.program.moves.kind == MoveKind.LINEAR)[0])


def welding() -> int:
    """A move in the middle of a bead."""
    program = boss_program().made.written.program
    return next(e.before for e in program.events if e.kind == EventKind.ARC_ON) + 2


def test_a_good_program_has_nothing_wrong() -> None:
    program = boss_program().made.written.program
    assert found(program) == set()
    assert told(program) == []


@pytest.mark.parametrize(("off_mm", "bad"), [(0.045, False), (0.055, True)])
def test_a_tool_may_be_a_twentieth_of_a_millimetre_off(off_mm: float, bad: bool) -> None:
    program = boss_program().made.written.program
    T = program.tools[0].T_flange_tcp.copy()
    T[0, 3] += off_mm / 1e3
    other = replace(program, tools=(replace(program.tools[0], T_flange_tcp=T),))
    assert found(other) == ({("tool", first_line())} if bad else set())


@pytest.mark.parametrize(("deg", "bad"), [(0.045, False), (0.055, True)])
def test_a_tool_may_be_turned_by_a_twentieth_of_a_degree(deg: float, bad: bool) -> None:
    program = boss_program().made.written.program
    c, s = np.cos(np.deg2rad(deg)), np.sin(np.deg2rad(deg))
    T = program.tools[0].T_flange_tcp.copy()
    T[:3, :3] = T[:3, :3] @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    other = replace(program, tools=(replace(program.tools[0], T_flange_tcp=T),))
    assert found(other) == ({("tool", first_line())} if bad else set())


@pytest.mark.parametrize(("blend_mm", "bad"), [(1.0, False), (1.01, True)])
def test_corners_inside_beads_are_rounded_as_far_as_they_are_checked(blend_mm: float, bad: bool) -> None:
    k = welding()
    assert found(changed(blend=(k, blend_mm / 1e3))) == ({("blend", k)} if bad else set())


@pytest.mark.parametrize(("off_mm", "bad"), [(0.0, False), (0.045, False), (0.055, True)])
def test_the_root_of_a_coupled_base_may_be_a_twentieth_of_a_millimetre_off(off_mm: float, bad: bool) -> None:
    boss = boss_program()
    program, root = boss.made.written.program, T_base_root(boss.job).copy()
    root[1, 3] += off_mm / 1e3
    other = replace(program, bases=tuple(replace(base, root=root) for base in program.bases if base.coupled))
    assert len(other.bases) == len(program.bases)
    assert found(other) == ({("base", first_line())} if bad else set())


@pytest.mark.parametrize("kind", [EventKind.ARC_ON, EventKind.ARC_OFF])
def test_where_the_arc_goes_on_or_off_no_corner_is_rounded(kind: EventKind) -> None:
    program = boss_program().made.written.program
    at = next(event.before for event in program.events if event.kind is kind) - 1
    assert found(changed(blend=(at, 0.0))) == set()
    assert ("blend", at) in found(changed(blend=(at, 0.5e-3)))


def test_corners_outside_beads_are_rounded_as_the_program_says() -> None:
    assert found(changed(blend=(first_line() - 1, 0.05))) == set()


@pytest.mark.parametrize(("speed", "bad"), [(2.99, False), (3.01, True)])
def test_no_tcp_is_led_at_more_than_three_metres_a_second(speed: float, bad: bool) -> None:
    k = welding()
    assert found(changed(speed=(k, speed))) == ({("speed", k)} if bad else set())


@pytest.mark.parametrize(("turned_deg", "bad"), [(0.0, False), (0.01, True)])
def test_a_base_in_the_world_is_wrong_where_the_table_moves(turned_deg: float, bad: bool) -> None:
    # the same points in the world: right as long as the table stands
    boss = boss_program()
    program = boss.made.written.program
    q = program.moves.external[0]
    from cell.programs.cell_frames import tables_seen_from_base

    T = tables_seen_from_base(boss.job.scene, q[None])[0] @ program.bases[0].T
    external = program.moves.external.copy()
    external[:, 0] += np.linspace(0, np.deg2rad(turned_deg), len(external))
    other = replace(
        program,
        bases=(replace(program.bases[0], T=T, coupled=False, machine=None),),
        moves=replace(program.moves, external=external),
    )
    assert found(other) == ({("base", first_line())} if bad else set())
    assert told(other)[0] == "program_frame"


def test_an_axis_that_is_never_given_is_found_from_the_first_move_on() -> None:
    assert found(changed(external=((slice(0, 9), 1), np.nan))) == {("external", 0)}  # type: ignore[arg-type]


def test_a_stand_of_unknown_length_inside_a_bead_is_found() -> None:
    k = welding()
    stands = replace(boss_program().made.written.program, stands=(k,))
    assert found(stands) == {("speed", k - 1)}
    job = boss_program().job
    [(failure, _, _)] = _program_findings(on_beads(job, run_program(stands, job)), job)
    assert failure_in_words(failure).endswith("for a time that is not known (HALT, WAIT FOR)")
    # where a case lets the torch be as slow as it likes, it is told
    process = job.case.process.model_copy(update={"least_speed_share": 0.0})
    slow = job.case.model_copy(update={"process": process})
    lax = replace(job, case=slow)
    run = on_beads(lax, run_program(stands, lax))
    assert not list(_program_findings(run, lax))
    assert [line.code for line in _warnings(run, lax)] == ["program_doubt"]


def test_a_ptp_in_a_bead_is_found() -> None:
    k = welding()
    program = changed(kind=(k, int(MoveKind.AXES)), axis_share=(k, 0.2))
    assert found(program) == {("arc", k)}


def test_the_arc_goes_on_and_off_by_turns() -> None:
    program = boss_program().made.written.program
    on = next(e for e in program.events if e.kind == EventKind.ARC_ON)
    at = program.events.index(on)
    last = len(program.moves) - 1
    twice = replace(program, events=(*program.events[: at + 1], on, *program.events[at + 1 :]))
    assert found(twice) == {("arc", on.before)}
    off = Event(EventKind.ARC_OFF, on.before)
    assert found(replace(program, events=(*program.events[:at], off, *program.events[at:]))) == {("arc", on.before)}
    end = max(k for k, e in enumerate(program.events) if e.kind == EventKind.ARC_OFF)
    left_on = replace(program, events=(*program.events[:end], *program.events[end + 1 :]))
    assert ("arc", last) in found(left_on)
