"""What is written: a whole small program, modules of bounded size, names, ASCII."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from support.paths import ROOT
from support.programs.programs import controller, programs

from cell.case.controller_section import HOOK_FIELDS
from cell.case.read import parse_case
from cell.errors import InputError
from cell.programs.controller import controller_of, program_name
from cell.programs.krl_modules import ModuleNames
from cell.programs.krl_write import write_krl
from cell.programs.orientation import frames_of_poses
from cell.programs.program import BaseFrame, Event, EventKind, MoveKind, Moves, Program, ToolFrame

GOLDEN = ROOT / "tests" / "data" / "programs" / "golden"
FIELDS: dict[str, str | float] = {"bead": 0.0, "layer": 0.0, "target": 0.0, "sub_volume": "SV1"}


def small() -> Program:
    """From home, two layers of one bead each on a table that turns, and home again."""
    home = np.radians([0, -90, 90, 0, 30, 0])
    moves = Moves.empty(12)
    kind = np.array([0, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 0])
    rows = np.zeros((12, 6))
    rows[:, 0] = [0, 40, 40, 45, 50, 50, 40, 40, 45, 50, 50, 0]
    rows[:, 2] = [0, 30, 5, 5, 5, 30, 30, 7.2, 7.2, 7.2, 30, 0]
    rows[:, :3] /= 1000
    rows[:, 3:] = np.radians([[0, 75 + 2.5 * i, 180] for i in range(12)])
    axes = (kind == MoveKind.AXES)[:, None]
    arc = np.isin(np.arange(12), (3, 4, 8, 9))
    zero = np.zeros(12, dtype=np.int64)
    turn = np.radians([0, 0, 0, 5, 10, 10, 0, 0, 5, 10, 10, 0])
    moves = replace(
        moves,
        kind=kind,
        joints=np.where(axes, home, np.nan),
        pose=np.where(axes, np.nan, rows),
        external=np.stack((np.full(12, np.pi / 2), turn), axis=1),
        tool=zero,
        base=zero,
        speed=np.where(axes[:, 0], np.nan, np.where(arc, 0.008, 0.1)),
        turn_speed=np.full(12, np.radians(200)),
        acceleration=np.full(12, 2.3),
        axis_share=np.full(12, 0.3),
        axis_acceleration=np.full(12, 0.5),
        external_share=np.full(12, 1.0),
        blend=np.where(np.isin(np.arange(12), (3, 8)), 0.001, 0.0),
    )

    def fields(layer: int, target: int = -1) -> dict[str, str | float]:
        found: dict[str, str | float] = {"layer": layer, "sub_volume": "SV1"}
        return found | ({"bead": layer, "target": target, "speed_mm_s": 8.0} if target >= 0 else {})

    events = (
        Event(EventKind.LAYER_START, 1, fields=fields(0)),
        Event(EventKind.ARC_ON, 3, fields=fields(0, 0)),
        Event(EventKind.WAIT, 3, seconds=0.3),
        Event(EventKind.ARC_OFF, 5, fields=fields(0, 2)),
        Event(EventKind.LAYER_END, 6, fields=fields(0)),
        Event(EventKind.LAYER_START, 6, fields=fields(1)),
        Event(EventKind.ARC_ON, 8, fields=fields(1, 3)),
        Event(EventKind.ARC_OFF, 10, fields=fields(1, 5)),
        Event(EventKind.LAYER_END, 11, fields=fields(1)),
    )
    torch = frames_of_poses(np.array([0.0635, 0, 0.41225, 0, np.radians(45), 0]))
    part = frames_of_poses(np.array([0, 0, 0.1, np.radians(30), 0, 0]))
    return Program("SMALL", moves, events, (ToolFrame(torch),), (BaseFrame(part, coupled=True, machine=2),))


def test_a_whole_program_is_as_it_was() -> None:
    files = write_krl(small(), controller("small"))
    assert sorted(files) == sorted(path.name for path in GOLDEN.iterdir())
    for name, text in files.items():
        assert text.replace("\r\n", "\n") == (GOLDEN / name).read_text(encoding="ascii"), name


def test_what_lies_between_layers_is_not_too_long_in_the_main_module_either() -> None:
    moves = Moves.empty(15)
    moves = replace(moves, kind=np.full(15, int(MoveKind.AXES)), joints=np.zeros((15, 6)), external=np.zeros((15, 2)))
    kinds = (EventKind.LAYER_START, EventKind.LAYER_END)
    events = tuple(Event(kind, before) for before in (4, 8, 12) for kind in kinds)
    files = write_krl(Program("between", moves, events, (), ()), controller("between", points_a_module=10))
    assert sum(text.count("PTP {") for text in files.values()) == 15
    assert max(text.count("PTP {") for text in files.values()) <= 10


@settings(max_examples=15, deadline=None)
@given(program=programs())
def test_every_file_can_be_loaded(program: Program) -> None:
    files = write_krl(program, controller("a name of far more than twenty-four", points_a_module=10))
    names = [name.removesuffix(".src") for name in files]
    assert len({name.upper() for name in names}) == len(names)
    for name, text in zip(names, files.values(), strict=True):
        assert re.fullmatch(r"[A-Za-z][A-Za-z0-9_]{0,23}", name)
        assert text.isascii()
        assert text.count("\r\n") == text.count("\n") == len(text.splitlines())
        lines = text.split("\r\n")
        assert f"DEF {name} ( )" in lines
        moves = [line for line in lines if line.startswith(("PTP ", "LIN ", "CIRC "))]
        assert len(moves) <= 10
        assert not any(re.search(r"nan|inf|\de|-0\.0*[,}]", line) for line in lines)
        for line in moves:
            assert re.search(r"E1 [-\d.]+,E2 [-\d.]+\}", line)  # in every point
        assert max(map(len, lines)) < 344  # lines of this length are known to run


def test_a_layer_is_cut_where_the_arm_stops() -> None:
    moves = Moves.empty(25)
    blend = np.full(25, 0.001)
    blend[[7, 24]] = 0
    zero = np.zeros(25, dtype=np.int64)
    pose = np.zeros((25, 6))
    moves = replace(moves, pose=pose, external=np.zeros((25, 2)), tool=zero, base=zero, speed=np.ones(25), blend=blend)
    program = Program("CUT", moves, (), (ToolFrame(np.eye(4)),), (BaseFrame(np.eye(4), coupled=True, machine=2),))
    files = write_krl(program, controller(program="CUT", points_a_module=10))
    assert [text.count("LIN ") for text in files.values()] == [0, 8, 10, 7]
    assert list(files) == ["CUT.src", "CUT_P000_0.src", "CUT_P000_1.src", "CUT_P000_2.src"]


def beads_of(*lengths: int) -> Program:
    """Beads of so many moves, each after a move that leads to it."""
    n = sum(lengths) + len(lengths)
    moves, zero, events, at = Moves.empty(n), np.zeros(n, dtype=np.int64), [], 0
    blend = np.zeros(n)
    for length in lengths:
        blend[at + 1 : at + length] = 0.001
        events += [
            Event(EventKind.ARC_ON, at + 1, fields=FIELDS),
            Event(EventKind.ARC_OFF, at + length + 1, fields=FIELDS),
        ]
        at += length + 1
    pose = np.zeros((n, 6))
    moves = replace(
        moves, pose=pose, external=np.zeros((n, 2)), tool=zero, base=zero, speed=np.full(n, 0.01), blend=blend
    )
    return Program(
        "CUT", moves, tuple(events), (ToolFrame(np.eye(4)),), (BaseFrame(np.eye(4), coupled=True, machine=2),)
    )


def test_a_bead_is_not_cut_unless_it_is_longer_than_a_module() -> None:
    files = write_krl(beads_of(3, 9, 4, 8), controller(program="CUT", points_a_module=10))
    texts = list(files.values())[1:]
    assert len(texts) == 4
    for text in texts:
        assert text.count("ARC_ON") == text.count("ARC_OFF") == 1
        assert text.index("$TOOL") < text.index("LIN")


def test_nothing_inside_a_bead_stops_the_advance_run() -> None:
    files = write_krl(beads_of(3, 34, 4), controller(program="CUT", points_a_module=10))
    text = "".join(text.replace("DEF ", "\n") for name, text in files.items() if name != "CUT.src")
    assert sum("goes on inside a bead" in one for one in files.values()) == 3
    for bead in re.findall(r"ARC_ON.*?ARC_OFF", text, re.DOTALL):
        inside = bead.split("LIN", 2)[-1]  # its speed and rounding are set where the arm stands still
        assert not re.search(r"\$|WAIT|BAS", inside)


@pytest.mark.parametrize(
    ("title", "name"),
    [("Propeller 3", "Propeller_3"), ("3 blades", "P_3_blades"), ("für Ñ", "fur_N"), ("叶", "P"), ("loop", "P_loop")],
)
def test_the_cases_name_becomes_a_modules(title: str, name: str) -> None:
    assert program_name(title) == name
    assert len(program_name("x" * 90)) == 24


def test_no_module_takes_the_name_of_a_sub_program_that_a_hook_calls() -> None:
    hooks = {"arc_on": ["CUT_L000 ( ) ;bead {bead}"], "arc_off": ["Arc_Off ( )"]}
    case = parse_case({"name": "arc off", "part": "none", "controller": {"hooks": hooks}}, ROOT / "arc_off.case.yaml")
    made = controller_of(case)
    assert made.program == "P_arc_off"
    assert made.taken >= {"CUT_L000", "ARC_OFF"}
    names = ModuleNames("CUT", made.taken)
    assert [names.module(layer, 0, 1) for layer in (0, 1)] == ["CU_L000", "CUT_L001"]


@pytest.mark.parametrize(
    ("section", "words"),
    [
        ({"program": "3D"}, "controller.program: must be 1 to 24"),
        ({"program": "A" * 25}, "controller.program: must be 1 to 24"),
        ({"program": "LOOP"}, "controller.program: is a word of KRL"),
        ({"program": "ARC_ON"}, "a hook calls a sub-program named ARC_ON"),
        ({"hooks": {"arc_on": "GO ({bed})"}}, f"has an unknown field {{bed}}; the fields are {', '.join(HOOK_FIELDS)}"),
        ({"hooks": {"arc_on": "GO ({bead.x})"}}, "has an unknown field {bead.x}"),
        ({"hooks": {"arc_on": "GO ({bead!r})"}}, "a format must be like"),
        ({"hooks": {"arc_on": "GO ({bead:>99})"}}, "a format must be like"),
        ({"hooks": {"arc_on": "GO ({bead)"}}, "is not a template"),
        ({"hooks": {"arc_on": "X=\nLIN {{X 1}}"}}, "may not move the arm"),
        ({"hooks": {"arc_on": "$TOOL = $NULLFRAME"}}, "may not move the arm"),
        ({"hooks": {"arc_on": "X=1\nASYPTP {{E1 5}}"}}, "may not move the arm"),
        ({"hooks": {"arc_on": "TOOL_DATA[1] = $NULLFRAME"}}, "may not move the arm"),
        ({"hooks": {"arc_on": "TRIGGER WHEN DISTANCE=0 DELAY=0 DO $VEL.CP=2"}}, "may not move the arm"),
        ({"hooks": {"arc_on": "INTERRUPT DECL 5 WHEN $IN[1] DO EVADE ( )"}}, "may not move the arm"),
        ({"hooks": {"arc_on": "GO () ;é"}}, "ASCII"),
        ({"hooks": {"arc_on": []}}, "controller.hooks.arc_on: has too few values"),
        ({"hooks": {"arc_on": ["A ( )", " "]}}, "must not be an empty line"),
        ({"hooks": {"arc_on": "W ({bead})", "arc_off": "w ({target})"}}, "arc_off begins like arc_on"),
        ({"read": {"tool_data": [1]}}, "controller.read.tool_data: must be a mapping"),
        ({"read": {"arc_on": ["("]}}, "is not a regular expression"),
        ({"advance": 6}, "controller.advance: must be 0 to 5"),
        ({"points_a_module": 1}, "controller.points_a_module: must be 10 to 100000"),
        ({"tool": {"position": [0, 0, 0]}}, "position"),
    ],
)
def test_what_a_controller_cannot_be(section: dict[str, object], words: str) -> None:
    part = {"sub_volumes": ["a.stl"], "body": {"radius_mm": 20}}
    with pytest.raises(InputError) as caught:
        parse_case({"part": part, "controller": section})
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_names_in_hooks_are_plain() -> None:
    program = small()
    events = tuple(replace(event, fields={**event.fields, "sub_volume": "Flügel 1;"}) for event in program.events)
    text = write_krl(replace(program, events=events), controller("small"))["small_L000.src"]
    assert ";layer 0 of Fl_gel_1_ starts\r\n" in text


def test_hooks_are_written_with_their_fields() -> None:
    hooks = {"arc_on": "ArcOn_{sub_volume} ({bead:03d}, {speed_mm_s:.1f}, {{0}})", "layer_end": []}
    part = {"sub_volumes": ["a.stl"], "body": {"radius_mm": 20}}
    its = controller_of(parse_case({"name": "small", "part": part, "controller": {"hooks": hooks}}))
    text = write_krl(small(), its)["small_L001.src"]
    assert "\r\nArcOn_SV1 (001, 8.0, {0})\r\n" in text
    assert "ends" not in text
