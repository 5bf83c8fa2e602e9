"""The pairs that an arm's clearance is the least of, in groups: each group travels less than the arm as a whole does.

    groups = groups_of(checker, found)      # () where the table moves as well
    groups[0].clearances(q, stage)          # of the group's pairs alone
    groups[0].travel_bound(radius, a, b)    # what its clearances at the ends of steps are held against

Against what stands still a part of the arm gets nearer by its own travel, not by the elbow's, and not by twice as much:
only of two parts of the arm may both move. Every pair that counts for the checker counts in one group at least.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ik.chain import Floats

from .checker import STEPS_TOGETHER, Checker
from .clearances import Clearances, Sees
from .motion_bounds import Frames, MotionBounds
from .reach_radii import radii

NEAR_SHARE = 1.25  # of the least clearance: what is nearest somewhere within this makes a group of its own


class PairGroup(Checker):
    """Collision detection of some parts of the arm against what is none of it, or of the arm against itself."""

    def __init__(self, checker: Checker, parts: NDArray[np.bool_] | None) -> None:
        """Prepare.

        Args:
            checker: of all pairs, of an arm at a table that stands.
            parts: geoms of the arm, (ngeom,), which are held against what is none of it; None: the arm against itself.
        """
        super().__init__(
            checker.scene, checker.table, checker.reach, checker.without, pair_gap=checker.pair_gap, beside=checker
        )
        scene = self.scene
        self.asked = checker.asked
        self.parts = parts
        moving = scene.arm_geom if parts is None else parts
        alone = scene if parts is None else replace(scene, arm_geom=parts)
        self.radius = radii(alone)
        self._bounds = MotionBounds(alone, self.radius)
        self._moving_body = np.zeros(scene.model.nbody, dtype=bool)
        self._moving_body[scene.model.geom_bodyid[moving]] = True
        if parts is None:
            self._broad_phase = None
        else:
            # pairs that the model names count with the arm's own; here they are met where they touch, and no sooner
            self.pair_gap = 0.0

    def travel_bound(self, radius: Floats, a: Floats, b: Floats) -> Floats:
        """As of the checker, for the pairs of this group."""
        blocks = [slice(i, i + STEPS_TOGETHER) for i in range(0, max(len(a), 1), STEPS_TOGETHER)]
        return np.concatenate([self.bound(a[some], b[some], None) for some in blocks])

    def bound(self, a: Floats, b: Floats, frames: Frames | None) -> Floats:
        """As of ``MotionBounds``: of an arm against itself, or against what stands still."""
        bounds = self._bounds.bound if self.parts is None else self._bounds.against_still
        return bounds(a, b, frames)

    def _lay(self, stage: int, *, arm_alone: bool) -> None:
        super()._lay(stage, arm_alone=arm_alone)
        model, arm = self._model, self.scene.arm_geom
        if self.parts is None:
            model.geom_conaffinity[~arm] = 0
            model.body_conaffinity[~self._moving_body] = 0
        else:
            model.geom_contype[~self.parts] = 0
            model.geom_conaffinity[arm] = 0
            model.body_contype[~self._moving_body] = 0
            model.body_conaffinity[self._arm_body] = 0


def groups_of(checker: Sees, found: Clearances) -> tuple[PairGroup, ...]:
    """Groups of the pairs, by what is nearest at samples: that comes first.

    Args:
        checker: of all pairs.
        found: clearances at samples.

    Returns:
        Together they hold every pair that counts for the checker; none where it has to be asked as a whole.
    """
    if not isinstance(checker, Checker) or len(checker.scene.arm_qpos) != checker.scene.chain.n:
        return ()
    scene = checker.scene
    solid = scene.arm_geom & scene.contact_bits.any(axis=0)
    least = float(found.distance.min())
    pair = found.pair[(found.distance <= NEAR_SHARE * least) & (found.pair >= 0).all(axis=1)]
    arm = scene.arm_geom[pair]
    near = np.zeros(len(solid), dtype=bool)
    near[pair[arm & ~arm[:, ::-1]]] = True
    tool = scene.tool_geom & solid
    parts = (near, tool & ~near, solid & ~tool & ~near)
    still, itself = [PairGroup(checker, some) for some in parts if some.any()], PairGroup(checker, None)
    return (*still, itself) if near.any() else (itself, *still)


def travel_bounds(groups: Sequence[PairGroup], q: Floats) -> list[Floats]:
    """How far each group can travel from each sample to the next, (m - 1,), m: frames are had once for all."""
    out: list[list[Floats]] = [[np.zeros(0)] for _ in groups]
    for first in range(0, len(q) - 1, STEPS_TOGETHER):
        some = q[first : first + STEPS_TOGETHER + 1]
        R, p = groups[0].scene.chain.frames(some)
        frames = (R[:-1], p[:-1]), (R[1:], p[1:])
        for group, mine in zip(groups, out, strict=True):
            mine.append(group.bound(some[:-1], some[1:], frames))
    return [np.concatenate(mine) for mine in out]
