"""How much is said: nothing, the usual, everything; colours only where they are wanted."""

from __future__ import annotations

import io
import re
from collections.abc import Callable
from pathlib import Path

import pytest
from rich.text import Text

from cell.cli.console import console
from cell.cli.main import main
from cell.cli.progress_bar import Bars
from cell.cli.verbosity import is_quiet, is_verbose, speaking
from cell.progress import counted_progress, phase
from cell.report.check_report import WORST


class Tty(io.StringIO):
    def isatty(self) -> bool:
        return True


@phase("adding")
def add(a: int, b: int) -> int:
    return a + b


def test_quiet_says_nothing_and_the_exit_code_tells(
    make_case: Callable[..., Path], capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    # what nobody would hear of is not searched
    monkeypatch.setattr("cell.remedy_search.search.remedies", lambda *_: pytest.fail("searched what would help"))
    assert main(["check", "--quiet", str(make_case())]) == 0
    assert main(["check", "-q", str(make_case(positioner={"position_mm": [4000, 0, 0]}))]) == 1
    assert capsys.readouterr() == ("", "")
    assert main(["check", "-q", "missing.case.yaml"]) == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert not is_quiet()


def test_quiet_still_writes_what_is_asked_for(
    make_case: Callable[..., Path], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["slice", "-q", str(make_case()), "--json", "-"]) == 0
    out, err = capsys.readouterr()
    assert out.startswith('{"schema": "rbam-slices/1"')
    assert err == ""


def test_verbose_lists_every_infeasible_target_and_what_took_how_long(
    make_case: Callable[..., Path], capsys: pytest.CaptureFixture[str]
) -> None:
    case = str(make_case(positioner={"position_mm": [4000, 0, 0]}))
    lines = []
    for option in ([], ["--verbose"]):
        assert main(["check", case, "--no-remedies", *option]) == 1
        out, err = capsys.readouterr()
        lines.append([line for line in out.splitlines() if "beyond the arm's reach" in line])
    assert len(lines[0]) == WORST
    number = re.search(r"infeasible: (\d+)|(\d+) of (\d+) targets", out)
    assert number
    assert len(lines[1]) == int(number[3])
    assert re.search(r"^time: .*slicing [\d.]+ s, .*checking [\d.]+ s, in all [\d.]+ s$", err, re.MULTILINE)


def test_quiet_and_verbose_exclude_each_other(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        main(["check", "-q", "-v"])
    assert caught.value.code == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_a_stage_is_timed_only_where_somebody_speaks() -> None:
    to = Tty()
    assert add(1, 2) == 3
    with speaking(False, True, to):
        assert is_verbose()
        assert add(3, 4) == 7
    assert add(5, 6) == 11
    assert "adding" in to.getvalue()
    assert re.search(r"time: adding 0\.\d\d s, in all", to.getvalue())


def test_bars_and_spinners_are_for_terminals_that_want_them() -> None:
    for quiet, stream, shown in ((False, Tty(), True), (True, Tty(), False), (False, io.StringIO(), False)):
        with speaking(quiet, False, stream):
            add(1, 2)
            with counted_progress(Bars(stream), "things", 2) as count:
                count()
        assert bool(stream.getvalue()) == shown


@pytest.mark.parametrize("no_color", [False, True])
def test_no_color_is_respected(monkeypatch: pytest.MonkeyPatch, no_color: bool) -> None:
    monkeypatch.setenv("TERM", "xterm-256color")
    monkeypatch.delenv("NO_COLOR", raising=False)
    if no_color:
        monkeypatch.setenv("NO_COLOR", "1")
    stream = Tty()
    console(stream).print(Text("feasible", "green"))
    assert ("\x1b[32m" in stream.getvalue()) != no_color


def test_progress_is_told_from_the_first_to_the_last_even_where_it_ends_early() -> None:
    told: list[tuple[str, int, int]] = []

    def stops() -> None:
        with counted_progress(lambda *step: told.append(step), "things", 4, done=1) as count:
            count()
            raise RuntimeError("stopped")

    with pytest.raises(RuntimeError, match="stopped"):
        stops()
    assert told == [("things", 1, 4), ("things", 2, 4), ("things", 4, 4)]


def test_the_last_that_a_bar_shows_is_all_of_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TERM", "xterm")
    stream = Tty()
    with counted_progress(Bars(stream), "things", 3) as count:
        for _ in range(3):
            count()
    shown = re.findall(r"(\d)/3", stream.getvalue())
    assert shown[-1] == "3"
