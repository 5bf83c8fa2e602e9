"""What is known of places on a bead: what only seems to bar the way does not count, and nothing free is overlooked."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.jobs.boss_motion import boss_case, job_of

from cell.planning.collision_free_rolls import FINEST, KnownRolls, checked_rolls, rolls_around
from cell.planning.configurations import BRANCHES
from cell.planning.context import Context
from cell.planning.cuts import cut_search
from cell.planning.cuts.cut_search import CutSearch
from cell.scene.scene import table_angles

BEAD = (14, 21)
COME, ON = 3, 10  # samples of the roll that are free at one place and at another


def context_of(folder, fixtures: list[dict] | None = None) -> Context:
    job = job_of(boss_case(folder, **({} if fixtures is None else {"fixtures": fixtures})))
    return Context.of(job, table_angles(job.scene, job.case.table.E1_deg, job.case.table.E2_deg))


@pytest.fixture(scope="module")
def boss(tmp_path_factory) -> Context:
    return context_of(tmp_path_factory.mktemp("boss"))


@pytest.mark.parametrize("allowed", [False, True])
def test_what_limits_forbid_at_two_places_bars_the_way_only_if_they_do_all_along(boss, monkeypatch, allowed):
    search = CutSearch(boss, *BEAD)
    rolls, places = rolls_around(boss, search.step), [0, int(search.place[-1])]
    for place, free in zip(places, (COME, ON), strict=True):
        room = np.full((BRANCHES, len(rolls)), -np.inf)
        room[:, free] = 0.1
        search._sampled[place] = cut_search._Sampled(room, np.zeros((*room.shape, 6)))
        search._known[place] = known(rolls, room[0])
        search._closely.update({(place, g): rolls[[free]] for g in range(BRANCHES)})
    monkeypatch.setattr(search, "_allowed", lambda Ts, some: np.full((len(Ts), BRANCHES, some.shape[1]), allowed))
    assert search.cut(places, 0) == tuple(places)  # so it seems
    assert search.confirmed({0: places}) == ({} if allowed else {0: tuple(places)})


def known(roll: np.ndarray, room: np.ndarray) -> KnownRolls:
    """Rolls of target 0 in branch 0."""
    none = np.zeros(len(roll), dtype=int)
    pair, position = np.full((len(roll), 2), -1), np.full((len(roll), 3), np.nan)
    return KnownRolls(none, none, roll, np.zeros((len(roll), 6)), room, np.zeros(len(roll)), pair, position)


@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("at_end", [-np.inf, -0.01])
def test_rolls_that_limits_allow_between_samples_are_checked(boss, monkeypatch, at_end, mirrored):
    """From the sample that is allowed up to 7.3 degrees, and from 10 to 13 degrees; the next sample is forbidden."""
    looked: list[float] = []

    def allowed(_, rolls: np.ndarray) -> np.ndarray:
        deg = np.rad2deg(15 * np.pi / 180 - rolls if mirrored else rolls)
        return np.repeat(((deg < 7.3) | ((deg > 10) & (deg < 13)))[:, None], BRANCHES, axis=1)

    def noted(context: Context, target: np.ndarray, roll: np.ndarray, *rest, **more) -> KnownRolls:
        looked.extend(np.rad2deg(roll))
        return checked_rolls(context, target, roll, *rest, **more)

    search = CutSearch(boss, *BEAD)
    monkeypatch.setattr(search, "_allowed", allowed)
    monkeypatch.setattr(cut_search, "checked_rolls", noted)
    rooms = [at_end, -np.inf]
    found = search._with_edges(
        known(np.deg2rad([0.0, 15.0]), np.array(rooms[::-1] if mirrored else rooms)), np.array([0])
    )
    assert len(found.roll) == 2 + len(looked)
    deg = 15 - np.array(looked) if mirrored else np.array(looked)
    assert ((deg > 10) & (deg < 13)).any()
    if np.isinf(at_end):  # nothing is known of what is allowed there
        assert ((deg > 0) & (deg < 7.3)).any()
        return
    before, after = deg[deg < 7.3].max(), deg[(deg >= 7.3) & (deg < 10)].min()
    assert after - before <= np.rad2deg(FINEST)


def test_what_a_wrist_has_in_common_with_its_flip_is_asked_about_once_and_nothing_else_is_taken_over(tmp_path):
    wall = {"name": "wall", "box": {"size_mm": [1000, 10, 800]}, "position_mm": [1500, 0, 900]}
    context = context_of(tmp_path, [wall])
    some = np.arange(0, 21, 4)
    rolls = rolls_around(context, np.deg2rad(15.0))
    target, roll = np.repeat(some, len(rolls)), np.tile(rolls, len(some))
    asked = []
    found = []
    for flips in (True, False):
        before = context.asked
        found.append(checked_rolls(context, target, roll, flips=flips))
        asked.append(context.asked - before)
    shared = found[0]
    at = np.flatnonzero(np.isfinite(shared.room))
    truth = context.screen.clearances(shared.q[at], context.deposits_before[shared.target[at]]).distance
    truth -= context.settings.clearance
    assert ((truth < 0) == (shared.room[at] < 0)).all()
    assert (truth <= shared.room[at] + 1e-5).all()  # it may be deeper in something else
    assert asked[0] < 0.9 * asked[1]
    assert (found[1].room[at] < 0).sum() == (truth < 0).sum() > 100
    assert ((shared.pair[at, 0] < 0) & (found[1].pair[at, 0] >= 0)).sum() > 20


def test_links_of_the_wrist_are_those_that_its_other_configuration_has_elsewhere(boss):
    scene, wrist = boss.checker.scene, boss.wrist_geom
    names = {scene.model.body(scene.model.geom_bodyid[g]).name for g in np.flatnonzero(wrist)}
    assert names == {"link_4", "link_5"}
    assert not (wrist & (scene.tool_geom | ~scene.arm_geom)).any()
    assert replace(boss).wrist_geom.tolist() == wrist.tolist()
