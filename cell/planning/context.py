"""What the searches for a motion share: the arm, the targets, the cell at a table pose, and limits and margins.

    context = Context.of(job, table)            # E1, E2 in rad
    context.describe(clearances, k)             # a collision as a failure

Metres, radians, seconds.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ik.chain import Floats
from ik.roll import RollWindow
from ik.singularity import SingularityLimits
from ik.solver import Solver

from ..arrays import Ints
from ..collision.arm_poses import joint_of_shapes
from ..collision.checker import Checker
from ..collision.clearances import CLEARANCE_REACH, Clearances
from ..collision.proofs.reach_radii import all_radii, radii, tool_radii
from ..collision.table_clearances import with_table_axes
from ..collision.wire import wire_checker
from ..failure import AT_TARGET, CollisionPlace, Contact, Failure, FailurePlace, Kind
from ..job.job import Job, speeds
from ..scene.placement import PlacedTargets, place_on_moving_table, place_targets
from ..scene.scene import Scene
from ..scene.table_kinematics import TableKinematics
from ..units import METRES_PER_MM


@dataclass(frozen=True)
class Steps:
    """How far samples of a motion are apart at most; along beads less where ``BeadTolerance`` asks for it.

    Attributes:
        position: along a bead, m.
        angle: along a bead, rad, of the wire's direction and the roll, and of every joint by its angles at the targets.
        travel_angle: between beads, rad, of every joint.
    """

    position: float = 16e-3
    angle: float = np.deg2rad(2.0)
    travel_angle: float = np.deg2rad(1.0)


@dataclass(frozen=True)
class BeadTolerance:
    """How close to the bead straight joint motion is to run.

    Attributes:
        bead_distance: of the TCP from the bead at most, m.
        wire_angle: of the wire from the deposition direction at most, rad.
        halvings: of steps at most; each quarters what they are off.
    """

    bead_distance: float = 0.03e-3
    wire_angle: float = np.deg2rad(0.03)
    halvings: int = 6


CLOSE = BeadTolerance()


def settings_of(job: Job) -> Settings:
    """The plan's settings, as the case has them."""
    case = job.case
    return Settings(
        clearance=case.checks.clearance_mm * METRES_PER_MM,
        speed=speeds(job),
        retract=case.process.retract_mm * METRES_PER_MM,
        roll_step=float(np.deg2rad(case.ik.roll_step_deg)),
        least_share=case.process.least_speed_share,
        travel_attempts=case.process.travel_attempts,
        every_target=case.checks.every_target,
    )


# m beyond the clearance asked for that is proved: what a motion file's digits and finer samples may take
KEPT_CLEARANCE = 2e-6
# times as many rolls where a bead does not come out whole, and again where every target is free by itself
FINER_ROLLS = 3
FIRST_OF_WRIST = 3  # the joints before it carry what a wrist's two configurations have in common
LEAST_REACH = 1e-4  # m: with no clearance asked for, touching still has to be seen


@dataclass(frozen=True)
class Settings:
    """Limits, margins and speeds of a plan.

    Attributes:
        clearance: least distance of everything from everything, m.
        speed: deposition speed from every target to the next, (n,), m/s.
        retract: way out along the normal before travelling, m.
        roll_step: distance of the roll's samples, rad.
        least_share: of the speed, to be held over every stretch of a bead.
        steps: density of the checks.
        travel_attempts: configurations tried for a travel that the simple ways do not make.
        every_target: whether all of a part that cannot be built is checked, whatever that costs.
    """

    clearance: float
    speed: Floats
    retract: float
    roll_step: float
    least_share: float = 1.0
    steps: Steps = field(default_factory=Steps)
    travel_attempts: int = 3000
    every_target: bool = False

    @property
    def kept(self) -> float:
        """Clearance that is proved to be kept all along, m."""
        return self.clearance + KEPT_CLEARANCE


@dataclass(frozen=True, eq=False)
class Span:
    """Targets that are planned together, and the configurations before and after them.

    Attributes:
        first: the first of them.
        stop: one past the last.
        start: where the arm comes from, (j,), rad; None where that is not known.
        end: where it goes to, (j,), rad; None where that is not known.
    """

    first: int
    stop: int
    start: Floats | None
    end: Floats | None

    @classmethod
    def whole(cls, job: Job) -> Span:
        """The whole part, from home and back."""
        return cls(0, len(job.targets), job.scene.start, job.scene.start)


@dataclass(frozen=True, eq=False)
class Context:
    """What every search needs.

    Attributes:
        solver: the arm.
        placed: the targets.
        deposits_before: deposits already laid when a target is welded, (n,).
        laid: deposits laid once its layer is done, (n,).
        window: allowed roll.
        limits: singularity margins to keep.
        checker: collision detection at the table pose, distances known far out.
        screen: the same, distances known out to twice the clearance: what only has to be passed costs less.
        settings: what to keep to.
        radius: from ``cell.collision.proofs.reach_radii.radii``, (j,), m; of all axes, (j + 2,), where the table moves.
        span: what of the part is planned.
    """

    solver: Solver
    placed: PlacedTargets
    deposits_before: Ints
    laid: Ints
    window: RollWindow
    limits: SingularityLimits
    checker: Checker
    screen: Checker
    settings: Settings
    radius: Floats
    span: Span

    @classmethod
    def of(
        cls, job: Job, table: tuple[float, float], settings: Settings | None = None, span: Span | None = None
    ) -> Context:
        """The context of a job at a table pose.

        Args:
            job: from ``cell.job.job.prepare``.
            table: E1, E2, rad; from ``cell.scene.scene.table_angles``.
            settings: what to keep to; the case's where left out.
            span: what of the part is planned; all of it, from home and back, where left out.

        Returns:
            The context.

        Raises:
            InputError: a target has no normal or is not finite.
        """
        settings = settings_of(job) if settings is None else settings
        placed = place_targets(job.targets, job.scene.T_base_part(*table))
        checkers = _checkers(job.scene, table, settings)
        return cls._made(job, placed, checkers, settings, radii(job.scene), Span.whole(job) if span is None else span)

    @classmethod
    def along(cls, job: Job, tables: Floats, settings: Settings | None = None) -> Context:
        """The context of a job whose table moves along the beads.

        Args:
            job: from ``cell.job.job.prepare``.
            tables: E1, E2 at each target, (n, 2), rad.
            settings: what to keep to; the case's where left out.

        Returns:
            The context: its checkers take configurations with E1 and E2 behind the arm's joints.

        Raises:
            InputError: a target has no normal or is not finite.
        """
        settings = settings_of(job) if settings is None else settings
        first = (float(tables[0, 0]), float(tables[0, 1]))
        placed = place_on_moving_table(job.targets, TableKinematics.of(job.scene), tables)
        checkers = _checkers(with_table_axes(job.scene), first, settings)
        return cls._made(job, placed, checkers, settings, all_radii(job.scene), Span.whole(job))

    @classmethod
    def _made(
        cls,
        job: Job,
        placed: PlacedTargets,
        checkers: tuple[Checker, Checker],
        settings: Settings,
        radius: Floats,
        span: Span,
    ) -> Context:
        """A context with what it takes from the job alone."""
        return cls(
            solver=job.solver,
            placed=placed,
            deposits_before=job.deposits_before,
            laid=job.laid,
            window=job.window,
            limits=job.singularity_limits,
            checker=checkers[0],
            screen=checkers[1],
            settings=settings,
            radius=radius,
            span=span,
        )

    @property
    def begun(self) -> int:
        """Deposits laid before the first target of the span."""
        return 0 if self.span.first == 0 else int(self.laid[self.span.first - 1])

    @property
    def done(self) -> int:
        """Deposits laid after the last target of the span."""
        whole = self.span.stop == len(self.laid)
        return self.checker.scene.n_deposits if whole else int(self.laid[self.span.stop - 1])

    @cached_property
    def tool_radius(self) -> Floats:
        """How far from the wire's line each geom that moves with the TCP reaches, (ngeom,), m; infinite for others."""
        return tool_radii(self.checker.scene)

    @cached_property
    def wrist_geom(self) -> NDArray[np.bool_]:
        """Whether a geom is of a link that A4 or A5 carries and A6 does not, (ngeom,)."""
        scene = self.checker.scene
        out = np.zeros(len(scene.arm_geom), dtype=bool)
        links = np.flatnonzero(scene.arm_geom & ~scene.tool_geom & scene.contact_bits.any(axis=0))
        out[links] = joint_of_shapes(scene, links) >= FIRST_OF_WRIST
        return out

    @property
    def asked(self) -> int:
        """Number of configurations queried so far."""
        return self.checker.asked.count + self.screen.asked.count

    @property
    def work(self) -> float:
        """The same with what was found there counted as well: what it has cost."""
        return self.checker.asked.work + self.screen.asked.work

    @cached_property
    def wire(self) -> Checker | None:
        """Collision detection of the wire and the part alone, None where the tool's wire is not modelled."""
        return wire_checker(self.checker)

    def without(self, deposits: Collection[int]) -> Context:
        """The same context without some deposits."""
        scene, table = self.checker.scene, self.checker.table
        checker = Checker(scene, table, self.checker.reach, deposits)
        screen = Checker(scene, table, self.screen.reach, deposits, beside=checker)
        checker.asked, screen.asked = self.checker.asked, self.screen.asked  # one count of all that is asked
        return replace(self, checker=checker, screen=screen)

    def describe(
        self,
        found: Clearances,
        k: int,
        place: FailurePlace = AT_TARGET,
        seen: CollisionPlace = CollisionPlace.AT_SAMPLE,
    ) -> Failure:
        """A collision as a failure.

        Args:
            found: clearances.
            k: the one that is too small.
            place: where it is.
            seen: how it was found.
        """
        scene = self.checker.scene
        pair = tuple(scene.geom_name(int(g)) for g in found.pair[k] if g >= 0)
        xyz = tuple(round(float(v) / METRES_PER_MM, 2) for v in found.position[k])
        return Failure(
            Kind.COLLISION,
            measure=round(float(found.distance[k]) / METRES_PER_MM, 3),
            limit=round(self.settings.clearance / METRES_PER_MM, 3),
            contact=Contact(pair, xyz, seen),
            place=place,
        )


def _checkers(scene: Scene, table: tuple[float, float], settings: Settings) -> tuple[Checker, Checker]:
    """Collision detection with distances known far out, and with those known as far as what only has to be passed."""
    checker = Checker(scene, table, max(CLEARANCE_REACH, 2 * settings.clearance))
    return checker, Checker(scene, table, max(2 * settings.clearance, LEAST_REACH), beside=checker)
