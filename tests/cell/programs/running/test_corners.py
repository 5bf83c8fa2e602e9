"""How far from its end a move may be rounded."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cell.programs.program import MoveKind, Moves
from cell.programs.running.corners import asked_distances


def one(**values: float) -> float:
    """The distance of one move."""
    moves = Moves.empty(1)
    return float(asked_distances(replace(moves, **{name: np.array([value]) for name, value in values.items()}))[0])


@pytest.mark.parametrize("share", [0.1, 0.5, 1.0])
def test_by_speed_it_begins_where_the_brakes_have_reached_the_share(share: float) -> None:
    v, a = 0.4, 1.5
    distance = one(kind=MoveKind.LINEAR, speed=v, acceleration=a, blend_share=share)
    # braking at a from v over the rest of the way: v^2 = 2 a s
    assert np.sqrt(2 * a * distance) == pytest.approx(share * v)


def test_what_is_not_set_is_the_controllers_own() -> None:
    assert one(kind=MoveKind.LINEAR, blend_share=1.0) == pytest.approx(2.0**2 / (2 * 2.3))
    # no axis is known to brake faster
    assert one(kind=MoveKind.LINEAR, speed=1.0, acceleration=9.0, blend_share=1.0) == pytest.approx(1 / (2 * 2.3))


def test_a_distance_is_what_is_asked_for() -> None:
    assert one(kind=MoveKind.LINEAR, speed=0.1, blend=0.004) == 0.004
    assert one(kind=MoveKind.AXES, blend=0.004, blend_share=1.0) == 0.004
