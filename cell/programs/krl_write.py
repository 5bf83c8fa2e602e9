"""A program as KRL: the texts of its modules.

Use:

    files = write_krl(program, controller)    # {"BLADE.src": "&ACCESS RVP..", "BLADE_L000.src": ..}

The main module holds what lies between the layers and calls one module a layer; a layer of more moves than a module
may have is split. Every point has X Y Z A B C and those of E1 and E2 that the table has. No module needs a .dat: all
frames and points stand in it. Lines end in CR LF, as other programs' for this controller do. What is written is ASCII,
and all numbers have the digits that 0.05 mm and 0.05 degrees at the part need: 0.0001 mm and 0.00001 degrees, of which
1 m makes 0.0002 mm.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ik.chain import Floats

from .controller import Controller
from .hooks import hook_lines
from .krl_modules import ModuleNames, arc_after, module_contents, split_content
from .orientation import pose_of, run_on
from .program import BaseFrame, Event, EventKind, MoveKind, Program, ToolFrame

HEADER = (
    "&ACCESS RVP",
    "&REL 1",
    "&COMMENT written by rbam-cell",
    r"&PARAM TEMPLATE = C:\KRC\Roboter\Template\vorgabe",
    "&PARAM EDITMASK = *",
)
INI = (
    ";FOLD INI",
    "  ;FOLD BASISTECH INI",
    "    GLOBAL INTERRUPT DECL 3 WHEN $STOPMESS==TRUE DO IR_STOPM ( )",
    "    INTERRUPT ON 3",
    "    BAS (#INITMOV,0 )",
    "  ;ENDFOLD (BASISTECH INI)",
    ";ENDFOLD (INI)",
)
INSIDE_A_BEAD = ";goes on inside a bead with what the module before it has set: never start it by itself"
END_OF_LINE = "\r\n"
MM, DEG = 4, 5  # decimals
FRAME_MM, FRAME_DEG = 5, 6  # of frames, which move every point


def write_krl(program: Program, controller: Controller) -> dict[str, str]:
    """Write a program.

    Args:
        program: what is to run. Joints and angles in rad, lengths in m.
        controller: names, hooks, points a module, advance.

    Returns:
        Texts by the names of their files; the main module is the first.

    Raises:
        ValueError: the program cannot be written as it is: a number is not finite, a linear move has no tool or no
            base, an arc starts or ends or a wait stands where a corner is rounded, or events are out of order.
    """
    _check(program)
    names = ModuleNames(controller.program, controller.taken)
    main = _Writer(program, controller)
    main.add(*INI, f"$ADVANCE = {controller.advance}", "$IPO_MODE = #BASE", "$ORI_TYPE = #VAR")
    if program.moves.table_axes.any():
        main.add("$ASYNC_AXIS = $ASYNC_AXIS B_AND 'B111100'")
    files = {f"{names.main}.src": ""}
    in_main = 0  # moves of the main module, whose pieces lie between layers
    for piece in module_contents(program):
        if piece.layer < 0 and in_main + piece.moves <= controller.points_a_module:
            main.write(piece.items)
            in_main += piece.moves
            continue
        parts, arc = split_content(program, piece, controller.points_a_module), False
        for number, items in enumerate(parts):
            name = names.module(piece.layer, number, len(parts))
            main.add(f"{name} ( )")
            if arc:  # frames and speeds are not set again: nothing may stop the advance run, and so the torch
                module = _Writer(program, controller, main.state)
                module.add(INSIDE_A_BEAD)
            else:
                module = _Writer(program, controller, main.state.fresh())
                module.hold(main.state.tool, main.state.base)
            module.write(items)
            arc = arc_after(arc, *items)
            main.state = module.state
            files[f"{name}.src"] = module.text(name)
    files[f"{names.main}.src"] = main.text(names.main)
    return files


def _check(program: Program) -> None:
    moves = program.moves
    places = [event.before for event in program.events]
    if places != sorted(places) or any(not 0 <= place <= len(moves) for place in places):
        raise ValueError("events are out of order")
    axes = moves.kind == MoveKind.AXES
    to_pose = axes & np.isnan(moves.joints).all(axis=1)
    points = moves.pose[~axes | to_pose]
    if not (np.isfinite(points).all() and np.isfinite(moves.joints[axes & ~to_pose]).all()):
        raise ValueError("a move has a number that is not finite")
    if not np.isfinite(moves.via[moves.kind == MoveKind.CIRCULAR, :3]).all():
        raise ValueError("a circular move has no auxiliary point")
    if ((moves.tool < 0) | (moves.base < 0))[~axes | to_pose].any():
        raise ValueError("a Cartesian move has no tool or no base")
    if (axes & (moves.blend > 0) & (moves.blend_share <= 0)).any():
        raise ValueError("a move of axes is rounded by a share of its way (C_PTP), and may have a distance beside it")
    for event in program.events:
        stops = event.kind in (EventKind.ARC_ON, EventKind.ARC_OFF, EventKind.WAIT)
        if stops and event.before and (moves.blend[event.before - 1] > 0 or moves.blend_share[event.before - 1] > 0):
            raise ValueError(f"{event.kind.value} stands where a corner is rounded: before move {event.before}")


@dataclass
class _State:
    """What the controller holds after what is written so far; what is None has to be written before it counts."""

    values: dict[str, str] = field(default_factory=dict)
    tool: int = -1
    base: int = -1
    abc: tuple[float, float, float] | None = None

    def fresh(self) -> _State:
        """The state at the start of a module, which sets everything again: it can be started on its own."""
        return _State(abc=self.abc)


class _Writer:
    """Lines of a module."""

    def __init__(self, program: Program, controller: Controller, state: _State | None = None) -> None:
        self.program, self.controller = program, controller
        self.state = state or _State()
        self.lines: list[str] = []
        self._rows = _Rows(program)
        given = np.flatnonzero(program.moves.table_axes)
        self._external_axes = int(given[-1]) + 1 if len(given) else 0

    def add(self, *lines: str) -> None:
        self.lines.extend(lines)

    def text(self, name: str) -> str:
        lines = [*HEADER, f"DEF {name} ( )", *self.lines, "END"]
        text = END_OF_LINE.join(lines) + END_OF_LINE
        if not text.isascii():
            raise ValueError(f"{name} has characters that are not ASCII")
        return text

    def write(self, items: list[int | Event]) -> None:
        for item in items:
            if isinstance(item, Event):
                self._event(item)
            else:
                self._move(item)

    def _event(self, event: Event) -> None:
        if event.kind == EventKind.WAIT:
            self.add(f"WAIT SEC {_number(event.seconds, 4)}")
            return
        fields = {"program": self.controller.program, **event.fields}
        self.add(*hook_lines(self.controller.hooks.get(event.kind, ()), fields))

    def _set(self, name: str, value: float, decimals: int) -> None:
        """Assign where it differs from what holds; NaN leaves it."""
        if np.isnan(value):
            return
        text = _number(value, decimals)
        if self.state.values.get(name) != text:
            self.state.values[name] = text
            self.add(f"{name} = {text}")

    def hold(self, tool: int, base: int) -> None:
        """Set frames that do not hold yet; -1 leaves what holds."""
        if tool >= 0 and tool != self.state.tool:
            self.add(f"$TOOL = {_tool_text(self.program.tools[tool])}")
            self.state.tool = tool
        if base >= 0 and base != self.state.base:
            frame = self.program.bases[base]
            self.add(f"$BASE = {_base_text(frame)}")
            if frame.coupled:
                self.add(f"$ACT_EX_AX = {self._external_axes}")
            self.state.base = base

    def _speeds(self, move: int) -> None:
        moves = self.program.moves
        share = (
            ("$VEL_AXIS", moves.axis_share, self.controller.axes),
            ("$ACC_AXIS", moves.axis_acceleration, self.controller.axes),
            ("$VEL_EXTAX", moves.external_share, self._external_axes),
            ("$ACC_EXTAX", moves.external_acceleration, self._external_axes),
        )
        for name, column, axes in share:
            for axis in range(axes):
                self._set(f"{name}[{axis + 1}]", 100 * float(column[move]), 3)
        for name in ("$VEL.ORI1", "$VEL.ORI2"):
            self._set(name, float(np.degrees(moves.turn_speed[move])), 4)
        self._set("$ACC.CP", float(moves.acceleration[move]), 5)
        self._set("$VEL.CP", float(moves.speed[move]), 6)

    def _blend(self, move: int) -> str:
        """The approximation of a move, as it stands behind it."""
        moves = self.program.moves
        distance, share = float(moves.blend[move]), float(moves.blend_share[move])
        words = ""
        if share > 0:
            axes = moves.kind[move] == MoveKind.AXES
            self._set("$APO.CPTP" if axes else "$APO.CVEL", 100 * share, 3)
            words = " C_PTP" if axes else " C_VEL"
        if distance > 0:
            self._set("$APO.CDIS", 1e3 * distance, MM)
            words = words + " C_DIS" if words != " C_VEL" else " C_DIS"
        return words

    def _move(self, move: int) -> None:
        moves, kind = self.program.moves, MoveKind(int(self.program.moves.kind[move]))
        self.hold(int(moves.tool[move]), int(moves.base[move]))
        self._speeds(move)
        words = self._blend(move)
        if kind == MoveKind.AXES and not np.isnan(moves.joints[move]).all():
            self.state.abc = None  # angles start anew after it
            self.add(f"PTP {{{self._rows.joints(move)}{self._rows.external(move)}}}{words}")
            return
        pose = self._run_on(self._rows.pose(move))
        point = f"{{{_pose_text(pose)}{self._configuration(move)}{self._rows.external(move)}}}"
        if kind == MoveKind.AXES:
            self.add(f"PTP {point}{words}")
        elif kind == MoveKind.LINEAR:
            self.add(f"LIN {point}{words}")
        else:
            angle = float(np.degrees(moves.arc_angle[move]))
            ca = "" if np.isnan(angle) else f", CA {_number(angle, DEG)}"
            self.add(f"CIRC {{{_pose_text(self._rows.via(move))}}}, {point}{ca}{words}")

    def _run_on(self, pose: list[float]) -> list[float]:
        abc = (pose[3], pose[4], pose[5])
        if self.state.abc is not None:
            abc = run_on(abc, self.state.abc)
        self.state.abc = abc
        return [*pose[:3], *abc]

    def _configuration(self, move: int) -> str:
        moves = self.program.moves
        if moves.kind[move] != MoveKind.AXES:
            return ""
        status, turn = int(moves.status[move]), int(moves.turn[move])
        return (f",S {status}" if status >= 0 else "") + (f",T {turn}" if turn >= 0 else "")


class _Rows:
    """The numbers of moves as plain lists."""

    def __init__(self, program: Program) -> None:
        moves = program.moves
        self._joints, self._external = np.degrees(moves.joints).tolist(), np.degrees(moves.external).tolist()
        self._pose, self._via = moves.pose.tolist(), moves.via.tolist()

    def pose(self, move: int) -> list[float]:
        row: list[float] = self._pose[move]
        return row

    def via(self, move: int) -> list[float]:
        row: list[float] = self._via[move]
        return row

    def joints(self, move: int) -> str:
        return ",".join(f"A{i + 1} {_number(x, DEG)}" for i, x in enumerate(self._joints[move]))

    def external(self, move: int) -> str:
        return "".join(f",E{i + 1} {_number(x, DEG)}" for i, x in enumerate(self._external[move]) if x == x)


def _number(value: float, decimals: int) -> str:
    """A number in fixed decimals, without a negative zero.

    Raises:
        ValueError: it is not finite, or too large for the language.
    """
    if not abs(value) < 1e9:
        raise ValueError(f"{value} cannot be written")
    text = f"{value:.{decimals}f}"
    return text[1:] if text.startswith("-") and not text.strip("-0.") else text


def _pose_text(pose: list[float]) -> str:
    """X Y Z A B C; without A B C where they are NaN."""
    names = "XYZABC" if pose[3] == pose[3] else "XYZ"
    scales = (1e3, 1e3, 1e3, RAD, RAD, RAD)
    return ",".join(
        f"{name} {_number(value * scale, MM if name in 'XYZ' else DEG)}"
        for name, value, scale in zip(names, pose, scales, strict=False)
    )


RAD = 180.0 / np.pi  # degrees


def _frame_text(T: Floats) -> str:
    pose = pose_of(T)
    values = [*(1e3 * pose[:3]), *np.degrees(pose[3:])]
    decimals = (FRAME_MM,) * 3 + (FRAME_DEG,) * 3
    pairs = zip("XYZABC", values, decimals, strict=True)
    return "{" + ",".join(f"{name} {_number(float(value), places)}" for name, value, places in pairs) + "}"


def _tool_text(tool: ToolFrame) -> str:
    return _frame_text(tool.T_flange_tcp) if tool.number is None else _listed("TOOL_DATA", tool.number)


def _base_text(base: BaseFrame) -> str:
    frame = _frame_text(base.T) if base.number is None else _listed("BASE_DATA", base.number)
    if not base.coupled:
        return frame
    if base.machine is None:
        raise ValueError("a coupled base names no machine")
    n = base.machine
    return f"EK(MACHINE_DEF[{n}].ROOT, MACHINE_DEF[{n}].MECH_TYPE, {frame})"


def _listed(name: str, number: int) -> str:
    return "$NULLFRAME" if number == 0 else f"{name}[{number}]"
