"""The roll certificate: witnesses that hold, proofs that nothing contradicts, and few targets left open."""

from dataclasses import dataclass

import numpy as np
import pytest
from support.cells.arms import (
    MODEL,
    chain_from_lines,
    kr70,
    random_class_arm,
    random_pose,
    replaced,
    sampled,
    welder,
    with_tool,
)

from cell.case.read import load_case
from cell.job.job import prepare
from cell.planning.configurations import nodes_at_rolls
from cell.scene.placement import place_targets
from ik.closed_form import solve, wrist_centre
from ik.joint_turns import with_turns
from ik.reachability_proof import REACHABLE, UNDECIDED, UNREACHABLE, certify
from ik.roll import RollWindow, apply_roll
from ik.roll_bounds import RollBounds
from ik.singularity import SingularityLimits, margins
from ik.spherical_wrist import SphericalWristArm, recognise

FREE = RollWindow.free()
PROPELLER = MODEL.parents[1] / "cases" / "propeller.case.yaml"


def form_of(chain) -> SphericalWristArm:
    form = recognise(chain)
    assert form is not None
    return form


def reached(chain, form, Ts, rolls, limits):
    """Which targets sampling finds: any of the rolls, any branch, any standing, (m,) booleans."""
    out = np.zeros(len(Ts), dtype=bool)
    for i, T in enumerate(Ts):
        q = with_turns(chain, solve(form, apply_roll(T, rolls)), packed=True)
        keeps = (margins(chain, form, q) >= limits.values(True)).all(axis=-1)
        out[i] = (keeps & np.isfinite(q[..., 0])).any()
    return out


def assert_consistent(chain, form, Ts, window, limits, found, rolls=720):
    """Witnesses reach, stay in the window and the limits, and keep the margins; no sample contradicts a proof."""
    ok = found.reachable
    poses = apply_roll(Ts[ok], found.roll[ok])
    np.testing.assert_allclose(chain.forward(found.q[ok]), poses, atol=1e-8)
    assert chain.within(found.q[ok], tolerance=0.0).all()
    assert (margins(chain, form, found.q[ok]) >= limits.values(True)).all()
    assert ((found.roll[ok] >= window.low) & (found.roll[ok] <= window.high)).all()
    assert np.isnan(found.roll[~ok]).all()
    assert np.isnan(found.q[~ok]).all()
    assert ((found.cause != "") == found.unreachable).all()
    assert ((found.axis >= 0) == (found.cause == "joint_limit")).all()
    samples = np.linspace(window.low, window.high, rolls)
    assert not reached(chain, form, Ts[found.unreachable], samples, limits).any()


@dataclass
class Case:
    """An arm with a tool, limits and margins, targets in and around its reach, and a window, all random."""

    seed: int
    count: int = 60

    def __post_init__(self):
        rng = np.random.default_rng(self.seed)
        chain = random_class_arm(rng, bent_wrist=self.seed % 3 == 0)
        if self.seed % 4:
            chain = with_tool(chain, random_pose(rng, 0.4))
        middle, half = rng.uniform(-1, 1, 6), rng.uniform(0.4, 4.5, 6)
        if self.seed % 2:
            half[[3, 5]] = rng.uniform(np.pi, 6, 2)
        if self.seed % 5 == 0:
            half = rng.uniform(2.5, 6, 6)
        self.chain = replaced(chain, lower=middle - half, upper=middle + half)
        self.form = form_of(self.chain)
        self.limits = SingularityLimits(rng.uniform(0, 0.4), rng.uniform(0, 0.4), rng.uniform(0, 0.2))
        if self.seed % 7 == 0:
            self.limits = SingularityLimits(0.0, 0.0, 0.0)
        within = self.chain.lower + rng.random((self.count, 6)) * (self.chain.upper - self.chain.lower)
        q = np.where(rng.random((self.count, 1)) < 0.4, within, rng.uniform(-3, 3, (self.count, 6)))
        self.Ts = self.chain.forward(q)
        self.Ts[::2, :3, 3] += rng.normal(size=self.Ts[::2, :3, 3].shape) * rng.choice([0.02, 0.2, 0.6])
        low = rng.uniform(-4, 4)
        self.window = [FREE, RollWindow(low, low + rng.uniform(0, 6)), RollWindow(low, low + rng.uniform(0.001, 0.5))][
            rng.integers(3)
        ]

    def certify(self):
        return certify(self.chain, self.Ts, self.window, self.limits, self.form)


def fuzz(seeds, rolls):
    states = np.zeros(3, dtype=int)
    for seed in seeds:
        case = Case(seed)
        found = case.certify()
        assert_consistent(case.chain, case.form, case.Ts, case.window, case.limits, found, rolls)
        states += np.bincount(found.state, minlength=3)
    assert states[UNDECIDED] <= 0.01 * states.sum()
    assert states[REACHABLE] > 0.2 * states.sum()
    assert states[UNREACHABLE] > 0.2 * states.sum()


@pytest.mark.slow
def test_no_proof_is_contradicted_on_random_arms():
    fuzz(range(60), rolls=96)


@pytest.mark.slow
def test_no_proof_is_contradicted_by_dense_sampling():
    fuzz(range(100, 108), rolls=1440)


def tight_around(chain, form, q, kind):
    """Limits that leave no room but at q (1, 6): of one joint, of all joints (6), or the margins (7)."""
    lower, upper = np.full(6, -7.0), np.full(6, 7.0)
    joints = [kind] if kind < 6 else list(range(6)) if kind == 6 else []
    lower[joints], upper[joints] = q[0, joints] - 1e-9, q[0, joints] + 1e-9
    least = margins(chain, form, q)[0] if kind == 7 else np.zeros(4)
    return replaced(chain, lower=lower, upper=upper), SingularityLimits(*least[:3])


@pytest.mark.parametrize("seed", [*range(15), *(pytest.param(k, marks=pytest.mark.slow) for k in range(15, 25))])
def test_an_interval_around_a_reachable_roll_is_never_excluded(seed):
    # the limits touch the configuration, so that a bound which misses it by anything would exclude it
    rng = np.random.default_rng(1000 + seed)
    chain = random_class_arm(rng, bent_wrist=bool(seed % 2))
    chain = with_tool(chain, random_pose(rng, 0.5)) if seed % 3 else chain
    form = form_of(chain)
    q = rng.uniform(-3, 3, (1, 6))
    near = 10 ** rng.uniform(-9, -1) * rng.choice([-1, 1])
    if seed % 5 == 1:  # close to a straight wrist
        q[0, 4] = form.wrist.base + rng.choice([0, np.pi]) + near
    if seed % 5 == 2:  # close to a stretched or folded elbow
        q[0, 2] = form.sign_3 * (np.angle(form.upper_arm) - np.angle(form.forearm) + rng.choice([0, np.pi])) + near
    T = chain.forward(q)
    for kind in range(8):
        bounds = RollBounds.of(*_with_form(tight_around(chain, form, q, kind), form, T))
        for half in (0.0, 1e-8, 1e-5, 1e-3, 0.03, 0.2, 0.7, 1.5, 1.7, np.pi):
            centre = np.concatenate([[0.0, half, -half], rng.uniform(-half, half, 5)])
            assert bounds.judge(np.zeros(8, dtype=int), centre, half).open.all(), (kind, half)


def _with_form(tight, form, T):
    chain, limits = tight
    return chain, form, T, limits


@pytest.mark.parametrize("seed", [*range(20), *(pytest.param(k, marks=pytest.mark.slow) for k in range(20, 40))])
def test_a_target_made_from_a_configuration_is_never_proven_out(seed):
    # reachable at one roll, by one configuration in limits as narrow as may be: a needle that bisection may miss
    rng = np.random.default_rng(2000 + seed)
    chain = with_tool(random_class_arm(rng, bent_wrist=bool(seed % 2)), random_pose(rng, 0.5))
    q = rng.uniform(-3, 3, 6)
    half = 10 ** rng.uniform(-9, 0, 6)
    at = rng.uniform(-1, 1, 6) * half
    chain = replaced(chain, lower=q - half - at, upper=q + half - at)
    form = form_of(chain)
    least = margins(chain, form, q)[:3] * rng.choice([0.0, 0.5, 1.0 - 1e-9], 3)
    low = rng.uniform(-3, 0)
    for window in (FREE, RollWindow(low, 0.0), RollWindow(low, low + 3.0), RollWindow.fixed(0.0)):
        roll = rng.uniform(window.low, window.high)
        T = apply_roll(chain.forward(q[None]), np.array([-roll]))
        assert certify(chain, T, window, SingularityLimits(*least), form).state[0] != UNREACHABLE


@pytest.fixture(scope="module")
def job():
    return prepare(load_case(PROPELLER))


def around_the_border(rng, count):
    """Poses with the TCP where the shipped arm's reach ends, the wire in any direction."""
    Ts = np.array([random_pose(rng, 0.0) for _ in range(count)])
    direction = rng.normal(size=(count, 3))
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    Ts[:, :3, 3] = direction * rng.uniform(1.5, 2.7, (count, 1)) + [0, 0, 0.575]
    return Ts


@pytest.mark.slow
def test_hardly_a_target_of_the_shipped_arm_is_left_open(job):
    chain, form, limits = job.solver.chain, form_of(job.solver.chain), job.singularity_limits
    Ts = around_the_border(np.random.default_rng(0), 2000)
    found = certify(chain, Ts, FREE, limits, form)
    assert found.undecided.sum() <= 2
    assert 300 < found.unreachable.sum() < 1000
    assert_consistent(chain, form, Ts[::4], FREE, limits, certify(chain, Ts[::4], FREE, limits, form), rolls=360)


@pytest.mark.parametrize("table", [(-45, 0), (90, 180)])
@pytest.mark.parametrize("degrees", [None, (-90, 90), (-60, -60), (30, 30)])
def test_the_propeller_agrees_with_sampled_candidates(job, table, degrees):
    window = FREE if degrees is None else RollWindow(*np.deg2rad(degrees))
    placed = place_targets(job.targets, job.scene.T_base_part(*np.deg2rad(table)))
    solver, limits = job.solver, job.singularity_limits
    nodes = nodes_at_rolls(solver, placed, window, np.deg2rad(30), limits)
    sampled_in = np.isfinite(nodes.cost).any(axis=(1, 2, 3))
    Ts = placed.Ts_base_target
    found = certify(solver.chain, Ts, window, limits, form_of(solver.chain))
    assert found.reachable[sampled_in].all()
    assert found.undecided.sum() <= 0.001 * len(Ts)
    assert_consistent(solver.chain, form_of(solver.chain), Ts, window, limits, found, rolls=36)
    if window.is_fixed:
        assert (found.reachable == sampled_in).all()
        for i in np.flatnonzero(found.unreachable):
            failure, _ = nodes.why_not(i)
            assert found.cause[i] == failure.reason
            if failure.reason == "joint_limit":
                assert solver.chain.names[found.axis[i]] == failure.axis


def moved_to(chain, wrist_at):
    """A pose of the arm with its wrist centre at a point of the base frame, (1, 4, 4)."""
    T = chain.forward(np.full((1, 6), 0.3))
    T[0, :3, 3] += wrist_at - wrist_centre(form_of(chain), T)[0]
    return T


def along_wire(chain):
    """The arm with a tool whose wire runs through the wrist centre: the roll does not move it."""
    form = form_of(chain)
    T = np.eye(4)
    T[:3, 3] = form.wrist_in_tcp
    return with_tool(chain, T)


@pytest.mark.parametrize("beyond", [-1e-3, -1e-10, 0.0, 1e-10, 1e-3])
@pytest.mark.parametrize("tool", [along_wire, lambda chain: chain, lambda _: welder()])
def test_a_wrist_centre_on_the_reach_sphere(beyond, tool):
    chain = tool(kr70())
    form, limits = form_of(chain), SingularityLimits(0.0, 0.0, 0.0)
    shoulder = form.origin + form.zeta_2.real * form.axes[0] + form.zeta_2.imag * form.e_r
    outwards = np.sign(form.zeta_2.imag) * form.e_r + 0.2 * form.axes[0]
    T = moved_to(chain, shoulder + (form.reach[1] + beyond) * outwards / np.linalg.norm(outwards))
    found = certify(chain, T, RollWindow(-1e-6, 1e-6), limits, form)
    assert_consistent(chain, form, T, RollWindow(-1e-6, 1e-6), limits, found)
    if beyond == 1e-3:
        assert found.state[0] == UNREACHABLE
        assert found.cause[0] == "unreachable"
    else:
        # 1e-10 beyond is what the padding leaves open
        assert found.state[0] != UNREACHABLE
    if beyond == -1e-3:
        assert found.state[0] == REACHABLE


@pytest.mark.parametrize("off", [0.0, 1e-12, 1e-9, 1e-6])
def test_a_wrist_centre_on_the_first_axis(off):
    half = np.deg2rad([185, 180, 180, 180, 125, 350.0])
    chain = replaced(along_wire(kr70()), lower=-half, upper=half)
    form = form_of(chain)
    T = moved_to(chain, np.array([off, 0.0, 1.4]))
    loose = certify(chain, T, FREE, SingularityLimits(0.0, 0.0, 0.0), form)
    assert loose.state[0] == REACHABLE
    strict = certify(chain, T, FREE, SingularityLimits(0.0, 0.0, 0.05), form)
    assert strict.state[0] == UNREACHABLE
    assert strict.cause[0] == "singular"
    # of the endlessly many angles of A1 the closed form shows one; outside the limits, that proves nothing
    narrow = replaced(chain, lower=np.concatenate([[np.deg2rad(100)], -half[1:]]))
    for window in (FREE, RollWindow.fixed(0.0)):
        assert certify(narrow, T, window, SingularityLimits(0.0, 0.0, 0.0), form).state[0] != UNREACHABLE or off > 1e-7


def test_a_straight_wrist_at_a_fixed_roll_proves_nothing_unless_the_margin_forbids_it():
    chain = kr70()
    q = np.deg2rad([[0, -90, 90, 40, 0, 30.0]])
    T = chain.forward(q)
    lower, upper = chain.lower.copy(), chain.upper.copy()
    lower[3], upper[3] = np.deg2rad([30, 50])  # the closed form leaves A4 at zero
    chain = replaced(chain, lower=lower, upper=upper)
    fixed, form = RollWindow.fixed(0.0), form_of(chain)
    assert certify(chain, T, fixed, SingularityLimits(0.0, 0.0, 0.0), form).state[0] == UNDECIDED
    assert certify(chain, T, fixed, SingularityLimits(), form).state[0] == UNREACHABLE


def test_inside_the_cylinder_of_a_lateral_offset_nothing_is_reachable():
    x, y, z = np.eye(3)
    wrist = np.array([0.9, 0.2, 1.2])
    p = np.array([0 * x, 0.4 * z, [0, 0, 1.1], wrist, wrist, wrist])
    chain = chain_from_lines(np.array([z, y, y, x, y, x]), p, np.random.default_rng(7))
    chain = along_wire(chain)
    form = form_of(chain)
    for distance, state in ((0.15, UNREACHABLE), (0.25, REACHABLE)):
        T = moved_to(chain, form.origin + 1.2 * form.axes[0] + distance * form.e_r)
        found = certify(chain, T, FREE, SingularityLimits(0.0, 0.0, 0.0), form)
        assert found.state[0] == state


def test_a_window_of_no_width_is_that_of_its_roll():
    chain = welder()
    form, limits = form_of(chain), SingularityLimits()
    rng = np.random.default_rng(3)
    Ts = apply_roll(chain.forward(rng.uniform(-3.2, 3.2, (400, 6))), rng.uniform(-3, 3, 400))
    fixed = certify(chain, Ts, RollWindow.fixed(0.4), limits, form)
    assert_consistent(chain, form, Ts, RollWindow.fixed(0.4), limits, fixed, rolls=1)
    assert (reached(chain, form, Ts, np.array([0.4]), limits) == fixed.reachable).all()
    assert not fixed.undecided.any()
    hair = certify(chain, Ts, RollWindow(0.4, 0.4 + 1e-12), limits, form)
    assert (hair.state == fixed.state).all()
    assert (hair.cause == fixed.cause).mean() > 0.95


def test_the_last_axis_of_350_degrees_excludes_nothing_and_a_narrow_one_does():
    chain = welder()
    form, limits = form_of(chain), SingularityLimits()
    q = sampled(chain, 300, seed=4, inside=0.02)
    Ts = chain.forward(q)
    keeps = (margins(chain, form, q) >= limits.values(True)).all(axis=-1)
    window = RollWindow(-0.02, 0.02)
    assert certify(chain, Ts, window, limits, form).reachable[keeps].all()
    # what stands at A6 = 300 stands at -60 as well, so +-350 must not be compared with wrapped angles
    upper = chain.upper.copy()
    upper[5] = chain.lower[5] + np.deg2rad(100)  # -350 .. -250 is 10 .. 110
    narrow = replaced(chain, upper=upper)
    found = certify(narrow, Ts, window, limits, form)
    assert_consistent(narrow, form, Ts, window, limits, found)
    assert found.reachable.any()
    assert (found.axis[found.unreachable] == 5).any()


def test_wider_windows_and_looser_margins_lose_nothing():
    case = Case(7)
    form, Ts = case.form, case.Ts
    strict = certify(case.chain, Ts, RollWindow(-0.5, 0.5), SingularityLimits(), form)
    wide = certify(case.chain, Ts, RollWindow(-1.5, 1.0), SingularityLimits(), form)
    loose = certify(case.chain, Ts, RollWindow(-0.5, 0.5), SingularityLimits(0.0, 0.0, 0.0), form)
    for more in (wide, loose):
        assert not more.unreachable[strict.reachable].any()
        assert not strict.reachable[more.unreachable].any()


def test_a_shifted_roll_zero_changes_nothing_of_a_free_roll():
    case = Case(8)
    turned = apply_roll(case.Ts, np.full(len(case.Ts), 1.234))
    one, other = (certify(case.chain, T, FREE, case.limits, case.form) for T in (case.Ts, turned))
    sure = ~one.undecided & ~other.undecided
    assert (one.state == other.state)[sure].all()


def test_batch_is_loop_and_blocks_change_nothing():
    case = Case(9, count=12)
    whole = case.certify()
    for i in range(12):
        one = certify(case.chain, case.Ts[i : i + 1], case.window, case.limits, case.form)
        assert one.state[0] == whole.state[i]
        assert one.cause[0] == whole.cause[i]
        np.testing.assert_allclose(one.q[0], whole.q[i], atol=1e-9)
    few = certify(case.chain, case.Ts, case.window, case.limits, case.form, block=5)
    np.testing.assert_array_equal(few.state, whole.state)
    assert certify(case.chain, case.Ts[:0], case.window, case.limits, case.form).q.shape == (0, 6)


def test_no_depth_leaves_hard_targets_undecided():
    chain = welder()
    Ts = around_the_border(np.random.default_rng(5), 300)
    shallow = certify(chain, Ts, FREE, SingularityLimits(), form_of(chain), max_depth=0)
    deep = certify(chain, Ts, FREE, SingularityLimits(), form_of(chain))
    assert shallow.undecided.any()
    decided = ~shallow.undecided
    assert (shallow.state == deep.state)[decided].all()


def test_what_cannot_be_used_is_refused():
    chain = kr70()
    form, limits = form_of(chain), SingularityLimits()
    with pytest.raises(ValueError, match="finite poses"):
        certify(chain, np.eye(4), FREE, limits, form)
    with pytest.raises(ValueError, match="finite poses"):
        certify(chain, np.full((1, 4, 4), np.nan), FREE, limits, form)
    with pytest.raises(ValueError, match="first_step"):
        certify(chain, np.eye(4)[None], FREE, limits, form, first_step=0.0)
