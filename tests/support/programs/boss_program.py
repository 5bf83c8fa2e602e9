"""A program of a small boss, as text, and what is done to it."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from tempfile import mkdtemp

from cell.job.job import Job
from cell.motion.motion import Motion
from cell.programs.cell_controller import cell_controller
from cell.programs.export import export_program
from cell.programs.exported.exported import Exported
from cell.programs.krl_read import read_krl
from cell.programs.program_check import ProgramResult, check_program

from ..jobs.boss_motion import NEAR_HOME, boss_case, result_of

LAYER = "boss_L001.src"


@dataclass(frozen=True, eq=False)
class BossProgram:
    """The boss, its checked motion and its program.

    Attributes:
        job: the boss, its wire's roll held at 20 deg, so that A, B and C all differ.
        motion: checked.
        made: the program.
    """

    job: Job
    motion: Motion
    made: Exported

    def read(self, folder: Path, change: Callable[[dict[str, str]], None] | None = None) -> ProgramResult:
        """The program as a file with something changed, read and judged."""
        files = {name: text.replace("\r\n", "\n") for name, text in self.made.files.items()}
        if change is not None:
            before = dict(files)
            change(files)
            assert files != before, "nothing was changed"
        for name, text in files.items():
            (folder / name).write_text(text, newline="\r\n")
        return check_program(self.job, read_krl(folder / "boss.src", cell_controller(self.job)))


@cache
def boss_program() -> BossProgram:
    """Made once for all tests."""
    result = result_of(boss_case(Path(mkdtemp(prefix="boss-")), roll={"fixed_deg": 20.0}, robot=NEAR_HOME))
    assert result.motion is not None
    return BossProgram(result.job, result.motion, export_program(result.job, result.motion))


def edited(pattern: str, new: str, *, file: str = LAYER, nth: int = 0) -> Callable[[dict[str, str]], None]:
    """Replace the nth place where a pattern stands in a file."""

    def change(files: dict[str, str]) -> None:
        found = list(re.finditer(pattern, files[file], re.MULTILINE))
        one = found[nth]
        files[file] = files[file][: one.start()] + one.expand(new) + files[file][one.end() :]

    return change


def line_of(pattern: str, *, file: str = LAYER, nth: int = 0) -> int:
    """Number of the line where a pattern stands in the unchanged program."""
    text = boss_program().made.files[file].replace("\r\n", "\n")
    found = list(re.finditer(pattern, text, re.MULTILINE))
    return text[: found[nth].start()].count("\n") + 1
