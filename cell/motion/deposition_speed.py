"""How far a bead's speed is held, from target to target: a torch that slows down deposits more.

    held = motion.held_speed
    held.ratio[i], held.taken_s[i], held.axis[i]    # from target i to the next one of its bead
    too_slow(held, least_share)                     # targets reached at less than that share, with why

Seconds; a ratio is the time asked for divided by the time taken. What has to be held is the speed over every stretch of
``STRETCH`` of a bead, wherever its targets are: over less a share says nothing about the weld.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ik.chain import Floats

if TYPE_CHECKING:
    from ..arrays import Ints
from ..failure import Failure, FailurePlace, Kind, SlowdownCause, Where

KEPT_SHARE = 0.98  # share of the deposition speed from which on it counts as kept
STRETCH = 5e-3  # m of a bead over which its speed is to be held: about its width, what the weld pool covers


@dataclass(frozen=True, eq=False)
class HeldSpeed:
    """The speed from every target to the next of its bead.

    Attributes:
        asked_s: time that the deposition speed asks for, (n,), s; NaN where no bead goes on.
        taken_s: time taken, (n,), s.
        axis: the axis that slows it down most, (n,), "" where the speed is held.
        by: "speed" or "acceleration" of that axis, (n,).
        least: least share over stretches of the bead with their middle on that way, (n,); NaN where none has, or that
            is not known.
    """

    asked_s: Floats
    taken_s: Floats
    axis: NDArray[np.str_]
    by: NDArray[np.str_]
    least: Floats

    @property
    def judged(self) -> Floats:
        """What is compared with the share asked for, (n,): the least over stretches, where that is known."""
        if np.isfinite(self.least).any():
            return self.least
        return self.ratio

    @property
    def ratio(self) -> Floats:
        """Share of the speed that is held, (n,); NaN where no bead goes on."""
        return self.asked_s / self.taken_s

    @classmethod
    def unknown(cls, n: int) -> HeldSpeed:
        """Of n targets, to be filled in."""
        names = np.full(n, "", dtype="<U32"), np.full(n, "", dtype="<U12")
        return cls(np.full(n, np.nan), np.full(n, np.nan), *names, np.full(n, np.nan))

    def rows(self, first: int, stop: int) -> HeldSpeed:
        """Of some targets that follow each other."""
        mine = slice(first, stop)
        return HeldSpeed(*(np.array(column[mine]) for column in self._columns))

    def put(self, first: int, held_speed: HeldSpeed) -> None:
        """Fill in that of targets from a first one on."""
        for mine, other in zip(self._columns, held_speed._columns, strict=True):
            mine[first : first + len(other)] = other

    @property
    def _columns(self) -> tuple[NDArray[Any], ...]:
        return self.asked_s, self.taken_s, self.axis, self.by, self.least


def over_stretches(s: Floats, t: Floats, asked: Floats) -> tuple[Floats, Floats]:
    """Shares of the speed held over stretches of a bead.

    Args:
        s: lengths along it, ascending, (m,), m.
        t: when they are passed, (m,), s.
        asked: when they would be, at the speed asked for, (m,), s.

    Returns:
        Middles of stretches, (k,), m, and shares, (k,): of ``STRETCH``, or of the whole of a shorter bead.
    """
    length = min(STRETCH, float(s[-1] - s[0]))
    start = np.unique(np.clip(np.concatenate([s, s - length]), s[0], s[-1] - length))
    taken = np.interp(start + length, s, t) - np.interp(start, s, t)
    wanted = np.interp(start + length, s, asked) - np.interp(start, s, asked)
    return start + length / 2, wanted / np.maximum(taken, 1e-12)


def note_stretches(held_speed: HeldSpeed, targets: Ints, along: Floats, found: tuple[Floats, Floats]) -> None:
    """Put down the least share of the stretches of a bead, by the way that their middle is on.

    Args:
        held_speed: of the part.
        targets: of the bead, (k,).
        along: lengths along it at which they are, (k,), m.
        found: from :func:`over_stretches`.
    """
    middle, share = found
    way = np.clip(np.searchsorted(along, middle, side="right") - 1, 0, len(along) - 2)
    least = np.full(len(along), np.inf)
    np.minimum.at(least, way, share)
    some = np.isfinite(least)
    held_speed.least[targets[some]] = least[some]


def too_slow(held_speed: HeldSpeed, least_share: float, slack: float = 0.0) -> dict[int, Failure]:
    """Targets that are reached too slowly.

    Args:
        held_speed: of a motion.
        least_share: of the deposition speed, to be held over every stretch.
        slack: share of that which does not count.

    Returns:
        Failures, by the number of the target at whose end of the way it is.
    """
    share = held_speed.judged
    return {
        int(i) + 1: _slow(held_speed, int(i), least_share) for i in np.flatnonzero(share < least_share * (1 - slack))
    }


def _slow(held_speed: HeldSpeed, i: int, least_share: float) -> Failure:
    return Failure(
        Kind.DEPOSITION_SPEED,
        measure=round(float(held_speed.judged[i]), 4),
        limit=least_share,
        axis=str(held_speed.axis[i]),
        cause=SlowdownCause(str(held_speed.by[i]), round(float(held_speed.taken_s[i]), 4)),
        place=FailurePlace(Where.BEAD, from_target=i),
    )


def speed_document(held_speed: HeldSpeed, bead: Ints) -> dict[str, Any]:
    """The speed as the report writes it.

    Args:
        held_speed: of a motion.
        bead: of every target, (n,).

    Returns:
        ``least_share`` over any stretch with ``from_target``, ``axis`` and ``by``; ``slowed_s``, the time below 98 % of
        the speed; ``lost_s``, how much more than asked for all takes; and the slowed ways from target to target.
    """
    share = held_speed.ratio
    known, judged = np.isfinite(share), held_speed.judged
    slow = np.flatnonzero(known & (share < KEPT_SHARE))
    least = int(np.nanargmin(judged)) if known.any() else None
    return {
        "least_share": None if least is None else round(float(judged[least]), 4),
        "from_target": least,
        "axis": None if least is None else str(held_speed.axis[least]) or None,
        "by": None if least is None else str(held_speed.by[least]) or None,
        "slowed_s": round(float(held_speed.taken_s[slow].sum()), 3),
        "lost_s": round(float(np.nansum(held_speed.taken_s - held_speed.asked_s)), 3),
        "slowed": [
            {
                "from_target": int(i),
                "bead": int(bead[i]),
                "share": round(float(share[i]), 4),
                "seconds": round(float(held_speed.taken_s[i]), 4),
                "axis": str(held_speed.axis[i]) or None,
                "by": str(held_speed.by[i]) or None,
            }
            for i in slow
        ],
    }
