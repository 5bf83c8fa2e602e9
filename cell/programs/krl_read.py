"""A program in KRL, ours or anybody's, as data.

Use:

    program = read_krl(Path("BLADE.src"), controller)
    program.moves.kind, program.line_of(3)

What is known is run: declarations, frames, motions, loops and conditions on the program's own numbers, sub-programs in
the same file or beside it. What is not known and could move the arm or change a frame is refused with file and line;
what moves nothing is passed over and counted.
"""

from __future__ import annotations

from pathlib import Path

from ..errors import InputError
from .controller import Controller
from .krl.execution import Execution
from .krl.sources import Sources
from .program import Program


def read_krl(path: str | Path, controller: Controller) -> Program:
    """Read a program.

    Args:
        path: of the main module (.src).
        controller: the case's: tables of frames, patterns of events, bounds.

    Returns:
        Its moves in the order in which they run, with the lines they stand in.

    Raises:
        InputError: the program cannot be read or followed; one line that names file and line.
    """
    path = Path(path)
    if path.suffix.lower() != ".src":
        raise InputError(f"{path}: a KRL program is a .src file")
    sources = Sources(path, controller)
    execution = Execution(sources, controller)
    execution.run()
    state = execution.state
    if not len(state):
        raise InputError(f"{path}: the program moves nothing")
    passed = dict(sources.passed)
    for kind, count in execution.passed.items():
        passed[kind] = passed.get(kind, 0) + count
    return Program(
        name=sources.main.first,
        moves=state.moves(),
        events=tuple(state.events),
        tools=tuple(state.tools),
        bases=tuple(state.bases),
        files=tuple(sources.files),
        passed_over=dict(sorted(passed.items())),
        doubts=state.doubts(),
        stands=tuple(state.stands),
    )
