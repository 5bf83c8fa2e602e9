"""Programs written and read back: the same text, the same moves."""

from __future__ import annotations

import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.programs.programs import controller, programs, written

from cell.programs.krl_read import read_krl
from cell.programs.krl_write import write_krl
from cell.programs.orientation import rotation_of
from cell.programs.program import BaseFrame, Event, EventKind, MoveKind, Moves, Program, ToolFrame


def turned_by(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Angles between orientations A B C, rad, without the loss that arccos has near 0."""
    difference = rotation_of(a) - rotation_of(b)
    return np.linalg.norm(difference, axis=(1, 2)) / np.sqrt(2)


def same_moves(read: Moves, made: Moves) -> None:
    """Equal to the digits that are written."""
    for name in ("kind", "status", "turn"):
        np.testing.assert_array_equal(getattr(read, name), getattr(made, name), err_msg=name)
    cartesian = ~np.isnan(made.pose[:, 0])
    np.testing.assert_allclose(read.pose[:, :3], made.pose[:, :3], atol=0.6e-7, err_msg="pose")
    assert (turned_by(read.pose[cartesian, 3:], made.pose[cartesian, 3:]) < 4e-7).all()
    np.testing.assert_allclose(read.via[:, :3], made.via[:, :3], atol=0.6e-7, err_msg="via")
    for name in ("joints", "external", "arc_angle"):
        np.testing.assert_allclose(getattr(read, name), getattr(made, name), atol=1e-7, err_msg=name)
    for name in ("speed", "turn_speed", "acceleration", "axis_share", "axis_acceleration", "external_share"):
        np.testing.assert_allclose(getattr(read, name), getattr(made, name), atol=1e-5, err_msg=name)
    for name in ("blend", "blend_share"):
        np.testing.assert_allclose(getattr(read, name), getattr(made, name), atol=1e-7, err_msg=name)


@settings(max_examples=30, deadline=None)
@given(program=programs(), points=st.sampled_from([10, 17, 1000]))
def test_what_is_written_comes_back(program: Program, points: int) -> None:
    its = controller(points_a_module=points)
    with tempfile.TemporaryDirectory() as folder:
        files = write_krl(program, its)
        path = written(Path(folder), files)
        read = read_krl(path, its)
        assert write_krl(read, its) == files  # text -> data -> text
    same_moves(read.moves, program.moves)
    found = [(event.kind, event.before, event.seconds) for event in read.events]
    assert found == [(event.kind, event.before, event.seconds) for event in program.events]
    for event, meant in zip(read.events, program.events, strict=True):
        assert {name: event.fields[name] for name in meant.fields} == dict(meant.fields)
    made = program.moves
    for row in np.flatnonzero(made.tool >= 0):
        tool, meant = read.tools[read.moves.tool[row]], program.tools[made.tool[row]]
        np.testing.assert_allclose(tool.T_flange_tcp, meant.T_flange_tcp, atol=2e-8)
        base, frame = read.bases[read.moves.base[row]], program.bases[made.base[row]]
        np.testing.assert_allclose(base.T, frame.T, atol=2e-8)
        assert (base.coupled, base.machine) == (frame.coupled, frame.machine)


@settings(max_examples=10, deadline=None)
@given(program=programs())
def test_every_move_knows_its_line(program: Program) -> None:
    its = controller(points_a_module=10)
    with tempfile.TemporaryDirectory() as folder:
        files = write_krl(program, its)
        read = read_krl(written(Path(folder), files), its)
    for move in range(len(read.moves)):
        line = read.line_of(move)
        assert line is not None
        text = files[line.file].split("\r\n")[line.number - 1]
        word = {MoveKind.AXES: "PTP", MoveKind.LINEAR: "LIN", MoveKind.CIRCULAR: "CIRC"}
        assert text.startswith(word[MoveKind(read.moves.kind[move])])


def path_of(abc: np.ndarray, **columns: np.ndarray) -> Program:
    """Linear moves in one place, with these angles."""
    n = len(abc)
    moves = Moves.empty(n)
    pose = np.concatenate((np.zeros((n, 3)), abc), axis=1)
    zero = np.zeros(n, dtype=np.int64)
    moves = replace(
        moves, pose=pose, external=np.zeros((n, 2)), tool=zero, base=zero, speed=np.full(n, 0.01), **columns
    )
    return Program("PATH", moves, (), (ToolFrame(np.eye(4)),), (BaseFrame(np.eye(4), coupled=True, machine=2),))


@pytest.mark.parametrize("sign", [1, -1])
def test_angles_run_on_through_a_right_angle_of_b(sign: int, tmp_path: Path) -> None:
    b = np.linspace(80, 100, 41)  # 90 itself is among them
    meant = np.radians(np.stack((np.full(41, 20.0), sign * b, np.full(41, -30.0)), axis=1))
    principal = meant.copy()  # as a rotation is taken apart: B within +-90, A and C jump by 180
    past = b > 90
    principal[past] = np.stack((meant[past, 0] + np.pi, sign * np.pi - meant[past, 1], meant[past, 2] + np.pi), axis=1)
    level = np.isclose(b, 90)
    principal[level] = np.array([0.0, sign * np.pi / 2, meant[0, 2] - sign * meant[0, 0]])  # A = 0, all of it in C
    its = controller()
    read = read_krl(written(tmp_path, write_krl(path_of(principal), its)), its)
    np.testing.assert_allclose(turned_by(read.moves.pose[:, 3:], meant), 0, atol=4e-7)
    steps = np.degrees(np.abs(np.diff(read.moves.pose[:, 3:], axis=0)))
    assert steps.max() < 0.51


def test_angles_do_not_jump_by_a_whole_turn(tmp_path: Path) -> None:
    a = np.radians(np.linspace(100, 500, 81))
    wrapped = (a + np.pi) % (2 * np.pi) - np.pi
    its = controller()
    read = read_krl(written(tmp_path, write_krl(path_of(np.stack((wrapped, 0 * a, 0 * a), axis=1)), its)), its)
    assert np.degrees(np.abs(np.diff(read.moves.pose[:, 3]))).max() < 5.01


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"pose": np.full((3, 6), np.nan)}, "not finite"),
        ({"tool": np.full(3, -1)}, "no tool or no base"),
        ({"base": np.full(3, -1)}, "no tool or no base"),
        ({"pose": np.array([[np.inf, 0, 0, 0, 0, 0]] * 3)}, "not finite"),
        ({"pose": np.array([[1e7, 0, 0, 0, 0, 0]] * 3)}, "cannot be written"),
        ({"kind": np.zeros(3, dtype=np.int64), "blend": np.full(3, 0.001)}, "C_PTP"),
    ],
)
def test_what_cannot_run_is_not_written(change: dict[str, np.ndarray], message: str) -> None:
    program = path_of(np.zeros((3, 3)))
    with pytest.raises(ValueError, match=message):
        write_krl(replace(program, moves=replace(program.moves, **change)), controller())


@pytest.mark.parametrize("kind", [EventKind.ARC_ON, EventKind.ARC_OFF, EventKind.WAIT])
def test_no_arc_starts_where_a_corner_is_rounded(kind: EventKind) -> None:
    program = path_of(np.zeros((3, 3)), blend=np.array([0.0, 0.001, 0.0]))
    with pytest.raises(ValueError, match="rounded"):
        write_krl(replace(program, events=(Event(kind, 2),)), controller())
    write_krl(replace(program, events=(Event(kind, 1),)), controller())


def test_a_number_stands_for_a_frame_of_the_controller(tmp_path: Path) -> None:
    frame = np.eye(4)
    frame[:3, 3] = 0.1, 0.2, 0.3
    program = path_of(np.zeros((2, 3)))
    program = replace(
        program, tools=(ToolFrame(frame, number=3),), bases=(BaseFrame(frame, coupled=True, number=5, machine=2),)
    )
    section = {"tool_data": {3: {"position_mm": [100, 200, 300]}}, "base_data": {5: {"position_mm": [100, 200, 300]}}}
    its = controller(read=section)
    files = write_krl(program, its)
    text = next(iter(files.values()))
    assert "$TOOL = TOOL_DATA[3]\r\n" in text
    assert "$BASE = EK(MACHINE_DEF[2].ROOT, MACHINE_DEF[2].MECH_TYPE, BASE_DATA[5])\r\n" in text
    read = read_krl(written(tmp_path, files), its)
    assert (read.tools[0].number, read.bases[0].number, read.bases[0].machine) == (3, 5, 2)
    np.testing.assert_allclose(read.bases[0].T, frame)
