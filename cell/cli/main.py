"""The command ``rbam``: arguments in, exit code out.

    rbam check                                  # the shipped propeller
    rbam check blade.case.yaml --e1 -45 --e2 0 --json report.json

Exit codes: 0 feasible or done, 1 infeasible, 2 bad input or usage (one line on stderr), 70 no verdict and no fault of
the input: an error of the program itself (one line; with ``--verbose`` or ``RBAM_TRACEBACK=1`` a traceback before it),
too little memory, or a worker process that was killed from outside; 130 interrupted, 128 + n ended by signal n.
Documents go to files or, with ``-``, to stdout; the report to stdout; progress and errors to stderr. The exit code is
the verdict, even if the report is read only in part.
"""

from __future__ import annotations

import argparse
import os
import re
import sys
from collections.abc import Callable, Sequence
from importlib import import_module

from ..atomic_files import discard_unfinished
from ..errors import InputError, WorkerKilledError
from ..printable import printable
from ..processes.own_process import begin_own_process
from ..processes.work_round import WorkerTraceback
from ..streams import standard_streams
from ..termination import Terminated, terminable
from .arguments import build_parser
from .exit_codes import BAD_INPUT, ENDED_BY_SIGNAL, INTERRUPTED, NO_VERDICT
from .verbosity import speaking

DRAWS = ("replay",)  # commands that MuJoCo draws for
POSITIONAL = {"case": "CASE", "input": "MESH|CASE"}  # arguments that no option begins, as the help calls them
TRACEBACK = "RBAM_TRACEBACK"  # set to 1, unexpected errors are printed with a traceback


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command.

    Args:
        argv: arguments; those of the process where left out.

    Returns:
        The exit code.
    """
    own = argv is None
    argv = sys.argv[1:] if argv is None else argv
    with standard_streams():
        try:
            with terminable():
                code = _run(argv, own)
                sys.stdout.flush()
                return code
        except (Exception, KeyboardInterrupt, Terminated) as error:  # noqa: BLE001 (the one place)
            return _told(error, argv)
        finally:
            discard_unfinished()
            sys.stderr.flush()


def _told(error: BaseException, argv: Sequence[str]) -> int:
    """Tell what ended a command in a line; its exit code."""
    ended = _signal_behind(error)
    if isinstance(ended, Terminated):
        return _error_line(ENDED_BY_SIGNAL + ended.number, "terminated")
    if ended is not None:
        return _error_line(INTERRUPTED, "interrupted")
    if isinstance(error, InputError):
        return _error_line(BAD_INPUT, printable(error))
    if isinstance(error, WorkerKilledError):
        return _error_line(NO_VERDICT, printable(error))
    return _program_error(error, argv)


def _signal_behind(error: BaseException | None) -> BaseException | None:
    """The signal that an error comes of; libraries turn what ends their import into errors of their own (pybind11)."""
    while error is not None and not isinstance(error, KeyboardInterrupt | Terminated):
        error = error.__cause__ or error.__context__
    return error


def _run(argv: Sequence[str], own: bool) -> int:
    """Run the command; ``own``: the process is there for nothing else."""
    args = build_parser().parse_args(_joined_negatives(argv))
    _refuse_empty(args)
    if own:
        begin_own_process(draws=args.command in DRAWS)
    with speaking(args.quiet, args.verbose, sys.stderr):
        return COMMANDS[args.command](args)


def _refuse_empty(args: argparse.Namespace) -> None:
    """Refuse empty arguments, as a script gives whose variable is not set: none counts as one that is left out.

    Raises:
        InputError: which one is empty.
    """
    empty = next((name for name, value in vars(args).items() if value == ""), None)
    if empty is not None:
        name = POSITIONAL.get(empty, f"--{empty.replace('_', '-')}")
        raise InputError(f"{name}: is empty (a variable of a script that is not set?); a value is needed")


def _error_line(code: int, line: str) -> int:
    sys.stderr.write(f"rbam: {line}\n")
    return code


def _program_error(error: BaseException, argv: Sequence[str]) -> int:
    """Tell an error that no input should cause."""
    import traceback

    asked = os.environ.get(TRACEBACK, "") not in ("", "0") or not {"-v", "--verbose"}.isdisjoint(argv)
    if asked:
        sys.stderr.write("".join(traceback.format_exception(error)))
    if isinstance(error, MemoryError):
        return _error_line(NO_VERDICT, "out of memory: no verdict; a coarser case needs less memory")
    where = traceback.extract_tb(error.__traceback__)[-1]
    what = printable(f"{type(error).__name__}: {error}")[:300]
    place = f"{os.path.basename(os.path.dirname(where.filename))}/{os.path.basename(where.filename)}:{where.lineno}"
    if isinstance(error.__cause__, WorkerTraceback):
        place = error.__cause__.place
    how = "the traceback above" if asked else f"what {TRACEBACK}=1 or --verbose prints"
    return _error_line(
        NO_VERDICT, f"no verdict: an error of the program itself ({what}; at {place}); please report it with {how}"
    )


def _joined_negatives(argv: Sequence[str]) -> list[str]:
    """``--e1 -90:90:15`` as ``--e1=-90:90:15``: argparse takes what starts with a minus for an option."""
    out: list[str] = []
    for arg in argv:
        if out and out[-1] in ("--e1", "--e2", "--positioner", "--height") and re.match(r"-[\d.]", arg):
            out[-1] += "=" + arg
        else:
            out.append(arg)
    return out


def _in_its_module(name: str) -> Callable[[argparse.Namespace], int]:
    """A command; its module is imported when it is run."""

    def run(args: argparse.Namespace) -> int:
        return int(import_module(f".{name}_command", __package__).run(args))

    return run


NAMES = ("check", "export", "slice", "compare", "sweep", "replay", "scene")
COMMANDS = {name: _in_its_module(name) for name in NAMES}
