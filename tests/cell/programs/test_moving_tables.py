"""Tables that move along the beads, and tables that index, become programs and come back."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from support.jobs.boss_motion import boss_case
from support.jobs.indexed import three_bosses

from cell.case.read import load_case
from cell.cli.main import main
from cell.job.job import prepare
from cell.job.reordered import in_order
from cell.motion.file_order import in_motion_order
from cell.programs.export import export_program
from cell.programs.program import MoveKind
from cell.verdict.by_table_mode import check


@pytest.mark.slow
def test_a_table_that_moves_along_the_beads_has_its_angles_in_every_point(tmp_path: Path) -> None:
    job = prepare(load_case(boss_case(tmp_path, table={"mode": "coordinated"})))
    result = check(job)
    assert result.motion is not None
    made = export_program(result.job, result.motion)
    assert made.fault is None
    assert made.gap is not None
    assert made.result is not None
    assert made.gap.share(made.written.thinning) < 1
    moves, run = made.result.program.moves, made.result.run
    linear = moves.kind == MoveKind.LINEAR
    assert np.ptp(moves.external[linear], axis=0).max() > np.deg2rad(5)
    # the table is where the checked motion has it, target by target
    wanted, motion = result.motion, run.motion
    for target in range(0, len(job.targets), 3):
        a, b = (int(np.flatnonzero((m.target == target) & (m.arc == 1))[0]) for m in (wanted, motion))
        assert np.abs(wanted.table[a] - motion.table[b]).max() < np.deg2rad(0.05)
    # what is asked to move is not told to
    assert "program_table" not in [getattr(line, "code", "") for line in made.result.warnings]


@pytest.mark.slow
def test_a_table_that_indexes_is_turned_between_its_groups_and_the_program_is_read_in_its_own_order(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    case, out = three_bosses(tmp_path, controller={"program": "THREE"}), tmp_path / "out"
    assert main(["export", str(case), "--krl", str(out)]) == 0
    assert main(["check", str(case), "--program", str(out / "THREE.src")]) == 0
    text = "".join(path.read_text() for path in out.glob("*.src"))
    turns = {line.split("E2 ")[1].split("}")[0] for line in text.splitlines() if "E2 " in line}
    assert len(turns) >= 3
    assert capsys.readouterr().err.count("rbam:") == 0


@pytest.mark.slow
def test_a_program_of_layers_by_turns_is_judged_in_the_order_it_was_made_in(tmp_path: Path) -> None:
    job = prepare(load_case(three_bosses(tmp_path)))
    result = check(job)
    assert result.motion is not None
    turns = [(k, layer, layer) for layer in range(job.layers[0]) for k in range(3)]
    mixed = in_order(job, turns)
    # a job that has an order keeps it, whatever a motion does
    assert in_motion_order(mixed, result.motion) is mixed
    # and one that has none takes the motion's: here sub-volume after sub-volume, as it is
    assert in_motion_order(job, result.motion) is job
