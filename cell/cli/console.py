"""What a command says and hands over: lines to a terminal or a pipe, documents to a file or standard output.

Use:

    say(report_lines(result), sys.stdout)     # nothing, with --quiet
    put_json("report.json", document)         # - for standard output
"""

from __future__ import annotations

from typing import IO, TYPE_CHECKING, Any

from ..atomic_files import STDOUT, write_json
from ..json_text import json_pieces
from ..printable import ERASED
from .verbosity import is_quiet

if TYPE_CHECKING:
    from rich.console import Console

PIPE_WIDTH = 100_000  # characters: in a pipe a message is one line, and columns are as wide as they have to be


def console(stream: IO[str]) -> Console:
    """A console that prints names as they are."""
    from rich.console import Console

    width = None if stream.isatty() else PIPE_WIDTH
    # names are printed as they are: brackets are no markup, colons no emoji
    return Console(file=stream, highlight=False, markup=False, emoji=False, width=width, soft_wrap=not stream.isatty())


def say(lines: Any, to: IO[str]) -> None:
    """Print renderables, one a block, unless the command is to be quiet; in a pipe no line ends in blanks."""
    if is_quiet():
        return
    out = console(to)
    for line in lines:
        shown = line.translate(ERASED) if isinstance(line, str) else line
        if out.is_terminal:
            out.print(shown)
            continue
        with out.capture() as captured:
            out.print(shown)
        to.write("".join(f"{text.rstrip(' ')}\n" for text in captured.get().removesuffix("\n").split("\n")))


def put_json(where: str, document: dict[str, Any]) -> None:
    """Write a document to a file, or with - to standard output."""
    if where == STDOUT:
        import sys

        for piece in json_pieces(document):
            sys.stdout.write(piece)  # one by one: the stream's own write knows of readers that leave
        sys.stdout.write("\n")
        return
    write_json(where, document)
