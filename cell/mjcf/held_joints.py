"""Joints that are not planned: a track under the arm, a lift, a positioner's third axis, a gripper's fingers.

    held = hold(spec, planned=["A1", ..., "A6"], own=OwnPlaces("robot", "arm.xml", "blade.case.yaml"))
    held.home, held.warnings                 # key home of what is planned; where all others stand

They are taken out of the model before it is composed and their bodies moved to where they stand: the place that the
case states, or else the model's key ``home``, or else the model's own zero. A warning names each of them. Metres
and radians.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from ik.chain import Floats
from slicing import Code, Warning

from ..errors import InputError
from .couplings import check_couplings
from .held_settings import OwnPlaces
from .names import name_bodies

HINGE, SLIDE = mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE
BALL, FREE = mujoco.mjtJoint.mjJNT_BALL, mujoco.mjtJoint.mjJNT_FREE
MM = 1e-3
SAME = 1e-9  # m, and rad
UNNAMED = "joint without a name "
MANY = 4  # joints without a name, said to stand at one place, that are reported together


@dataclass(frozen=True, eq=False)
class HeldJoints:
    """What became of a model's joints.

    Attributes:
        joints: names of all its joints.
        home: places of the planned joints in the model's key ``home``, rad; empty where it has no such key.
        keys: names of the model's keys.
        warnings: where every other joint stands, and which couplings are left out.
        bodies: names of the bodies from which joints were taken, so that they are welded to what carries them.
    """

    joints: tuple[str, ...]
    home: dict[str, float]
    keys: tuple[str, ...]
    warnings: tuple[Warning, ...]
    bodies: tuple[str, ...] = ()


def hold(spec: mujoco.MjSpec, planned: Sequence[str], own: OwnPlaces) -> HeldJoints:
    """Take the joints that are not planned out of a model.

    Args:
        spec: the model before it is attached to a cell, changed in place.
        planned: names of the joints that are planned.
        own: what the case says of the others.

    Returns:
        The planned joints' home and where the others stand.

    Raises:
        InputError: a place is stated of a joint that is planned, not there, or of another kind; a place is outside its
            joint's range; or a coupling would not hold in a motion of the planned joints.
    """
    keys = tuple(key.name for key in spec.keys)
    for k, joint in enumerate(j for j in spec.joints if not j.name):
        joint.name = f"{UNNAMED}{k}"
    free = [joint for joint in spec.joints if joint.name not in planned]
    has = tuple(joint.name for joint in spec.joints)
    _check_stated(spec, planned, own)
    coupled = bool(len(spec.equalities) or len(spec.tendons))
    if not (free or coupled or "home" in keys):
        return HeldJoints(has, {}, keys, ())
    try:
        with warnings.catch_warnings():  # of flexes, which are left out and reported
            warnings.simplefilter("ignore")
            model = spec.copy().compile()
    except ValueError as error:
        raise InputError(f"{own.model}: does not compile: {' '.join(str(error).split())}") from None
    home = model.key("home").qpos if "home" in keys else None
    reported = [*check_couplings(model, planned, own)]
    if free or coupled:
        _drop_what_drives(spec)
    if home is not None:
        reported += _dragged(spec, model, own)
    welded = []
    for body in spec.bodies:
        joints = list(body.joints)
        if all(joint.name in planned for joint in joints):
            continue
        reported += _fold(spec, model, body, planned, own, home)
        if not len(body.joints):
            welded.append(body)
    if any(not body.name for body in welded):
        name_bodies(spec, own.section)
    names = tuple(body.name for body in welded)
    return HeldJoints(has, _places(model, home, planned), keys, tuple(_few(reported)), names)


def _few(reported: list[Warning]) -> Iterator[Warning]:
    """Warnings, those of many joints without a name at one place as one: a cable or a cloth has hundreds."""
    alike: dict[str, list[Warning]] = {}
    for one in reported:
        alike.setdefault(re.sub(rf"{UNNAMED}\d+", UNNAMED, one), []).append(one)
    for text, some in alike.items():
        if len(some) < MANY:
            yield from some
        else:
            text = text.replace(f"{UNNAMED} is not", f"{len(some)} joints without a name are not")
            yield Warning(some[0].code, text.replace("; it stands", "; each stands"))


def check_planned(held: HeldJoints, planned: Sequence[str], own: OwnPlaces) -> None:
    """Refuse planned joints that the model does not have.

    Raises:
        InputError: which, and those it has.
    """
    for name in planned:
        if name not in held.joints:
            what = "" if own.section == "robot" else f"{name} does not turn the table: "
            has = ", ".join(held.joints) or "none"
            raise own.error(f".joints: {what}the model has no joint named {name!r}; it has {has}")


def _drop_what_drives(spec: mujoco.MjSpec) -> None:
    """Take out what names joints and moves nothing here: actuators, sensors, tendons, equalities."""
    for group in (spec.sensors, spec.actuators, spec.equalities, spec.tendons):
        for element in list(group):
            spec.delete(element)


def _places(model: mujoco.MjModel, home: Floats | None, planned: Sequence[str]) -> dict[str, float]:
    if home is None:
        return {}
    at = {model.joint(j).name: int(model.jnt_qposadr[j]) for j in range(model.njnt)}
    return {name: float(home[at[name]]) for name in planned if name in at}


def _check_stated(spec: mujoco.MjSpec, planned: Sequence[str], own: OwnPlaces) -> None:
    known = {joint.name: joint for joint in spec.joints}
    free = [name for name in known if name not in planned]
    for key, stated, kind in (("held_deg", own.held_deg, HINGE), ("held_mm", own.held_mm, SLIDE)):
        for name in stated:
            if name in planned:
                raise own.error(f".{key}: {name} is planned, so its position cannot be given; leave it out")
            if name not in known:
                has = ", ".join(free) or "none"
                raise own.error(f".{key}: {own.model} has no joint {name!r}; the joints that are not planned are {has}")
            if known[name].type != kind:
                other = "held_mm" if known[name].type == SLIDE else "held_deg" if known[name].type == HINGE else "none"
                raise own.error(f".{key}: {name} is not a {'hinge' if kind == HINGE else 'slide'}; its key is {other}")


def _fold(
    spec: mujoco.MjSpec,
    model: mujoco.MjModel,
    body: mujoco.MjsBody,
    planned: Sequence[str],
    own: OwnPlaces,
    home: Floats | None,
) -> list[Warning]:
    """Move a body to where its joints that are not planned hold it, and take them out.

    A body's joints move it one after the other, each in the body's own frame: T J1 J2. With J1 planned and J2 held this
    is T J2 (J2^-1 J1 J2): the held ones go into T, and those before them are turned back by them.
    """
    warnings, moved = [], np.eye(4)
    before: list[mujoco.MjsJoint] = []
    for joint in list(body.joints):
        if joint.name in planned:
            before.append(joint)
            continue
        j = int(model.joint(joint.name).id)
        if model.jnt_type[j] == FREE:
            warnings.append(_freed(spec, model, body, (j, home), own))
        else:
            by, said = _displacement(model, j, own, home)
            moved = moved @ by
            for other in before:
                _turn_back(other, by, own)
            warnings.append(said)
        spec.delete(joint)
    if not np.array_equal(moved, np.eye(4)):
        _put(body, _pose_of(spec, body) @ moved)
    return warnings


def _turn_back(joint: mujoco.MjsJoint, by: Floats, own: OwnPlaces) -> None:
    """Turn a planned joint back by the displacement of a held one that comes after it in the same body."""
    if np.array_equal(by, np.eye(4)):
        return
    if joint.frame is not None:
        raise own.error(
            f".model: {own.model}: {joint.name} shares its body with a joint that is not planned; use two bodies"
        )
    back = np.linalg.inv(by)
    joint.axis = back[:3, :3] @ np.asarray(joint.axis)
    joint.pos = back[:3, :3] @ np.asarray(joint.pos) + back[:3, 3]


def _pose_of(spec: mujoco.MjSpec, body: mujoco.MjsBody) -> Floats:
    quat = resolved(spec, body)
    T = np.eye(4)
    R = np.zeros(9)
    mujoco.mju_quat2Mat(R, quat)
    T[:3, :3], T[:3, 3] = R.reshape(3, 3), body.pos
    return T


def resolved(spec: mujoco.MjSpec, element: mujoco.MjsBody | mujoco.MjsSite) -> Floats:
    """The orientation of a body or site in its frame as a quaternion wxyz, however it was written.

    Args:
        spec: the model it is in.
        element: the body or site; the compiler of its own file says what its angles mean, which of an attached model
            is another.

    Returns:
        (4,), of length 1.
    """
    quat = np.array(element.quat, dtype=float)
    if element.alt.type != mujoco.mjtOrientation.mjORIENTATION_QUAT:
        c = element.compiler
        quat = np.array(spec.resolve_orientation(degree=bool(c.degree), sequence=c.eulerseq, orientation=element.alt))
    unit: Floats = quat / np.linalg.norm(quat)
    return unit


def _put(body: mujoco.MjsBody, T: Floats) -> None:
    quat = np.zeros(4)
    mujoco.mju_mat2Quat(quat, T[:3, :3].ravel())
    body.alt.type = mujoco.mjtOrientation.mjORIENTATION_QUAT
    body.pos, body.quat = T[:3, 3], quat


def _displacement(model: mujoco.MjModel, j: int, own: OwnPlaces, home: Floats | None) -> tuple[Floats, Warning]:
    """How far a joint's place is from where its body is drawn, (4, 4); and that place in words."""
    name, kind, at = model.joint(j).name, model.jnt_type[j], int(model.jnt_qposadr[j])
    T = np.eye(4)
    if kind == BALL:
        quat = np.array([1.0, 0, 0, 0]) if home is None else home[at : at + 4]
        R = np.zeros(9)
        mujoco.mju_quat2Mat(R, quat / np.linalg.norm(quat))
        T[:3, :3] = R.reshape(3, 3)
        T[:3, 3] = model.jnt_pos[j] - T[:3, :3] @ model.jnt_pos[j]
        return T, _warning(own, name, "as its model turns it", home is not None)
    unit, factor = ("deg", np.rad2deg(1.0)) if kind == HINGE else ("mm", 1 / MM)
    stated = (own.held_deg if kind == HINGE else own.held_mm).get(name)
    value = stated / factor if stated is not None else 0.0 if home is None else float(home[at])
    source = "the case" if stated is not None else "key home" if home is not None else ""
    _check_range(model, j, value * factor, (factor, unit), own)
    by = value - float(model.qpos0[at])
    if kind == SLIDE:
        T[:3, 3] = by * model.jnt_axis[j]
    else:
        quat, R = np.zeros(4), np.zeros(9)
        mujoco.mju_axisAngle2Quat(quat, model.jnt_axis[j], by)
        mujoco.mju_quat2Mat(R, quat)
        T[:3, :3] = R.reshape(3, 3)
        T[:3, 3] = model.jnt_pos[j] - T[:3, :3] @ model.jnt_pos[j]
    key = f"{own.section}.held_{unit}"
    return T, _warning(own, name, f"at {round(value * factor, 6):g} {unit}", bool(source), source, key)


def _check_range(model: mujoco.MjModel, j: int, value: float, unit: tuple[float, str], own: OwnPlaces) -> None:
    factor, name = unit
    if not model.jnt_limited[j]:
        return
    low, high = model.jnt_range[j] * factor
    if not low - 1e-6 <= value <= high + 1e-6:
        joint = model.joint(j).name
        raise own.error(
            f": {joint} is not planned and would stand at {value:g} {name}, outside its range {low:g} .. {high:g}; "
            f"set its position: {own.section}.held_{name}: {{{joint}: ..}}"
        )


def _warning(
    own: OwnPlaces, name: str, place: str, known: bool, source: str = "key home", key: str | None = None
) -> Warning:
    named = name if name.startswith(UNNAMED) else f"joint {name}"
    whose = f"{own.section}: {own.model}: {named} is not planned"
    if known:
        text = f"{whose}; it stands {place} ({source})"
    else:
        text = f"{whose}, and the model has no key home; it stands {place}"
    return Warning(Code.JOINT_HELD, text + (f"; {key} sets another position" if key else ""))


def _freed(
    spec: mujoco.MjSpec, model: mujoco.MjModel, body: mujoco.MjsBody, at_home: tuple[int, Floats | None], own: OwnPlaces
) -> Warning:
    """Put a body with a free joint to where the key has it; without a key it stays where it is drawn."""
    j, home = at_home
    if home is not None:
        seven = slice(int(model.jnt_qposadr[j]), int(model.jnt_qposadr[j]) + 7)
        # what a joint places may be the body's inertial frame (alignfree) and no frame of the file's
        _bring(spec, body, _pose(home[seven]) @ np.linalg.inv(_pose(model.qpos0[seven])), own)
    return _warning(
        own,
        model.joint(j).name,
        "where its body is drawn" if home is None else "where the key has it",
        home is not None,
    )


def _dragged(spec: mujoco.MjSpec, model: mujoco.MjModel, own: OwnPlaces) -> Iterator[Warning]:
    """Put bodies that a user drags to where the key home has them, and say so of each that it moves."""
    key = model.key("home")
    for k, body in enumerate(body for body in spec.bodies if body.mocap):
        number = int(np.flatnonzero(model.body_mocapid == k)[0])
        drawn = np.concatenate([model.body_pos[number], model.body_quat[number]])
        at = np.concatenate([key.mpos.reshape(-1, 3)[k], key.mquat.reshape(-1, 4)[k]])
        if not np.allclose(_pose(at), _pose(drawn), atol=SAME):
            _bring(spec, body, _pose(at) @ np.linalg.inv(_pose(drawn)), own)
            name = body.name or "without a name"
            text = f"{own.section}: {own.model}: body {name} (mocap) stands where the key home has it"
            yield Warning(Code.JOINT_HELD, text)


def _bring(spec: mujoco.MjSpec, body: mujoco.MjsBody, by: Floats, own: OwnPlaces) -> None:
    """Displace a body of the worldbody."""
    if np.allclose(by, np.eye(4), atol=SAME):
        return
    if body.frame is not None:
        raise own.error(
            f".model: {own.model}: the key home moves a free body inside a frame; remove the frame from the MJCF"
        )
    _put(body, by @ _pose_of(spec, body))


def _pose(seven: Floats) -> Floats:
    """A place and a quaternion, (7,), as a (4, 4)."""
    T, R = np.eye(4), np.zeros(9)
    mujoco.mju_quat2Mat(R, seven[3:] / np.linalg.norm(seven[3:]))
    T[:3, :3], T[:3, 3] = R.reshape(3, 3), seven[:3]
    return T
