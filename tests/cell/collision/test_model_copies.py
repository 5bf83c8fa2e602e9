"""Copies of a model are used again, and nobody sees who had them before."""

from __future__ import annotations

import gc

import mujoco
import numpy as np
import pytest
from support.jobs.cases import little_case

from cell.case.read import load_case
from cell.collision.checker import Checker
from cell.collision.model_copies import AWAY, MOST_SPARE, borrowed
from cell.collision.pair_groups import PairGroupChecker, pair_groups
from cell.collision.table_clearances import TableChecker
from cell.collision.wire import wire_checker
from cell.job.job import prepare


class Borrower:
    """Somebody."""


def a_model() -> mujoco.MjModel:
    xml = "<mujoco><worldbody><geom size='1'/><geom size='2' pos='0 0 9'/></worldbody></mujoco>"
    return mujoco.MjModel.from_xml_string(xml)


def test_a_copy_is_for_one_at_a_time_and_then_for_the_next() -> None:
    model = a_model()
    one, other = Borrower(), Borrower()
    first, second = borrowed(model, one), borrowed(model, other)
    assert first is not second
    assert first is not model
    del one
    again = Borrower()
    assert borrowed(model, again) is first
    beside = borrowed(model, again)  # all that were given back are taken
    assert beside is not first
    assert beside is not second
    assert borrowed(a_model(), again) is not first


def test_a_copy_with_shapes_away_is_never_given_for_one_without() -> None:
    model, one = a_model(), Borrower()
    away = borrowed(model, one, (1,))
    assert away.geom_pos[1, 2] > 1e4
    assert model.geom_pos[1, 2] == 9
    del one
    assert borrowed(model, Borrower()).geom_pos[1, 2] == 9
    assert borrowed(model, Borrower(), (0,)).geom_pos[1, 2] == 9
    assert borrowed(model, Borrower(), (1,)) is away


def test_what_a_checker_finds_does_not_depend_on_who_had_its_copy_before(tmp_path) -> None:
    scene = prepare(load_case(little_case(tmp_path))).scene
    rng = np.random.default_rng(3)
    q = rng.uniform(scene.chain.lower, scene.chain.upper, (60, scene.chain.n))
    deposits_laid = rng.integers(0, scene.n_deposits + 1, 60)

    def made() -> Checker:
        return Checker(scene, (0.3, 1.0), 0.05)

    both = made(), made()  # at once, so that neither has the other's copy
    order = np.argsort(-both[0].clearances(q, deposits_laid).distance)  # a copy is left with little looked for
    q, deposits_laid = q[order], deposits_laid[order]
    fresh = both[1].clearances(q, deposits_laid)  # in the order of all that follows: how far is looked out hangs on it
    assert (fresh.distance < 0).any()
    assert fresh.distance[0] > 0
    del both
    groups = [PairGroupChecker(made(), itself=itself) for itself in (False, True)]
    wires = [wire_checker(made()) for _ in range(2)]
    tables = [TableChecker(scene, 0.05) for _ in range(2)]
    for group in groups:
        group.clearances(q, deposits_laid)
    for wire in wires:
        assert wire is not None
        wire.clearances(q, deposits_laid)
    for table in tables:
        table.clearances(rng.uniform(-1, 1, (9, 2)), np.zeros(9, dtype=np.int64))
    wired = wires[0].clearances(q, deposits_laid)
    del groups, group, wires, wire, tables, table
    # all copies that were used, at once
    for checker in [made() for _ in range(MOST_SPARE + 1)]:
        found = checker.clearances(q, deposits_laid)
        assert np.array_equal(found.distance, fresh.distance)
        assert np.array_equal(found.pair, fresh.pair)
    for wire in [wire_checker(made()) for _ in range(MOST_SPARE + 1)]:
        assert np.array_equal(wire.clearances(q, deposits_laid).distance, wired.distance)


def test_two_that_share_a_copy_each_look_as_far_as_they_are_to(tmp_path) -> None:
    scene, table = prepare(load_case(little_case(tmp_path))).scene, (0.3, 1.0)
    q = np.random.default_rng(3).uniform(scene.chain.lower, scene.chain.upper, (300, scene.chain.n))
    away = Checker(scene, table, 0.05).clearances(q, np.zeros(300, dtype=np.int64)).distance
    # some within reach first, then one beyond it: after that one the whole reach is what was looked out to last
    q = q[np.argsort(away)][np.sort(away) > 1e-3]
    reach, deposits_laid = min(float(np.sort(away)[-2:].mean()), 0.049), np.zeros(len(q), dtype=np.int64)
    far = Checker(scene, table, reach)
    near = Checker(scene, table, 1e-4, beside=far)
    alone = far.clearances(q, deposits_laid).distance
    assert np.isfinite(alone[0])
    assert not np.isfinite(alone[-1])
    near.clearances(q, deposits_laid)
    assert np.array_equal(far.clearances(q, deposits_laid).distance, alone)


def test_a_copy_is_nobody_elses_as_long_as_one_of_those_that_share_it_is_there(tmp_path) -> None:
    scene, table = prepare(load_case(little_case(tmp_path))).scene, (0.3, 1.0)
    q = np.random.default_rng(5).uniform(scene.chain.lower, scene.chain.upper, (40, scene.chain.n))
    deposits_laid = np.full(len(q), scene.n_deposits)
    checker = Checker(scene, table, 0.05)
    wire, (still, _) = wire_checker(checker), pair_groups(checker)
    assert wire_checker(checker) is wire
    assert pair_groups(checker)[0] is still
    found = still.clearances(q, deposits_laid)
    del checker, _
    gc.collect()
    others = [Checker(scene, (0.9, 0.2), 0.05) for _ in range(MOST_SPARE + 1)]
    for other in others:
        other.clearances(q, deposits_laid)
    again = still.clearances(q, deposits_laid)
    assert np.array_equal(again.distance, found.distance)
    assert np.array_equal(again.pair, found.pair)


@pytest.mark.parametrize("pos", ["0 0 0", "0.1 0 0"], ids=["in its body's own frame", "beside it"])
def test_a_shape_that_is_moved_away_is_away(pos: str) -> None:
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><worldbody><body pos="1 0 0"><geom name="there" size="0.1" pos="{pos}"/></body>'
        '<geom name="other" size="0.1"/></worldbody></mujoco>'
    )
    user = Borrower()
    mine = borrowed(model, user, (model.geom("there").id,))
    data = mujoco.MjData(mine)
    mujoco.mj_forward(mine, data)
    assert data.geom("there").xpos[2] >= AWAY
    assert data.geom("other").xpos == pytest.approx([0, 0, 0])
