"""One wrong digit in a good program is found, with the line it stands in."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest
from support.programs.boss_program import LAYER, boss_program, edited, line_of

from cell.errors import InputError

LIN = r"^LIN \{X (\S+?),Y (\S+?),Z (\S+?),A (\S+?),B (\S+?),C (\S+?),E1 (\S+?),E2 (\S+?)\}( C_DIS)?$"
Change = Callable[[dict[str, str]], None]


def point(**values: str) -> str:
    """What a LIN is replaced with."""
    own = dict(zip("XYZABC", (rf"\g<{k}>" for k in range(1, 7)), strict=True)) | {"E1": r"\g<7>", "E2": r"\g<8>"}
    return "LIN {" + ",".join(f"{name} {value}" for name, value in (own | values).items()) + r"}\g<9>"


def everywhere(pattern: str, new: str | Callable[[re.Match[str]], str], *names: str) -> Change:
    """Replace all places in some files, in all where none are named."""

    def change(files: dict[str, str]) -> None:
        for name in names or tuple(files):
            files[name] = re.sub(pattern, new, files[name], flags=re.MULTILINE)

    return change


UNCOUPLED = r"^\$BASE = EK\(.*?(\{.*\})\)$", r"$BASE = \1"
FOUND: dict[str, tuple[Change, str, str, int]] = {
    # what was done: the change, the reason expected, the file and line that it is expected at
    "E1 is given nowhere": (everywhere(r",E1 [-\d.]+", ""), "external", "boss.src", line_of(r"^PTP", file="boss.src")),
    "A and C swapped": (edited(LIN, point(A=r"\g<6>", C=r"\g<4>"), nth=3), "off_bead", LAYER, line_of(LIN, nth=3)),
    "base not coupled": (everywhere(*UNCOUPLED, LAYER), "unreachable", LAYER, line_of(LIN)),
    "a digit of the tool": (edited(r"Z 430", "Z 431"), "tool", LAYER, line_of(LIN)),
    "a digit of the base": (edited(r"Z 100", "Z 101"), "off_bead", LAYER, line_of(LIN, nth=2)),
    "C_DIS too wide": (edited(r"CDIS = 1.0000", "CDIS = 10.000"), "blend", LAYER, line_of(LIN, nth=2)),
    "a point missing": (edited(LIN + "\n", "", nth=3), "off_bead", LAYER, line_of(LIN, nth=3)),
    "a point that is not there": (edited(LIN, point(X="-2.2199"), nth=2), "off_bead", LAYER, line_of(LIN, nth=2)),
    "ten times the speed": (edited(r"CP = 0.008", "CP = 0.08"), "speed", LAYER, line_of(LIN, nth=2)),
    "a tenth of the speed": (edited(r"CP = 0.008", "CP = 0.0008"), "speed", LAYER, line_of(LIN, nth=2)),
    "a sign flipped": (edited(LIN, point(Y=r"-\g<2>"), nth=4), "off_bead", LAYER, line_of(LIN, nth=4)),
    "arc on missing": (edited(r"^ARC_ON.*\n", ""), "order", "boss_L002.src", line_of(LIN, file="boss_L002.src", nth=2)),
    "PTP instead of LIN": (
        edited(r"^LIN \{(.*)\}( C_DIS)?$", r"PTP {\1}", nth=3),
        "arc",
        LAYER,
        line_of(LIN, nth=3),
    ),
    "a layer's call missing": (
        edited(r"^boss_L001 \( \)\n", "", file="boss.src"),
        "order",
        "boss_L002.src",
        line_of(LIN, file="boss_L002.src", nth=2),
    ),
    "rounded where the arc starts": (edited(LIN, r"\g<0> C_DIS", nth=1), "blend", LAYER, line_of(LIN, nth=1)),
    "rounded where the arc ends": (edited(LIN, r"\g<0> C_DIS", nth=7), "blend", LAYER, line_of(LIN, nth=7)),
    "a PTP rounded where the arc starts": (
        edited(r"^LIN \{(.*)\}$", r"PTP {\1} C_PTP", nth=1),
        "blend",
        LAYER,
        line_of(LIN, nth=1),
    ),
    "rounded by the orientation": (edited(" C_DIS$", " C_ORI", nth=2), "blend", LAYER, line_of(" C_DIS$", nth=2)),
    "the root elsewhere": (
        everywhere(r"MACHINE_DEF\[2\].ROOT", "{X 1500,Y 0.1,Z 0,A -90,B 0,C 0}", LAYER),
        "base",
        LAYER,
        line_of(LIN),
    ),
    "the root turned": (
        everywhere(r"MACHINE_DEF\[2\].ROOT", "{X 1500,Y 0,Z 0,A -89.9,B 0,C 0}", LAYER),
        "base",
        LAYER,
        line_of(LIN),
    ),
    "arc on again": (edited(LIN, r"\g<0>\nARC_ON ( )", nth=3), "arc", LAYER, line_of(LIN, nth=4) + 1),
    "arc off missing": (
        edited(r"^ARC_OFF.*\n", ""),
        "off_bead",
        "boss_L002.src",
        line_of(LIN, file="boss_L002.src"),
    ),
}


def test_the_program_as_it_is_written_is_feasible(tmp_path: Path) -> None:
    result = boss_program().read(tmp_path)
    assert result.feasible
    assert result.found.welded == len(boss_program().job.targets)
    assert not [line for line in result.warnings if getattr(line, "code", "").startswith("program")]


@pytest.mark.slow
@pytest.mark.parametrize("what", FOUND)
def test_a_wrong_digit_is_found_with_its_line(what: str, tmp_path: Path) -> None:
    change, reason, file, line = FOUND[what]
    result = boss_program().read(tmp_path, change)
    assert not result.feasible
    assert (file, line) in {(f.line.file, f.line.number) for f in result.findings if f.reason == reason and f.line}


PUSHED = {  # further along the wire than it is where the arc goes on or off, or beside it, and back
    "into what lies below, and across": (
        r"^ARC_OFF.*\n",
        r"\g<0>LIN_REL {Z 4} #TOOL\nLIN_REL {Y -12}\nLIN_REL {Z -4} #TOOL\n",
    ),
    "across, as deep as it was": (r"^ARC_OFF.*\n", r"\g<0>LIN_REL {Z 12}\nLIN_REL {Z -14} #TOOL\n"),
    "into what lies below": (r"^ARC_ON.*\n", r"LIN_REL {Z 2} #TOOL\nLIN_REL {Z -2} #TOOL\n\g<0>"),
}


@pytest.mark.parametrize("what", PUSHED)
def test_a_wire_that_is_pushed_into_the_part_beside_a_bead_is_found(what: str, tmp_path: Path) -> None:
    pattern, new = PUSHED[what]
    result = boss_program().read(tmp_path, edited(pattern, new))
    assert {f.reason for f in result.findings} == {"collision"}
    assert {"torch_wire"} <= set(result.findings[0].failure.pair)
    line = line_of(pattern) + new.startswith(r"\g<0>")
    assert line in {f.line.number for f in result.findings if f.line}


@pytest.mark.parametrize(
    "away", ["LIN_REL {Z -4} #TOOL\nLIN_REL {Y -12}", "LIN_REL {Y -1}", "LIN_REL {Y -6,Z -9} #TOOL"]
)
def test_a_wire_that_is_drawn_back_beside_a_bead_is_free(away: str, tmp_path: Path) -> None:
    change = edited(r"^ARC_OFF.*\n", rf"\g<0>{away}\nLIN_REL {{Z -14}} #TOOL\n")
    assert boss_program().read(tmp_path, change).feasible


HARMLESS = {
    "the root as it is": everywhere(r"MACHINE_DEF\[2\].ROOT", "{X 1500,Y 0,Z 0,A -90,B 0,C 0}"),
    "a wait between a rounded corner and the arc": edited(
        r"^(LIN .*[^S])$(?=\nARC_ON)", r"\1 C_DIS\nWAIT SEC 0.1", nth=0
    ),
    "capitals": everywhere(r"^(LIN|PTP|END|DEF) (.*)$", lambda m: m.group(0).lower()),
    "a point twice": edited(LIN, r"\g<0>\n\g<0>", nth=3),
    "words of the arc in comments": edited(LIN, r"; ARC_OFF ( ) comes\n\g<0> ;ARC_OFF ( )", nth=3),
}


@pytest.mark.parametrize(
    "what",
    [what if what.startswith(("a wait", "words")) else pytest.param(what, marks=pytest.mark.slow) for what in HARMLESS],
)
def test_what_changes_nothing_is_feasible(what: str, tmp_path: Path) -> None:
    assert boss_program().read(tmp_path, HARMLESS[what]).feasible


REFUSED = {
    "a tool that nobody knows": (edited(r"^\$TOOL = .*$", "$TOOL = TOOL_DATA[4]"), line_of(r"^\$TOOL")),
    "mm/s for m/s": (edited(r"CP = 0.008000", "CP = 8.0"), line_of(r"CP = 0.008")),
    "no active external axes": (edited(r"^\$ACT_EX_AX = 2", "$ACT_EX_AX = 0"), line_of(LIN)),
    "external axes of no number": (edited(r"^\$ACT_EX_AX = 2", "$ACT_EX_AX = -1"), line_of(r"^\$ACT_EX_AX")),
    "two machines": (edited(r"MACHINE_DEF\[2\]\.ROOT", "MACHINE_DEF[3].ROOT"), line_of(r"^\$BASE")),
}


@pytest.mark.parametrize("what", REFUSED)
def test_what_cannot_be_run_is_refused_with_its_line(what: str, tmp_path: Path) -> None:
    change, line = REFUSED[what]
    with pytest.raises(InputError, match=rf"{LAYER}:{line}: "):
        boss_program().read(tmp_path, change)


def test_a_table_that_moves_inside_a_bead_is_told_with_its_line(tmp_path: Path) -> None:
    # the torch follows the table: on the part nothing changes, and it may be meant
    result = boss_program().read(tmp_path, edited(LIN, point(E2="-179.00000"), nth=3))
    told = [line for line in result.warnings if getattr(line, "code", None) == "program_table"]
    assert len(told) == 1
    assert f"{LAYER}:{line_of(LIN, nth=3)}: E2 moves with the arc on, by 1 deg" in told[0]


DOUBTED = {
    "E1 dropped in one point": (
        edited(LIN, r"LIN {X \g<1>,Y \g<2>,Z \g<3>,A \g<4>,B \g<5>,C \g<6>,E2 \g<8>}\g<9>", nth=3),
        f"{LAYER}:{line_of(LIN, nth=3)}: E1 is left out of the point: it stays where it is",
    ),
    "$ACT_EX_AX missing": (
        everywhere(r"^\$ACT_EX_AX.*$", ";"),
        f"boss_L000.src:{line_of(LIN, file='boss_L000.src')}: the base is coupled by EK, and $ACT_EX_AX is not set",
    ),
}


@pytest.mark.parametrize(
    "what", [what if what.startswith("E1") else pytest.param(what, marks=pytest.mark.slow) for what in DOUBTED]
)
def test_what_may_be_meant_is_told_with_its_line(what: str, tmp_path: Path) -> None:
    change, words = DOUBTED[what]
    result = boss_program().read(tmp_path, change)
    told = [line for line in result.warnings if getattr(line, "code", None) == "program_doubt"]
    assert len(told) == 1
    assert told[0].startswith(words)


def test_a_table_that_stands_elsewhere_is_told_with_its_line(tmp_path: Path) -> None:
    result = boss_program().read(tmp_path, everywhere(r"E2 -180.00000", "E2 -178.00000"))
    told = [line for line in result.warnings if getattr(line, "code", None) == "program_table"]
    assert len(told) == 1
    assert "welds at E1 90, E2 -178 deg; the case has E1 90, E2 180" in told[0]
