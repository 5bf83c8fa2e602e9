"""Motions of KRL: where they go, given where the arm is.

Use:

    move(state, motion, where, scope)         # adds one move to the state, or refuses it

What a point leaves out stays as it is. A relative motion, or one that leaves X Y Z A B C out, after a motion of axes
needs to know where that has put the TCP: ``Controller.forward`` says it, or else it is refused.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cache
from typing import Any

import numpy as np

from ..orientation import frames_of_poses, pose_of, turns_the_longer_way
from ..program import MoveKind
from .expressions import Variable
from .lexing import quoted, refuse
from .line_forms import CIRCLES, SPLINE_CIRCLES
from .setting import check_modes
from .state import NAN, ControllerState, Destination
from .statements import MotionStatement
from .values.evaluation import CARTESIAN, TIED, Scope, UnknownValue, angles, evaluate, integer, is_tied, number, shown
from .values.number_kinds import deviation_of

EXTERNAL = ("E1", "E2", "E3", "E4", "E5", "E6")
WHERE_IT_IS = (Variable("$AXIS_ACT"), Variable("$POS_ACT"))  # a motion to there moves nothing
MOST_DEVIATION = 0.1  # mm or degrees by which a computed point may be off
FURTHEST, MOST_TURN = 1e6, 1e5  # mm, degrees: beyond them nothing is a robot's
STATUSES, TURNS = 64, 4096  # values that S and T can have


def move(state: ControllerState, motion: MotionStatement, where: tuple[int, int], scope: Scope) -> None:
    """Add a motion.

    Args:
        state: what holds, which is changed.
        motion: as it is written.
        where: file and line.
        scope: variables.

    Raises:
        InputError: it has no tool, no base or no end that is known, or names what the arm has not.
    """
    word = motion.word
    if motion.points[0] in WHERE_IT_IS and len(motion.points) == 1 and not word.endswith("_REL"):
        evaluate(motion.points[0], scope)  # which stops the advance run
        return
    points = [_point(point, word, state, scope) for point in motion.points]
    end = points[-1]
    if not end:
        raise refuse(scope.where, "goes to a point without a component")
    external = _external(state, end, word, scope)
    _doubt(state, end)
    begins = _begins(state, points[0], word, scope) if word in SPLINE_CIRCLES else None
    if word.endswith("_REL"):
        to = _relative(state, motion, points, scope)
    elif word in ("PTP", "SPTP"):
        to = _axes(state, end, scope)
    else:
        to = _cartesian(state, motion, points, scope)
    kind = MoveKind.CIRCULAR if word in CIRCLES else MoveKind.LINEAR
    if word.startswith(("PTP", "SPTP")):
        kind = MoveKind.AXES
    if word in SPLINE_CIRCLES:
        _check_way_round(begins, to, scope)
    if kind != MoveKind.AXES:
        circular = ("$CIRC_TYPE",) if kind == MoveKind.CIRCULAR else ()
        check_modes(state, ("$IPO_MODE", "$ORI_TYPE", *circular), scope)
    elif to.pose is not None:
        check_modes(state, ("$IPO_MODE",), scope)
    if to.pose is not None:
        _need_frames(state, scope)
    state.add(kind, to, motion.blends, external, where)
    if to.angle == to.angle:
        state.pose = None  # it ends at an angle of its circle, not at its point


def _begins(state: ControllerState, auxiliary: dict[str, float], word: str, scope: Scope) -> list[float] | None:
    """Where the circle begins whose auxiliary point is oriented; None where it is not known, or need not be."""
    given = {"A", "B", "C"} & auxiliary.keys()
    if 0 < len(given) < 3 and not word.endswith("_REL"):
        raise refuse(scope.where, "SCIRC: its auxiliary point gives some of A B C and not the others")
    _need_frames(state, scope)
    return position_now(state, scope) if given else None


def _check_way_round(begins: list[float] | None, to: Destination, scope: Scope) -> None:
    """Refuse a circle of the spline kind on which the tool may turn the longer way round.

    Of the two ways from one orientation to the other such a circle takes the one that its auxiliary point's orientation
    is nearer to ($CIRC_MODE.AUX_PT.ORI = #CONSIDER, what holds where nothing is set); only the shorter one is run here.

    Raises:
        InputError: that orientation is nearer to the longer way, or it is not known where the circle begins.
    """
    assert to.pose is not None
    assert to.via is not None
    if any(math.isnan(x) for x in to.via[3:]):
        return
    if begins is None:
        raise refuse(scope.where, "SCIRC: the orientation where it begins is not known; lead it there by a LIN")
    start, via, end = (frames_of_poses(np.array(pose))[:3, :3] for pose in (begins, to.via, to.pose))
    if turns_the_longer_way(start, via, end):
        raise refuse(
            scope.where,
            "SCIRC: its auxiliary point is oriented as on the longer way round from its beginning to its end, and only "
            "the shorter one is supported; divide the circle",
        )


def position_now(state: ControllerState, scope: Scope) -> list[float] | None:
    """X Y Z A B C of the TCP in the base that holds, m and rad; None where it is not known."""
    forward = state.controller.forward
    if state.pose is None and state.joints is not None and forward is not None:
        _need_frames(state, scope)
        assert state.tool is not None
        assert state.base is not None
        pose = forward(np.array(state.joints), np.array(state.external), state.tool, state.base)
        state.pose, state.angles_read = [float(x) for x in pose], True
    return state.pose


def _need_frames(state: ControllerState, scope: Scope) -> None:
    if state.tool is None:
        raise refuse(scope.where, "the motion has no tool: no $TOOL holds (BAS (#INITMOV,..) takes it away)")
    if state.base is None:
        raise refuse(scope.where, "the motion has no base: no $BASE holds (BAS (#INITMOV,..) takes it away)")
    if state.base.coupled and state.external_active is False:
        raise refuse(
            scope.where,
            "the base is on the table (EK), and $ACT_EX_AX is 0, which makes no external axes active: whether the base "
            "moves with the table then is not known",
        )
    machine, table = state.base.machine, state.controller.machine
    if state.base.coupled and machine is not None and machine != table:
        raise refuse(
            scope.where,
            f"the base is on MACHINE_DEF[{machine}], and the case's table is MACHINE_DEF[{table}] (controller.machine)",
        )


def _point(point: Any, word: str, state: ControllerState, scope: Scope) -> dict[str, float]:
    """The numbers of a point, by component."""
    value = point if isinstance(point, dict) else evaluate(point, scope)
    if isinstance(value, UnknownValue):
        raise refuse(scope.where, f"goes to an unknown value: {value.why}")
    if not isinstance(value, Mapping) or any(isinstance(name, tuple) for name in value):
        raise refuse(scope.where, f"goes to a point or to axes, not to {shown(value)}")
    axes = state.controller.axes
    known, names = _known(axes)
    if not word.startswith(("PTP", "SPTP")):  # which needs no S and T
        value = {name: given for name, given in value.items() if name not in ("S", "T") or not _unknown(given)}
    found = {name: given for name, given in value.items() if name not in ("A", "B", "C")} | angles(value, scope)
    for name, given in found.items():
        if name in known:
            _in_reach(name, number(given, scope, angle=name in ("A", "B", "C")), scope)
        else:
            raise refuse(
                scope.where,
                f"{quoted(name)} is not an axis of this arm, which has A1 .. A{axes}, X Y Z A B C S T, E1 .. E6",
            )
    if not names.isdisjoint(value) and any(name in value for name in CARTESIAN):
        raise refuse(scope.where, "goes to a point and to axes at once")
    return {name: found[name] for name in value}


def _unknown(value: Any) -> bool:
    return isinstance(value, UnknownValue)


@cache
def _known(axes: int) -> tuple[frozenset[str], frozenset[str]]:
    """Components that a point can have, and those of them that are axes of the arm."""
    names = frozenset(f"A{i}" for i in range(1, axes + 1))
    return names | {*CARTESIAN, *EXTERNAL, "S", "T"}, names


def _in_reach(name: str, value: float, scope: Scope) -> None:
    if abs(value) > (FURTHEST if name in "XYZ" else MOST_TURN):
        unit = "mm" if name in "XYZ" else "degrees"
        raise refuse(
            scope.where, f"{name} {value:g}: at most {FURTHEST if unit == 'mm' else MOST_TURN:g} {unit} is allowed"
        )
    if deviation_of(value) > MOST_DEVIATION:
        raise refuse(
            scope.where, f"{name} {value:g} may be off by {deviation_of(value):.2g}: the controller has seven digits"
        )


def _doubt(state: ControllerState, end: dict[str, float]) -> None:
    """Note what a point leaves out, and a table whose axes nothing has made count."""
    for axis, name in enumerate(EXTERNAL[: len(state.external)]):
        if name not in end and not math.isnan(state.external[axis]):
            state.doubt(f"{name} is left out of the point: it stays where it is")
    to_pose = any(name in end for name in CARTESIAN)
    if to_pose and state.base is not None and state.base.coupled and state.external_active is None:
        state.doubt("the base is coupled by EK, and $ACT_EX_AX is not set: the controller may ignore the table's axes")


def _external(state: ControllerState, end: dict[str, float], word: str, scope: Scope) -> list[float]:
    external = list(state.external)
    relative = word.endswith("_REL")
    for axis, name in enumerate(EXTERNAL):
        if name not in end:
            continue
        if axis >= len(external):
            if end[name] != 0:
                raise refuse(scope.where, f"{name} {end[name]:g}: the cell has E1 and E2 alone")
            continue
        value = math.radians(end[name])
        if relative and math.isnan(external[axis]):
            raise refuse(scope.where, f"{word} adds to {name}, which has no value yet")
        external[axis] = external[axis] + value if relative else value
    return external


def _axes(state: ControllerState, end: dict[str, float], scope: Scope) -> Destination:
    """Where a PTP goes."""
    if any(name in end for name in CARTESIAN):
        status, turn = (integer(end[name], scope) if name in end else -1 for name in ("S", "T"))
        if not (-1 <= status < STATUSES and -1 <= turn < TURNS):
            raise refuse(scope.where, f"S is 0 to {STATUSES - 1} and T 0 to {TURNS - 1}, not {status} and {turn}")
        return Destination(pose=_pose(state, end, scope), status=status, turn=turn)
    return Destination(joints=_joints(state, end, scope))


def _joints(state: ControllerState, end: dict[str, float], scope: Scope) -> list[float]:
    axes = state.controller.axes
    joints = list(state.joints) if state.joints is not None else [NAN] * axes
    for axis in range(axes):
        name = f"A{axis + 1}"
        if name in end:
            joints[axis] = math.radians(end[name])
        elif math.isnan(joints[axis]):
            raise refuse(scope.where, f"gives no {name}, and its earlier value is not known")
    return joints


def _pose(state: ControllerState, end: dict[str, float], scope: Scope) -> list[float]:
    missing = [name for name in CARTESIAN if name not in end]
    held = position_now(state, scope) if missing else None
    if missing and held is None:
        raise refuse(scope.where, f"gives no {' '.join(missing)}, and the earlier position of the TCP is not known")
    pose = list(held) if held is not None else [NAN] * 6
    angles_left_out = {"A", "B", "C"} & set(missing)
    if 0 < len(angles_left_out) < 3 and state.angles_read and held is not None and is_tied(np.degrees(held[3:])):
        raise refuse(scope.where, f"leaves {' '.join(sorted(angles_left_out))} out where it is not known: {TIED}")
    for i, name in enumerate(CARTESIAN):
        if name in end:
            pose[i] = end[name] * 1e-3 if i < 3 else math.radians(end[name])
    return pose


def _cartesian(
    state: ControllerState, motion: MotionStatement, points: list[dict[str, float]], scope: Scope
) -> Destination:
    """Where a LIN or CIRC goes."""
    end = points[-1]
    if not _known(state.controller.axes)[1].isdisjoint(end):
        raise refuse(scope.where, f"{motion.word} goes to axes; here it needs a point with X Y Z A B C")
    pose = _pose(state, end, scope)
    if motion.word not in CIRCLES:
        return Destination(pose=pose, read=state.angles_read and not any(name in end for name in "ABC"))
    via = [points[0].get(name, NAN) for name in CARTESIAN]
    if any(math.isnan(x) for x in via[:3]):
        raise refuse(scope.where, "the auxiliary point of a circle needs X Y Z")
    via = [*(1e-3 * x for x in via[:3]), *map(math.radians, via[3:])]
    if any(math.isnan(x) for x in via[3:]):
        via[3:] = [NAN] * 3
    angle = NAN if motion.angle is None else math.radians(number(evaluate(motion.angle, scope), scope))
    return Destination(pose=pose, via=via, angle=angle)


def _relative(
    state: ControllerState, motion: MotionStatement, points: list[dict[str, float]], scope: Scope
) -> Destination:
    """Where a relative motion goes."""
    end, word = points[-1], motion.word
    if word in ("PTP_REL", "SPTP_REL") and not any(name in end for name in CARTESIAN):
        if state.joints is None:
            raise refuse(scope.where, f"{word} adds to the position of the axes, which is not known")
        return Destination(joints=[x + math.radians(end.get(f"A{i + 1}", 0.0)) for i, x in enumerate(state.joints)])
    if any(name[0] == "A" and len(name) > 1 for name in end):
        raise refuse(scope.where, f"{word} goes to axes; here it needs a step in X Y Z")
    held = position_now(state, scope)
    if held is None:
        raise refuse(scope.where, f"{word} adds to the position of the TCP, which is not known")
    if any(name in end for name in ("S", "T")):
        raise refuse(scope.where, f"{word} with S or T is not supported")
    pose = _stepped(held, end, motion, scope)
    if word not in CIRCLES:
        return Destination(pose=pose, read=motion.frame == "#TOOL" or state.angles_read)
    # both points of a circle count from where it begins
    via = _stepped(held, points[0], motion, scope)
    angle = NAN if motion.angle is None else math.radians(number(evaluate(motion.angle, scope), scope))
    via[3:] = via[3:] if motion.frame == "#TOOL" and word in SPLINE_CIRCLES else [NAN] * 3
    return Destination(pose=pose, via=via, angle=angle, read=motion.frame == "#TOOL" or state.angles_read)


def _stepped(held: list[float], by: dict[str, float], motion: MotionStatement, scope: Scope) -> list[float]:
    """X Y Z A B C, m and rad, of a pose and a step from it."""
    step = [by.get(name, 0.0) for name in CARTESIAN]
    if motion.frame == "#TOOL":
        T = frames_of_poses(np.array(held)) @ frames_of_poses(
            np.array([*(1e-3 * x for x in step[:3]), *map(math.radians, step[3:])])
        )
        return [float(x) for x in pose_of(T)]
    if any(step[3:]):
        raise refuse(scope.where, f"{motion.word} with a turn about the base's axes is not supported; use #TOOL")
    return [*(x + 1e-3 * dx for x, dx in zip(held[:3], step[:3], strict=True)), *held[3:]]
