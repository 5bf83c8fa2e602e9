"""The order in which layers are built, and numbers of targets and beads that do not depend on it.

    targets, order = in_build_order(targets, layers, [(0, 0, 7), (1, 0, 7), (0, 8, 20), (1, 8, 20)])
    order.target[17]                                 # the number that files give to target 17
    order.deposit[1][8]                              # the number of the deposit that is layer 8 of sub-volume 1

Inside, targets, beads and deposits are numbered as they are built. In files targets and beads have the numbers of the
sub-volumes one after the other, as they were sliced, so that these do not depend on the order.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from slicing import PartShape, Targets

from ..arrays import Ints

LayerRun = tuple[int, int, int]  # a sub-volume's number, the first and the last of its layers


@dataclass(frozen=True, eq=False)
class BuildOrder:
    """An order of layers.

    Attributes:
        runs: layers of sub-volumes, in the order in which they are built.
        target: number in files of every target, (n,).
        bead: number in files of every bead, (beads,).
        deposit: of each sub-volume the numbers of its layers' deposits, (layers,).
    """

    runs: tuple[LayerRun, ...]
    target: Ints
    bead: Ints
    deposit: tuple[Ints, ...]

    def targets_of_file(self, numbers: Ints) -> Ints:
        """Targets as they are built, of numbers in a file; what no target has stays as it is."""
        return _back(self.target, numbers)

    def beads_of_file(self, numbers: Ints) -> Ints:
        """Beads as they are built, of numbers in a file; what no bead has stays as it is."""
        return _back(self.bead, numbers)


def _back(number: Ints, asked: Ints) -> Ints:
    inside = (asked >= 0) & (asked < len(number))
    out = asked.copy()
    out[inside] = np.argsort(number)[asked[inside]]
    return out


def in_build_order(targets: Targets, layers: Sequence[int], runs: Sequence[LayerRun]) -> tuple[Targets, BuildOrder]:
    """Targets in the order in which layers are built.

    Args:
        targets: as they were sampled, sub-volume after sub-volume.
        layers: how many each sub-volume has.
        runs: every layer once, each sub-volume's in their order.

    Returns:
        The targets, with beads and targets numbered anew, and what they are called in files.
    """
    deposit = [np.zeros(count, dtype=np.int64) for count in layers]
    number = 0
    for sub_volume, first, last in runs:
        deposit[sub_volume][first : last + 1] = number + np.arange(last + 1 - first)
        number += last + 1 - first
    when = np.zeros(len(targets), dtype=np.int64)
    for k, numbers in enumerate(deposit):
        mine = targets.sub_volume_index == k
        when[mine] = numbers[targets.layer[mine]]
    index = np.argsort(when, kind="stable")
    path = targets.bead[index]
    first_of = np.flatnonzero(np.diff(path, prepend=-1))
    beads = path[first_of]
    names = ("sub_volume_index", "layer", "position", "normal", "tangent", "thickness_mm", "speed_mm_s")
    moved = replace(
        targets,
        bead=np.repeat(np.arange(len(beads)), np.diff(np.append(first_of, len(path)))),
        closed=targets.closed[beads],
        **{name: getattr(targets, name)[index] for name in names},
    )
    return moved, BuildOrder(tuple(runs), index, beads, tuple(deposit))


def ordered_shape(shape: PartShape, deposit: Sequence[Ints]) -> PartShape:
    """The part with its deposits numbered as they are built.

    Args:
        shape: with its deposits numbered sub-volume after sub-volume.
        deposit: of each sub-volume the numbers of its layers' deposits.
    """
    number = np.concatenate(deposit)
    hulls = {}
    for name, points in shape.hulls.items():
        kind, *rest = name.split("/")
        if kind == "deposit":
            name = "/".join([kind, str(number[int(rest[0])]), *rest[1:]])
        hulls[name] = points
    return replace(shape, hulls=hulls)


def layers_of(shape: PartShape) -> tuple[int, ...]:
    """Number of layers of each sub-volume."""
    ends = (*shape.first_deposit[1:], shape.n_deposits)
    return tuple(end - first for first, end in zip(shape.first_deposit, ends, strict=True))
