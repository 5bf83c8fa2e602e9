"""Motion files in a replay: what is shown is the file's motion, whatever its verdict."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest
from support.jobs.boss_motion import boss_case, result_of

from cell.cli.main import main
from cell.motion.motion import Motion
from cell.motion.motion_file import read_motion, write_motion
from cell.verdict.result import Result
from cell.verification.motion_check import check_motion
from cell.view.picture import picture
from cell.view.player import Player
from cell.view.shown_motion import ShownMotion, played
from cell.view.stage_scene import StagedScene


@pytest.fixture(scope="module")
def boss(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return boss_case(tmp_path_factory.mktemp("boss"))


@pytest.fixture(scope="module")
def result(boss: Path) -> Result:
    return result_of(boss)


def shown(result: Result, motion: Motion, path: Path, target: int | None = None) -> ShownMotion:
    write_motion(path, motion)
    return played(result.job, check_motion(result.job, read_motion(path, result.job)), target)


def test_a_good_motion_plays_as_the_checked_one_does(result: Result, tmp_path: Path) -> None:
    late = replace(result.motion, t_s=result.motion.t_s + 100.0)
    again = Player(shown(result, late, tmp_path / "m.npz"))
    player = Player(result)
    assert again.end == pytest.approx(player.end)
    assert ("verdict", "feasible") in again.texts()
    # off the rows: which of two a time rounded to microseconds is in is nobody's affair
    m = result.motion.t_s
    for time in ((m[1:] + m[:-1]) / 2)[:: len(m) // 25]:
        player.time = again.time = float(time)
        a, b = player.frame(), again.frame()
        np.testing.assert_allclose(a.q, b.q, atol=1e-4)
        assert (a.target, a.laying) == (b.target, b.laying)
        assert a.done == pytest.approx(b.done, abs=1e-3)


def test_a_bad_motion_plays_and_says_what_is_wrong(result: Result, tmp_path: Path) -> None:
    m = result.motion
    bad = replace(m, q=m.q.copy())
    mine = np.flatnonzero((m.bead == 1) & (m.arc == 1))
    bad.q[mine, 5] += 2 * np.pi * np.sign(-bad.q[mine, 5].mean())
    bad.q[mine[3:], 4] += np.deg2rad(0.5)
    keep = m.bead < m.bead.max()
    bad = replace(bad, q=(bad.q - (bad.q - m.q) * (np.arange(6) == 5)))
    columns = {name: getattr(bad, name)[keep] for name in ("t_s", "q", "table", "arc", "bead", "layer", "target")}
    there = shown(result, replace(bad, **columns), tmp_path / "m.csv")
    assert not there.feasible
    player = Player(there)
    assert player.end == pytest.approx(m.t_s[keep][-1], abs=1e-5)
    verdict = dict(player.texts())["verdict"]
    assert verdict.startswith("infeasible: ")
    off = int(m.target[mine[5]])
    assert there.rows[off].reason in ("off_bead", "speed")
    assert there.rows[-1].reason == "not_welded"
    for i, row in enumerate(there.rows):
        if row.reason is not None:
            player.time = float(player._at[i])
            assert player.frame().q.shape == (6,)
            assert player.texts()


def test_a_picture_stands_the_table_where_it_is_at_that_target(result: Result, tmp_path: Path) -> None:
    m = result.motion
    table = m.table.copy()
    table[:, 0] -= np.deg2rad(np.linspace(0, 2, len(table)))
    there = shown(result, replace(m, table=table), tmp_path / "m.csv", target=len(result.job.targets) - 1)
    at = np.flatnonzero((m.target == len(result.job.targets) - 1) & (m.arc == 1))[0]
    assert there.table[0] == pytest.approx(table[at, 0], abs=1e-3)
    staged = StagedScene(there)
    staged.pose(Player(there).frame())
    data = mujoco.MjData(staged.model)
    data.qpos[result.job.scene.table_qpos] = table[0]
    mujoco.mj_kinematics(staged.model, data)
    np.testing.assert_allclose(staged.data.site("part").xpos, data.site("part").xpos, atol=1e-6)


@pytest.mark.slow
def test_the_command_draws_a_motion_from_a_file(
    result: Result, boss: Path, tmp_path: Path, gl: None, capsys: pytest.CaptureFixture[str]
) -> None:
    path, png = tmp_path / "m.csv", tmp_path / "m.png"
    write_motion(path, result.motion)
    argv = ["replay", str(boss), "--motion-in", str(path), "--picture", str(png), "--size", "160x120"]
    assert main(argv) == 0
    assert capsys.readouterr().err == ""
    assert png.read_bytes() == picture(shown(result, result.motion, path), width=160, height=120)
    write_motion(path, replace(result.motion, t_s=result.motion.t_s * 9))
    assert main(argv) == 0
    assert "infeasible" in capsys.readouterr().err


def test_what_does_not_fit_is_one_line(result: Result, boss: Path, tmp_path: Path, capsys) -> None:
    png = tmp_path / "m.png"
    path = tmp_path / "m.csv"
    write_motion(path, result.motion)
    path.write_text(path.read_text().replace("A6_deg", "J6_deg"))
    for argv, said in (
        (["--motion", str(path)], "has no column A6_deg"),
        (["--motion", str(tmp_path / "none.csv")], "no such file"),
        (["--motion", "m.txt"], "a motion file must end in .csv or .npz"),
        (["--motion", str(path), "--e1", "10"], "--e1: does not go with --motion"),
        (["--motion", str(path), "--sweep", "map.json"], "--sweep: does not go with --motion"),
    ):
        assert main(["replay", str(boss), *argv, "--picture", str(png)]) == 2
        error = capsys.readouterr().err
        assert said in error
        assert error.count("\n") == 1
        assert not png.exists()
