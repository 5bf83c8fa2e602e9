"""From a case to a job: the part sliced, its targets sampled, and the cell composed.

    job = prepare(load_case("blade.case.yaml"))
    job.sliced, job.targets, job.scene

Everything that does not depend on the table's angles is computed here once; ``cell.verdict.check`` and
``cell.pose_sweep.sweep`` use it for every pose.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from ik.chain import Chain, Floats
from ik.roll import RollWindow
from ik.singularity import SingularityLimits
from ik.solver import Solver
from ik.spherical_wrist import TOLERANCE, misfits
from slicing import (
    NO_ENDS,
    WRONG_LAYER,
    BeadParameters,
    BeadSpeed,
    Body,
    Code,
    LaidSubVolume,
    PartError,
    PartShape,
    SlicedSubVolume,
    SlicingParameters,
    Targets,
    Toolpath,
    Warning,
    beyond_borders,
    body_ends,
    lay_beads,
    overhangs,
    sample_beads,
    slice_sub_volume,
    toolpath_shape,
    typed,
)

from ..arrays import Ints
from ..case.files import require_cell_files, require_part_files
from ..case.sections import Case, Sampling
from ..errors import InputError
from ..failure import Failure
from ..processes.worker_pool import pool
from ..progress import phase
from ..scene.compose import compose
from ..scene.drives import Drives, drives
from ..scene.placement import place_targets
from ..scene.scene import Scene, case_table
from ..units import METRES_PER_MM
from .bead_support import (
    BeadOverhang,
    Below,
    bead_overhang_warnings,
    bead_thickness_warnings,
    sunk_bead_warnings,
    unsupported_beads,
)
from .beside_body import pieces_beside
from .build_order import BuildOrder, in_build_order, layers_of, ordered_shape
from .built_solids import rest_of_built
from .part_input import PartInput, read_body, read_part
from .table_section_check import build_runs, check_table
from .table_winding import for_moving_table
from .wire_in_metal import Metal, wires_in_metal

if TYPE_CHECKING:
    from slicing import Evidence

LARGE_PART = 1500  # targets from which a part is cut into chunks of whole beads that are planned side by side
LEAST_CHUNK = 750  # targets that a chunk has at least
WORTH_A_START = 10_000  # targets from which processes that begin with nothing save more than half a second, their start


def speeds(job: Job) -> Floats:
    """Deposition speed from every target to the next, (n,), m/s: the target's own where it has one."""
    own = getattr(job.targets, "speed_mm_s", None)
    if own is None:
        return np.full(len(job.targets), job.case.process.deposition_speed_mm_s * METRES_PER_MM)
    return np.asarray(own, dtype=float) * METRES_PER_MM


@dataclass(frozen=True, eq=False)
class Job:
    """A case with its layers, targets and cell.

    Attributes:
        case: the case.
        sliced: the sliced sub-volumes; empty for another slicer's toolpath.
        shape: the part as shapes that collide.
        targets: the targets in the order of deposition, part frame, mm.
        scene: the composed cell.
        warnings: one line each.
        beads: the sub-volumes' beads, with their metal and what overhangs; empty where they are not known.
        T_part_input: (4, 4) rigid motion from the meshes' frame to the part frame, mm.
        evidence: how the body of a part in one mesh was found.
        order: the order of the layers, if it is not one sub-volume after the other; else None.
        given: the toolpath that it was prepared with instead of the case's own part.
        overhanging_beads: of another slicer's beads those that overhang.
    """

    case: Case
    sliced: tuple[SlicedSubVolume, ...]
    shape: PartShape
    targets: Targets
    scene: Scene
    warnings: tuple[str, ...]
    beads: tuple[LaidSubVolume, ...] = ()
    T_part_input: Floats = field(default_factory=lambda: np.eye(4))
    evidence: Evidence | None = None
    order: BuildOrder | None = None
    given: Toolpath | None = None
    overhanging_beads: tuple[BeadOverhang, ...] = ()

    def __repr__(self) -> str:
        return f"<Job {self.case.title!r}: {sum(self.layers)} layers, {len(self.targets)} targets>"

    @cached_property
    def solver(self) -> Solver:
        """The solver of the arm's configurations, as set in the case."""
        try:
            solver = Solver.for_chain(self.scene.chain, self.case.ik.solver)
        except ValueError as error:
            raise InputError(f"{self.case.path}: ik.solver: {error}") from None
        return Solver(solver.chain, solver.form, solver.geometry, self.case.ik.seeds)

    @cached_property
    def drives(self) -> Drives:
        """Largest speeds and accelerations of the axes."""
        return drives(self.scene)

    @property
    def chain(self) -> Chain:
        """The arm with its tool."""
        return self.scene.chain

    @property
    def Ts_base_target(self) -> Floats:
        """Targets at roll 0 at the case's own table pose, (n, 4, 4), m, base frame."""
        table = case_table(self.case, self.scene)
        return place_targets(self.targets, self.scene.T_base_part(*table)).Ts_base_target

    @property
    def layers(self) -> tuple[int, ...]:
        """Number of layers of each sub-volume."""
        return layers_of(self.shape)

    @property
    def window(self) -> RollWindow:
        """Allowed roll."""
        return roll_window(self.case)

    @property
    def singularity_limits(self) -> SingularityLimits:
        """Margins to keep."""
        c = self.case.checks
        return SingularityLimits(
            np.deg2rad(c.wrist_deg), np.deg2rad(c.elbow_deg), c.shoulder_mm * METRES_PER_MM, c.sigma
        )

    @property
    def laid(self) -> Ints:
        """Deposits laid once a target's layer is done, (n,)."""
        t = self.targets
        first = np.array(self.shape.first_deposit)[t.sub_volume_index]
        return np.asarray(np.concatenate(self.deposits)[first + t.layer] + 1)

    @property
    def deposits(self) -> tuple[Ints, ...]:
        """Of each sub-volume the numbers of its layers' deposits, (layers,): they count up as they are laid."""
        if self.order is not None:
            return self.order.deposit
        return tuple(
            first + np.arange(count) for first, count in zip(self.shape.first_deposit, self.layers, strict=True)
        )

    @cached_property
    def deposits_before(self) -> Ints:
        """Deposits already laid when a target is welded, (n,).

        The layer being laid does not count, unless a bead of it lies there already, or the bead itself may be in the
        way: what it lays on one side of a groove is there while it lays the other.
        """
        layer, path = self.laid - 1, self.targets.bead
        first_bead = np.full(self.shape.n_deposits, np.iinfo(np.int64).max)
        np.minimum.at(first_bead, layer, path)
        faces_itself = np.array([one.faces_itself for one in self.sliced] or [False] * len(self.targets.sub_volume))
        return layer + ((path > first_bead[layer]) | faces_itself[self.targets.sub_volume_index])

    @property
    def laid_beside_the_wire(self) -> Ints:
        """Deposits that the wire may run through when a target is welded, (n,): they are numbered below this.

        Of layers that are sliced here the beads lie beside one another. Another slicer's may lie anyhow: once a layer
        has a bead, all of it counts.
        """
        return self.laid - 1 if self.sliced else self.deposits_before

    @property
    def layers_lie_below(self) -> bool:
        """Whether a sub-volume's lower layers lie below all of its beads, so that no wire of it runs through them.

        Another slicer's layers may lie anyhow, and offsets of a profile with a groove face one another.
        """
        return bool(self.sliced) and all(one.parameters.strategy != "revolved" for one in self.sliced)

    @cached_property
    def wires_in_metal(self) -> dict[int, Failure]:
        """Targets at which the wire would run through metal between nozzle and bead, wherever the table stands."""
        metal = Metal.of(self.case, self.shape, self.targets, self.layers_lie_below)
        return wires_in_metal(self.scene, metal, self.targets, self.laid_beside_the_wire, self.laid - 1)


def margin_warnings(solver: Solver) -> tuple[Warning, ...]:
    """Which singularity margins do not count for an arm, and why."""
    chain, near = solver.chain, solver.geometry is not None
    if near and (solver.form is not None or not misfits(chain)):
        return ()
    if chain.n != 6:
        why = f"has {chain.n} joints"
    else:
        found = [f"{text} {amount:.4g} {unit}" for text, amount, unit in misfits(chain)]
        why = "does not have A1 across A2, A2 along A3 and a spherical wrist "
        why += f"({'; '.join(found) or 'a link has length 0'}; allowed are {1e3 * TOLERANCE:g} mm and "
        why += f"{np.rad2deg(TOLERANCE):.2g} deg)"
    if near:
        text = f"robot.model: the arm {why}: its margins are those of the nearest arm that does"
        return (
            Warning(
                Code.MARGINS_APPROXIMATE, f"{text}; configurations are searched numerically: the search may miss some"
            ),
        )
    return (
        Warning(
            Code.MARGINS_NOT_COUNTED,
            f"robot.model: the arm {why}: checks.sigma counts instead of checks.wrist_deg, elbow_deg and shoulder_mm; "
            "configurations are searched numerically: the search may miss some",
        ),
    )


def roll_window(case: Case) -> RollWindow:
    """The roll that a case allows."""
    if isinstance(case.roll, str):
        return RollWindow.free()
    if case.roll.fixed_deg is not None:
        return RollWindow.fixed(float(np.deg2rad(case.roll.fixed_deg)))
    low, high = np.deg2rad(case.roll.range_deg or (0.0, 0.0))
    return RollWindow(float(low), float(high))


@phase("slicing")
def slice_part(case: Case, part: PartInput) -> tuple[SlicedSubVolume, ...]:
    """Slice the sub-volumes of a part.

    Args:
        case: says how.
        part: from ``cell.job.part_input.read_part``.

    Returns:
        The sliced sub-volumes, in their order; before them the body, where it is printed as well.

    Raises:
        InputError: a sub-volume cannot be sliced; one line.
    """
    first: tuple[SlicedSubVolume, ...] = ()
    try:
        if part.body_solid is not None and part.round_body is not None:
            from slicing import slice_body

            first = (slice_body(part.body_solid, part.round_body, case.slicing),)
        return first + tuple(
            slice_sub_volume(mesh, body, case.slicing, heights_of_body_ends(part, body))
            for mesh, body in zip(part.meshes, part.bodies, strict=True)
        )
    except PartError as error:
        meshes = part.meshes if part.body_mesh is None else (*part.meshes, part.body_mesh)
        hints = "".join(f"; {line}" for mesh in meshes for line in mesh.warnings)
        raise InputError(f"{error}{hints}") from None


def heights_of_body_ends(part: PartInput, body: Body) -> tuple[float, float]:
    """Where the body that is there ends along the part's axis, as a sub-volume sees it.

    Args:
        part: from ``cell.job.part_input.read_part``.
        body: what the sub-volume stands on.

    Returns:
        Lower and upper end, mm; infinite where nothing says so.
    """
    if part.profile is not None:
        return body_ends(part.profile, body)
    if part.body_mesh is not None:
        low, high = part.body_mesh.bounds[:, 2].tolist()
        return float(low), float(high)
    return NO_ENDS


def sample_part(
    case: Case, sliced: tuple[SlicedSubVolume, ...]
) -> tuple[tuple[LaidSubVolume, ...], Targets, tuple[str, ...]]:
    """Lay and sample the beads of sliced sub-volumes.

    Args:
        case: says how.
        sliced: from :func:`slice_part`.

    Returns:
        The beads, their targets, and warnings, one line each.

    Raises:
        InputError: a layer cannot be laid as asked; one line.
    """
    process = case.process
    laid = lay_part(case, sliced)
    try:
        speed = BeadSpeed(process.deposition_speed_mm_s, tuple(process.speed_by_thickness or ()))
        targets = sample_beads(laid, case.sampling.chord_tolerance_mm, case.sampling.min_segment_mm, speed)
    except PartError as error:
        raise InputError(f"{case.path}: {error}") from None
    return laid, targets, tuple(line for one in laid for line in one.warnings)


def lay_part(case: Case, sliced: tuple[SlicedSubVolume, ...]) -> tuple[LaidSubVolume, ...]:
    """Lay the beads of sliced sub-volumes.

    Raises:
        InputError: a layer cannot be laid as asked; one line.
    """
    try:
        return lay_beads(sliced, case.beads, overhang_mm=case.checks.overhang_mm)
    except PartError as error:
        raise InputError(f"{case.path}: {error}") from None


def _require_right_layers(case: Case, sliced: tuple[SlicedSubVolume, ...]) -> None:
    """Refuse layers that their own check calls wrong: no verdict is given on them."""
    wrong = [line for one in sliced for line in map(typed, one.warnings) if line.code in WRONG_LAYER]
    if wrong:
        more = f" (and {len(wrong) - 1} more such lines)" if len(wrong) > 1 else ""
        raise InputError(
            f"{case.path}: {wrong[0]}{more}; a wrong layer gets no verdict [{wrong[0].code}]; rbam slice shows it"
        )


def _built(case: Case, part: PartInput) -> list[tuple[SlicedSubVolume, Floats]]:
    """Sub-volumes that are there from the start, sliced, and how far their beads reach beyond their borders, mm."""
    if not part.built:
        return []
    meshes, bodies = zip(*part.built, strict=True)
    sliced = slice_part(case, replace(part, meshes=meshes, bodies=bodies, body_solid=None))
    parameters = replace(case.beads, seams=())
    return [(one.sliced, beyond_borders(one, parameters)) for one in lay_beads(sliced, parameters)]


def prepare(case: Case, toolpath: Toolpath | None = None) -> Job:
    """Slice the part, sample its targets and compose the cell.

    Args:
        case: the case.
        toolpath: beads (`slicing.lay`, `slicing.read_toolpath`) that replace the case's sub-volumes; only the body of
            the case's part is used then, and the sub-volumes of part.built, which are there from the start.

    Returns:
        The job.

    Raises:
        InputError: it is no case, something in it cannot be used, or a layer is not that of its solid (`layer_area`,
            `layer_length`, `layer_loops`); one line.
    """
    if not isinstance(case, Case):
        raise InputError(f"prepare takes a case, not a {type(case).__name__}; cell.load_case reads one")
    require_cell_files(case)
    path = _read_path(case) if toolpath is None and case.part.toolpath is not None else toolpath
    if path is None:
        part, path = _laid_here(case)
        built, said = _built(case, part), path.warnings
    else:
        _require_right_layers(case, path.sliced)
        path = _with_overhang_limit(case, path)
        part = read_body(case, path.z_mm, path.targets.sub_volume)
        built = _built(case, part)
        said = (*part.warnings, *path.warnings)
    if len(path.targets) == 0:
        raise InputError(
            f"{case.path}: part: the sub-volumes give no targets at h_layer_mm {case.slicing.h_layer_mm:g}"
        )
    if len(path.targets) >= max(LARGE_PART, WORTH_A_START):
        pool().begin(len(path.targets) // LEAST_CHUNK, "cell.part_chunks.chunked_run")
    axis = (0.0, 0.0) if part.round_body is None else part.round_body.axis_xy_mm
    shape = toolpath_shape(path, part.body_mesh, part.profile, axis, built)
    if part.body_solid is None:
        shape = replace(shape, hulls=shape.hulls | pieces_beside(part.beside_profile))
    shape = replace(shape, hulls=shape.hulls | rest_of_built([s.mesh for s, _ in built], shape.hulls))
    targets, order, layers = path.targets, None, layers_of(shape)
    runs = build_runs(case, targets.sub_volume, layers)
    if runs is not None:
        targets, order = in_build_order(targets, layers, runs)
        shape = ordered_shape(shape, order.deposit)
    scene = compose(case, shape)
    check_table(case, scene)
    targets, split = for_moving_table(case, scene, targets)
    warnings = (*said, *scene.warnings, *split)
    job = Job(case, path.sliced, shape, targets, scene, warnings, path.laid, part.T_part_input, part.evidence, order)
    job = replace(job, warnings=(*job.warnings, *margin_warnings(job.solver)), given=toolpath)
    if not path.laid:
        job = _with_overhanging_beads(job, path)
    _ = job.drives  # computed here so that an error in them comes before any search
    return job


def _unused_keys(case: Case) -> list[Warning]:
    """A warning of keys that a case sets and that another slicer's beads make no use of."""
    sections: list[tuple[str, object, object, tuple[str, ...]]] = [
        ("slicing", case.slicing, SlicingParameters(), ("h_layer_mm", "h_min_mm", "h_max_mm")),
        ("beads", case.beads, BeadParameters(), ("width_mm",)),
        ("sampling", case.sampling, Sampling(), ()),
    ]
    unused = [
        f"{name}.{key}"
        for name, given, default, used in sections
        for key in vars(default)
        if key not in used and getattr(given, key) != getattr(default, key)
    ]
    unused += ["process.speed_by_thickness"] if case.process.speed_by_thickness else []
    if not unused:
        return []
    return [
        Warning(Code.TOOLPATH_KEYS, f"part.toolpath: its beads are laid as they are; unused keys: {', '.join(unused)}")
    ]


@phase("what lies below the beads")
def _with_overhanging_beads(job: Job, path: Toolpath) -> Job:
    """A job of another slicer's beads with what of them lies over nothing, and warnings of it."""
    limit = job.case.checks.overhang_mm
    below = Below(job.scene, path, job.targets, job.laid)
    found = unsupported_beads(below, limit)
    thickness = bead_thickness_warnings(job.targets, job.case.slicing.h_min_mm, job.case.slicing.h_max_mm)
    about_beads = (*thickness, *sunk_bead_warnings(below), *bead_overhang_warnings(found, limit))
    said = (*job.warnings, *_unused_keys(job.case), *about_beads)
    return replace(job, overhanging_beads=found, warnings=said)


def _laid_here(case: Case) -> tuple[PartInput, Toolpath]:
    """A case's part sliced and laid."""
    part = read_part(case)
    sliced = slice_part(case, part)
    _require_right_layers(case, sliced)
    laid, targets, reported = sample_part(case, sliced)
    said = (*part.warnings, *(line for one in sliced for line in one.warnings), *reported)
    return part, Toolpath(targets, case.beads, laid, warnings=said)


def _with_overhang_limit(case: Case, path: Toolpath) -> Toolpath:
    """A toolpath of layers sliced here whose overhangs are those beyond the case's limit, where it sets one."""
    limit = case.checks.overhang_mm
    if limit is None:
        return path
    return replace(path, laid=tuple(replace(one, overhangs=overhangs(one.sliced, limit)) for one in path.laid))


@phase("reading the toolpath")
def _read_path(case: Case) -> Toolpath:
    """A case's toolpath of another slicer."""
    from slicing import read_toolpath

    require_part_files(case)
    process = case.process
    try:
        return read_toolpath(
            case.path_of(str(case.part.toolpath)),
            width_mm=case.beads.width_mm,
            thickness_mm=case.slicing.h_layer_mm,
            speed_mm_s=process.deposition_speed_mm_s,
            normal=case.part.toolpath_normal,
            metal=case.part.toolpath_metal,
        )
    except PartError as error:
        raise InputError(str(error)) from None
