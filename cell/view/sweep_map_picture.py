"""The map of a sweep as a picture: E1 up, E2 across, one panel for every cell that was tried.

    write_bytes("map.png", sweep_picture(document))         # "rbam-sweep/1"

Colours are those of Okabe and Ito, which the colour-blind tell apart; feasible poses are green and framed, infeasible
ones have the colour of the reason that most of their targets have, paler where fewer targets are concerned.

Source: Okabe, Ito, Color universal design, 2008.
"""

from __future__ import annotations

import io
import math
from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any

from ..errors import InputError
from ..pose_sweep.variants import SweepRow, variant_pieces, variants

if TYPE_CHECKING:
    from PIL import ImageDraw, ImageFont

    from ..pose_sweep.grid import Pose

Colour = tuple[int, int, int]
Box = tuple[float, float, float, float]

INK, SOFT, RULE, PAGE, EMPTY = (27, 33, 41), (88, 100, 115), (200, 206, 214), (255, 255, 255), (240, 242, 245)
FEASIBLE: Colour = (0, 158, 115)
REASON_COLOUR: dict[str, Colour] = {
    "unreachable": (90, 90, 96),
    "joint_limit": (213, 94, 0),
    "singular": (204, 121, 167),
    "collision": (0, 114, 178),
    "no_path": (230, 179, 0),
    "speed": (150, 225, 235),
    "gravity": (146, 110, 60),
    "overhang": (75, 54, 33),
}
PALEST = 0.6  # strength of a reason's colour where a single target is concerned
SCALE = 2  # pixels a unit: the sizes below are those of a small picture
CELL_MIN, CELL_MAX = 3, 40
PANEL, PANEL_OF_MANY = 620, 420  # width that maps aim at
MOST_PANELS = 24
LEFT, RIGHT, TOP, BOTTOM = 58, 22, 30, 46
HEAD = 68


def sweep_picture(document: dict[str, Any]) -> bytes:
    """Draw the map.

    Args:
        document: "rbam-sweep/1".

    Returns:
        A PNG.

    Raises:
        InputError: more cells were tried than fit into one picture.
    """
    from PIL import Image, ImageDraw

    groups = variants(document)
    if len(groups) > MOST_PANELS:
        raise InputError(f"--picture: {len(groups)} maps do not fit into one picture; at most {MOST_PANELS} do")
    across = min(len(groups), max(1, math.ceil(math.sqrt(len(groups)))))
    axes = tuple(sorted({row[name] for row in document["poses"]}) for name in ("E2_deg", "E1_deg"))
    size = min(max((PANEL if across == 1 else PANEL_OF_MANY) / len(axes[0]), CELL_MIN), CELL_MAX)
    titles = _titles([pose for pose, _ in groups])
    top = TOP + 15 * len(titles[0])
    panel_w = max(LEFT + RIGHT + size * len(axes[0]), 300 if titles[0] else 0)
    panel_h = top + BOTTOM + size * len(axes[1])
    width = max(across * panel_w, 560)
    below = HEAD + panel_h * math.ceil(len(groups) / across)
    # drawn on a tall sheet that is cut where the legend ends
    sheet = below + 60 + 20 * (len(REASON_COLOUR) + len(document["marks"]))
    image = Image.new("RGB", (round(width * SCALE), round(sheet * SCALE)), PAGE)
    brush = _Brush(ImageDraw.Draw(image))
    brush.text((20, 14), document["case"], 19, INK)
    good = sum(row["verdict"] == "feasible" for row in document["poses"])
    brush.text((20, 38), f"Feasible table poses: {good} of {len(document['poses'])}", 13, SOFT)
    for k, (_, rows) in enumerate(groups):
        corner = (k % across) * panel_w, HEAD + (k // across) * panel_h
        for line, words in enumerate(titles[k]):
            brush.text((corner[0] + LEFT, corner[1] + 15 * line), words, 12, INK)
        _panel(brush, (corner[0] + LEFT, corner[1] + top), rows, axes, (size, size), document)
    end = _legend(brush, _legend_rows(document), document, (20, below + 8), width)
    out = io.BytesIO()
    image.crop((0, 0, image.width, min(round((end + 12) * SCALE), image.height))).save(out, format="PNG", optimize=True)
    return out.getvalue()


class _Brush:
    """Draws in units of the small picture."""

    def __init__(self, draw: ImageDraw.ImageDraw) -> None:
        self.draw = draw
        self._fonts: dict[float, ImageFont.FreeTypeFont | ImageFont.ImageFont] = {}

    def _font(self, size: float) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
        from PIL import ImageFont

        if size not in self._fonts:
            self._fonts[size] = ImageFont.load_default(size * SCALE)
        return self._fonts[size]

    def text(self, at: tuple[float, float], words: str, size: float, colour: Colour, anchor: str = "la") -> None:
        self.draw.text((at[0] * SCALE, at[1] * SCALE), words, font=self._font(size), fill=colour, anchor=anchor)

    def length(self, words: str, size: float) -> float:
        return float(self.draw.textlength(words, font=self._font(size))) / SCALE

    def box(self, box: Box, fill: Colour, outline: Colour | None = None) -> None:
        x0, y0, x1, y1 = (round(v * SCALE) for v in box)
        self.draw.rectangle((x0, y0, max(x1 - 1, x0), max(y1 - 1, y0)), fill=fill, outline=outline, width=SCALE)

    def line(self, ends: Sequence[tuple[float, float]], colour: Colour, width: float = 1.0) -> None:
        points = [(x * SCALE, y * SCALE) for x, y in ends]
        self.draw.line(points, fill=colour, width=max(1, round(width * SCALE)))

    def ring(self, at: tuple[float, float], radius: float) -> None:
        """A mark that shows on any colour."""
        for r, colour, width in ((radius + 1.5, PAGE, 4.5), (radius, INK, 2.0)):
            x0, y0, x1, y1 = at[0] - r, at[1] - r, at[0] + r, at[1] + r
            self.draw.ellipse([v * SCALE for v in (x0, y0, x1, y1)], outline=colour, width=round(width * SCALE))

    def star(self, at: tuple[float, float], radius: float) -> None:
        for r, colour in ((radius + 2.5, INK), (radius, (255, 236, 120))):
            points = [
                (
                    (at[0] + (r if i % 2 == 0 else 0.45 * r) * math.sin(math.pi * i / 5)) * SCALE,
                    (at[1] - (r if i % 2 == 0 else 0.45 * r) * math.cos(math.pi * i / 5)) * SCALE,
                )
                for i in range(10)
            ]
            self.draw.polygon(points, fill=colour)


def colour_of(row: SweepRow) -> Colour:
    """A pose's colour: of its verdict, or of the reason that most of its infeasible targets have."""
    if row["verdict"] == "feasible":
        return FEASIBLE
    reason = main_reason(row)
    share = row["infeasible"] / max(int(row.get("looked_at") or row["infeasible"]), 1)
    strength = PALEST + (1 - PALEST) * math.sqrt(min(share, 1.0))
    r, g, b = (round(255 - strength * (255 - c)) for c in REASON_COLOUR[reason])
    return r, g, b


def main_reason(row: SweepRow) -> str:
    """The reason that most of a pose's infeasible targets have; the first of equals."""
    reasons: dict[str, Any] = row["reasons"]

    def count(reason: str) -> int:
        return int(reasons.get(reason) or 0)

    return max(REASON_COLOUR, key=count)


def _titles(poses: list[Pose]) -> list[list[str]]:
    """Of every map what tells it from the others, one line each; all of the same number of lines."""
    pieces = [variant_pieces(pose) for pose in poses]
    differing = [k for k in range(len(pieces[0])) if len({p[k] for p in pieces}) > 1]
    return [[p[k] for k in differing] for p in pieces]


def _panel(
    brush: _Brush,
    origin: tuple[float, float],
    rows: list[SweepRow],
    axes: tuple[list[float], ...],
    size: tuple[float, float],
    document: dict[str, Any],
) -> None:
    x0, y0 = origin
    turns, tilts = axes
    w, h = size[0] * len(turns), size[1] * len(tilts)
    brush.box((x0, y0, x0 + w, y0 + h), EMPTY)
    column = {v: k for k, v in enumerate(turns)}
    line = {v: len(tilts) - 1 - k for k, v in enumerate(tilts)}
    gap = 0.5 if size[0] > 8 else 0.0
    for row in rows:
        x, y = x0 + size[0] * column[row["E2_deg"]], y0 + size[1] * line[row["E1_deg"]]
        brush.box((x + gap, y + gap, x + size[0] - gap, y + size[1] - gap), colour_of(row))
    _borders(brush, rows, column, line, (x0, y0), size)
    _ticks(brush, (x0, y0, w, h), axes, size)
    _marks(brush, rows, document, axes, (x0, y0), size)


def _borders(
    brush: _Brush,
    rows: list[SweepRow],
    column: dict[float, int],
    line: dict[float, int],
    origin: tuple[float, float],
    size: tuple[float, float],
) -> None:
    """Frame the islands, so that they show without colours as well."""
    good = {(column[r["E2_deg"]], line[r["E1_deg"]]) for r in rows if r["verdict"] == "feasible"}
    for i, j in good:
        x, y = origin[0] + i * size[0], origin[1] + j * size[1]
        sides = {
            (i - 1, j): ((x, y), (x, y + size[1])),
            (i + 1, j): ((x + size[0], y), (x + size[0], y + size[1])),
            (i, j - 1): ((x, y), (x + size[0], y)),
            (i, j + 1): ((x, y + size[1]), (x + size[0], y + size[1])),
        }
        for beside, ends in sides.items():
            if beside not in good:
                brush.line(ends, INK, 1.2)


def _ticks(brush: _Brush, area: Box, axes: tuple[list[float], ...], size: tuple[float, float]) -> None:
    x0, y0, w, h = area
    for k in _shown(axes[0], 46 / size[0]):
        x = x0 + (k + 0.5) * size[0]
        brush.line(((x, y0 + h), (x, y0 + h + 4)), SOFT)
        brush.text((x, y0 + h + 6), f"{axes[0][k]:g}°", 11, SOFT, "ma")
    for k in _shown(axes[1], 20 / size[1]):
        y = y0 + h - (k + 0.5) * size[1]
        brush.line(((x0 - 4, y), (x0, y)), SOFT)
        brush.text((x0 - 7, y), f"{axes[1][k]:g}°", 11, SOFT, "rm")
    brush.text((x0 + w / 2, y0 + h + 22), "E2, turn of the table", 12, INK, "ma")
    brush.text((x0, y0 - 5), "E1, tilt", 12, INK, "rd")


def _shown(values: list[float], apart: float) -> list[int]:
    """Which values get a label: round ones where they fit."""
    for step in (15, 30, 45, 90, 180):
        some = [k for k, v in enumerate(values) if math.isclose(v % step, 0, abs_tol=1e-9)]
        if len(some) > 1 and min(b - a for a, b in pairwise(some)) >= apart:
            return some
    every = max(1, math.ceil(apart))
    return list(range(0, len(values), every))


def _marks(
    brush: _Brush,
    rows: list[SweepRow],
    document: dict[str, Any],
    axes: tuple[list[float], ...],
    origin: tuple[float, float],
    size: tuple[float, float],
) -> None:
    def place(e1: float, e2: float) -> tuple[float, float] | None:
        across, up = _along(axes[0], e2), _along(axes[1], e1)
        if across is None or up is None:
            return None
        return origin[0] + across * size[0], origin[1] + (len(axes[1]) - up) * size[1]

    best = document["best"]
    if best is not None and any(row is best or row == best for row in rows):
        at = place(best["E1_deg"], best["E2_deg"])
        if at is not None:
            brush.star(at, 7)
    for k, mark in enumerate(document["marks"]):
        at = place(mark["E1_deg"], mark["E2_deg"])
        if at is not None:
            brush.ring(at, 10)
            side = 15 if at[0] < origin[0] + 0.9 * size[0] * len(axes[0]) else -15
            _tag(brush, (at[0] + side, at[1]), _letter(k), "lm" if side > 0 else "rm")


def _tag(brush: _Brush, at: tuple[float, float], words: str, anchor: str) -> None:
    wide = brush.length(words, 13) + 8
    x0 = at[0] if anchor == "lm" else at[0] - wide
    brush.box((x0, at[1] - 9, x0 + wide, at[1] + 9), PAGE, INK)
    brush.text((x0 + wide / 2, at[1]), words, 13, INK, "mm")


def _letter(k: int) -> str:
    return chr(ord("A") + k % 26)


def _along(values: list[float], value: float) -> float | None:
    """Where a value stands on an axis, in cells from its left edge; a turn on where only that is on it."""
    for v in (value, value - 360, value + 360):
        if len(values) == 1 and v == values[0]:
            return 0.5
        for k in range(len(values) - 1):
            if values[k] <= v <= values[k + 1]:
                return k + 0.5 + (v - values[k]) / (values[k + 1] - values[k])
    return None


def _legend_rows(document: dict[str, Any]) -> list[tuple[str, Colour]]:
    present = {main_reason(row) for row in document["poses"] if row["verdict"] != "feasible"}
    rows: list[tuple[str, Colour]] = []
    if any(row["verdict"] == "feasible" for row in document["poses"]):
        rows.append(("feasible", FEASIBLE))
    return rows + [(reason.replace("_", " "), REASON_COLOUR[reason]) for reason in REASON_COLOUR if reason in present]


def _legend(
    brush: _Brush, rows: list[tuple[str, Colour]], document: dict[str, Any], at: tuple[float, float], width: float
) -> float:
    """Draw the legend; gives where it ends."""
    x, y = at
    for words, colour in rows:
        wide = 36 + brush.length(words, 12)
        if x + wide > width - 10:
            x, y = at[0], y + 20
        brush.box((x, y, x + 14, y + 14), colour, INK if words == "feasible" else None)
        brush.text((x + 20, y + 7), words, 12, INK, "lm")
        x += wide
    y += 22
    if document["best"] is not None:
        brush.star((at[0] + 7, y + 7), 6)
        best = document["best"]
        brush.text((at[0] + 20, y + 7), f"best: E1 = {best['E1_deg']:g}°, E2 = {best['E2_deg']:g}°", 12, INK, "lm")
        y += 20
    for k, mark in enumerate(document["marks"]):
        words = f"{mark['label']} (E1 = {mark['E1_deg']:g}°, E2 = {mark['E2_deg']:g}°)"
        _tag(brush, (at[0] - 1, y + 7), _letter(k), "lm")
        brush.text((at[0] + 24, y + 7), words, 12, INK, "lm")
        y += 20
    return y
