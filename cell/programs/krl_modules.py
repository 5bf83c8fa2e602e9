"""Which module of a KRL program holds what, and what the modules are called.

for content in module_contents(program):                     # layers, and what lies between them
for part in split_content(program, content, 5000): ...   # items of modules of at most so many moves
ModuleNames("BLADE").module(0, 0, 1)                         # "BLADE_L000"
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator
from dataclasses import dataclass, field

from ..case.controller_section import KRL_WORDS, MOST_PROGRAM_NAME
from .program import Event, EventKind, Program


@dataclass(frozen=True)
class ModuleContent:
    """What one module holds, or the main module between two calls.

    Attributes:
        layer: its number in the program, -1 of the main module.
        items: numbers of moves, and events, in order.
    """

    layer: int
    items: list[int | Event] = field(default_factory=list)

    @property
    def moves(self) -> int:
        """How many moves it holds."""
        return sum(isinstance(item, int) for item in self.items)


def module_contents(program: Program) -> Iterator[ModuleContent]:
    """The program cut into layers and what lies between them; a layer that is not closed is none.

    Args:
        program: moves, with its events in order.

    Yields:
        What each holds, in order.
    """
    events, place, layer = program.events, 0, 0
    last_end = max((i for i, event in enumerate(events) if event.kind == EventKind.LAYER_END), default=-1)
    piece = ModuleContent(-1)
    for move in range(len(program.moves) + 1):
        while place < len(events) and events[place].before == move:
            event = events[place]
            place += 1
            if event.kind == EventKind.LAYER_START and piece.layer < 0 and place <= last_end:
                if piece.items:
                    yield piece
                piece, layer = ModuleContent(layer), layer + 1
            piece.items.append(event)
            if event.kind == EventKind.LAYER_END and piece.layer >= 0:
                yield piece
                piece = ModuleContent(-1)
        if move < len(program.moves):
            piece.items.append(move)
    if piece.items:
        yield piece


def split_content(program: Program, piece: ModuleContent, most: int) -> list[list[int | Event]]:
    """What is one layer's, in modules of at most so many moves, cut where the arm stops with the arc off.

    A bead is cut only where it has more moves than a module may have itself.

    Args:
        program: the program.
        piece: of it.
        most: moves a module.

    Returns:
        Items of each module.
    """
    rounded = (program.moves.blend > 0) | (program.moves.blend_share > 0)
    parts: list[list[int | Event]] = []
    part: list[int | Event] = []
    moves = stop = 0  # items of the part up to its last exact stop with the arc off
    arc = exact = False
    for item in piece.items:
        if isinstance(item, int):
            if moves == most:
                cut = stop or len(part)
                parts.append(part[:cut])
                part, stop = part[cut:], 0
                moves = sum(isinstance(one, int) for one in part)
            moves += 1
            exact = not rounded[item]
        else:
            arc = arc_after(arc, item)
        part.append(item)
        if exact and not arc and (isinstance(item, int) or item.kind == EventKind.ARC_OFF):
            stop = len(part)
    return [*parts, part]


def arc_after(arc: bool, *items: int | Event) -> bool:
    """Whether the arc is on after some items, given whether it was before."""
    for item in items:
        if isinstance(item, Event) and item.kind in (EventKind.ARC_ON, EventKind.ARC_OFF):
            arc = item.kind == EventKind.ARC_ON
    return arc


class ModuleNames:
    """Names of modules: at most 24 characters, each once, capitals or not, and none of those that are taken."""

    def __init__(self, main: str, taken: Collection[str] = ()) -> None:
        if not re.fullmatch(rf"[A-Za-z][A-Za-z0-9_]{{0,{MOST_PROGRAM_NAME - 1}}}", main) or main.upper() in KRL_WORDS:
            raise ValueError(f"{main} is not a name of a module")
        self.main = main
        self._taken = {main.upper(), *taken}
        self._pieces = 0

    def module(self, layer: int, number: int, parts: int) -> str:
        """The name of a module that has none yet.

        Args:
            layer: whose, -1 of what lies between layers.
            number: of the module among those of the layer.
            parts: how many these are.
        """
        if layer < 0:
            self._pieces += number == 0
        tail = f"_L{layer:03d}" if layer >= 0 else f"_P{self._pieces - 1:03d}"
        tail += f"_{number}" if parts > 1 else ""
        room = MOST_PROGRAM_NAME - len(tail)
        while (name := self.main[:room] + tail).upper() in self._taken:
            room -= 1
        self._taken.add(name.upper())
        return name
