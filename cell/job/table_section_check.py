"""What the case's section ``table`` asks for, compared with the sub-volumes and the positioner.

    runs = build_runs(case, names, layers)    # the order in which its poses build the layers
    check_table(case, scene)                  # refuses what the positioner cannot do

Angles in degrees, as in the case.
"""

from __future__ import annotations

from collections.abc import Sequence

from ..case.sections import Case
from ..errors import InputError
from ..scene.scene import Scene, table_angles
from .build_order import LayerRun

AXES = ("E1", "E2")
BODY = "BODY"


def build_runs(case: Case, names: Sequence[str], layers: Sequence[int]) -> list[LayerRun] | None:
    """The order in which the case's poses build the layers.

    Args:
        case: the case.
        names: of the sub-volumes, as they are sliced.
        layers: how many each has.

    Returns:
        One run of layers a pose; None where no poses are given.

    Raises:
        InputError: a sub-volume or layers that are not there, layers given twice, out of order or not at all; one line.
    """
    poses = case.table.poses
    if not poses:
        return None
    runs: list[LayerRun] = []
    for k, pose in enumerate(poses):
        where = f"{case.path}: table.poses.{k}"
        if pose.sub_volume not in names:
            raise InputError(
                f"{where}.sub_volume: there is no {pose.sub_volume}; the sub-volumes are {', '.join(names)}"
            )
        at = list(names).index(pose.sub_volume)
        first, last = pose.layers or (0, layers[at] - 1)
        if last >= layers[at]:
            raise InputError(f"{where}.layers: {pose.sub_volume} has layers 0 to {layers[at] - 1}, not {last}")
        runs.append((at, first, last))
    for at, name in enumerate(names):
        _require_each_once(case, name, [run[1:] for run in runs if run[0] == at], layers[at])
    if BODY in names and any(names[at] != BODY for at, _, _ in runs[: [run[0] for run in runs].index(0) + 1]):
        raise InputError(f"{case.path}: table.poses: BODY must come first, since the others stand on it")
    return runs


def check_table(case: Case, scene: Scene) -> None:
    """Refuse what the section ``table`` asks for and the positioner cannot do.

    Args:
        case: the case.
        scene: its cell.

    Raises:
        InputError: angles or axes that the positioner does not have, or a mode that it cannot do; one line.
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
        try:
            table_angles(scene, pose.E1_deg, pose.E2_deg)
        except InputError as error:
            raise InputError(f"{case.path}: table.poses.{k}: {error}") from None


def _require_each_once(case: Case, name: str, runs: Sequence[tuple[int, int]], count: int) -> None:
    """Refuse poses that leave a layer of a sub-volume out, give it twice, or take its layers out of order."""
    if not runs:
        raise InputError(f"{case.path}: table.poses: no pose for {name}")
    following = 0
    for first, last in runs:
        if first < following:
            raise InputError(f"{case.path}: table.poses: layer {first} of {name} comes twice, or after a later one")
        if first > following:
            raise InputError(f"{case.path}: table.poses: no pose for layer {following} of {name}")
        following = last + 1
    if following < count:
        raise InputError(f"{case.path}: table.poses: no pose for layer {following} of {name}")
