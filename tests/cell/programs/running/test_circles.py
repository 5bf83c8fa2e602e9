"""Circles and turns of the tool that a program does not settle are refused, those that it settles are run."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.programs.boss_program import boss_program

from cell.errors import InputError
from cell.programs.cell_controller import cell_controller
from cell.programs.krl_read import read_krl
from cell.programs.orientation import turns_the_longer_way
from cell.programs.running.interpolation import unsure_circles
from cell.programs.running.program_path import ProgramPath, interpolate_program

BEGIN = "$TOOL={X 0,Y 0,Z 100,A 0,B 0,C 0}\n$BASE=$NULLFRAME\nPTP {A1 0,A2 -90,A3 90,A4 0,A5 45,A6 0,E1 0,E2 0}\n"


def run(folder: Path, body: str) -> ProgramPath:
    boss = boss_program()
    (folder / "T.src").write_text(f"DEF T ( )\n{BEGIN}{body}END\n")
    return interpolate_program(read_krl(folder / "T.src", cell_controller(boss.job)), boss.job)


@pytest.fixture
def at(tmp_path: Path):
    """Points beside where the arm begins: mm along x and y of the base, degrees about its z."""
    T = run(tmp_path, "LIN_REL {Z 0}\n").begins[1]

    def point(dx: float = 0.0, dy: float = 0.0, turn: float | None = 0.0) -> str:
        x, y, z = 1e3 * T[:3, 3] + [dx, dy, 0.0]
        text = f"X {x:.6f},Y {y:.6f},Z {z:.6f}"
        if turn is not None:
            R = Rotation.from_euler("z", turn, degrees=True) * Rotation.from_matrix(T[:3, :3])
            text += ",A {:.6f},B {:.6f},C {:.6f}".format(*R.as_euler("ZYX", degrees=True))
        return "{" + text + "}"

    return point


NO_CIRCLE = "make no sure circle"


@pytest.mark.parametrize(
    ("via", "end", "tail", "message"),
    [
        ((20, 20), (0, 0), "", NO_CIRCLE),  # a full circle, as some write it
        ((20, 20), (0, 0), ",CA 360", NO_CIRCLE),
        ((20, 0), (40, 0), ",CA 90", NO_CIRCLE),
        ((20, 0.002), (40, 0), ",CA 90", NO_CIRCLE),
        ((60, 0), (40, 0), "", NO_CIRCLE),
        ((0, 0), (40, 0), "", NO_CIRCLE),
        ((20, 20), (40, 0, 30), ",CA 200", "ends at an angle .CA. and turns the tool, by 30 deg"),
        ((20, 20), (40, 0, 180), "", "turns the tool by 180 deg: it may go either way round"),
    ],
)
def test_circles_that_are_not_settled_are_refused(at, tmp_path: Path, via, end, tail: str, message: str) -> None:
    with pytest.raises(InputError, match=rf"T.src:6: .*{message}"):
        run(tmp_path, f"LIN {at()}\nCIRC {at(*via)},{at(*end)}{tail}\n")


def test_a_line_of_half_a_turn_is_refused(at, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"T.src:5: .*turns the tool by 180 deg"):
        run(tmp_path, f"LIN {at(5, 0, 180)}\n")


def test_circles_that_are_settled_are_run(at, tmp_path: Path) -> None:
    chord = run(tmp_path, f"LIN {at()}\nCIRC {at(20, 0.002)},{at(40)}\n")
    places = chord.Ts_frame_tcp[chord.move == 2][:, :3, 3] - chord.begins[2][:3, 3]
    np.testing.assert_allclose(places[-1], [0.04, 0, 0], atol=1e-6)
    assert np.abs(places[:, 1]).max() == pytest.approx(2e-6, rel=0.05)
    round_ = run(tmp_path, f"LIN {at()}\nCIRC {at(20, 20)},{at(40)},CA 450\n")
    places = round_.Ts_frame_tcp[round_.move == 2][:, :3, 3] - round_.begins[2][:3, 3]
    np.testing.assert_allclose(np.linalg.norm(places - [0.02, 0, 0], axis=1), 0.02, atol=1e-6)
    np.testing.assert_allclose(places[-1], [0.02, 0.02, 0], atol=1e-6)


@pytest.mark.parametrize(
    ("via", "end", "is_run"),
    [(-60, -120, True), (120, -120, False), (0, -30, True), (10, -30, True), (25, -30, False), (None, -120, True)],
)
def test_a_spline_circle_turns_the_way_of_its_auxiliary_point(
    at, tmp_path: Path, via: float | None, end: float, is_run: bool
) -> None:
    line, points = f"LIN {at()}\n", f"{at(20, 20, via)},{at(40, 0, end)}\n"
    assert not run(tmp_path, f"{line}CIRC {points}").failures  # which takes the shorter way whatever stands there
    if is_run:
        assert not run(tmp_path, f"{line}SCIRC {points}").failures
    else:
        with pytest.raises(InputError, match=r"T.src:6: SCIRC: .* the longer way round"):
            run(tmp_path, f"{line}SCIRC {points}")


def test_a_spline_circle_needs_to_know_where_it_begins(at, tmp_path: Path) -> None:
    circle = f"SCIRC {at(20, 20)},{at(40)}\n"
    assert not run(tmp_path, circle).failures  # from the axes of the PTP before
    with pytest.raises(InputError, match=r"T.src:7: SCIRC: the orientation where it begins is not known"):
        run(tmp_path, f"LIN {at()}\n$TOOL=$TOOL\n{circle}")
    assert not run(tmp_path, f"LIN {at()}\n$TOOL=$TOOL\nSCIRC {at(20, 20, None)},{at(40)}\n").failures
    with pytest.raises(InputError, match=r"T.src:6: SCIRC: its auxiliary point gives some of A B C"):
        run(tmp_path, f"LIN {at()}\nSCIRC {at(20, 20, None)[:-1]},A 5}},{at(40)}\n")
    with pytest.raises(InputError, match=r"T.src:5: SCIRC: .* the longer way round"):
        run(tmp_path, "SCIRC_REL {X 5,Y 5,A 90},{X 10,A -120} #TOOL\n")


def test_the_way_round_is_that_of_the_nearer_orientations() -> None:
    rng = np.random.default_rng(4)
    for _ in range(200):
        start, via = Rotation.random(2, random_state=int(rng.integers(2**31))).as_matrix()
        axis = rng.normal(size=3)
        turn = rng.uniform(0.2, 3.0) * axis / np.linalg.norm(axis)
        share = np.linspace(0, 1, 721)[:, None]
        end = start @ Rotation.from_rotvec(turn).as_matrix()
        back = turn - 2 * np.pi * turn / np.linalg.norm(turn)
        nearest = [
            (Rotation.from_matrix(start) * Rotation.from_rotvec(share * way)).inv() * Rotation.from_matrix(via)
            for way in (turn, back)
        ]
        short, long = (float(way.magnitude().min()) for way in nearest)
        if short < long:
            assert not turns_the_longer_way(start, via, end)
        elif short > long + 0.5:
            assert turns_the_longer_way(start, via, end)
    assert not turns_the_longer_way(start, via, start)


def test_three_points_settle_a_circle_as_far_as_they_are_from_a_line() -> None:
    start, end = np.zeros((4, 3)), np.tile([0.02, 0, 0], (4, 1))
    via = np.array([[0.01, 9e-6, 0], [0.01, 2e-5, 0], [0.03, 9e-6, 0], [0.03, 3e-5, 0]])
    assert unsure_circles(start, via, end, np.zeros(4, dtype=bool)).tolist() == [False, False, True, False]
    assert unsure_circles(start, via, end, np.ones(4, dtype=bool)).tolist() == [True, False, True, False]
