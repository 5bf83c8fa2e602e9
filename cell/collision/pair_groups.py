"""The pairs of geoms whose clearance is checked, in two groups: of the arm and what stands still, and within the arm.

    still = PairGroupChecker(checker, itself=False)
    itself = PairGroupChecker(checker, itself=True, beside=still)   # with the same data of MuJoCo's
    still.pairs_within(q, deposits_laid, far)       # of the group's pairs alone

Against what stands still a shape of the arm approaches by its own travel only; two shapes of the arm may both move.
Every pair that the checker takes into account is in at least one group.
"""

from __future__ import annotations

import weakref
from collections.abc import Sequence

import numpy as np

from .checker import Checker
from .clearances import SeesClearances

REACH_ITSELF = 0.1  # m


class PairGroupChecker(Checker):
    """Collision detection of the arm against everything else, or of the arm against itself."""

    def __init__(
        self, checker: Checker, *, itself: bool, beside: Checker | None = None, reach: float | None = None
    ) -> None:
        """Prepare.

        Args:
            checker: of all pairs, of an arm at a table that stands.
            itself: whether the arm is checked against itself.
            beside: as of :class:`cell.collision.checker.Checker`.
            reach: distances are known out to here, m; as far as the checker's where left out.
        """
        given = checker.scene, checker.table, checker.reach if reach is None else reach, checker.without
        super().__init__(*given, pair_gap=checker.pair_gap, beside=beside)
        self.asked = checker.asked
        self.itself = itself
        self.moving = 2 if itself else 1
        scene = self.scene
        self._moving_body = np.zeros(scene.model.nbody, dtype=bool)
        self._moving_body[scene.model.geom_bodyid[scene.arm_geom]] = True
        if itself:
            self._broad_phase = None
        else:
            # pairs that the model names count with the arm's own; here they are met where they touch, and no sooner
            self.pair_gap = 0.0

    def _lay(self, deposits_laid: int, *, arm_alone: bool) -> None:
        super()._lay(deposits_laid, arm_alone=arm_alone)
        switched, arm = self._switched, self.scene.arm_geom
        if self.itself:
            switched.geom_conaffinity[~arm] = 0
            switched.body_conaffinity[~self._moving_body] = 0
        else:
            switched.geom_conaffinity[arm] = 0
            switched.body_conaffinity[self._arm_body] = 0


_made: weakref.WeakKeyDictionary[Checker, tuple[PairGroupChecker, PairGroupChecker]] = weakref.WeakKeyDictionary()


def pair_groups(checker: Checker) -> tuple[PairGroupChecker, PairGroupChecker]:
    """The two groups of a checker's pairs, of an arm at a table that stands: against all else, and itself; made once.

    The arm is seen further from itself than from other things: nothing is mostly near it, and so few looks do.
    """
    if checker not in _made:
        still = PairGroupChecker(checker, itself=False, beside=checker)
        itself = PairGroupChecker(checker, itself=True, beside=checker, reach=max(checker.reach, REACH_ITSELF))
        _made[checker] = still, itself
    return _made[checker]


def groups_of(checker: SeesClearances) -> Sequence[SeesClearances]:
    """Checkers whose pairs are together those of one: its two groups; itself where the table moves as well."""
    if not isinstance(checker, Checker) or isinstance(checker, PairGroupChecker):
        return (checker,)
    if len(checker.scene.arm_qpos) != checker.scene.chain.n:
        return (checker,)
    return pair_groups(checker)
