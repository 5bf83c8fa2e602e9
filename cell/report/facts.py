"""Facts of a report: a name and what it is, one a line.

Use:

    facts_table([("part", "1 sub-volume(s)"), ("speed", "held all along")])    # a rich renderable
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.table import Table


def facts_table(facts: Iterable[tuple[str, str]]) -> Table:
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
