"""A comparison of strategies on a terminal.

Use:

    for line in compare_lines("boiler", comparisons): ...      # rich renderables
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import RenderableType
from ..compare.compare import CRITERIA, FIGURES, Comparison, best_strategy, criteria_of, title_of


def compare_lines(title: str, found: Sequence[Comparison]) -> Iterator[RenderableType]:
    """The terminal report: a table a sub-volume, the paper's figures in brackets beside ours.

    Args:
        title: of the case, or what else was compared.
        found: the comparisons.

    Yields:
        rich renderables.
    """
    from rich.text import Text

    beside = any(one.paper for one in found)
    yield Text.assemble((title, "bold"), "  strategies compared", "; the paper's figures in brackets" if beside else "")
    for one in found:
        yield _table(one)
        yield from (f"{row.strategy}: {row.problem}" for row in one.rows if row.problem)
    if beside:
        both = [one for one in found if one.paper is not None]
        same = sum(best_strategy(one.rows) == best_strategy(one.paper or ()) for one in both)
        yield f"best F by the same strategy as in the paper: {same} of {len(both)}"


def _table(one: Comparison) -> RenderableType:
    from rich.table import Table
    from rich.text import Text

    table = Table(box=None, pad_edge=False, header_style="dim")
    table.add_column(one.name, style="dim", min_width=16)
    for row in one.rows:
        table.add_column(title_of(row.strategy), justify="right", min_width=18)
    ours, best = criteria_of(one.rows), best_strategy(one.rows)
    paper = {} if one.paper is None else criteria_of(one.paper)
    for title, key, digits in CRITERIA:
        cells = []
        for row in one.rows:
            value, theirs = ours[row.strategy].get(key), paper.get(row.strategy, {}).get(key)
            text = "-" if value is None else f"{value:.{digits}f}"
            text += "" if theirs is None else f" ({theirs:.{digits}f})"
            cells.append(Text(text, style="bold green" if key == "F" and row.strategy == best else ""))
        table.add_row(title, *cells)
    for title, key, form in FIGURES:
        values = [getattr(row, key) for row in one.rows]
        table.add_row(title, *("-" if value is None else form.format(value) for value in values))
    return table
