"""Copies of a model are used again, and nobody sees who had them before."""

from __future__ import annotations

import copy
import weakref
from collections.abc import Callable
from dataclasses import replace

import mujoco
import numpy as np
import pytest
from support.jobs.cases import little_case

from cell.arrays import Ints
from cell.case.read import load_case
from cell.collision import model_copies
from cell.collision.checker import NEVER, Checker
from cell.collision.model_copies import Switched, discard_spare, lent
from cell.collision.pair_groups import PairGroupChecker, pair_groups
from cell.collision.table_clearances import TableChecker
from cell.collision.wire import wire_checker, wire_scene
from cell.job.job import prepare
from cell.scene.scene import Scene
from ik.chain import Floats


def a_model() -> mujoco.MjModel:
    xml = "<mujoco><worldbody><geom size='1'/><geom size='2' pos='0 0 9'/></worldbody></mujoco>"
    return mujoco.MjModel.from_xml_string(xml)


def test_a_copy_is_for_one_at_a_time_and_then_for_the_next() -> None:
    model = a_model()
    with lent(model) as first, lent(model) as second:
        assert first is not second
        assert first.model is not model
        first.geom_gap[:] = 3.0
        assert first.model.geom_gap[0] == 3.0
        assert second.model.geom_gap[0] == model.geom_gap[0] == 0.0
    with lent(model) as again, lent(model) as beside, lent(model) as third:
        assert {id(again), id(beside)} == {id(first), id(second)}
        assert third not in (first, second)  # all that were given back are taken
        with lent(a_model()) as other:
            assert other not in (first, second, third)


def test_a_copy_is_given_back_when_a_look_fails() -> None:
    model = a_model()
    with pytest.raises(ValueError, match="on the way"), lent(model) as first:
        raise ValueError("on the way")
    with lent(model) as again:
        assert again is first


def test_spare_copies_can_be_let_go_of() -> None:
    model, other = a_model(), a_model()
    with lent(model) as first, lent(other) as others:
        pass
    gone = weakref.ref(first)
    del first
    assert gone() is not None
    discard_spare(model)
    assert gone() is None
    with lent(other) as again:
        assert again is others


def looks(scene: Scene) -> list[Callable[[Floats, Ints], object]]:
    """What every kind of checker of a scene is asked for."""
    tables = [TableChecker(scene, 0.05), TableChecker(scene, 0.01)]
    wires = [wire_checker(Checker(scene, (0.3, E2), 0.05)) for E2 in (1.0, 0.5)]
    checkers = [Checker(scene, (0.1 * k, 0.2), 0.01 * (k + 1)) for k in range(8)]
    groups = [group for checker in checkers[:3] for group in pair_groups(checker)]
    assert None not in wires
    seen = [checker.clearances for checker in (*checkers, *groups, *wires) if checker is not None]
    return [*seen, *(lambda q, laid, table=table: table.clearances(q[:, :2], laid) for table in tables)]


def test_any_number_of_checkers_need_one_copy_of_the_model(tmp_path, monkeypatch) -> None:
    made = []

    class Counted(Switched):
        def __init__(self, model: mujoco.MjModel) -> None:
            made.append(model)
            super().__init__(model)

    monkeypatch.setattr(model_copies, "Switched", Counted)
    scene = prepare(load_case(little_case(tmp_path))).scene
    q = np.random.default_rng(4).uniform(scene.chain.lower, scene.chain.upper, (5, scene.chain.n))
    kept = looks(scene)  # all of them are there while each of them looks
    for look in kept:
        look(q, np.full(len(q), scene.n_deposits))
    assert [model is scene.model for model in made] == [True]


def test_what_a_checker_finds_does_not_depend_on_who_had_its_copy_before(tmp_path) -> None:
    scene = prepare(load_case(little_case(tmp_path))).scene
    rng = np.random.default_rng(3)
    q = rng.uniform(scene.chain.lower, scene.chain.upper, (60, scene.chain.n))
    deposits_laid = rng.integers(0, scene.n_deposits + 1, 60)

    def made() -> Checker:
        return Checker(scene, (0.3, 1.0), 0.05)

    order = np.argsort(-made().clearances(q, deposits_laid).distance)  # a copy is left with little looked for
    q, deposits_laid = q[order], deposits_laid[order]
    with lent(scene.model):  # so that the checker does not have the copy that was used
        fresh = made().clearances(q, deposits_laid)  # in the order of all that follows: how far is looked hangs on it
    assert (fresh.distance < 0).any()
    assert fresh.distance[0] > 0
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
    # with each of the copies that were used
    for before in (groups[0], groups[1], wires[1], made()):
        before.clearances(q, deposits_laid)
        found = made().clearances(q, deposits_laid)
        assert np.array_equal(found.distance, fresh.distance)
        assert np.array_equal(found.pair, fresh.pair)
        before.clearances(q, deposits_laid)
        assert np.array_equal(wires[0].clearances(q, deposits_laid).distance, wired.distance)


def test_two_that_share_data_each_look_as_far_as_they_are_to(tmp_path) -> None:
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


def test_checkers_that_look_by_turns_while_one_is_looking_do_not_change_what_it_finds(tmp_path) -> None:
    scene, table = prepare(load_case(little_case(tmp_path))).scene, (0.3, 1.0)
    q = np.random.default_rng(5).uniform(scene.chain.lower, scene.chain.upper, (40, scene.chain.n))
    deposits_laid = np.full(len(q), scene.n_deposits)
    checker, other = Checker(scene, table, 0.05), Checker(scene, (0.9, 0.2), 0.01)
    alone = checker.clearances(q, deposits_laid)

    def meanwhile(*_seen: object) -> None:
        other.clearances(q[:3], np.zeros(3, dtype=np.int64))

    found = checker.clearances(q, deposits_laid, meanwhile)
    assert np.isfinite(alone.distance).sum() > 5
    assert np.array_equal(found.distance, alone.distance)
    assert np.array_equal(found.pair, alone.pair)


@pytest.mark.parametrize("many", [10**9, 0], ids=["MuJoCo's kinematics", "the arm's own"])
def test_pairs_that_the_model_names_are_never_met_where_they_do_not_count(tmp_path, monkeypatch, many: int) -> None:
    monkeypatch.setattr("cell.collision.checker.MANY_GEOMS", many)
    scene, table = prepare(load_case(little_case(tmp_path))).scene, (0.3, 1.0)
    model, chain = copy.copy(scene.model), scene.chain
    larger = np.union1d(model.pair_geom1, model.pair_geom2)  # so that torch and link are in each other
    model.geom_size[larger] += 0.1
    model.geom_rbound[larger] += 0.3
    scene = replace(scene, model=model)
    named = {tuple(sorted(pair)) for pair in zip(model.pair_geom1.tolist(), model.pair_geom2.tolist(), strict=True)}
    q, laid = np.random.default_rng(6).uniform(chain.lower, chain.upper, (50, chain.n)), np.zeros(50, dtype=np.int64)

    def met(checker: Checker) -> tuple[set[tuple[int, ...]], float]:
        found = checker.pairs_within(q, laid, 1e-3)
        return named & {tuple(sorted(pair)) for pair in found.geom.tolist()}, found.distance.min(initial=np.inf)

    pairs, deepest = met(Checker(scene, table, 0.05))
    assert pairs
    assert deepest < -0.01
    wire = wire_scene(scene)
    assert wire is not None
    assert not met(Checker(wire, table, 0.05, pair_gap=NEVER))[0]
