"""What a command says in a pipe."""

from __future__ import annotations

import io

from rich.table import Table

from cell.cli.console import say
from cell.report.facts import facts_grid


def test_in_a_pipe_a_message_is_one_line_however_long() -> None:
    long, table = "word " * 400, Table(box=None)
    table.add_column("place")
    table.add_column("why")
    table.add_row("target 7", long)
    out = io.StringIO()
    say([long, facts_grid([("warning", long), ("part", "short")]), table], out)
    lines = out.getvalue().splitlines()
    assert [line.split()[0] for line in lines] == ["word", "warning", "part", "place", "target"]
    assert sum(line.count("word") for line in lines) == 1200
