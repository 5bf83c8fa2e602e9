"""What programs are written and read with: the case's section ``controller`` as numbers and arrays.

Use:

    controller = controller_of(case)
    write_krl(program, controller)
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ik.chain import Floats

from ..case.controller_section import KRL_WORDS, MOST_PROGRAM_NAME, FrameSection
from ..case.sections import Case
from ..units import METRES_PER_MM
from .hooks import HookPattern, hook_patterns
from .orientation import frames_of_poses
from .program import BaseFrame, EventKind, ToolFrame

Forward = Callable[[Floats, Floats, ToolFrame, BaseFrame], Floats]


@dataclass(frozen=True, eq=False)
class Controller:
    """A controller.

    Attributes:
        program: name of the main module.
        machine: index of the table in MACHINE_DEF.
        advance: points computed ahead, 0 to 5.
        points_a_module: most moves of one file.
        taken: names of modules that the hooks call, in capitals.
        hooks: lines written where something happens, as templates.
        patterns: by which events are recognised: those of the hooks, then the case's.
        harmless: patterns of statements that move nothing.
        tool_data: T_flange_tcp of numbers, (4, 4), m.
        base_data: frames of numbers; coupled where the case names their machine.
        machines: where external kinematics stand in the controller's world, (4, 4), m.
        home: the arm's axes of HOME, (j,), rad; None where it is not known.
        axes: of the arm.
        limits: bounds of what is read.
        forward: X Y Z A B C of joints (j,), external axes (2,), tool and base, for moves relative to where a move of
            axes ended; None: such moves are refused.
    """

    program: str = "PROGRAM"
    machine: int = 2
    advance: int = 3
    points_a_module: int = 1000
    taken: frozenset[str] = frozenset()
    hooks: Mapping[EventKind, tuple[str, ...]] = field(default_factory=dict)
    patterns: tuple[HookPattern, ...] = ()
    harmless: tuple[re.Pattern[str], ...] = ()
    tool_data: Mapping[int, Floats] = field(default_factory=dict)
    base_data: Mapping[int, BaseFrame] = field(default_factory=dict)
    machines: Mapping[int, Floats] = field(default_factory=dict)
    home: Floats | None = None
    axes: int = 6
    limits: ReadLimits = field(default_factory=lambda: ReadLimits())
    forward: Forward | None = None


@dataclass(frozen=True)
class ReadLimits:
    """Bounds of what is read, so that any text ends in bounded time and memory.

    Attributes:
        file_bytes: of all files together. A controller's program memory is 4 to 8 MB.
        lines: of a file.
        line: characters of a line.
        statements: executed, beside moves.
        moves: of the program.
        depth: of blocks and of expressions in each other.
        calls: of sub-programs in each other.
        files: of the program.
    """

    file_bytes: int = 16 * 2**20
    lines: int = 1_000_000
    line: int = 2000
    statements: int = 500_000
    moves: int = 300_000
    depth: int = 40
    calls: int = 40
    files: int = 5000


def controller_of(case: Case, **changes: Any) -> Controller:
    """The controller of a case.

    Args:
        case: the case.
        changes: attributes to set beside: home, axes, forward, limits.

    Returns:
        The controller.
    """
    section = case.controller
    hooks = {happens: tuple(getattr(section.hooks, happens.value)) for happens in HOOKS}
    read = section.read
    patterns = [
        *(pattern for happens in HOOKS for pattern in hook_patterns(happens, hooks[happens])),
        *(
            HookPattern(happens, (re.compile(text, re.IGNORECASE),))
            for happens in HOOKS
            for text in getattr(read, happens.value)
        ),
    ]
    return Controller(
        program=section.program or program_name(case.title, section.called_by_hooks()),
        taken=frozenset(section.called_by_hooks()),
        machine=section.machine,
        advance=section.advance,
        points_a_module=section.points_a_module,
        hooks=hooks,
        patterns=tuple(patterns),
        harmless=tuple(re.compile(text, re.IGNORECASE) for text in read.harmless),
        tool_data={number: matrix_of(frame) for number, frame in read.tool_data.items()},
        base_data={
            number: BaseFrame(matrix_of(frame), coupled=frame.machine is not None, number=number, machine=frame.machine)
            for number, frame in read.base_data.items()
        },
        machines={number: matrix_of(frame) for number, frame in read.machines.items()},
        **changes,
    )


HOOKS = (EventKind.ARC_ON, EventKind.ARC_OFF, EventKind.LAYER_START, EventKind.LAYER_END)


def matrix_of(frame: FrameSection) -> Floats:
    """A frame of the case as a matrix (4, 4), m."""
    return frames_of_poses(np.concatenate((np.array(frame.position_mm) * METRES_PER_MM, np.radians(frame.abc_deg))))


def program_name(title: str, taken: Collection[str] = ()) -> str:
    """A module's name made of a case's: its ASCII letters and digits, 24 of them at most, a letter first.

    Args:
        title: of the case.
        taken: names that other modules have, in capitals.
    """
    plain = unicodedata.normalize("NFKD", title).encode("ascii", "ignore").decode()
    name = re.sub(r"[^A-Za-z0-9]+", "_", plain).strip("_")
    name = name[:MOST_PROGRAM_NAME].rstrip("_")
    if not name or not name[0].isalpha() or name.upper() in KRL_WORDS or name.upper() in taken:
        name = f"P_{name}"
    return name[:MOST_PROGRAM_NAME].rstrip("_")
