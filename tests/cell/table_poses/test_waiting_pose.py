"""A place nearer than home is only taken where it stays known how near the motion comes to anything."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from cell.table_poses import waiting_pose
from cell.table_poses.waiting_pose import CheckedTravel


def way(least: float) -> CheckedTravel:
    return CheckedTravel(None, least, (0, 1))  # type: ignore[arg-type]


def end(least: float) -> Any:
    return SimpleNamespace(least=least, ends=SimpleNamespace(paths=SimpleNamespace(back=(), out=())))


@pytest.mark.parametrize(
    ("old", "new", "taken"),
    [
        (0.030, 0.030, True),  # something else comes nearest, before and after
        (0.030, 0.008, True),  # the new way comes nearest: that is known
        (0.010, 0.010, True),  # both come as near, as where they begin alike
        (0.010, 0.030, False),  # the way that came nearest is gone, and what else did is not known
    ],
)
def test_what_comes_nearest_stays_known(old: float, new: float, taken: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    for olds, news in (((old, 0.05), (new, 0.05)), ((0.05, old), (0.05, new))):
        monkeypatch.setattr(waiting_pose, "_checked", lambda *_, olds=olds: tuple(way(least) for least in olds))
        found = SimpleNamespace(back=way(news[0]), out=way(news[1]))
        got = waiting_pose._as_near(end(0.010), end(0.010), found)  # type: ignore[arg-type]
        assert (got is found) == taken
        assert got is None or taken


def test_what_is_laid_by_then_stands_in_the_way_of_a_nearer_place(monkeypatch: pytest.MonkeyPatch) -> None:
    """5 deposits with the last target before the turn, and 9 before what is welded next."""
    asked: list[tuple[str, int]] = []
    context = SimpleNamespace(span=None, laid=np.array([3, 4, 5]), begun=9, checker=SimpleNamespace(table=(0.0, 0.0)))
    stretch = SimpleNamespace(stop=3, axes=np.zeros((1, 6)))
    one = SimpleNamespace(context=context, ends=SimpleNamespace(last=stretch, first=stretch))
    path = SimpleNamespace(q=np.zeros((2, 6)))

    def travelled(context: Any, out_of: Any, into: Any, laid: int) -> Any:
        asked.append(("out of" if out_of else "into", laid))
        return path

    monkeypatch.setattr(waiting_pose, "reduced_budget", lambda context, to: context)
    monkeypatch.setattr(waiting_pose, "replace", lambda thing, **_: thing)
    monkeypatch.setattr(waiting_pose, "travel", travelled)
    monkeypatch.setattr(waiting_pose, "straight_retract", lambda *_: np.inf)
    context.settings = SimpleNamespace(retract=0.05)
    assert waiting_pose._ways(one, one, np.zeros(6)) == (path, path)  # type: ignore[arg-type]
    assert asked == [("out of", 5), ("into", 9)]
