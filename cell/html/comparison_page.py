"""A comparison of strategies as one HTML file: the paper's tables, with a bar for every index. It needs no script.

    page = html_compare(compare_document(title, found))      # "rbam-compare/1"
    write_bytes("compare.html", page.encode())

What comes from a case (names, problems) is escaped here.
"""

from __future__ import annotations

from collections.abc import Iterator
from html import escape
from typing import Any

from ..compare.compare import CRITERIA, FIGURES, title_of
from .page import page, template

BARS = (("NL", "layers NL", "fewer is better"), ("A_mm2", "adhesion A, mm²", "more is better"),
        ("NV", "targets NV", "fewer is better"), ("R_rad", "top angle R, rad", "less is better"),
        ("F", "total score F", "more is better"))  # fmt: skip
ORDERS = {
    "A_kept": "Non-uniform layers adhere as well as cylindrical ones",
    "A_above_planar": "and better than planar ones",
    "NV_at_most_cylindrical": "they need no more targets than cylindrical ones",
    "R_zero_where_planar_is": "and meet the top exactly where planar ones do",
}


def html_compare(document: dict[str, Any]) -> str:
    """The page of a comparison.

    Args:
        document: from ``cell.compare_document``.

    Returns:
        The whole file; UTF-8.
    """
    subs = document["sub_volumes"]
    fill = {
        "heading": escape(f"{document['case']}: strategies compared"),
        "title": escape(document["case"]),
        "css": template("report.css") + template("compare.css"),
        "sentence": escape(_sentence(subs)),
        "legend": "".join(
            f'<span><i class="swatch" data-strategy="{s}"></i>{title_of(s)}</span>' for s in document["strategies"]
        )
        + ('<span><i class="paper"></i>figure of the paper</span>' if _beside(subs) else ""),
        "sections": "".join(_section(sub, document["strategies"]) for sub in subs),
    }
    return page("compare.html", "", fill)


def _beside(subs: list[dict[str, Any]]) -> bool:
    return any("paper" in sub for sub in subs)


def _sentence(subs: list[dict[str, Any]]) -> str:
    best = [title_of(sub["best"]) for sub in subs]
    counts = ", ".join(f"{name} for {best.count(name)}" for name in dict.fromkeys(best))
    words = f"The highest total score F: {counts} of {len(subs)} sub-volume{'s' if len(subs) > 1 else ''}."
    if not _beside(subs):
        return words
    both = [sub for sub in subs if "paper" in sub]
    same = sum(sub["best"] == sub["paper"]["best"] for sub in both)
    return f"{words} The same strategy as in the paper in {same} of {len(both)}; the paper's figures stand in brackets."


def _section(sub: dict[str, Any], strategies: list[str]) -> str:
    problems = "".join(f"<li>{escape(title_of(s))}: {escape(why)}</li>" for s, why in sub["problems"].items())
    return (
        f'<section class="sub"><h2>{escape(sub["name"])} <small>best: {title_of(sub["best"])}</small></h2>'
        f'<div class="both">{_table(sub, strategies)}<div class="group">{"".join(_charts(sub, strategies))}</div></div>'
        + (f'<ul class="warnings">{problems}</ul>' if problems else "")
        + _orders(sub)
        + "</section>"
    )


def _figures(of: dict[str, Any], strategy: str) -> dict[str, float]:
    """Indices and scores of one strategy; empty where it could not slice."""
    indices = of["indices"].get(strategy)
    return {} if indices is None else {**indices, **of["scores"][strategy]}


def _table(sub: dict[str, Any], strategies: list[str]) -> str:
    head = "".join(f'<th scope="col">{title_of(s)}</th>' for s in strategies)
    rows = []
    for words, key, digits in CRITERIA:
        cells = []
        for s in strategies:
            value = _figures(sub, s).get(key)
            theirs = _figures(sub["paper"], s).get(key) if "paper" in sub else None
            text = "–" if value is None else f"{value:.{digits}f}"
            text = f"<strong>{text}</strong>" if key == "F" and s == sub["best"] else text
            text += "" if theirs is None else f' <span class="theirs">({theirs:.{digits}f})</span>'
            cells.append(f"<td>{text}</td>")
        title = escape(words.replace("mm2", "mm²"))
        rows.append(f'<tr><th scope="row">{title}</th>{"".join(cells)}</tr>')
    for words, key, form in FIGURES:
        values = [sub[key].get(s) for s in strategies]
        cells = ["<td>–</td>" if value is None else f"<td>{form.format(value)}</td>" for value in values]
        rows.append(f'<tr><th scope="row">{escape(words)}</th>{"".join(cells)}</tr>')
    return (
        f'<div class="wide"><table><thead><tr><th></th>{head}</tr></thead><tbody>{"".join(rows)}</tbody></table></div>'
    )


def _charts(sub: dict[str, Any], strategies: list[str]) -> Iterator[str]:
    for key, words, note in BARS:
        ours = {s: _figures(sub, s).get(key) for s in strategies}
        paper = {s: _figures(sub["paper"], s).get(key) if "paper" in sub else None for s in strategies}
        most = max((v for v in (*ours.values(), *paper.values()) if v is not None), default=0.0) or 1.0
        bars = "".join(_bar(s, ours[s], paper[s], most, 0 if key in ("NL", "NV") else 2) for s in strategies)
        yield (
            f'<figure class="chart small"><figcaption><span class="title">{words}</span>'
            f'<span class="soft">{note}</span></figcaption>{bars}</figure>'
        )


def _bar(strategy: str, value: float | None, theirs: float | None, most: float, digits: int) -> str:
    text = "cannot" if value is None else f"{value:.{digits}f}"
    mark = "" if theirs is None else f'<i class="paper" style="left:{100 * theirs / most:.2f}%"></i>'
    wide = 100 * (value or 0.0) / most
    return (
        f'<div class="row"><span class="name">{title_of(strategy)}</span><span class="lane">'
        f'<i class="bar-of" data-strategy="{strategy}" style="width:{wide:.2f}%"></i>{mark}</span>'
        f'<span class="number">{text}</span></div>'
    )


def _orders(sub: dict[str, Any]) -> str:
    orders = sub["orders"]
    if orders is None:
        return ""
    said = "".join(f"<li>{words}: <b>{'yes' if orders[key] else 'no'}</b></li>" for key, words in ORDERS.items())
    title = "The paper's findings, on this part"
    return f'<details class="settings"><summary>{title}</summary><ul>{said}</ul></details>'
