"""What a model couples: closed chains, joints that follow others, tendons that limit several joints at once.

    warnings = check_couplings(model, planned=["A1", ..., "A6"], own=OwnPlaces("robot", "arm.xml", "blade.case.yaml"))

A cell's joints each move by themselves. A coupling between what the planned joints move apart would not hold in its
motions, so that the model is refused; one within what moves together, one to a body that a user drags and one that is
not active change nothing and are reported.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import mujoco
import numpy as np

from slicing import Code, Warning

from .held_settings import OwnPlaces

EQ, WRAP = mujoco.mjtEq, mujoco.mjtWrap
REMEDY = "remove from the model what follows, or the coupling if the machine moves without it"


def check_couplings(model: mujoco.MjModel, planned: Sequence[str], own: OwnPlaces) -> tuple[Warning, ...]:
    """Refuse couplings that a motion of the planned joints would break; say which others are left out.

    Args:
        model: compiled, all its joints named.
        planned: names of the joints that are planned.
        own: which model and case it is, for messages.

    Returns:
        Warnings: of the couplings that are left out, and of tendons that limit planned joints.

    Raises:
        InputError: a planned joint follows another, is held, or is followed by one that is not planned; or a
            constraint ties bodies together that the planned joints move against each other.
    """
    looked_at = _Couplings(model, tuple(planned), own)
    for number in np.flatnonzero(model.eq_active0).tolist():
        kind = int(model.eq_type[number])
        if kind == EQ.mjEQ_JOINT:
            looked_at.check_joints(number)
        elif kind in (EQ.mjEQ_CONNECT, EQ.mjEQ_WELD):
            looked_at.check_bodies(number)
        elif kind == EQ.mjEQ_TENDON:
            looked_at.check_tendons(number)
    reported = []
    if model.neq:
        text = (
            f"{own.section}.model: {model.neq} equality constraint(s) left out of the cell: what they couple stands "
            "still"
        )
        reported.append(Warning(Code.MODEL_ELEMENT_LEFT_OUT, text))
    return (*reported, *looked_at.limiting_tendons())


@dataclass(frozen=True, eq=False)
class _Couplings:
    """A compiled model and which of its joints are planned."""

    model: mujoco.MjModel
    planned: tuple[str, ...]
    own: OwnPlaces

    @cached_property
    def moved_by(self) -> list[frozenset[str]]:
        """The planned joints that move each body."""
        model = self.model
        moved: list[frozenset[str]] = [frozenset()]
        for body in range(1, model.nbody):  # parents come first
            first = int(model.body_jntadr[body])
            names = (model.joint(j).name for j in range(first, first + int(model.body_jntnum[body])))
            moved.append(moved[int(model.body_parentid[body])] | {name for name in names if name in self.planned})
        return moved

    def check_joints(self, number: int) -> None:
        """Refuse a joint that follows or holds a planned one."""
        model, own = self.model, self.own
        ids = [int(i) for i in (model.eq_obj1id[number], model.eq_obj2id[number]) if i >= 0]
        names = [model.joint(i).name for i in ids]
        moved = [name for name in names if name in self.planned]
        if not moved:
            return
        if len(names) == 1:
            raise own.error(
                f".model: {own.model}: joint {names[0]} is fixed in its place (an equality); it cannot be planned"
            )
        leader = moved[0] if len(moved) == 1 else names[1]
        follower = next(name for name in names if name != leader)
        raise own.error(
            f".model: {own.model}: joint {follower} follows {leader} (an equality); joints that move with planned "
            f"ones are not supported: {REMEDY}"
        )

    def check_bodies(self, number: int) -> None:
        """Refuse a closed chain that planned joints would break."""
        model, own = self.model, self.own
        bodies = [int(i) for i in (model.eq_obj1id[number], model.eq_obj2id[number])]
        if model.eq_objtype[number] == mujoco.mjtObj.mjOBJ_SITE:
            bodies = [int(model.site_bodyid[i]) for i in bodies]
        if any(model.body_mocapid[body] >= 0 for body in bodies):
            return  # dragged about in a viewer: there it leads the arm, here nothing does
        apart = self._apart(bodies)
        if apart:
            one, two = (model.body(body).name or f"body {body}" for body in bodies)
            raise own.error(
                f".model: {own.model}: {one} is tied to {two} (an equality), and {', '.join(apart)} "
                f"{'moves' if len(apart) == 1 else 'move'} against each other: closed chains are not supported; "
                f"{REMEDY}"
            )

    def check_tendons(self, number: int) -> None:
        """Refuse a tendon of one length that planned joints would stretch."""
        model, own = self.model, self.own
        for tendon in (int(i) for i in (model.eq_obj1id[number], model.eq_obj2id[number]) if i >= 0):
            apart = self._stretched_by(tendon)
            if apart:
                name = model.tendon(tendon).name or tendon
                raise own.error(
                    f".model: {own.model}: tendon {name} couples {', '.join(apart)} (an equality); joints that move "
                    f"with planned ones are not supported: {REMEDY}"
                )

    def limiting_tendons(self) -> list[Warning]:
        """Say which limits of tendons are not kept."""
        model, reported = self.model, []
        for tendon in np.flatnonzero(model.tendon_limited).tolist():
            apart = self._stretched_by(tendon)
            if apart:
                text = (
                    f"{self.own.section}.model: tendon {model.tendon(tendon).name or tendon} limits "
                    f"{', '.join(apart)}: not checked, only the joints' own ranges are kept"
                )
                reported.append(Warning(Code.MODEL_ELEMENT_LEFT_OUT, text))
        return reported

    def _apart(self, bodies: Sequence[int]) -> list[str]:
        """The planned joints that move some of these bodies and not the others."""
        moved = [self.moved_by[body] for body in bodies]
        apart = frozenset().union(*moved) - frozenset.intersection(*moved)
        return [name for name in self.planned if name in apart]

    def _stretched_by(self, tendon: int) -> list[str]:
        """The planned joints on which a tendon's length depends."""
        model, bodies, joints = self.model, [], set()
        first = int(model.tendon_adr[tendon])
        for wrap in range(first, first + int(model.tendon_num[tendon])):
            kind, on = int(model.wrap_type[wrap]), int(model.wrap_objid[wrap])
            if kind == WRAP.mjWRAP_JOINT:
                joints.add(model.joint(on).name)
            elif kind == WRAP.mjWRAP_SITE:
                bodies.append(int(model.site_bodyid[on]))
            elif kind in (WRAP.mjWRAP_SPHERE, WRAP.mjWRAP_CYLINDER):
                bodies.append(int(model.geom_bodyid[on]))
        if bodies:
            return self._apart(bodies)
        return [name for name in self.planned if name in joints]
