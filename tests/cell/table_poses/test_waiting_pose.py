"""A place nearer than home is only taken where it stays known how near the motion comes to anything."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

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
