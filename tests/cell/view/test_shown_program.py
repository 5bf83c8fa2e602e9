"""A program shown: its verdict, its lines, and what is wrong with it, in the replay and on the page."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import pytest
from support.jobs.boss_motion import boss_case
from support.programs.boss_program import LAYER, boss_program, edited, line_of

from cell.cli.main import main
from cell.html.check_page import html_report, page_data
from cell.html.pack import unpack
from cell.view.player import Player
from cell.view.shown_motion import played_program

LIN = r"^LIN .*$"


def said(player: Player) -> dict[str, str]:
    return dict(player.texts())


def test_a_replay_says_the_line_that_is_run(tmp_path: Path) -> None:
    boss = boss_program()
    result = boss.read(tmp_path)
    shown = played_program(boss.job, result)
    assert shown.feasible
    player = Player(shown)
    assert said(player)["verdict"] == "feasible"
    seen = set()
    while player.time < player.end:
        player.playing = True
        player.advance(0.05)
        text = said(player)
        file, number = text["line"].split(":")
        line = (tmp_path / file).read_text().splitlines()[int(number) - 1]
        assert line.startswith(("LIN", "PTP"))
        seen.add(text["line"])
        if text["arc"] == "on":
            assert line.startswith("LIN")
    assert len(seen) > 20


@pytest.mark.slow
def test_what_only_a_program_has_wrong_makes_what_is_shown_infeasible(tmp_path: Path) -> None:
    boss = boss_program()
    result = boss.read(tmp_path, edited(r"CDIS = 1.0000", "CDIS = 10.000"))
    assert result.found.feasible  # the motion alone is
    shown = played_program(boss.job, result)
    assert not shown.feasible
    assert {row.reason for row in shown.rows} == {None, "blend"}
    page = html_report(shown)
    assert "can weld all" not in page
    assert f"Found at {LAYER}:{line_of(LIN, nth=2)}: corners are rounded over 10 mm" in page


def test_the_page_counts_all_that_is_wrong(tmp_path: Path) -> None:
    boss = boss_program()
    result = boss.read(tmp_path, edited(r"\$TOOL = \{X [\d.]+", "$TOOL = {X 100.0"))
    count = Counter(one.reason for one in result.findings[1:])
    assert len(count) > 2
    page = html_report(played_program(boss.job, result))
    sentence = page[page.index("Found at") : page.index("</p>", page.index("Found at"))]
    assert f"{count.total()} more: " in sentence
    assert all(f"{k} {reason.replace('_', ' ')}" in sentence for reason, k in count.items())


def test_a_page_of_a_program_has_its_verdict_its_clearance_and_its_lines(tmp_path: Path) -> None:
    boss = boss_program()
    result = boss.read(tmp_path)
    shown = played_program(boss.job, result)
    page = html_report(shown)
    path = unpack(page_data(shown))["path"]
    assert len(path["line"]) == len(path["x"])
    for k in (5, len(path["x"]) // 2, -1):
        text = (tmp_path / path["files"][int(path["file"][k])]).read_text().splitlines()
        assert text[int(path["line"][k]) - 1].startswith(("LIN", "PTP"))
    assert "run as the controller would and checked in the cell" in page
    assert "No faults." in page
    assert result.found.clearance is not None
    assert f"{result.found.clearance[0] * 1e3:.1f} mm between" in page
    assert "can weld all" not in page


def test_replay_takes_a_program_and_refuses_what_does_not_go_with_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    boss_program().read(tmp_path)
    case, program = boss_case(tmp_path, roll={"fixed_deg": 20.0}), str(tmp_path / "boss.src")
    picture = tmp_path / "a.png"
    assert main(["replay", str(case), "--program", program, "--motion-in", "a.csv", "--picture", str(picture)]) == 2
    assert "does not go with --motion" in capsys.readouterr().err
    assert main(["replay", str(case), "--program", program, "--e1", "3", "--picture", str(picture)]) == 2
    assert "does not go with --program" in capsys.readouterr().err
