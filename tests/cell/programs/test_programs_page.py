"""docs/programs.md shows what is written, and its hooks can be used."""

from __future__ import annotations

import re
import tempfile
from pathlib import Path

import yaml
from hypothesis import given, settings
from support.paths import ROOT
from support.programs.programs import controller, programs, written

from cell.programs.krl_read import read_krl
from cell.programs.krl_write import write_krl
from cell.programs.program import Program

PAGE = (ROOT / "docs" / "programs.md").read_text(encoding="utf-8")
GOLDEN = ROOT / "tests" / "data" / "programs" / "golden"


def test_the_lines_it_walks_through_are_written() -> None:
    golden = "".join(path.read_text(encoding="ascii") for path in GOLDEN.iterdir()).replace("small", "BLADE")
    walk = PAGE[PAGE.index("## A written program") : PAGE.index("## Hooks")]
    blocks = re.findall(r"^    (.*)$", walk, re.M)
    shown = [re.split(r"  +(?=\S)", line.strip())[0] for line in blocks]  # without what is said beside it
    assert len(shown) > 35
    assert [line for line in shown if line not in golden] == []


def sections() -> list[dict[str, object]]:
    """The controller sections it shows."""
    blocks = re.findall(r"(?:^    .*\n)+", PAGE, re.M)
    found = [yaml.safe_load(block) for block in blocks if block.strip().startswith("controller:")]
    return [content["controller"] for content in found]


def test_it_shows_hooks_for_arctech_and_hooks_without_an_arc() -> None:
    assert len(sections()) == 2


@settings(max_examples=10, deadline=None)
@given(program=programs())
def test_its_hooks_come_back(program: Program) -> None:
    for section in sections():
        its = controller(**section)
        with tempfile.TemporaryDirectory() as folder:
            files = write_krl(program, its)
            read = read_krl(written(Path(folder), files), its)
        assert [(event.kind, event.before) for event in read.events] == [
            (event.kind, event.before) for event in program.events
        ]
        assert write_krl(read, its) == files
