"""What the terminal says beyond the verdict: what would help, and everything that keeps a target out.

Use:

    for line in remedy_lines(result, remedies): ...            # rich renderables
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import TYPE_CHECKING

from ..verdict.all_reasons import Excluded
from ..verdict.failure_words import failure_in_words
from ..verdict.result import Result
from ..verdict.severity import worst_first
from .check_report import WORST

if TYPE_CHECKING:
    from rich.console import RenderableType

    from ..failure import Failure
    from ..remedy_search.search import Remedy


def remedy_lines(result: Result, remedies: Iterable[Remedy]) -> Iterator[RenderableType]:
    """What would help, a line each, as it is found.

    Args:
        result: the verdict.
        remedies: from ``cell.remedy_search.search``.

    Yields:
        rich renderables.
    """
    for remedy in remedies:
        whose = whom_it_helps(result, remedy)
        yield f"what would help{whose and ' '}{whose}: {remedy.sentence}"


def whom_it_helps(result: Result, remedy: Remedy) -> str:
    """The targets that a remedy is about, in words; empty where it is about all infeasible ones."""
    if len(remedy.targets) >= result.infeasible:
        return ""
    reason = str(remedy.reason).replace("_", " ")
    some = "1 target" if len(remedy.targets) == 1 else f"{len(remedy.targets)} targets"
    return f"{some} ({reason}, {_where(result, remedy.targets)})"


def _where(result: Result, targets: Iterable[int]) -> str:
    """The layers of a group of neighbouring targets, in words."""
    t, index = result.job.targets, list(targets)
    low, high = int(t.layer[index].min()), int(t.layer[index].max())
    name = t.sub_volume[t.sub_volume_index[index[0]]]
    return f"{name}/{low}" if low == high else f"{name}/{low} to {high}"


def all_reasons_lines(
    result: Result, found: Mapping[int, list[Excluded]], *, every: bool = False
) -> Iterator[RenderableType]:
    """Of the worst infeasible targets, how many candidates each reason excludes, and its best measure.

    Args:
        result: the verdict.
        found: from ``cell.verdict.all_reasons``.
        every: list every infeasible target, not the worst ones alone.

    Yields:
        rich renderables.
    """
    from rich.table import Table

    if not found:
        return
    table = Table(box=None, pad_edge=False, header_style="dim")
    for name, justify in (
        ("target", "right"),
        ("reason", "left"),
        ("candidates", "right"),
        ("the nearest to passing", "left"),
    ):
        table.add_column(name, justify=justify)  # type: ignore[arg-type]
    shown = found if every else sorted(worst_first(result)[:WORST])
    for i, reasons in ((i, found[i]) for i in shown):
        for k, entry in enumerate(reasons):
            words = _candidate_in_words(result, i, entry.failure)
            table.add_row("" if k else str(i), entry.reason, str(entry.candidates), words)
    if len(found) > len(shown):
        table.caption = f"and {len(found) - len(shown)} more; all of them with --verbose or --json"
        table.caption_justify = "left"
    yield table


def _candidate_in_words(result: Result, i: int, failure: Failure | None) -> str:
    if failure is None:
        why = result.rows[i].reason
        return f"the target by itself is free; its verdict is {why}"
    roll = "" if failure.roll_deg is None else f", at roll {failure.roll_deg:g}"
    return failure_in_words(failure) + roll
