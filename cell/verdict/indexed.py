"""The verdict on a part that is built group by group, each at a pose of the table of its own.

    result = check_indexed(prepare(case))
    result.feasible, result.poses

A group is a sub-volume or a run of its layers. Its pose is the case's, or searched: of the poses that suit it those
that pass the screening are checked whole, best first, until one holds. The order of sub-volumes whose poses are
searched is the one in which the table turns least; where what was built before locks the torch out, the group that it
locks out comes first. Between two groups the arm stands clear while the table turns. Radians and metres.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial

import numpy as np

from ik.chain import Floats
from ik.singularity import KINDS

from ..collision.proofs.between_samples import least_between_samples
from ..failure import Failure
from ..job.build_order import LayerRun
from ..job.job import Job
from ..job.reordered import in_order
from ..job.table_groups import TableGroup, table_groups
from ..part_chunks.least_values import LeastValue
from ..planning.assemble import with_home_travels
from ..planning.context import Context
from ..planning.travels.home import HomeTravels
from ..processes.worker_pool import processor_time
from ..progress import Progress, counted_progress, phase
from ..scene.placement import PlacedTargets
from ..scene.scene import table_angles
from ..table_poses.indexed_motion import joined_motion
from ..table_poses.suited_poses import SuitedPose, upright_band
from ..table_poses.table_turn import Angles, TableTurn, TurnSearch, nearest_turn, turn_time
from ..table_poses.waiting_pose import CheckedTravel, TurnEnd, nearer_place
from .check import SpanVerdict, failed, off_upright
from .group_verdicts import GroupTrial, GroupVerdicts, place_of
from .order_search import OrderSearch
from .result import BuiltAt, Result, TargetVerdict

CHECKS = 4  # poses of a group that are checked whole
ORDERS = 4  # orders of layers that are tried
A1_TURNS = np.deg2rad([0.0, 60.0, -60.0, 120.0, -120.0, 180.0])  # of A1 from rest: places to stand in without a home


@dataclass(frozen=True, eq=False)
class _Built:
    """What became of a group.

    Attributes:
        trial: which, at its pose.
        context: what it was planned with.
        found: the verdict.
        pose: E1, E2 as asked for or found, deg.
        turn: the table's way there; None where it stands there already, or has none.
    """

    trial: GroupTrial
    context: Context
    found: SpanVerdict
    pose: Angles
    turn: TableTurn | None

    @property
    def group(self) -> TableGroup:
        """Which."""
        return self.trial.group


@phase("checking", spins=False)
def check_indexed(job: Job, progress: Progress | None = None) -> Result:
    """Check a part whose groups are built at poses of their own.

    Args:
        job: from ``cell.job.job.prepare``; its case's ``table.poses`` are taken, or searched where there are none.
        progress: called with how far it is.

    Returns:
        The verdict; its job has the sub-volumes in the order in which they are built.
    """
    begun = processor_time()
    if job.case.table.poses:
        return replace(_Build(job, progress).result(), seconds=processor_time() - begun)
    search = OrderSearch(job)
    best: Result | None = None
    tried: list[list[LayerRun]] = []
    # what is learned may leave no order but one that is known
    while len(tried) < ORDERS and search.runs() not in tried:
        tried.append(search.runs())
        result = _Build(in_order(job, tried[-1]), progress, search.suited).result()
        lost = result.infeasible + result.not_looked_at
        if best is None or lost < best.infeasible + best.not_looked_at:
            best = result
        if result.feasible or not search.learned(result):
            break
    assert best is not None
    return replace(best, seconds=processor_time() - begun)


class _Build:
    """The groups of a job, built in the order in which they stand."""

    def __init__(
        self, job: Job, progress: Progress | None, suited: Mapping[str, Sequence[SuitedPose]] | None = None
    ) -> None:
        self.job, self.progress, self.suited = job, progress, suited or {}
        self.groups = table_groups(job)
        self.turns = TurnSearch(job)
        self.verdicts = GroupVerdicts(job, progress)
        self.seconds = cache(partial(turn_time, job))
        self.built: list[_Built] = []
        self.place = next(_places(job))

    def result(self) -> Result:
        """Build all groups and put what was found together."""
        with counted_progress(self.progress, "table poses", len(self.groups)) as count:
            for group in self.groups:
                self.built.append(self._best_of(group))
                count()
        if all(one.found.motion is not None for one in self.built):
            for k in range(1, len(self.built)):
                self._stand_nearer(k)
        return self._put_together()

    def _stand_nearer(self, k: int) -> None:
        """Have the arm stand nearer than at home while the table turns for a group, where that is clear."""
        before, after = self.built[k - 1], self.built[k]
        ends = [_turn_end(one) for one in (before, after)]
        if after.turn is None or ends[0] is None or ends[1] is None:
            return
        found = nearer_place(self.turns, ends[0], ends[1], after.turn)
        if found is None:
            return
        self.built[k - 1] = _come_to(self.job, before, None, found.back)
        self.built[k] = replace(_come_to(self.job, after, found.out, None), turn=found.turn)

    def _best_of(self, group: TableGroup) -> _Built:
        """The group at the first pose that holds, or else at the one that loses fewest targets."""
        best: _Built | None = None
        self.verdicts.look_ahead(self._likely())
        tried = 0
        for some in self.verdicts.first_alone(self._trials(group, self._stood_at)):
            for trial in some:
                found = self.verdicts.of(trial)
                if found is None:
                    continue
                tried += 1
                built = self._at(trial, found)
                if best is None or _lost(built.found) < _lost(best.found):
                    best = built
                if not _lost(built.found) or tried == CHECKS:
                    return best
        if best is None:  # nothing serves: the best of the poses says why
            trial = replace(next(self._trials(group, self._stood_at)), screened=False)
            best = self._at(trial, self._verdict(trial))
        return best

    @property
    def _stood_at(self) -> list[Angles]:
        """Where the table stood for the groups built so far, E1, E2, rad."""
        return [one.trial.pose for one in self.built]

    def _likely(self) -> Iterator[GroupTrial]:
        """The groups that are left, each at the pose that is tried first if those before it hold at theirs."""
        stood = self._stood_at
        for group in self.groups[len(self.built) :]:
            trial = next(self._trials(group, stood))
            yield trial
            stood = [*stood, trial.pose]

    def _trials(self, group: TableGroup, stood: Sequence[Angles]) -> Iterator[GroupTrial]:
        """A group at the poses that are to be tried, the best first.

        Args:
            group: which.
            stood: where the table stood before, E1, E2, rad.

        Yields:
            Trials.
        """
        home, place = place_of(self.job.scene.start), place_of(self.place)
        start = place if stood else home
        end = home if group is self.groups[-1] else place
        for pose in self._poses(group, stood):
            yield GroupTrial(group, pose, start, end, screened=group.pose is None)

    def _poses(self, group: TableGroup, stood: Sequence[Angles]) -> Iterator[Angles]:
        """Poses to be tried, rad."""
        before = stood[-1] if stood else None
        if group.pose is not None:
            pose = table_angles(self.job.scene, *group.pose)
            yield pose if before is None else nearest_turn(self.job.scene, pose, before)
            return
        scene, suited = self.job.scene, self.suited[group.sub_volume]
        again = [pose for pose in reversed(stood) if upright_band(self.job, group, pose) <= suited[0].band]
        poses = [one.pose for one in suited]
        if before is not None:
            poses = [nearest_turn(scene, pose, before) for pose in poses]
            # of those alike the one that is nearest comes first
            time_to = {pose: self.seconds(before, pose) for pose in poses}
            order = sorted(range(len(poses)), key=lambda k: (suited[k].band, -suited[k].room, time_to[poses[k]]))
            poses = [poses[k] for k in order]
        yield from dict.fromkeys([*again, *poses])

    def _verdict(self, trial: GroupTrial) -> SpanVerdict:
        """The verdict on a trial that is not screened, or that is known to serve."""
        found = self.verdicts.of(trial)
        assert found is not None
        return found

    def _at(self, trial: GroupTrial, found: SpanVerdict) -> _Built:
        """A trial and its verdict, with the table's way there."""
        group, pose = trial.group, trial.pose
        turn: TableTurn | None = None
        why: Failure | None = None
        if self.built and self.built[-1].trial.pose != pose:
            way = self._turned(pose)
            turn, why = (way, None) if isinstance(way, TableTurn) else (None, way)
            if self._from_here(trial) != trial:
                trial = replace(self._from_here(trial), screened=False)
                found = self._verdict(trial)
        asked = (float(np.rad2deg(pose[0])), float(np.rad2deg(pose[1]))) if group.pose is None else group.pose
        asked = (round(asked[0], 6), round(asked[1], 6))
        if why is not None:
            found = _not_turned(found, group, why)
        if group.pose is None:
            found = replace(found, rows=tuple(map(unproved, found.rows)))
        return _Built(trial, trial.context(self.job), found, asked, turn)

    def _from_here(self, trial: GroupTrial) -> GroupTrial:
        """The same trial, come to from where the arm stands now and left to there."""
        place = place_of(self.place)
        start = place if self.built else trial.start
        return replace(trial, start=start, end=trial.end if trial.group is self.groups[-1] else place)

    def _turned(self, pose: Angles) -> TableTurn | Failure:
        """The table's way from where it stands to a pose, with the arm standing clear of it."""
        last = self.built[-1]
        found = self.turns.search(self.place, last.trial.pose, pose, last.context.done)
        if isinstance(found, TableTurn) or _lost(last.found):
            return found
        for place in _places(self.job):
            if (place == self.place).all():
                continue
            other = self.turns.search(place, last.trial.pose, pose, last.context.done)
            if isinstance(other, Failure):
                continue
            trial = replace(last.trial, end=place_of(place), screened=False)
            again = self._verdict(trial)
            if not _lost(again):
                self.built[-1] = replace(last, trial=trial, context=trial.context(self.job), found=again)
                self.place = place
                return other
        return found

    def _put_together(self) -> Result:
        job, built = self.job, self.built
        rows = tuple(row for one in built for row in one.found.rows)
        turns = [one.turn for one in built[1:]]
        motions = [one.found.motion for one in built]
        whole = [motion for motion in motions if motion is not None]
        motion = joined_motion(job, whole, turns) if len(whole) == len(built) else None
        tables = np.concatenate([np.tile(one.trial.pose, (len(one.found.rows), 1)) for one in built])
        placed = _placed(built)
        sigmas = [one.found.sigma for one in built if one.found.sigma is not None]
        warnings = [line for one in built for line in one.found.warnings]
        return Result(
            job=replace(job, warnings=(*job.warnings, *warnings)),
            asked=built[0].pose,
            table=built[0].trial.pose,
            placed=placed,
            rows=rows,
            clearance=self._least_clearance(),
            singularity=self._least_margin(),
            sigma=min(sigmas) if sigmas else None,
            gravity=off_upright(job, placed),
            motion=motion,
            mode="indexed",
            poses=tuple(_built_at(one.group, one.pose) for one in built),
            moved=tables,
        )

    def _least_clearance(self) -> LeastValue | None:
        """The nearest anything comes, while the table turns too."""
        found = [one.found.clearance for one in self.built if one.found.clearance is not None]
        for one in self.built:
            if one.turn is None:
                continue
            axes, laid = one.turn.axes, np.full(len(one.turn.looked_at), one.turn.deposits_laid)
            _, nearest = least_between_samples(self.turns.arm, self.turns.radius, axes, laid, one.turn.clearances)
            if np.isfinite(nearest.distance[0]):
                pair = tuple(self.job.scene.geom_name(int(g)) for g in nearest.pair[0])
                found.append(LeastValue(float(nearest.distance[0]), one.group.first, pair))
        return min(found, key=lambda least: least.value) if found else None

    def _least_margin(self) -> LeastValue | None:
        found = [one.found.singularity for one in self.built if one.found.singularity is not None]
        limits = self.job.singularity_limits.values(self.job.solver.geometry is not None)
        return min(found, key=lambda least: least.value / limits[KINDS.index(least.what[0])]) if found else None


def _turn_end(one: _Built) -> TurnEnd | None:
    """A group as a turn before or after it sees it; None where it is not known how it is come to."""
    found = one.found
    if found.ends is None or found.clearance is None:
        return None
    return TurnEnd(one.context, found.ends, found.clearance.value)


def _come_to(job: Job, one: _Built, out: CheckedTravel | None, back: CheckedTravel | None) -> _Built:
    """A group that is come to, or left, on another way."""
    found, ends = one.found, one.found.ends
    assert found.motion is not None
    assert ends is not None
    rows = [None if way is None else way.path.q for way in (out, back)]
    least = [found.clearance] if found.clearance is not None else []
    for way, target in ((out, one.group.first), (back, one.group.stop - 1)):
        if way is not None and np.isfinite(way.least):
            least.append(LeastValue(way.least, target, tuple(job.scene.geom_name(g) for g in way.pair)))
    ways = HomeTravels(ends.paths.out if out is None else out.path, ends.paths.back if back is None else back.path)
    motion = with_home_travels(job, found.motion, *rows)
    clearance = min(least, key=lambda one: one.value, default=None)
    return replace(one, found=replace(found, motion=motion, clearance=clearance, ends=replace(ends, paths=ways)))


def _placed(built: list[_Built]) -> PlacedTargets:
    """Every target where it stands when it is welded."""
    parts = [one.context.placed.rows(slice(one.group.first, one.group.stop)) for one in built]
    reference = tuple(
        np.concatenate([np.tile(part.reference[k], (len(part.position), 1)) for part in parts]) for k in (0, 1)
    )
    return PlacedTargets(
        position=np.concatenate([part.position for part in parts]),
        normal=np.concatenate([part.normal for part in parts]),
        reference=(reference[0], reference[1]),
    )


def _built_at(group: TableGroup, pose: Angles) -> BuiltAt:
    return BuiltAt(group.sub_volume, group.layers, *pose, group.first, group.stop)


def _places(job: Job) -> Iterator[Floats]:
    """Where the arm may stand while the table turns: at home, or drawn up and turned aside."""
    scene = job.scene
    if scene.has_home:
        yield scene.home
    for turn in A1_TURNS:
        place = scene.home.copy()
        place[0] += turn
        if scene.chain.lower[0] <= place[0] <= scene.chain.upper[0] and not (scene.has_home and turn == 0):
            yield place


def _lost(found: SpanVerdict) -> int:
    return sum(row.reason is not None for row in found.rows)


def unproved(row: TargetVerdict) -> TargetVerdict:
    """The same with nothing proved, because a target that is infeasible at one pose may be feasible at another."""
    return row if row.failure is None else replace(row, failure=replace(row.failure, proved=False))


def _not_turned(found: SpanVerdict, group: TableGroup, why: Failure) -> SpanVerdict:
    """The same where the table cannot turn there: said of the group's first target, unless more is wrong with it."""
    rows = list(found.rows)
    if rows[0].reason is None:
        place = replace(why.place, from_target=group.first - 1, to_target=group.first)
        rows[0] = failed(why.at(place), group.first, rows[0].q)
    return replace(found, rows=tuple(rows), motion=None)
