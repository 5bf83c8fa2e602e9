"""Arms a little off their class: solved on their own chain, bounded in the proofs."""

from __future__ import annotations

import numpy as np
import pytest
from support.cells.arms import kr70, random_class_arm, random_pose, replaced, sampled, welder

from ik.chain import Chain, rotation_about
from ik.closed_form import solve
from ik.reachability_proof import certify
from ik.roll import RollWindow, apply_roll
from ik.roll_bounds import RollBounds
from ik.singularity import SingularityLimits, margins
from ik.solver import Solver
from ik.spherical_wrist import TOLERANCE, recognise


def shaken(chain: Chain, by: float, seed: int) -> Chain:
    """A chain whose frames are off by about ``by`` (m and rad) each, as rounding to a few digits leaves them."""
    rng = np.random.default_rng(seed)
    off = np.tile(np.eye(4), (chain.n, 1, 1))
    for T in off:
        axis = rng.normal(size=3)
        T[:3, :3] = rotation_about(axis / np.linalg.norm(axis), np.array(by * rng.uniform(-1, 1)))
        T[:3, 3] = by * rng.uniform(-1, 1, 3)
    return replaced(chain, origins=chain.origins @ off)


def arms(by: float):
    yield shaken(kr70(), by, 0)
    yield shaken(welder(), by, 1)
    yield from (shaken(random_class_arm(np.random.default_rng(k), bent_wrist=k % 2 == 1), by, k) for k in range(4))


@pytest.mark.parametrize("by", [1e-5, 5e-5])
def test_bounds_hold_and_solutions_are_the_chains_own(by):
    for chain in arms(by):
        assert recognise(chain) is None
        form = recognise(chain, TOLERANCE)
        assert form is not None
        assert form.off is not None
        q = sampled(chain, 300, 2)
        Ts = chain.forward(q)
        found = solve(form, Ts)
        ok = np.isfinite(found[..., 0])
        again = chain.forward(found[ok])
        assert np.abs(again - np.repeat(Ts, ok.sum(axis=1), axis=0)).max() < 1e-8
        # the configuration it was made of is among them, unless it is next to a singularity
        clear = (margins(chain, form, q)[:, :3] > (0.05, 0.05, 0.02)).all(axis=1)
        gap = np.abs((found - q[:, None] + np.pi) % (2 * np.pi) - np.pi).max(axis=-1)
        assert np.nanmin(np.where(ok, gap, np.inf), axis=1)[clear].max() < 1e-6


def test_the_bound_on_the_tcp_holds_and_is_not_idle():
    """Against the same joint angles on an arm of the class put together from the recognised axes alone."""
    for chain in arms(1e-4):
        form = recognise(chain, TOLERANCE)
        points = _points(form, chain)
        q = sampled(chain, 2000, 3)
        T, U = chain.forward(q), _product(form, points, q)
        away = np.linalg.norm(T[:, :3, 3] - U[:, :3, 3], axis=1).max()
        turned = np.linalg.norm(T[:, :3, :3] - U[:, :3, :3], axis=(1, 2)).max() / np.sqrt(2)
        assert away <= form.off.length <= 12 * away
        assert turned <= form.off.angle * 1.01 <= 8 * turned


def _points(form, chain):
    wrist = form.R_tcp_0 @ form.wrist_in_tcp + chain.forward(np.zeros((1, 6)))[0, :3, 3]
    p = chain.frames(np.zeros((1, 6)))[1][0]
    return np.array([p[0], p[1], p[2], wrist, wrist, wrist])


def _product(form, points, q):
    """Forward kinematics as a product of rotations about lines, apart from the code under test."""
    n = len(q)
    T = np.tile(np.eye(4), (n, 1, 1))
    wrist = points[5]
    for axis, point, angle in zip(form.axes, points, q.T, strict=True):
        turn = np.tile(np.eye(4), (n, 1, 1))
        turn[:, :3, :3] = rotation_about(axis, angle)
        turn[:, :3, 3] = point - turn[:, :3, :3] @ point
        T = T @ turn
    end = np.eye(4)
    end[:3, :3], end[:3, 3] = form.R_tcp_0, wrist - form.R_tcp_0 @ form.wrist_in_tcp
    return T @ end


def test_what_is_called_proved_is_found_by_no_dense_search():
    refuted = proved = 0
    window, limits = RollWindow(-0.6, 0.9), SingularityLimits()
    for k, chain in enumerate(arms(2e-5)):
        rng = np.random.default_rng(k)
        tight = replaced(chain, lower=np.full(6, -1.6), upper=rng.uniform(0.2, 1.8, 6))
        form = recognise(tight, TOLERANCE)
        Ts = chain.forward(sampled(chain, 30, k))
        for w in (window, RollWindow.fixed(0.3)):
            out = certify(tight, Ts, w, limits, form).unreachable
            rolls = w.samples(np.deg2rad(2.0))
            q = Solver.for_chain(tight).candidates(apply_roll(Ts[out][:, None], rolls).reshape(-1, 4, 4)).q
            keeps = (margins(tight, form, q) >= limits.values(True)).all(axis=-1) & np.isfinite(q[..., 0])
            refuted += int(keeps.any(axis=(1, 2)).reshape(-1, len(rolls)).any(axis=1).sum())
            proved += int(out.sum())
    assert refuted == 0
    assert proved > 50


def test_a_proof_near_the_edge_allows_for_the_deviation():
    """Targets made by the chain itself, at the very limit of a joint: no interval with their roll is excluded."""
    for k, chain in enumerate(arms(1e-4)):
        form = recognise(chain, TOLERANCE)
        q = sampled(chain, 400, k, inside=0.3)
        q = q[(margins(chain, form, q)[:, :3] > (0.1, 0.1, 0.06)).all(axis=1)]
        at = k % 6
        q[:, at] = 0.4
        limit = replaced(chain, upper=np.where(np.arange(6) == at, 0.4, chain.upper))
        Ts = chain.forward(q)
        keeps = (margins(chain, form, q)[:, :3] > (0.1, 0.1, 0.06)).all(axis=1)
        bounds = RollBounds.of(limit, form, Ts[keeps], SingularityLimits())
        target = np.arange(keeps.sum())
        for half in (0.0, 1e-4):
            assert bounds.judge(target, np.full(len(target), half / 2), half).open.all()


def test_a_proof_at_one_roll_allows_for_the_deviation_where_the_arm_is_stretched():
    """Targets made by the chain with its elbow nearly straight: the arm next to it may not get there."""
    limits, lost = SingularityLimits(wrist=0.0, elbow=0.0, shoulder=0.0), 0
    for k, chain in enumerate(arms(1e-4)):
        form = recognise(chain, TOLERANCE)
        q = sampled(chain, 200, k, inside=0.3)
        A3 = np.linspace(chain.lower[2], chain.upper[2], 4001)
        bent = margins(chain, form, np.where(np.arange(6) == 2, A3[:, None], q[0]))[:, 1]
        q[:, 2] = A3[np.argmin(bent)] + np.linspace(-2e-3, 2e-3, len(q))
        q = q[((q > chain.lower) & (q < chain.upper)).all(axis=1)]
        Ts = chain.forward(q)
        assert not certify(chain, Ts, RollWindow.fixed(0.0), limits, form).unreachable.any()
        lost += int(np.isnan(solve(form, Ts)[..., 0]).all(axis=1).sum())
    assert lost > 10


def test_random_poses_of_a_tool_are_solved_alike_by_the_arm_and_the_one_next_to_it():
    exact = welder()
    near = shaken(exact, 2e-5, 9)
    limits, window = SingularityLimits(), RollWindow.free()
    Ts = exact.forward(sampled(exact, 80, 4)) @ random_pose(np.random.default_rng(1), 0.5)
    a = certify(exact, Ts, window, limits, recognise(exact))
    b = certify(near, Ts, window, limits, recognise(near, TOLERANCE))
    assert (a.state == b.state).mean() > 0.95
