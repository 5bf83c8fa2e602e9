"""S and T of a PTP to a pose: KUKA's bits, of the configuration that the signs of T leave."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from support.programs.boss_program import boss_program

from cell.errors import InputError
from cell.programs.cell_controller import cell_controller
from cell.programs.krl_read import read_krl
from cell.programs.running.configuration_tracking import ConfigurationTracker
from cell.programs.running.program_path import interpolate_program
from ik import closed_form
from ik.roll import wrap

AXES = np.array([20.0, -80.0, 85.0, 30.0, 60.0, -20.0])


def test_every_configuration_of_a_pose_has_a_status_of_its_own() -> None:
    solver = boss_program().job.solver
    pose = solver.chain.forward(np.deg2rad(AXES)[None])
    q = closed_form.solve(solver.form, pose)[0]
    q = wrap(q[np.isfinite(q[:, 0])])
    found = [ConfigurationTracker(solver).status(one) for one in q]
    assert ConfigurationTracker(solver).status(np.deg2rad(AXES)) == 2
    assert sorted(found) == list(range(8))
    for one, status in zip(q, found, strict=True):
        assert status is not None
        assert bool(status & 4) == (one[4] < 0)
        assert bool(status & 1) == (abs(wrap(one[0] - np.deg2rad(AXES[0]))) > np.pi / 2)
    # of two that differ by the elbow alone the one with the greater A3 has bit 1
    elbows = {status & 2: one[2] for one, status in zip(q, found, strict=True) if status is not None and not status & 1}
    assert elbows[2] > elbows[0]


def test_a_status_that_contradicts_the_turn_is_refused(tmp_path: Path) -> None:
    boss = boss_program()
    its, path = cell_controller(boss.job), tmp_path / "T.src"
    begin = "$TOOL=$NULLFRAME\n$BASE=$NULLFRAME\nPTP {A1 0,A2 -90,A3 90,A4 0,A5 45,A6 0,E1 0,E2 0}\n"
    axes = ",".join(f"A{i + 1} {value:g}" for i, value in enumerate(AXES))
    path.write_text(f"DEF T ( )\n{begin}PTP {{{axes}}}\nLIN_REL {{Z 0}}\nEND\n")
    x, y, z, a, b, c = read_krl(path, its).moves.pose[2] * [1e3, 1e3, 1e3, *[180 / np.pi] * 3]
    turn = sum(1 << i for i, value in enumerate(AXES) if value < 0)
    for status in range(8):
        point = f"X {x:.6f},Y {y:.6f},Z {z:.6f},A {a:.6f},B {b:.6f},C {c:.6f},S {status},T {turn}"
        path.write_text(f"DEF T ( )\n{begin}PTP {{{point}}}\nEND\n")
        if status == 2:
            end = interpolate_program(read_krl(path, its), boss.job).axes[-1, :6]
            np.testing.assert_allclose(np.degrees(end), AXES, atol=1e-3)
            continue
        with pytest.raises(InputError, match=f"S {status} and T {turn} are of different configurations: .* have S 2"):
            interpolate_program(read_krl(path, its), boss.job)
