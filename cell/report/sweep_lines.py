"""What the terminal says of a sweep: the map in characters, and the best pose in words.

Use:

    for line in sweep_lines(document): ...            # "rbam-sweep/1"; rich renderables
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from ..pose_sweep.grid import Pose
from ..pose_sweep.variants import SweepRow, is_lower_bound, variant_words, variants

if TYPE_CHECKING:
    from rich.console import RenderableType

CELL = 6  # characters of a pose on a wide map
MOST_COLUMNS = 16  # turns that fit beside one another as numbers
MAPS = 4  # shown one below the other; of more, only the best


def sweep_lines(document: dict[str, Any]) -> Iterator[RenderableType]:
    """The terminal's maps of a sweep: rows are E1, the greatest at the top, columns E2.

    Yields:
        rich renderables.
    """
    from rich.text import Text

    groups = variants(document)
    yield Text.assemble((document["case"], "bold"), f"  feasible table poses{_of_what(document)}; E1 up, E2 across")
    if len(groups) > 1:
        yield _overview(groups)
    best = document["best"]
    shown = groups
    if len(groups) > MAPS:
        mine = None if best is None else Pose.of(best).variant
        shown = [group for group in groups if group[0] == mine] or groups[:1]
    for pose, rows in shown:
        if len(groups) > 1:
            yield Text(variant_words(pose), style="bold")
        yield from _map(rows)
    wide = all(len({row["E2_deg"] for row in rows}) <= MOST_COLUMNS for _, rows in shown)
    more = " (12+: at least 12)" if any(map(is_lower_bound, document["poses"])) else ""
    yield (
        f"yes: feasible; a number: count of infeasible targets{more}"
        if wide
        else "#: feasible; + below 10 %, : below 50 %, . more of the targets checked infeasible"
    )
    yield _best(best)


def _of_what(document: dict[str, Any]) -> str:
    """What is built at the poses, where that is not the whole part."""
    of = next((row for row in document["poses"] if "sub_volume" in row), None)
    return "" if of is None else f" of {of['sub_volume']} layers {of['layers'][0]} to {of['layers'][1]}, built first"


def _overview(groups: list[tuple[Pose, list[SweepRow]]]) -> RenderableType:
    from rich.table import Table

    table = Table(box=None, pad_edge=False, header_style="dim")
    table.add_column("tried")
    table.add_column("feasible", justify="right")
    table.add_column("best rank", justify="right")
    table.add_column("at E1, E2")
    for pose, rows in groups:
        good = [row for row in rows if row["rank"] is not None]
        top = min(good, key=lambda row: row["rank"], default=None)
        where = ("", "-") if top is None else (f"{top['rank']}", f"{top['E1_deg']:g}, {top['E2_deg']:g}")
        table.add_row(variant_words(pose), f"{len(good)} of {len(rows)}", *where)
    return table


def _map(rows: list[SweepRow]) -> Iterator[RenderableType]:
    from rich.text import Text

    e1, e2 = (sorted({row[name] for row in rows}) for name in ("E1_deg", "E2_deg"))
    at = {(row["E1_deg"], row["E2_deg"]): row for row in rows}
    wide = len(e2) <= MOST_COLUMNS
    if wide:
        yield Text(" " * 8 + "".join(f"{v:>{CELL}g}" for v in e2), style="dim")
    for tilt in reversed(e1):
        line = Text(f"{tilt:>7g} ", style="dim")
        for turn in e2:
            line.append(*_mark(at.get((tilt, turn)), wide))
        yield line


def _mark(row: SweepRow | None, wide: bool) -> tuple[str, str]:
    if row is None:
        return (" " * CELL if wide else " "), ""
    if row["verdict"] == "feasible":
        return (f"{'yes':>{CELL}}" if wide else "#"), "green"
    k = row["infeasible"]
    if wide:
        return f"{f'{k}+' if is_lower_bound(row) else f'{k}':>{CELL}}", "red"
    share = k / row.get("looked_at", k)
    return ("+" if share < 0.1 else ":" if share < 0.5 else "."), "red"


def _best(best: SweepRow | None) -> str:
    if best is None:
        return "no feasible pose"
    clearance = best["least_clearance_mm"]
    room = "more than 50 mm" if clearance is None else f"{clearance:.1f} mm"
    tried = variant_words(Pose.of(best))
    return (
        f"best: E1 = {best['E1_deg']:g}, E2 = {best['E2_deg']:g} deg{f', {tried}' if tried else ''}: deposits at most "
        f"{best['gravity_max_deg']:.0f} deg off upright, least clearance {room}"
    )
