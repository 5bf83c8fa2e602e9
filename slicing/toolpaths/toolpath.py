"""A toolpath: beads in the order of deposition, as targets, with the metal that they leave.

    path = Toolpath(targets, parameters, laid)              # of beads that were laid here
    path = read_toolpath("theirs.csv", width_mm=5.0)       # of another slicer's
    shape = toolpath_shape(path, body_mesh=None, profile=((20.0, 0.0), (20.0, 60.0)))

It is all that a cell takes from slicing: a job is made of it, whatever made the path. Part frame, mm.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import groupby

from ..beads.lay import LaidSubVolume
from ..deposits.part_shape import PartShape, beyond_borders, body_shape, built_hulls, part_shape
from ..layers.layer import SlicedSubVolume
from ..mesh.solid import Floats, Mesh, PartError
from ..parameters import BeadParameters
from ..targets.targets import Targets
from .bead_hulls import bead_hulls, first_deposits, hulls_mesh


@dataclass(frozen=True, eq=False)
class Toolpath:
    """Beads in the order of deposition.

    Attributes:
        targets: the beads.
        beads: what they were laid with; of another slicer's its width alone counts.
        laid: the sub-volumes' beads where they were laid here; empty where the path is another slicer's.
        metal_below: whether the metal lies below its targets and not above them; of another slicer's path.
        warnings: one line each.
        source: the file it was read from; empty where it was laid here.
    """

    targets: Targets
    beads: BeadParameters = field(default_factory=BeadParameters)
    laid: tuple[LaidSubVolume, ...] = ()
    metal_below: bool = False
    warnings: tuple[str, ...] = ()
    source: str = ""

    @property
    def sliced(self) -> tuple[SlicedSubVolume, ...]:
        """The sliced sub-volumes, where they were sliced here."""
        return tuple(one.sliced for one in self.laid)

    @property
    def z_mm(self) -> tuple[float, float]:
        """Least and greatest height of its targets, mm."""
        z = self.targets.position[:, 2]
        return float(z.min()), float(z.max())


def toolpath_shape(
    path: Toolpath,
    body_mesh: Mesh | None,
    profile: Sequence[tuple[float, float]] | None,
    axis_xy_mm: tuple[float, float] = (0.0, 0.0),
    built: Sequence[tuple[SlicedSubVolume, Floats]] = (),
) -> PartShape:
    """The part as shapes that collide: the body, and the metal of the path, layer by layer.

    Args:
        path: the toolpath.
        body_mesh: the body's own shape, to look at; its convex hull collides where there is no profile.
        profile: the body as (r, z) points about its axis, mm, lowest first.
        axis_xy_mm: where that axis is.
        built: sub-volumes that are there from the start, each with how far its beads reach beyond the layers' borders.

    Returns:
        The shapes.

    Raises:
        ValueError: neither body_mesh nor profile is given, and the body is not among what is printed.
    """
    if path.laid:
        beyond = [beyond_borders(one, path.beads) for one in path.laid]
        return part_shape(path.sliced, body_mesh, profile, beyond, built)
    visual, hulls = body_shape(axis_xy_mm, body_mesh, profile)
    visual |= {f"{s.name}_visual": s.mesh for s, _ in built}
    hulls |= built_hulls(built)
    metal = dict(bead_hulls(path.targets, path.beads.width_mm, below=path.metal_below))
    for name, some in groupby(metal, key=lambda hull: hull.split("/")[2]):
        visual[f"{name}_visual"] = hulls_mesh(name, [metal[hull] for hull in some])
    *first, count = first_deposits(path.targets)
    return PartShape(visual, {**hulls, **metal}, tuple(first), count)


def require_order(targets: Targets, rows: Sequence[int], source: str) -> None:
    """Refuse a path whose layers do not follow one another: what is laid earlier has to have a lower number.

    Args:
        targets: of the path.
        rows: line of the file that each target stands in, (n,).
        source: the file, for the message.

    Raises:
        PartError: a layer, or a sub-volume, is gone back to.
    """
    first = first_deposits(targets)
    last = -1
    for k in range(len(targets)):
        number = first[int(targets.sub_volume_index[k])] + int(targets.layer[k])
        if number < last:
            raise PartError(
                f"{source}: line {rows[k]}: layer {int(targets.layer[k])} of "
                f"{targets.sub_volume[int(targets.sub_volume_index[k])]} comes after a later one; beads stand in the "
                "order of deposition, layer by layer and sub-volume by sub-volume (leave the column sub_volume out "
                "and number the layers as they are laid)"
            )
        last = number
