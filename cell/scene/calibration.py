"""A positioner as it was measured: its axes and its flange where the controller has them.

Use:

    place, quat = calibrated(assembly, spec, place, quat)      # the model changed; where it stands now

A controller keeps a positioner as a chain of frames, X Y Z in mm and A B C in degrees (R = Rz(A) Ry(B) Rx(C)):
root · axis 1 · Rz(E1) · axis 2 · Rz(E2) · flange. Real axes are neither square nor crossing. The model's shapes keep
their form: the whole device is moved to where its first axis was measured, the bodies on the second axis are moved with
that axis, and the table's frame is set to the measured flange. Each axis turns about the z of its frame.

The zero directions of the frames are arbitrary: only the line of each axis and the pose of the next frame at E = 0 have
a meaning. The model's shapes are turned about and moved along the axes to where they deviate least.

Source: KUKA's machine data $ET1_TA1KR, $ET1_TA2A1, $ET1_TFLA3, multiplied as RoboDK's turntable calibration does.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import mujoco
import numpy as np

from ik.chain import Floats
from slicing import Code, Warning

from ..case.cell_sections import Calibration, Positioner
from ..errors import InputError
from ..rigid import inverse, pose
from ..units import METRES_PER_MM
from .composition import CellAssembly

PARALLEL = 0.1  # sine of an angle between two lines below which their directions say nothing of the turn about one
FAR_MM, FAR_DEG = 20.0, 2.0  # from the model: a measured frame that is further off is more likely a slip


@dataclass(frozen=True, eq=False)
class _PositionerFrames:
    """A positioner as frames, each in the one before, (4, 4), m; the first in the world.

    Attributes:
        axes: of the first axis, and of the second where there is one.
        flange: the table.
    """

    axes: tuple[Floats, ...]
    flange: Floats

    def at_zero(self) -> list[Floats]:
        """The frames in the world at E1 = E2 = 0: those of the axes, then the flange."""
        out = [self.axes[0]]
        for T in (*self.axes[1:], self.flange):
            out.append(out[-1] @ T)
        return out


def frame_from_mm_deg(xyzabc: tuple[float, ...]) -> Floats:
    """A controller's frame, X Y Z in mm and A B C in degrees, as (4, 4), m."""
    a, b, c = np.deg2rad(xyzabc[3:])
    ca, sa, cb, sb, cc, sc = np.cos(a), np.sin(a), np.cos(b), np.sin(b), np.cos(c), np.sin(c)
    R = np.array(
        [
            [ca * cb, ca * sb * sc - sa * cc, ca * sb * cc + sa * sc],
            [sa * cb, sa * sb * sc + ca * cc, sa * sb * cc - ca * sc],
            [-sb, cb * sc, cb * cc],
        ]
    )
    return pose(np.array(xyzabc[:3]) * METRES_PER_MM, R)


def calibrated(assembly: CellAssembly, spec: mujoco.MjSpec, place: Floats, quat: Floats) -> tuple[Floats, Floats]:
    """Bring a positioner's model to where it was measured.

    Args:
        assembly: the cell so far; its case holds the measured frames, and its warnings get what deviates much.
        spec: the positioner's model, which is changed.
        place: where the case puts its origin, (3,), m.
        quat: and how it is turned.

    Returns:
        Where its origin comes to be.

    Raises:
        InputError: the frames do not fit the positioner's axes; one line.
    """
    given = assembly.case.positioner
    if given.calibration is None:
        return place, quat
    T_place = _pose_of(place, quat)
    joints = _in_order(assembly, given)
    drawn, bodies = _drawn(spec, joints, given.table, T_place)
    measured = _alike(_measured(given.calibration, drawn), drawn)
    before, after = drawn.at_zero(), measured.at_zero()
    moved = [new @ inverse(old) for new, old in zip(after, before, strict=True)]
    assembly.warnings += _deviations(measured, drawn, float(T_place[:3, 2] @ moved[0][:3, :3] @ T_place[:3, 2]))
    # the whole device goes with its first axis, what the second carries with that, the table's frame with the flange
    _move(spec, "site", given.table, inverse(T_place) @ inverse(moved[-2]) @ moved[-1] @ T_place)
    if len(joints) == 2:
        _move(spec, "body", bodies[1], inverse(T_place) @ inverse(moved[0]) @ moved[1] @ T_place)
    T = moved[0] @ T_place
    turned = np.zeros(4)
    mujoco.mju_mat2Quat(turned, T[:3, :3].ravel())
    return T[:3, 3], turned


def _in_order(assembly: CellAssembly, given: Positioner) -> list[str]:
    calibration = given.calibration
    assert calibration is not None
    if not given.joints:
        raise InputError(f"{assembly.case.path}: positioner.calibration: the table has no axes; leave it out")
    if (calibration.axis_2_mm_deg is not None) != (len(given.joints) == 2):
        needed = "axis_2_mm_deg is needed" if len(given.joints) == 2 else "leave axis_2_mm_deg out"
        raise InputError(
            f"{assembly.case.path}: positioner.calibration: the positioner has {len(given.joints)} axis(es): {needed}"
        )
    return list(given.joints)


def _pose_of(position: Floats, quat: Floats) -> Floats:
    R = np.zeros(9)
    mujoco.mju_quat2Mat(R, np.asarray(quat, dtype=float))
    return pose(np.asarray(position, dtype=float), R)


def _drawn(spec: mujoco.MjSpec, joints: list[str], table: str, T_place: Floats) -> tuple[_PositionerFrames, list[str]]:
    """The model as a chain, its axes' x where it may be, and the names of the bodies that its axes move."""
    model = spec.copy().compile()
    data = mujoco.MjData(model)
    data.qpos[:] = 0.0
    mujoco.mj_kinematics(model, data)
    frames, bodies = [], []
    for name in joints:
        joint = model.joint(name).id
        frames.append(T_place @ pose(data.xanchor[joint], _about(data.xaxis[joint])))
        bodies.append(model.body(model.jnt_bodyid[joint]).name)
    site = model.site(table).id
    frames.append(T_place @ pose(data.site_xpos[site], data.site_xmat[site]))
    steps = [frames[0], *(inverse(a) @ b for a, b in pairwise(frames))]
    return _PositionerFrames(tuple(steps[:-1]), steps[-1]), bodies


def _about(axis: Floats) -> Floats:
    """A rotation whose z is an axis."""
    x = np.eye(3)[int(np.argmin(np.abs(axis)))]
    x = x - axis * (axis @ x)
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(axis, x), axis], axis=1)


def _measured(given: Calibration, drawn: _PositionerFrames) -> _PositionerFrames:
    first = frame_from_mm_deg(given.root_mm_deg) @ frame_from_mm_deg(given.axis_1_mm_deg)
    second = () if given.axis_2_mm_deg is None else (frame_from_mm_deg(given.axis_2_mm_deg),)
    flange = drawn.flange if given.flange_mm_deg is None else frame_from_mm_deg(given.flange_mm_deg)
    return _PositionerFrames((first, *second), flange)


def _alike(measured: _PositionerFrames, drawn: _PositionerFrames) -> _PositionerFrames:
    """The measured chain with frames turned about and moved along their axes to be most like the model's.

    Neither changes where anything is at any E1 and E2.
    """
    after = [*measured.axes[1:], measured.flange]
    axes = [measured.axes[0]]
    for k, like in enumerate([*drawn.axes[1:], drawn.flange]):
        own = _screw(after[k], like, last=k == len(after) - 1)
        axes[k] = axes[k] @ own
        after[k] = inverse(own) @ after[k]
        if k < len(after) - 1:
            axes.append(after[k])
    return _PositionerFrames(tuple(axes), after[-1])


def _screw(T: Floats, like: Floats, *, last: bool) -> Floats:
    """The turn about z and the way along z after which a pose that follows is most like another, (4, 4)."""
    out = np.eye(4)
    turn = 0.0
    # what the next axis points along says how far it is turned; along this one, its place; of the flange, its x
    for one, other in ((T[:3, 2], like[:3, 2]), *([(T[:3, 0], like[:3, 0])] if last else [(T[:3, 3], like[:3, 3])])):
        size = min(float(np.linalg.norm(one)), float(np.linalg.norm(other)), 1.0)
        if min(np.hypot(*one[:2]), np.hypot(*other[:2])) > PARALLEL * size > 0.0:
            turn = float(np.arctan2(one[1], one[0]) - np.arctan2(other[1], other[0]))
            break
    out[:2, :2] = [[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]
    out[2, 3] = _height(T, last=last) - _height(like, last=last)
    return out


def _height(T: Floats, *, last: bool) -> float:
    """Where along z the next axis passes nearest, or the flange is."""
    z = T[:3, 2]
    across = float(np.hypot(*z[:2]))
    if last or across <= PARALLEL:
        return float(T[2, 3])
    # the point of the next axis that is nearest to z: its way along itself
    way = -float(T[:2, 3] @ z[:2]) / across**2
    return float(T[2, 3] + way * z[2])


def _deviations(measured: _PositionerFrames, drawn: _PositionerFrames, upright: float) -> list[Warning]:
    """What is so far from the model that the frames may be wrong; upright: cosine of how far the device leans."""
    found = []
    lean = float(np.rad2deg(np.arccos(np.clip(upright, -1.0, 1.0))))
    if lean > FAR_DEG:
        found.append(f"the device leans by {lean:.1f} deg")
    pairs = [*zip(("axis_2_mm_deg",), measured.axes[1:], drawn.axes[1:], strict=False)]
    pairs.append(("flange_mm_deg", measured.flange, drawn.flange))
    for key, one, other in pairs:
        off = inverse(other) @ one
        away = float(np.linalg.norm(off[:3, 3])) / METRES_PER_MM
        angle = float(np.rad2deg(np.arccos(np.clip((np.trace(off[:3, :3]) - 1) / 2, -1.0, 1.0))))
        if away > FAR_MM or angle > FAR_DEG:
            found.append(f"{key} is {away:.1f} mm and {angle:.1f} deg off the model's")
    if not found:
        return []
    text = (
        f"positioner.calibration: {'; '.join(found)}: the shapes of the model may not stand where the real ones do "
        "(each axis turns about the z of its frame; the frames are those at E = 0)"
    )
    return [Warning(Code.CALIBRATION_FAR, text)]


def _move(spec: mujoco.MjSpec, kind: str, name: str, shift: Floats) -> None:
    """Move a body or a site of a model by a rigid motion of the model's own frame, its joints at 0."""
    model = spec.copy().compile()
    data = mujoco.MjData(model)
    data.qpos[:] = 0.0
    mujoco.mj_kinematics(model, data)
    if kind == "body":
        found = model.body(name).id
        parent = int(model.body_parentid[found])
        own = _pose_of(model.body_pos[found], model.body_quat[found])
        # a joint's reference is part of how a body stands in its parent, not of where its axis is
        T_parent = pose(data.xpos[parent], data.xmat[parent])
        local = inverse(T_parent) @ shift @ T_parent @ own
    else:
        found = model.site(name).id
        parent = int(model.site_bodyid[found])
        T_parent = pose(data.xpos[parent], data.xmat[parent])
        local = inverse(T_parent) @ shift @ T_parent @ _pose_of(model.site_pos[found], model.site_quat[found])
    element = getattr(spec, kind)(name)
    local = inverse(_frame_about(spec, kind, name)) @ local
    quat = np.zeros(4)
    mujoco.mju_mat2Quat(quat, np.ascontiguousarray(local[:3, :3]).ravel())
    element.pos, element.quat = local[:3, 3], quat
    element.alt.type = mujoco.mjtOrientation.mjORIENTATION_QUAT


def _frame_about(spec: mujoco.MjSpec, kind: str, name: str) -> Floats:
    """The frame that an element is given in: where it would be without a place of its own."""
    bare = spec.copy()
    element = getattr(bare, kind)(name)
    element.pos, element.quat = np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0])
    element.alt.type = mujoco.mjtOrientation.mjORIENTATION_QUAT
    model = bare.compile()
    if kind == "body":
        found = model.body(name).id
        return _pose_of(model.body_pos[found], model.body_quat[found])
    found = model.site(name).id
    return _pose_of(model.site_pos[found], model.site_quat[found])
