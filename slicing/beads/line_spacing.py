"""How far apart lines to and fro run, so that they lay the metal that is left for them.

    strokes = spread(lines, wanted_mm, pitch_mm=3.75, width_mm=5.0)      # lines(apart_mm) -> strokes

Lines a pitch apart fill what lies between them. What joins their ends, and the rounds that they run into, is metal
beside; and so is what rounding the number of lines up adds. Lines a little farther apart make up for it, at most a
bead's width, beyond which there would be a gap between two; or a little closer where metal is missing.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from .infill import Stroke

CLOSE = 0.03  # of what is wanted: near enough
CLOSEST = 0.8  # of the pitch
TRIES = 3


def length_of(strokes: Sequence[Stroke]) -> float:
    """Length of strokes in their chart, mm."""
    total = 0.0
    for stroke in strokes:
        line = np.concatenate([stroke.line, stroke.line[:1] + stroke.shift]) if stroke.closed else stroke.line
        total += float(np.hypot(*np.diff(line, axis=0).T).sum())
    return total


def spread(lines: Callable[[float], list[Stroke]], wanted_mm: float, pitch_mm: float, width_mm: float) -> list[Stroke]:
    """The lines whose length is nearest to what is wanted.

    Args:
        lines: strokes, by the greatest distance of two of them, mm.
        wanted_mm: length of lines that lays the metal.
        pitch_mm: what a bead fills.
        width_mm: of a bead.

    Returns:
        The strokes.
    """
    apart, best = pitch_mm, lines(pitch_mm)
    got = length_of(best)
    if wanted_mm <= 0.0 or got <= 0.0:
        return best
    off = abs(got - wanted_mm)
    for _ in range(TRIES):
        before, apart = apart, min(max(apart * got / wanted_mm, CLOSEST * pitch_mm), width_mm)
        if off <= CLOSE * wanted_mm or apart == before:
            break
        tried = lines(apart)
        got = length_of(tried)
        if abs(got - wanted_mm) < off and got > 0.0:
            best, off = tried, abs(got - wanted_mm)
    return best
