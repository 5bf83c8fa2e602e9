"""What can be welded is found: large turns of joints, rolls between samples, short ways out, ends close together."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import trimesh
import yaml
from support.jobs.boss_motion import boss_case
from support.jobs.boss_motion import result_of as result_of_path
from support.jobs.random_bosses import random_case
from support.jobs.searches import setup_of

from cell.case.read import load_case, with_changes
from cell.collision.clearances import Clearances
from cell.errors import InputError
from cell.failure import CollisionPlace, Contact, Failure, FailurePlace, Kind, SearchEffort, Where
from cell.motion.deposition_speed import STRETCH, HeldSpeed, note_stretches, over_stretches, too_slow
from cell.motion.motion_file import read_motion, write_motion
from cell.planning.bead_plan import plan_bead
from cell.planning.collision_free_rolls import collision_free_rolls, stabbing
from cell.planning.configurations import nodes_at_rolls
from cell.planning.edges.edge_tracking import EdgePoses, along
from cell.planning.infeasible_part import lost_alone
from cell.rigid import frames
from cell.verdict.failure_words import failure_in_words
from cell.verification.motion_check import check_motion
from ik.roll import apply_roll, roll_of, wrap
from ik.singularity import sides
from ik.solver import Solver
from slicing.warning import Code, typed


@pytest.fixture(scope="module")
def coarse(tmp_path_factory):
    """A boss that is welded close to the wrist's singularity: A4 turns by 67 deg within 4 mm."""
    folder = tmp_path_factory.mktemp("wrist")
    box = trimesh.creation.box((8.0, 8.0, 12.0))
    box.apply_translation((-9.0, 0.0, 20.0))
    box.export(folder / "boss.stl")
    content = {
        "part": {"sub_volumes": ["boss.stl"], "body": {"radius_mm": 9, "z_mm": [0, 40]}},
        "support": {"radius_mm": 8, "height_mm": 100},
        "positioner": {"position_mm": [1500, 0, 480]},
        "table": {"E1_deg": 0, "E2_deg": 0},
        "tool": {"dimensions": {"neck_angle_deg": 0}},
        "roll": {"fixed_deg": 0},
        "process": {"deposition_speed_mm_s": 4},
    }
    path = folder / "coarse.case.yaml"
    path.write_text(yaml.safe_dump(content))
    return result_of_path(path)


@pytest.mark.slow
def test_a_joint_may_turn_far_between_two_targets(coarse, tmp_path):
    assert coarse.feasible
    q = np.array([row.q for row in coarse.rows])
    same = np.diff(coarse.job.targets.bead) == 0
    assert np.rad2deg(np.abs(np.diff(q, axis=0)).max(axis=1)[same].max()) > 60
    # in one configuration on every bead, and without a jump
    motion, form = coarse.motion, coarse.job.solver.geometry
    for bead in range(int(motion.bead.max()) + 1):
        welding = motion.q[(motion.arc == 1) & (motion.bead == bead)]
        assert (sides(form, welding) == sides(form, welding[:1])).all()
        assert np.rad2deg(np.abs(np.diff(welding, axis=0)).max()) < 15
    write_motion(tmp_path / "m.npz", motion)
    assert check_motion(coarse.job, read_motion(tmp_path / "m.npz", coarse.job)).feasible


def test_a_way_is_followed_in_its_branch_and_closely_enough(coarse):
    placed, solver = coarse.placed, coarse.job.solver
    q = np.array([row.q for row in coarse.rows])
    e = int(np.argmax(np.abs(np.diff(q, axis=0)).max(axis=1) * (np.diff(coarse.job.targets.bead) == 0)))
    ways = EdgePoses.of(placed, np.array([e]), np.zeros((1, 2)))
    edge, t, followed = along(solver, ways, q[[e]], np.zeros(3, dtype=np.int64), np.array([0.0, 0.5, 1.0]))
    assert followed[0] == pytest.approx(q[e])
    assert followed[-1] == pytest.approx(q[e + 1], abs=1e-6)
    assert np.rad2deg(np.abs(np.diff(followed, axis=0)).max()) <= 3.0
    at = solver.chain.forward(followed)
    assert at == pytest.approx(ways.at(edge, t), abs=1e-9)


@pytest.fixture(scope="module")
def boss(tmp_path_factory):
    return setup_of(boss_case(tmp_path_factory.mktemp("rolls"), roll="free", sampling={"min_segment_mm": 4.0}))


class Slit:
    """A checker in whose cell one narrow stretch of the roll is free, moving along the bead."""

    def __init__(self, real, setup, at, half, drift=0.0):
        self.real, self.setup, self.at, self.half, self.drift = real, setup, at, half, drift

    def __getattr__(self, name):
        return getattr(self.real, name)

    def clearances(self, q, deposits_laid, met=None):
        found = self.real.clearances(q, deposits_laid, met)
        T = self.setup.solver.chain.forward(q)
        p, reference = T[:, :3, 3], self.setup.placed.reference
        roll = roll_of(frames(p, -T[:, :3, 2], reference), T)
        along = np.linalg.norm(p - self.setup.placed.position[0], axis=1)
        off = np.abs(wrap(roll - self.at - self.drift * along))
        room = self.setup.settings.clearance + LEVER * (self.half - off)
        return Clearances(np.minimum(found.distance, room), np.maximum(found.pair, 0), np.nan_to_num(found.position))


LEVER = 0.2  # m: less than what the forearm moves by for each rad of roll


def with_slit(setup, *slit):
    return replace(setup, checker=Slit(setup.checker, setup, *slit), screen=Slit(setup.screen, setup, *slit))


@pytest.mark.parametrize("half_deg", [0.25, 3.0])
def test_a_free_stretch_of_the_roll_is_found_however_narrow_and_deep_what_is_beside_it(boss, half_deg):
    _, setup = boss
    for at_deg in (-61.3, 2.4):
        slit = with_slit(setup, np.deg2rad(at_deg), np.deg2rad(half_deg))
        found = collision_free_rolls(slit, [0], np.deg2rad(5.0))[0]
        assert found
        for low, high in np.rad2deg(found):
            assert at_deg - half_deg - 1e-6 <= low <= high <= at_deg + half_deg + 1e-6
    assert collision_free_rolls(with_slit(setup, 0.0, -0.01), [0, 1], np.deg2rad(5.0)) == {0: [], 1: []}


def test_a_target_that_is_free_between_the_sampled_rolls_alone_is_not_lost(boss):
    _, setup = boss
    at, some = np.deg2rad(-7.4), [0, 1, 2]
    assert lost_alone(with_slit(setup, at, np.deg2rad(0.5)), some) == {}
    assert sorted(lost_alone(with_slit(setup, at, -0.01), some)) == some


@pytest.mark.parametrize("branch", [0, 3])
def test_a_target_that_joint_limits_leave_between_the_sampled_rolls_alone_is_not_lost(boss, branch):
    _, setup = boss
    T = apply_roll(setup.placed.rows([0]).Ts_base_target, np.deg2rad([2.4]))
    found = setup.solver.candidates(T).q[0].reshape(-1, 6)
    q = found[np.isfinite(found[:, 0])][branch]
    chain = replace(setup.solver.chain, lower=q - 5e-3, upper=q + 5e-3)  # a few tenths of a degree of roll
    narrow = replace(setup, solver=Solver.for_chain(chain))
    assert not stands_at_a_sample(narrow)
    assert lost_alone(narrow, [0]) == {}


def stands_at_a_sample(context):
    """Whether target 0 has a configuration at a sampled roll."""
    nodes = nodes_at_rolls(
        context.solver, context.placed.rows([0]), context.window, context.settings.roll_step, context.limits
    )
    return bool(np.isfinite(nodes.cost).any())


@pytest.mark.parametrize(
    ("half_deg", "drift_deg", "step_deg"), [(1.0, 0.0, 15.0), pytest.param(2.0, -2000.0, 15.0, marks=pytest.mark.slow)]
)
def test_a_bead_comes_out_whole_at_rolls_that_no_sample_has(boss, half_deg, drift_deg, step_deg):
    job, setup = boss
    stop = int(np.searchsorted(job.targets.bead, 1))
    setup = replace(setup, settings=replace(setup.settings, roll_step=np.deg2rad(step_deg)))
    narrow = with_slit(setup, np.deg2rad(-7.4), np.deg2rad(half_deg), np.deg2rad(drift_deg))
    plan = plan_bead(narrow, 0, stop, None)
    assert plan.whole
    assert plan.stretches[0].clearances.distance.min() >= setup.settings.clearance


def test_few_rolls_are_in_every_stretch():
    rng = np.random.default_rng(0)
    low = rng.uniform(-3, 2.5, 60)
    stretches = list(zip(low, low + rng.uniform(0, 0.6, 60), strict=True))
    found = stabbing(stretches)
    assert len(found) < 30
    assert all(any(a - 1e-12 <= r <= b + 1e-12 for r in found) for a, b in stretches)
    assert len(stabbing([])) == 0


@pytest.mark.slow
def test_a_way_out_that_is_not_free_is_gone_as_far_as_it_is(tmp_path):
    result = result_of_path(boss_case(tmp_path, process={"retract_mm": 2500.0}))
    assert result.feasible
    (told,) = (w for w in map(typed, result.job.warnings) if w.code == Code.SHORT_RETRACT)
    assert "process.retract_mm 2500" in told
    # and what leads across is off the part: the wire is not drawn through it
    write_motion(tmp_path / "m.npz", result.motion)
    assert check_motion(result.job, read_motion(tmp_path / "m.npz", result.job)).feasible


def test_a_speed_is_held_over_stretches_and_not_over_microns():
    # a bead whose last 14 um take as long as they do where the torch comes to rest
    s = np.array([0.0, 0.010, 0.020, 0.020014])
    asked = s / 0.008
    t = asked + np.array([0.0, 0.0, 0.0, 0.016])
    held_speed = HeldSpeed.unknown(4)
    held_speed.asked_s[:3], held_speed.taken_s[:3] = np.diff(asked), np.diff(t)
    assert held_speed.ratio[2] < 0.11
    note_stretches(held_speed, np.arange(4), s, over_stretches(s, t, asked))
    assert too_slow(held_speed, 0.5) == {}
    # the same time lost over a stretch is told, wherever targets are
    for inner in ([], [0.0113], [0.0101, 0.0102, 0.0149]):
        s = np.sort(np.array([0.0, 0.010, 0.015, 0.020, *inner]))
        asked = s / 0.008
        t = asked + np.interp(s, [0.010, 0.015], [0.0, 3 * STRETCH / 0.008])
        middle, share = over_stretches(s, t, asked)
        assert share.min() == pytest.approx(0.25)
        assert middle[np.argmin(share)] == pytest.approx(0.0125)


def test_changes_are_refused_that_the_case_file_would_refuse(tmp_path):
    case = load_case(boss_case(tmp_path))
    assert with_changes(case) == case
    assert with_changes(case, roll={"range_deg": [-10, 20]}).roll.range_deg == (-10, 20)
    for section, key, value in (("process", "retract_mm", -3.0), ("checks", "clearance_mm", -1.0)):
        changed = getattr(case, section).model_copy(update={key: value})
        with pytest.raises(InputError, match=f"{section}.{key}"):
            with_changes(case, **{section: changed})


def test_messages_say_what_was_found_and_what_is_needed():
    hit = Failure(Kind.COLLISION, 4.981, 5.0, contact=Contact(("a", "b")))
    assert failure_in_words(hit) == "a - b 4.981 mm, needs 5"
    assert failure_in_words(replace(hit, measure=1.2)) == "a - b 1.2 mm, needs 5"
    assert "not proved" in failure_in_words(replace(hit, measure=6.0).seen(CollisionPlace.BETWEEN_SAMPLES))
    effort = SearchEffort(reached_mm=24.0, retract_mm=50.0, shut_in="leaving")
    place = FailurePlace(Where.TRAVEL, from_target=3, to_target=4)
    way = Failure(Kind.JOINT_LIMIT, axis="A5", place=place, effort=effort)
    words = failure_in_words(way)
    assert words.startswith("travel from target 3: A5 at its limit after 24 of 50 mm")
    assert "process.retract_mm" in words
    assert "no way found in 60 attempts" in failure_in_words(replace(way, effort=replace(effort, attempts=60)))
    limit = Failure(Kind.JOINT_LIMIT, measure=12.3, axis="A6")
    changed = Failure(Kind.CONFIGURATION_CHANGE, because=limit, place=FailurePlace(Where.BEAD, from_target=0))
    assert failure_in_words(changed).endswith("no configuration goes on: A6 12.3 deg over its limit")


@pytest.mark.slow
@pytest.mark.parametrize("seed", [10, 24])
def test_a_verdict_does_not_hang_on_how_finely_curves_are_sampled(tmp_path, seed):
    said = []
    for segment in (8.0, 2.5):
        sampling = {"min_segment_mm": segment, "chord_tolerance_mm": 0.2}
        path = random_case(np.random.default_rng([5, seed]), tmp_path, f"s{segment:g}", sampling=sampling)
        said.append(result_of_path(path))
    assert len(said[0].rows) < len(said[1].rows)
    assert said[0].feasible == said[1].feasible
