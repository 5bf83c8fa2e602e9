"""What the case's section ``table`` asks for, held against the sub-volumes and the positioner.

order = build_order(case, names)          # the order in which its poses build the sub-volumes
check_table(case, scene, names, layers)   # refuses what it asks for in vain
"""

from __future__ import annotations

from collections.abc import Sequence

from ..case.sections import Case
from ..errors import InputError
from ..scene.scene import Scene, table_angles

AXES = ("E1", "E2")
BODY = "BODY"


def build_order(case: Case, names: Sequence[str]) -> list[int]:
    """The order in which the case's poses build the sub-volumes.

    Args:
        case: the case.
        names: of the sub-volumes, as they are sliced.

    Returns:
        Numbers of the sub-volumes; as they are sliced where no poses are given.

    Raises:
        InputError: a sub-volume that is not there, or two that take turns; one line.
    """
    poses = case.table.poses
    if not poses:
        return list(range(len(names)))
    order: list[int] = []
    for k, pose in enumerate(poses):
        where = f"{case.path}: table.poses.{k}.sub_volume"
        if pose.sub_volume not in names:
            raise InputError(f"{where}: there is no {pose.sub_volume}; sub-volumes are {', '.join(names)}")
        at = list(names).index(pose.sub_volume)
        if order and at != order[-1] and at in order:
            raise InputError(
                f"{where}: {pose.sub_volume} comes again after {names[order[-1]]}; layers of a sub-volume are built one"
                " after the other"
            )
        if at not in order:
            order.append(at)
    left = [name for at, name in enumerate(names) if at not in order]
    if left:
        raise InputError(f"{case.path}: table.poses: no pose for {', '.join(left)}")
    if BODY in names and names[order[0]] != BODY:
        raise InputError(f"{case.path}: table.poses: BODY comes first, since the others stand on it")
    return order


def check_table(case: Case, scene: Scene, names: Sequence[str], layers: Sequence[int]) -> None:
    """Refuse what the section ``table`` asks for in vain.

    Args:
        case: the case.
        scene: its cell.
        names: of the sub-volumes.
        layers: how many each has.

    Raises:
        InputError: layers given twice or not at all, angles or axes that the positioner does not have, or a mode that
            it cannot do; one line.
    """
    table = case.table
    has = [name for name, there in zip(AXES, scene.has_axis, strict=True) if there]
    if table.mode != "fixed" and not has:
        raise InputError(
            f"{case.path}: table.mode: {table.mode} needs a positioner with an axis; this one stands still"
        )
    for axis in table.axes or ():
        if axis not in has:
            raise InputError(f"{case.path}: table.axes: this positioner has no {axis}; it has {', '.join(has)}")
    for k, pose in enumerate(table.poses):
        count = layers[list(names).index(pose.sub_volume)]
        if pose.layers is not None and pose.layers[1] >= count:
            raise InputError(
                f"{case.path}: table.poses.{k}.layers: {pose.sub_volume} has layers 0 to {count - 1}, not"
                f" {pose.layers[1]}"
            )
        try:
            table_angles(scene, pose.E1_deg, pose.E2_deg)
        except InputError as error:
            raise InputError(f"{case.path}: table.poses.{k}: {error}") from None
    for name, count in zip(names, layers, strict=True):
        _require_each_once(case, name, count)


def _require_each_once(case: Case, name: str, count: int) -> None:
    """Refuse poses that leave a layer of a sub-volume out, give it twice, or take its layers out of order."""
    runs = [pose.layers or (0, count - 1) for pose in case.table.poses if pose.sub_volume == name]
    following = 0
    for first, last in runs:
        if first < following:
            raise InputError(f"{case.path}: table.poses: layer {first} of {name} comes twice, or after a later one")
        if first > following:
            raise InputError(f"{case.path}: table.poses: no pose for layer {following} of {name}")
        following = last + 1
    if runs and following < count:
        raise InputError(f"{case.path}: table.poses: no pose for layer {following} of {name}")
