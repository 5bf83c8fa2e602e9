"""The result of a bead's search: stretches with a motion, and why the other targets have none.

    plan.whole, plan.stretches
    plan.edge_failures, plan.target_failures         # by target

Metres and radians.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from ik.chain import Floats

from ..failure import Failure
from .edges.edge_check import Stretch


@dataclass(frozen=True, eq=False)
class TargetFailure:
    """Why a target has no configuration that could be used.

    Attributes:
        failure: of its best candidate: unreachable, a joint limit, singular or a collision.
        attempt: the best attempt, (j,), rad, or None.
    """

    failure: Failure
    attempt: Floats | None


@dataclass(frozen=True, eq=False)
class BeadPlan:
    """The result of a bead's search.

    Attributes:
        first: its first target.
        stop: one past its last.
        stretches: what can be run through.
        edge_failures: targets that cannot be reached from the one before, with why.
        target_failures: targets without any configuration, with why.
        open: targets that were not checked: the bead is lost by others, or the whole part was before.
        hard: whether it was found only with the roll sampled finer, or like a bead that was.
    """

    first: int
    stop: int
    stretches: tuple[Stretch, ...]
    edge_failures: dict[int, Failure]
    target_failures: dict[int, TargetFailure]
    open: frozenset[int] = frozenset()
    hard: bool = False

    @property
    def whole(self) -> bool:
        """Whether one motion leads through the whole bead."""
        return not self.edge_failures and not self.target_failures and not self.open

    @property
    def may_be_mended(self) -> bool:
        """Whether a roll between the samples could help: not where all lost targets are proved out."""
        return bool(self.edge_failures) or not all(m.failure.proved for m in self.target_failures.values())

    @property
    def lost(self) -> int:
        """Targets that no motion leads to, that are out of reach, or that were not checked."""
        return len(self.edge_failures) + len(self.target_failures) + len(self.open)

    def only(self, known: set[int]) -> BeadPlan:
        """The same with some of the failures of targets alone; the others, and those cut off, are left open."""
        target_failures = {i: m for i, m in self.target_failures.items() if i in known}
        return replace(
            self,
            edge_failures={},
            target_failures=target_failures,
            open=frozenset({*self.edge_failures, *self.target_failures} - known),
        )
