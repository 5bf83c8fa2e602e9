"""The numbers that README and help promise are those that the program keeps; a weaker one has to be told."""

from __future__ import annotations

import contextlib
import io
import re
from collections.abc import Callable

import numpy as np
import pytest
from support.paths import ROOT

from cell.case.sections import Case, Checks, Process
from cell.cli.check_command import HELP_CHECKS, HELP_SECONDS
from cell.cli.main import main
from cell.collision.blend_bisection import MANY, NEARLY_ALL, NEARLY_MANY
from cell.job.job import LARGE_PART
from cell.planning.context import Steps
from cell.planning.infeasible_part import FLOOR, LARGE_FLOOR, PER_TARGET, SMALL
from cell.programs.round_trip import OFF, TURNED
from slicing import BeadParameters

SPACING = Steps()
WORDS = {"two": 2.0, "half": 0.5}
COMPLETE = {"part": {"mesh": "propeller.stl"}}


def help_of(command: str) -> str:
    said = io.StringIO()
    with contextlib.redirect_stdout(said), pytest.raises(SystemExit):
        main([command, "--help"])
    return " ".join(said.getvalue().split())


def read_me() -> str:
    return " ".join((ROOT / "README.md").read_text(encoding="utf-8").split())


PROMISES: list[tuple[Callable[[], str], str, list[float]]] = [
    (
        read_me,
        r"samples are at most ([\d.]+) mm and about ([\d.]+) degrees apart along beads, and about ([\d.]+) degree",
        [1e3 * SPACING.position, np.rad2deg(SPACING.angle), np.rad2deg(SPACING.travel_angle)],
    ),
    (
        read_me,
        r"the clearance less ([\d.]+) mm is proved, or (half) the clearance where a path needs more than ([\d,]+) coll",
        [1e3 * NEARLY_ALL, NEARLY_MANY, MANY],
    ),
    (
        read_me,
        r"search is limited to ([\d.]+) s of processor time and that of (two) checks",
        [HELP_SECONDS, HELP_CHECKS],
    ),
    (read_me, r"arm and torch keep ([\d.]+) mm from everything else unless", [Checks().clearance_mm]),
    (
        read_me,
        r"below (half) of it \(`process.least_speed_share`\) the part",
        [Process().least_speed_share],
    ),
    (read_me, r"Beads are ([\d.]+) mm wide unless", [Case.model_validate(COMPLETE).beads.width_mm]),
    (read_me, r"Beads are ([\d.]+) mm wide unless", [BeadParameters().width_mm]),
    (
        lambda: help_of("check"),
        r"limited: ([\d,]+) configurations \(([\d,]+) for parts of up to ([\d,]+) targets\) and ([\d,]+) more for each",
        [LARGE_FLOOR, FLOOR, SMALL, PER_TARGET],
    ),
    (
        lambda: help_of("check"),
        r"at most ([\d.]+) s of processor time and that of (two) checks",
        [HELP_SECONDS, HELP_CHECKS],
    ),
    (lambda: help_of("check"), r"Parts of ([\d,]+) targets and more are checked in chunks", [LARGE_PART]),
    (
        lambda: help_of("export"),
        r"is the checked one within ([\d.]+) mm and ([\d.]+) deg",
        [1e3 * OFF, np.rad2deg(TURNED)],
    ),
]


@pytest.mark.parametrize(("text", "promise", "kept"), PROMISES, ids=[promise[:40] for _, promise, _ in PROMISES])
def test_what_is_promised_is_kept(text: Callable[[], str], promise: str, kept: list[float]) -> None:
    found = re.findall(promise, text())
    assert len(found) == 1, "the sentence stands there once"
    told = [found[0]] if isinstance(found[0], str) else list(found[0])
    assert [WORDS[w] if w in WORDS else float(w.replace(",", "")) for w in told] == pytest.approx(kept)
