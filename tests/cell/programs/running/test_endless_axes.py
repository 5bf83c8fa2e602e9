"""A controller turns an endless axis of the table by the shorter way: programs are written and run so."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from support.cells.arm_models import table
from support.jobs.boss_motion import boss_case, result_of

from cell.motion.motion import Motion
from cell.programs.cell_controller import cell_controller
from cell.programs.export import export_program
from cell.programs.krl_read import read_krl
from cell.programs.program_check import ProgramResult, check_program
from cell.programs.running.external_axes import endless_axes
from cell.verdict.result import Result

E2 = 150.0  # deg, of the boss


@pytest.fixture(scope="module")
def boss_on(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Result]:
    """The boss on a table whose E2 is written so: without a range it is endless."""
    return cache(lambda turn: made_on(tmp_path_factory.mktemp("boss"), turn))


def made_on(folder: Path, turn: str) -> Result:
    (folder / "table.xml").write_text(table(turn=turn), encoding="utf-8")
    place = {"position_mm": [1500, 0, 0], "rotation_deg": [0, 0, -90], "max_speed_deg_s": [100, 150]}
    result = result_of(
        boss_case(folder, positioner={"model": "table.xml", **place}, table={"E1_deg": 90, "E2_deg": E2})
    )
    assert result.motion is not None
    return result


def turned_before(motion: Motion, turn_deg: float) -> Motion:
    """The motion, with the table coming from so far off while the arm stands at home."""
    dt = 0.02
    share = np.linspace(1.0, 0.0, int(abs(turn_deg)) + 1)[:-1] ** 2 * (
        3 - 2 * np.linspace(1.0, 0.0, int(abs(turn_deg)) + 1)[:-1]
    )
    first = {
        name: np.repeat(getattr(motion, name)[:1], len(share), axis=0)
        for name in ("q", "table", "bead", "layer", "target", "arc")
    }
    first["table"] = first["table"] + np.stack([np.zeros(len(share)), np.deg2rad(turn_deg) * share], axis=1)
    t_s = np.concatenate([dt * np.arange(len(share)), dt * len(share) + motion.t_s - motion.t_s[0]])
    return replace(
        motion, t_s=t_s, **{name: np.concatenate([rows, getattr(motion, name)]) for name, rows in first.items()}
    )


def modulo(turn_deg: float) -> float:
    """The turn that a controller makes of an endless axis."""
    return (turn_deg + 180.0) % 360.0 - 180.0


def ends(files: dict[str, str]) -> list[float]:
    """E2 of the points of the main module, deg."""
    return [float(angle) for angle in re.findall(r",E2 ([-\d.]+)\}", next(iter(files.values())))]


@pytest.mark.parametrize("turn_deg", [300.0, *(pytest.param(turn, marks=pytest.mark.slow) for turn in (-300.0, 180.0))])
def test_a_long_turn_of_an_endless_axis_is_written_in_moves_that_the_controller_makes_alike(boss_on, turn_deg):
    result = boss_on("")
    assert endless_axes(result.job.scene).tolist() == [False, True]
    made = export_program(result.job, turned_before(result.motion, turn_deg))
    assert made.fault is None
    moves = made.written.program.moves
    turns = np.rad2deg(np.diff(moves.external[:, 1]))
    assert np.abs(turns).max() < 179
    assert sum(modulo(turn) for turn in turns) == pytest.approx(-turn_deg)
    layer = next(text for name, text in made.files.items() if name.endswith("L000.src"))
    assert layer.count("PTP") >= 3


@pytest.mark.slow
def test_a_long_turn_of_an_axis_with_a_range_is_one_move(boss_on):
    result = boss_on('range="-350 460"')
    made = export_program(result.job, turned_before(result.motion, 300.0))
    assert made.fault is None
    assert np.rad2deg(np.abs(np.diff(made.written.program.moves.external[:, 1]))).max() == pytest.approx(300.0)


def rerun(folder: Path, result: Result, first_E2: float) -> ProgramResult:
    """The boss' program with its first point at another E2, read and judged."""
    made = export_program(result.job, result.motion)
    assert made.fault is None
    files = dict(made.files)
    main = next(iter(files))
    assert ends(files)[0] == pytest.approx(E2)
    files[main] = files[main].replace(f",E2 {E2:.5f}}}", f",E2 {first_E2:.5f}}}", 1)
    for name, text in files.items():
        (folder / name).write_text(text, newline="")
    return check_program(result.job, read_krl(folder / main, cell_controller(result.job)))


def span(result: ProgramResult) -> float:
    return float(np.rad2deg(np.ptp(result.run.motion.table[:, 1])))


@pytest.mark.parametrize(
    ("first_E2", "made_deg"),
    [(450.0, 60.0), *(pytest.param(*one, marks=pytest.mark.slow) for one in ((-20.0, 170.0), (-200.0, 10.0)))],
)
def test_a_program_is_run_the_way_an_endless_axis_turns(boss_on, tmp_path, first_E2, made_deg):
    result = rerun(tmp_path, boss_on(""), first_E2)
    assert span(result) == pytest.approx(made_deg)
    assert [f.reason for f in result.findings] == []
    told = [str(line) for line in result.warnings if "shorter way" in str(line)]
    assert len(told) == (abs(first_E2 - E2) > 180)


@pytest.mark.slow
def test_a_program_is_run_as_its_numbers_say_where_the_axis_has_a_range(boss_on, tmp_path):
    result = rerun(tmp_path, boss_on('range="-350 460"'), 450.0)
    assert span(result) == pytest.approx(300.0)
    assert not any("shorter way" in str(line) for line in result.warnings)


@pytest.mark.parametrize("first_E2", [330.0, *(pytest.param(E2, marks=pytest.mark.slow) for E2 in (-30.0, -29.9))])
def test_half_a_turn_of_an_endless_axis_is_a_finding(boss_on, tmp_path, first_E2):
    found = [f for f in rerun(tmp_path, boss_on(""), first_E2).findings if f.reason == "external"]
    assert [(f.detail["axis"], round(f.detail["turns_deg"], 1)) for f in found] == [
        ("E2", pytest.approx(abs(modulo(E2 - first_E2)), abs=0.06))
    ]
    assert found[0].line is not None
