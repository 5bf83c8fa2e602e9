"""Rows that are put between others: on the bead, checked, and refused where they do not hold."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cell.case.read import load_case
from cell.failure import Kind
from cell.job.job import prepare
from cell.planning.bead_plan import plan_bead
from cell.planning.context import Context
from cell.planning.edges.densify import BeadTolerance, densified
from cell.planning.edges.edge_check import Stretch
from cell.scene.scene import table_angles
from cell.shipped import DEFAULT_CASE


@pytest.fixture(scope="module")
def context() -> Context:
    case = load_case(DEFAULT_CASE)
    job = prepare(case)
    table = table_angles(job.scene, case.table.E1_deg, case.table.E2_deg)
    return Context.of(job, table)


@pytest.fixture(scope="module")
def bead(context: Context) -> Stretch:
    """The first bead, round the hub, where the wire swings most."""
    stop = int(np.flatnonzero(np.diff(context.laid))[0]) + 1
    plan = plan_bead(context, 0, stop, None)
    assert plan.whole
    return plan.stretches[0]


def off_and_askew(context: Context, stretch: Stretch, between: float) -> tuple[np.ndarray, np.ndarray]:
    """Of straight joint motion, m and rad, with the direction interpolated between the targets."""
    q = (1 - between) * stretch.q[:-1] + between * stretch.q[1:]
    T = context.solver.chain.forward(q)
    k = stretch.edge[:-1]
    a, b = context.placed.position[k], context.placed.position[k + 1]
    s = (((T[:, :3, 3] - a) * (b - a)).sum(1) / ((b - a) ** 2).sum(1))[:, None]
    na, nb = context.placed.normal[k], context.placed.normal[k + 1]
    swing = np.arccos(np.clip((na * nb).sum(1), -1, 1))[:, None]
    sine = np.where(swing > 1e-6, np.sin(swing), 1.0)
    mixed = np.where(swing > 1e-6, (np.sin((1 - s) * swing) * na + np.sin(s * swing) * nb) / sine, na)
    wire_angle = np.arctan2(np.linalg.norm(np.cross(T[:, :3, 2], mixed), axis=1), -(T[:, :3, 2] * mixed).sum(1))
    return np.linalg.norm(T[:, :3, 3] - a - s * (b - a), axis=1), wire_angle


def test_rows_are_put_where_straight_joint_motion_leaves_the_bead(context: Context, bead: Stretch) -> None:
    assert np.rad2deg(off_and_askew(context, bead, 0.5)[1].max()) > 0.05
    (dense,), failures = densified(context, [bead])
    assert failures == {}
    assert len(dense.q) > len(bead.q)
    for between in (0.0, 0.3, 0.5, 0.8):
        off, wire_angle = off_and_askew(context, dense, between)
        assert off.max() < 4e-5
        assert np.rad2deg(wire_angle.max()) < 0.04
    # nothing that was there is gone
    old = {tuple(q) for q in bead.q.round(12).tolist()}
    assert old <= {tuple(q) for q in dense.q.round(12).tolist()}
    again, _ = densified(context, [dense])
    assert len(again[0].q) == len(dense.q)


def test_of_several_beads_each_gets_the_rows_that_it_gets_by_itself(context: Context, bead: Stretch) -> None:
    """Two parts of a bead, as if they were beads that follow one another."""

    def part(a: int, b: int) -> Stretch:
        rows = slice(*np.searchsorted(bead.edge, [a, b]))
        names = ("edge", "fraction", "q", "position", "table", "low", "kept", "margin")
        own = {name: getattr(bead, name)[rows] for name in names}
        found = bead.clearances.rows(np.arange(len(bead.edge))[rows])
        return replace(bead, first=a, q_targets=bead.q_targets[a:b], roll=bead.roll[a:b], clearances=found, **own)

    some = [part(0, 4), part(4, 7)]
    together, failures = densified(context, some)
    assert failures == {}
    assert [one.first for one in together] == [0, 4]
    for one, stretch in zip(together, some, strict=True):
        (alone,), _ = densified(context, [stretch])
        assert len(alone.q) > len(stretch.q)
        assert one.q == pytest.approx(alone.q, abs=1e-12)
        assert (one.edge == alone.edge).all()
        assert one.fraction == pytest.approx(alone.fraction, abs=1e-12)
        assert (one.q_targets == stretch.q_targets).all()


def test_a_new_row_that_is_too_near_to_something_is_refused(context: Context, bead: Stretch) -> None:
    strict = replace(context, settings=replace(context.settings, clearance=0.049))
    _, failures = densified(strict, [bead])
    assert failures
    target, failure = next(iter(failures.items()))
    assert failure.from_target == target - 1
    assert failure.kind is Kind.COLLISION
    assert failure.reason == "no_path"
    assert (failure.limit, failure.unit) == (49.0, "mm")


def test_a_new_row_that_is_near_a_singularity_is_refused(context: Context, bead: Stretch) -> None:
    strict = replace(context, limits=replace(context.limits, wrist=np.deg2rad(89.0)))
    assert {f.kind for f in densified(strict, [bead])[1].values()} == {Kind.SINGULAR}


def test_what_stays_off_the_bead_is_no_bead(context: Context, bead: Stretch) -> None:
    _, failures = densified(context, [bead], BeadTolerance(wire_angle=np.deg2rad(0.001), halvings=1))
    assert failures
    assert {failure.kind for failure in failures.values()} == {Kind.JUMP}
    assert all(failure.from_target == i - 1 for i, failure in failures.items())


def test_new_rows_that_come_too_near_are_refused(context: Context, bead: Stretch) -> None:
    # the bead's own rows were passed before: what is found now is found of what is put between them
    beyond = float(bead.low.max()) + 1e-3
    (dense,), failures = densified(replace(context, settings=replace(context.settings, clearance=beyond)), [bead])
    assert len(dense.q) > len(bead.q)
    assert {failure.kind for failure in failures.values()} == {Kind.COLLISION}


def test_what_is_kept_by_a_new_row_is_what_the_step_keeps_less_how_far_the_row_is_off_it(
    context: Context, bead: Stretch
) -> None:
    (dense,), _ = densified(context, [bead], BeadTolerance(wire_angle=np.deg2rad(0.001), halvings=1))
    old = np.flatnonzero(np.isin(dense.q, bead.q).all(axis=1))
    assert len(old) == len(bead.q) < len(dense.q)
    off = 0.0
    for k, (a, b) in enumerate(zip(old[:-1].tolist(), old[1:].tolist(), strict=True)):
        if b == a + 2:
            away = np.abs(dense.q[a + 1] - (dense.q[a] + dense.q[b]) / 2) @ context.radius
            assert dense.kept[[a, a + 1]] == pytest.approx(bead.kept[k] - away, abs=1e-12)
            off = max(off, away)
        else:
            assert dense.kept[a] == bead.kept[k]
    assert off > 1e-6
