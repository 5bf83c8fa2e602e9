"""The verdict on a part that is built group by group, each at a pose of the table of its own.

    result = check_indexed(prepare(case))
    result.feasible, result.poses

A group is a sub-volume or a run of its layers. Its pose is the case's, or searched: of the poses that suit it those
that nothing speaks against are checked whole, best first, until one holds. The order of sub-volumes whose poses are
searched is the one in which the table turns least; where what was built before locks the torch out, the group that it
locks out comes first. Between two groups the arm stands clear while the table turns. Radians and metres.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ik.chain import Floats
from ik.singularity import KINDS

from ..collision.between_samples import least_on_the_way
from ..failure import Failure
from ..job.build_order import LayerRun
from ..job.job import Job
from ..job.reordered import in_order
from ..job.table_groups import TableGroup, table_groups
from ..job.table_section_check import BODY
from ..planning.context import Context, Span
from ..processes import processor_time
from ..progress import Progress, counted, phase
from ..scene.placement import Placed
from ..scene.scene import table_angles
from ..table_poses.indexed_motion import joined_motion
from ..table_poses.layer_order import shortest_order
from ..table_poses.locked_layers import locked_layers
from ..table_poses.suited_poses import SuitedPose, serves, suited_poses, upright_band, upright_poses
from ..table_poses.table_turn import Angles, TableTurn, TurnSearch, nearest_turn, turn_time
from .check import BuiltAt, Least, Result, SpanVerdict, TargetVerdict, check_span, failed, off_upright

CHECKS = 4  # poses of a group that are checked whole
ORDERS = 4  # orders of layers that are tried
ASIDE = np.deg2rad([0.0, 60.0, -60.0, 120.0, -120.0, 180.0])  # of A1 from rest: places to stand in without a home


@dataclass(frozen=True, eq=False)
class _Built:
    """What became of a group.

    Attributes:
        group: which.
        context: at its pose.
        found: the verdict.
        pose: E1, E2 as asked for or found, deg.
        turn: the table's way there; None where it stands there already, or has none.
    """

    group: TableGroup
    context: Context
    found: SpanVerdict
    pose: Angles
    turn: TableTurn | None


@phase("checking", spins=False)
def check_indexed(job: Job, progress: Progress | None = None) -> Result:
    """Check a part whose groups are built at poses of their own.

    Args:
        job: from ``cell.job.job.prepare``; its case's ``table.poses`` are taken, or searched where there are none.
        progress: told how far it is.

    Returns:
        The verdict; its job has the sub-volumes in the order in which they are built.
    """
    begun = processor_time()
    if job.case.table.poses:
        return replace(_Build(job, progress).result(), seconds=processor_time() - begun)
    search = _OrderSearch(job)
    best: Result | None = None
    for _ in range(ORDERS):
        result = _Build(in_order(job, search.runs()), progress, search.suited).result()
        lost = result.infeasible + result.not_looked_at
        if best is None or lost < best.infeasible + best.not_looked_at:
            best = result
        if result.feasible or not search.learned(result):
            break
    assert best is not None
    return replace(best, seconds=processor_time() - begun)


class _OrderSearch:
    """Poses for the sub-volumes, and orders of their layers."""

    def __init__(self, job: Job) -> None:
        self.job = job
        groups = {group.sub_volume: group for group in table_groups(job)}
        self.suited = {name: suited_poses(job, group) for name, group in groups.items()}
        lost = any(not suited for suited in self.suited.values())
        for name, group in groups.items():
            if not self.suited[name]:  # nothing can hold: the most upright one says why
                poses, band = upright_poses(job, group)
                self.suited[name] = [SuitedPose(int(band[0]), 0, (float(poses[0][0]), float(poses[0][1])))]
        best = [self.suited[name][0].pose if name in groups else None for name in job.targets.sub_volume]
        # a part that is lost whatever comes first is not looked at for what locks out what
        self.needs = locked_layers(job, [None] * len(best) if lost else best)
        at = [pose or (0.0, 0.0) for pose in best]
        self.seconds = np.array([[turn_time(job, a, nearest_turn(job.scene, b, a)) for b in at] for a in at])

    def runs(self) -> list[LayerRun]:
        """The order to try next."""
        layers = self.job.layers
        fixed = int(self.job.targets.sub_volume[0] == BODY)
        natural = [(k, 0, count - 1) for k, count in enumerate(layers)]
        return shortest_order(layers, self.seconds, self.needs, fixed) or natural

    def learned(self, result: Result) -> bool:
        """Take note of layers that lock out others in a result; whether there are any that were not known."""
        t, names = result.job.targets, list(self.job.targets.sub_volume)
        new = False
        for i, row in enumerate(result.rows):
            own, layer = int(t.sub_volume_index[i]), int(t.layer[i])
            for other in () if row.failure is None else row.failure.locked_by:
                a = names.index(other.sub_volume)
                if a != own and other.layer < self.needs[own][layer, a]:
                    self.needs[own][layer, a], new = other.layer, True
        return new


class _Build:
    """The groups of a job, built in the order in which they stand."""

    def __init__(
        self, job: Job, progress: Progress | None, suited: Mapping[str, Sequence[SuitedPose]] | None = None
    ) -> None:
        self.job, self.progress, self.suited = job, progress, suited or {}
        self.groups = table_groups(job)
        self.turns = TurnSearch(job)
        self.built: list[_Built] = []
        self.place = next(_places(job))

    def result(self) -> Result:
        """Build all groups and put what was found together."""
        with counted(self.progress, "table poses", len(self.groups)) as count:
            for group in self.groups:
                self.built.append(self._best_of(group))
                count()
        return self._put_together()

    def _best_of(self, group: TableGroup) -> _Built:
        """The group at the first pose that holds, or else at the one that loses fewest targets."""
        best: _Built | None = None
        for pose in self._poses(group):
            found = self._at(group, pose)
            if group.pose is None:
                found = replace(found, found=replace(found.found, rows=tuple(map(unproved, found.found.rows))))
            if best is None or _lost(found.found) < _lost(best.found):
                best = found
            if not _lost(found.found):
                break
        assert best is not None
        return best

    def _poses(self, group: TableGroup) -> Iterator[Angles]:
        """Poses to be checked, rad."""
        before = self.built[-1].context.checker.table if self.built else None
        if group.pose is not None:
            pose = table_angles(self.job.scene, *group.pose)
            yield pose if before is None else nearest_turn(self.job.scene, pose, before)
            return
        scene, suited = self.job.scene, self.suited[group.sub_volume]
        used = [one.context.checker.table for one in reversed(self.built)]
        again = [pose for pose in used if upright_band(self.job, group, pose) <= suited[0].band]
        poses = [one.pose for one in suited]
        if before is not None:
            poses = [nearest_turn(scene, pose, before) for pose in poses]
            # of those alike the one that is nearest comes first
            time_to = {pose: turn_time(self.job, before, pose) for pose in poses}
            order = sorted(range(len(poses)), key=lambda k: (suited[k].band, -suited[k].room, time_to[poses[k]]))
            poses = [poses[k] for k in order]
        tried = 0
        for pose in dict.fromkeys([*again, *poses]):
            if tried < CHECKS and serves(self.job, group, pose):
                tried += 1
                yield pose
        if not tried:
            yield poses[0]  # says why

    def _at(self, group: TableGroup, pose: Angles) -> _Built:
        """The group at a pose, with the table's way there."""
        turn: TableTurn | None = None
        why: Failure | None = None
        if self.built and self.built[-1].context.checker.table != pose:
            found = self._turned(pose)
            turn, why = (found, None) if isinstance(found, TableTurn) else (None, found)
        asked = (float(np.rad2deg(pose[0])), float(np.rad2deg(pose[1]))) if group.pose is None else group.pose
        asked = (round(asked[0], 6), round(asked[1], 6))
        last = group is self.groups[-1]
        start = self.job.scene.start if not self.built else self.place
        end = self.job.scene.start if last else self.place
        span = Span(group.first, group.stop, start, end)
        context = Context.of(self.job, pose, span=span)
        found_ = check_span(self.job, context, off_upright(self.job, context.placed), self.progress)
        if why is not None:
            found_ = _not_turned(found_, group, why)
        return _Built(group, context, found_, asked, turn)

    def _turned(self, pose: Angles) -> TableTurn | Failure:
        """The table's way from where it stands to a pose, with the arm standing clear of it."""
        last = self.built[-1]
        found = self.turns.search(self.place, last.context.checker.table, pose, last.context.done)
        if isinstance(found, TableTurn) or _lost(last.found):
            return found
        for place in _places(self.job):
            if (place == self.place).all():
                continue
            other = self.turns.search(place, last.context.checker.table, pose, last.context.done)
            if isinstance(other, Failure):
                continue
            span = replace(last.context.span, end=place)
            context = replace(last.context, span=span)
            again = check_span(self.job, context, off_upright(self.job, context.placed))
            if not _lost(again):
                self.built[-1] = replace(last, context=context, found=again)
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
        tables = np.concatenate([np.tile(one.context.checker.table, (len(one.found.rows), 1)) for one in built])
        placed = _placed(built)
        sigmas = [one.found.sigma for one in built if one.found.sigma is not None]
        warnings = [line for one in built for line in one.found.warnings]
        return Result(
            job=replace(job, warnings=(*job.warnings, *warnings)),
            asked=built[0].pose,
            table=built[0].context.checker.table,
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

    def _least_clearance(self) -> Least | None:
        """The nearest anything comes, while the table turns too."""
        found = [one.found.clearance for one in self.built if one.found.clearance is not None]
        for one in self.built:
            if one.turn is None:
                continue
            axes, laid = one.turn.axes, np.full(len(one.turn.looked_at), one.turn.stage)
            _, nearest = least_on_the_way(self.turns.arm, self.turns.radius, axes, laid, one.turn.clearances)
            if np.isfinite(nearest.distance[0]):
                pair = tuple(self.job.scene.geom_name(int(g)) for g in nearest.pair[0])
                found.append(Least(float(nearest.distance[0]), one.group.first, pair))
        return min(found, key=lambda least: least.value) if found else None

    def _least_margin(self) -> Least | None:
        found = [one.found.singularity for one in self.built if one.found.singularity is not None]
        limits = self.job.singularity_limits.values(self.job.solver.geometry is not None)
        return min(found, key=lambda least: least.value / limits[KINDS.index(least.what[0])]) if found else None


def _placed(built: list[_Built]) -> Placed:
    """Every target where it stands when it is welded."""
    parts = [one.context.placed.rows(slice(one.group.first, one.group.stop)) for one in built]
    reference = tuple(
        np.concatenate([np.tile(part.reference[k], (len(part.position), 1)) for part in parts]) for k in (0, 1)
    )
    return Placed(
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
    for turn in ASIDE:
        place = scene.home.copy()
        place[0] += turn
        if scene.chain.lower[0] <= place[0] <= scene.chain.upper[0] and not (scene.has_home and turn == 0):
            yield place


def _lost(found: SpanVerdict) -> int:
    return sum(row.reason is not None for row in found.rows)


def unproved(row: TargetVerdict) -> TargetVerdict:
    """The same with nothing proved: that a target is infeasible at one pose says nothing of others."""
    return row if row.failure is None else replace(row, failure=replace(row.failure, proved=False))


def _not_turned(found: SpanVerdict, group: TableGroup, why: Failure) -> SpanVerdict:
    """The same where the table cannot turn there: said of the group's first target, unless more is wrong with it."""
    rows = list(found.rows)
    if rows[0].reason is None:
        place = replace(why.place, from_target=group.first - 1, to_target=group.first)
        rows[0] = failed(why.at(place), group.first, rows[0].q)
    return replace(found, rows=tuple(rows), motion=None)
