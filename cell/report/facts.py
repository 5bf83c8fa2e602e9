"""What every report begins with: a line with the verdict, and facts, a name and what it is, one a line.

Use:

    headline("propeller", "E1 = 90, E2 = 180 deg", feasible=True)

    facts_grid([("part", "1 sub-volume"), ("speed", "kept all along")])    # a rich renderable
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.table import Table
    from rich.text import Text


def headline(title: str, of: str, *, feasible: bool) -> Text:
    """A report's first line.

    Args:
        title: the case's.
        of: what of it was judged: a table pose, a file.
        feasible: the verdict.

    Returns:
        The line.
    """
    from rich.text import Text

    verdict = ("feasible" if feasible else "infeasible", "bold green" if feasible else "bold red")
    return Text.assemble((title, "bold"), f"  {of}   ", verdict)


def facts_grid(facts: Iterable[tuple[str, str]]) -> Table:
    """Names and values in two columns.

    Args:
        facts: each a name and a value.

    Returns:
        The table.
    """
    from rich.table import Table

    table = Table.grid(padding=(0, 2))
    table.add_column(style="dim")
    table.add_column()
    for name, value in facts:
        table.add_row(name, value)
    return table
