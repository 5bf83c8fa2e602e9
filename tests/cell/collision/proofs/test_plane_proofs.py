"""What planes prove is kept: nothing is nearer in any of many configurations, and few had to be looked at."""

import mujoco
import numpy as np
import pytest
from support.cells.random_cells import ARM, random_scenes, text, write_meshes

from cell import prepare
from cell.case.read import parse_case
from cell.collision.checker import Checker
from cell.collision.clearances import Clearances
from cell.collision.proofs.carried_planes import PairsBelow, StepBends, pairs_below
from cell.collision.proofs.convex_shapes import convex_shape
from cell.collision.proofs.motion_clearance import MotionSamples, clearance_along
from cell.collision.proofs.plane_proofs import PlaneProofs, proofs_of
from cell.collision.proofs.reach_radii import radii
from cell.collision.proofs.step_clusters import StepClusters, gather_steps
from cell.collision.table_clearances import with_table_axes
from cell.scene.compose import compose

REACH, STEPS = 0.3, 20
COUNT = 60  # steps


@pytest.fixture(scope="module")
def scenes(tmp_path_factory):
    return random_scenes(tmp_path_factory.mktemp("cells"), seed=11, count=4)


def motions(checker, rng, size):
    """Motions of STEPS steps that begin free, (3 (STEPS + 1), n), and which of them each sample belongs to."""
    chain = checker.scene.chain
    starts = rng.uniform(chain.lower, chain.upper, (120, chain.n))
    near = checker.clearances(starts, np.full(120, checker.scene.n_deposits)).distance
    starts = starts[np.argsort(np.where((near > 0.03) & (near < REACH), 0.0, 1.0), kind="stable")][:3]
    turns = rng.normal(size=(3, 1, chain.n)) * np.linspace(0, 1, STEPS + 1)[:, None]
    curves = rng.normal(size=(3, 1, chain.n)) * np.sin(np.linspace(0, 6, STEPS + 1))[:, None]
    q = starts[:, None] + size * (STEPS * turns + 3 * curves)
    return q.reshape(-1, chain.n), np.repeat(np.arange(3), STEPS + 1)


def dense(q, step, rng):
    """Configurations on steps, (k, 9, n)."""
    t = np.sort(np.append(rng.uniform(size=7), [0.0, 1.0]))[:, None]
    return q[step][:, None] + t * (q[step + 1] - q[step])[:, None]


@pytest.mark.parametrize(
    ("size", "wanted"), [(0.002, 0.06), (0.02, 0.005), pytest.param(0.03, 0.03, marks=pytest.mark.slow)]
)
def test_nothing_is_nearer_than_what_is_proved_to_be_kept(scenes, size, wanted):
    rng = np.random.default_rng(int(1e4 * size + 1e3 * wanted))
    tight = []
    for scene in scenes:
        checker = Checker(scene, tuple(rng.uniform(*scene.table_range.T)), REACH)
        q, apart = motions(checker, rng, size)
        step = np.flatnonzero(np.diff(apart) == 0)
        laid = np.sort(rng.integers(0, scene.n_deposits + 1, len(step)))
        for bend, covered in ((1e-3, False), (1.0, False), (1e-3, True)):
            proved = PlaneProofs(checker, covered=covered).along(q, step, laid, wanted, bend)
            every = dense(q, step, rng)
            near = checker.clearances(every.reshape(-1, q.shape[1]), np.repeat(laid, every.shape[1])).distance
            least = np.minimum(near, REACH).reshape(len(step), -1).min(axis=1)
            known = np.minimum(proved.kept, REACH)
            assert (known <= least + 1e-7).all()
            tight.append((least - known)[(known > wanted) & (least < REACH)])
            seen = np.flatnonzero(np.isfinite(proved.seen.distance))
            at = checker.clearances(q[seen], laid[np.minimum(np.searchsorted(step, seen), len(step) - 1)])
            assert (proved.seen.distance[seen] >= at.distance - 1e-6).all()
    assert len(np.concatenate(tight)) > 10
    # some of it is nearly as near as it is said to be at least
    assert np.min(np.concatenate(tight)) < (0.03 if size < 0.03 else 0.06)


def test_nothing_is_nearer_where_little_is_looked_at(scenes):
    """As above with one look at a whole motion, out to hardly more than what is wanted, and planes that many share."""
    rng = np.random.default_rng(21)
    known_of = []
    for scene in scenes:
        checker = Checker(scene, tuple(rng.uniform(*scene.table_range.T)), REACH)
        proofs = PlaneProofs(checker, spacings=(10.0,), beyond=(1e-3, 1e-3), one_plane=0.2)
        for size in (0.0005, 0.002, 0.005):
            q, apart = motions(checker, rng, size)
            step = np.flatnonzero(np.diff(apart) == 0)
            laid = np.full(len(step), scene.n_deposits)
            every = dense(q, step, rng)
            near = checker.clearances(every.reshape(-1, q.shape[1]), np.repeat(laid, 9)).distance
            least = np.minimum(near, REACH).reshape(len(step), -1).min(axis=1)
            each = [proofs.along(q, step[apart[step] == k], laid[apart[step] == k], 0.1, 1e-3) for k in range(3)]
            known = np.minimum(np.concatenate([proved.kept for proved in each]), REACH)
            assert (known <= least + 1e-7).all()
            known_of.append(known)
    assert (np.concatenate(known_of) > 0).sum() > 100


def test_no_point_of_the_arm_travels_further_than_it_is_said_to(scenes):
    rng = np.random.default_rng(13)
    share = []
    for scene in scenes:
        checker = Checker(scene, (0.0, 0.0), REACH)
        proofs = PlaneProofs(checker)
        q, _ = motions(checker, rng, 0.02)
        links = proofs._links
        poses = links.poses(q)
        sample = rng.permutation(len(q))
        travel, most = links.travel(poses, sample, np.arange(len(q))), np.zeros(len(q))
        for g in links.moving.tolist():
            shape, R, p = links.shape(g), poses.R[:, links.owner[g]], poses.p[:, links.owner[g]]
            at = shape.points @ np.swapaxes(R, 1, 2) + p[:, None]
            most = np.maximum(most, np.linalg.norm(at[sample] - at, axis=2).max(axis=1))
        assert (most <= travel + 1e-9).all()
        share.append(most[travel > 0] / travel[travel > 0])
    assert np.median(np.concatenate(share)) > 0.7


def test_between_a_steps_ends_no_point_of_the_arm_is_further_off_its_chord_than_it_is_said_to(scenes):
    rng = np.random.default_rng(29)
    share = []
    t = np.linspace(0, 1, 17)[:, None]
    for scene in scenes:
        proofs = PlaneProofs(Checker(scene, (0.0, 0.0), REACH))
        links = proofs._links
        for size in (1e-3, 0.02, 0.1, 0.7, 1.5):
            a = rng.uniform(scene.chain.lower, scene.chain.upper, (COUNT, scene.chain.n))
            b = a + size * rng.normal(size=a.shape)
            q, step = np.stack([a, b], axis=1).reshape(-1, a.shape[1]), 2 * np.arange(COUNT)
            poses, halfway = links.poses(q), links.poses((a + b) / 2)
            bend, most = proofs._bend(poses, halfway, step, np.abs(b - a)), np.zeros(COUNT)
            dense_poses = links.poses((a[:, None] + t * (b - a)[:, None]).reshape(-1, a.shape[1]))
            for g in links.moving.tolist():
                R, p = dense_poses.R[:, links.owner[g]], dense_poses.p[:, links.owner[g]]
                at = (links.shape(g).points @ np.swapaxes(R, 1, 2) + p[:, None]).reshape(COUNT, len(t), -1, 3)
                chord = at[:, :1] + t[None, :, None] * (at[:, -1:] - at[:, :1])
                most = np.maximum(most, np.linalg.norm(at - chord, axis=3).max(axis=(1, 2)))
            assert (most <= bend + 1e-12).all()
            share.append(np.median(most / bend))
    assert np.median(share) > 0.6


def test_over_planes_that_are_carried_along_nothing_is_nearer_than_said(scenes):
    """Held against the distances of the pairs themselves, between the ends of the steps as well."""
    rng = np.random.default_rng(31)
    rest: list[float] = []
    for scene in scenes:
        table = tuple(rng.uniform(*scene.table_range.T))
        checker = Checker(scene, table, REACH)
        proofs = PlaneProofs(checker)
        links, model, data = proofs._links, scene.model, mujoco.MjData(scene.model)
        data.qpos[scene.table_qpos] = table
        for size in (0.002, 0.05, 0.3):
            q, apart = motions(checker, rng, size)
            step = np.flatnonzero(np.diff(apart) == 0)
            turn = np.abs(q[step + 1] - q[step])
            poses, halfway = links.poses(q), links.poses((q[step] + q[step + 1]) / 2)
            laid = np.full(len(step), scene.n_deposits)
            clusters, of = gather_steps(links.places(poses), step, laid, 0.1)
            near = proofs._groups[0][0].pairs_within(q[clusters.at], clusters.laid, 0.2)
            below = pairs_below(links, near, np.flatnonzero(near.distance > 0))
            mine = np.flatnonzero(~proofs._endless(below.other))
            pairs = PairsBelow(*(getattr(below, name)[mine] for name in ("cluster", "geom", "other", "normal")))
            bends = StepBends(poses, halfway, step, turn)
            which, at, over = proofs._carried.over(poses, bends, pairs, clusters)
            known = dict(zip(zip(which.tolist(), at.tolist(), strict=True), over.tolist(), strict=True))
            for k in rng.permutation(len(pairs.cluster))[:60].tolist():
                some = np.flatnonzero(clusters.cluster[of] == pairs.cluster[k])
                i = int(rng.choice(some))
                told = min(known[k, int(of[i])], known[k, int(of[i]) + 1])
                true = np.inf
                for t in (0.0, 0.2, 0.35, 0.5, 0.65, 0.8, 1.0):
                    data.qpos[scene.arm_qpos] = (1 - t) * q[step[i]] + t * q[step[i] + 1]
                    mujoco.mj_kinematics(model, data)
                    pair = int(pairs.geom[k]), int(pairs.other[k])
                    true = min(true, mujoco.mj_geomDistance(model, data, *pair, 10.0, None))
                assert told <= true + 1e-6
                rest.append(true - told)
                # seen from its link no point of the other is further off its chord than is taken off
                j, first = int(links.owner[pairs.geom[k]]), (which == k) & (at == of[i])
                off = proofs._carried._bent(bends, pairs, which[first], clusters.sample[at[first]])
                way = q[step[i]] + np.linspace(0, 1, 9)[:, None] * (q[step[i] + 1] - q[step[i]])
                dense_poses, points = links.poses(way), links.shape(int(pairs.other[k])).points
                seen = np.einsum("tji,tvj->tvi", dense_poses.R[:, j], points - dense_poses.p[:, j, None])
                chord = seen[:1] + np.linspace(0, 1, 9)[:, None, None] * (seen[-1:] - seen[:1])
                assert np.linalg.norm(seen - chord, axis=2).max() <= off.item() + 1e-12
    assert len(rest) > 100
    assert np.quantile(rest, 0.2) < 2e-3


def test_along_a_flat_wall_few_samples_prove_all(scenes):
    rng = np.random.default_rng(3)
    asked = proved = 0
    for scene in scenes:
        checker = Checker(scene, tuple(rng.uniform(*scene.table_range.T)), REACH)
        q, apart = motions(checker, rng, 0.001)
        checker.asked.count = 0
        found = clearance_along(
            checker, radii(scene), MotionSamples(q, np.zeros(len(q), dtype=np.int64), apart, apart), 0.005
        )
        whole = np.setdiff1d(apart, apart[found.open])
        proved += int(np.isin(apart, whole).sum())
        asked += checker.asked.count if len(whole) == 3 else 0
    assert proved > 5 * STEPS
    assert 0 < asked < 0.7 * proved


@pytest.mark.parametrize("least", [0.005, pytest.param(0.05, marks=pytest.mark.slow)])
def test_a_clearance_is_kept_along_where_no_step_is_named(scenes, least):
    rng = np.random.default_rng(int(1e3 * least))
    named = closed = 0
    for scene in scenes:
        checker = Checker(scene, tuple(rng.uniform(*scene.table_range.T)), REACH)
        for size in (0.003, 0.03):
            q, apart = motions(checker, rng, size)
            deposits_laid = rng.integers(0, scene.n_deposits + 1, 3)[apart]
            # of a part that is too near one step at least is named
            part = 100 * apart + np.arange(len(q)) // (5 if size < 0.01 else STEPS)
            step = np.flatnonzero(np.diff(apart) == 0)
            found = clearance_along(checker, radii(scene), MotionSamples(q, deposits_laid, apart, part), least)
            every = dense(q, step, rng)
            near = checker.clearances(every.reshape(-1, q.shape[1]), np.repeat(deposits_laid[step], 9)).distance
            true = np.minimum(near, REACH).reshape(len(step), -1).min(axis=1)
            bad = np.unique(part[step[true < least - 1e-7] + 1])
            assert np.isin(bad, part[found.open + 1]).all()
            named += len(found.open)
            clear = ~np.isin(part[step + 1], part[found.open + 1])
            closed += int(clear.sum())
            assert (found.kept[step[clear]] >= least).all()
            assert (np.minimum(found.kept[step], REACH) <= true + 1e-7).all()
            low = np.minimum(checker.clearances(q, deposits_laid).distance, REACH)
            assert (np.minimum(found.low, REACH) <= low + 1e-6).all()
            assert (found.nearest.distance < least + 0.05).all()
            assert (found.nearest.pair >= 0).all()
    assert named > 10
    assert closed > 100


def test_shapes_reach_as_far_as_collision_detection_has_them(scenes):
    """The gap along the direction in which two shapes are apart is their distance."""
    rng = np.random.default_rng(8)
    kinds = set()
    for scene in scenes:
        checker = Checker(scene, (0.0, 0.0), REACH)
        model, data = scene.model, mujoco.MjData(scene.model)
        q = rng.uniform(scene.chain.lower, scene.chain.upper, (20, scene.chain.n))
        near = checker.pairs_within(q, np.full(20, scene.n_deposits), REACH)
        order = np.lexsort((near.distance, near.geom[:, 1], near.geom[:, 0], near.row))
        _, first = np.unique(np.column_stack([near.row, near.geom])[order], axis=0, return_index=True)
        for k in order[first].tolist():  # of a plane and a shape several points are told
            i, (a, b), distance, normal = near.row[k], near.geom[k].tolist(), near.distance[k], near.normal[k]
            if distance < 1e-3:
                continue
            data.qpos[scene.table_qpos], data.qpos[scene.arm_qpos] = 0.0, q[i]
            mujoco.mj_kinematics(model, data)
            one, other = (convex_shape(model, g, data.geom_xmat[g].reshape(3, 3), data.geom_xpos[g]) for g in (a, b))
            gap = -other.support(-normal) - one.support(normal)
            if model.geom_type[a] == model.geom_type[b] == mujoco.mjtGeom.mjGEOM_ELLIPSOID:
                continue
            kinds |= {int(model.geom_type[a]), int(model.geom_type[b])}
            assert gap <= distance + 1e-6
            if mujoco.mjtGeom.mjGEOM_ELLIPSOID not in model.geom_type[[a, b]]:
                assert gap >= distance - 1e-3
    assert len(kinds) > 4


def test_there_are_no_such_proofs_where_the_table_turns_as_well(scenes):
    scene = with_table_axes(scenes[0])
    assert proofs_of(Checker(scene, (0.0, 0.0), REACH)) is None
    assert proofs_of(Checker(scenes[0], (0.0, 0.0), REACH)) is not None


def test_every_pair_lies_on_either_side_of_a_plane(scenes):
    rng = np.random.default_rng(17)
    shared = 0
    for scene in scenes:
        checker = Checker(scene, (0.0, 0.0), REACH)
        proofs = PlaneProofs(checker, one_plane=0.2)
        q, _ = motions(checker, rng, 0.05)
        links, every = proofs._links, np.arange(len(q))
        poses = links.poses(q)
        clusters = StepClusters(every, np.full(len(q), scene.n_deposits), every, every)
        near = checker.pairs_within(q, clusters.laid, REACH)
        pairs = pairs_below(proofs._links, near, np.arange(len(near.row)))
        planes = proofs._shared.between(poses, clusters, pairs, near.distance)
        for row, pair in zip(near.row.tolist(), near.geom.tolist(), strict=True):
            b, a = sorted(pair, key=lambda g: links.owner[g])
            mine = (planes.cluster == row) & (planes.geom == a) & (planes.frame == links.owner[b])
            assert (links.shape(b).support(planes.normal[mine].T) <= planes.offset[mine] + 1e-9).any()
        shared += len(near.row) - len(planes.cluster)
    assert shared > 50


def test_steps_of_a_cell_lie_close_together_and_have_the_same_laid():
    rng = np.random.default_rng(19)
    shared = 0
    for spacing in (0.0, 0.3, 10.0):
        step = np.flatnonzero(rng.random(90) < 0.8)
        laid = np.sort(rng.integers(0, 3, len(step)))
        # back and forth, as a zigzag: neighbours in place are none in time
        along = np.abs((np.arange(91) * 0.1) % 2.0 - 1.0)
        places = np.stack([along, 0.02 * np.arange(91)], axis=1) + 0.01 * rng.random((91, 2))
        clusters, of = gather_steps(places, step, laid, spacing)
        assert (clusters.sample[of] == step).all()
        assert (clusters.sample[of + 1] == step + 1).all()
        assert (clusters.cluster[of] == clusters.cluster[of + 1]).all()
        assert (laid == clusters.laid[clusters.cluster[of]]).all()
        assert (np.diff(clusters.cluster) >= 0).all()
        middle = (places[step] + places[step + 1]) / 2
        for c in range(len(clusters.at)):
            mine = clusters.cluster[of] == c
            samples = clusters.sample[clusters.cluster == c]
            assert sorted(samples.tolist()) == sorted({*step[mine].tolist(), *(step[mine] + 1).tolist()})
            assert clusters.at[c] in samples
            assert np.ptp(middle[mine], axis=0).max() <= spacing * (1 + 1e-6) or mine.sum() == 1
            shared += int((np.diff(step[mine]) > 1).sum())
        which, at = clusters.samples_of(np.array([1, 0]))
        assert (clusters.cluster[at] == np.array([1, 0])[which]).all()
        assert len(at) == np.isin(clusters.cluster, [0, 1]).sum()
        assert (len(clusters.at) == len(step)) == (spacing == 0.0)
    assert shared > 10


class Posts:
    """Collision detection of a point in the plane of two joints, a metre a radian, against thin posts."""

    reach = 10.0

    def __init__(self, posts):
        self.posts = posts

    def travel_bound(self, radius, a, b):
        return np.linalg.norm(b - a, axis=1)

    def clearances(self, q, deposits_laid):
        apart = np.linalg.norm(q[:, None] - self.posts, axis=2).min(axis=1)
        return Clearances(apart, np.zeros((len(q), 2), dtype=np.int64), np.zeros((len(q), 3)))


def test_of_a_part_that_is_too_near_nothing_is_said_to_be_kept_that_is_not():
    rng = np.random.default_rng(23)
    near = 0
    for _ in range(60):
        q = np.cumsum(rng.normal(size=(24, 2)) * 0.2, axis=0)
        # in the middles of some steps, and further along others
        k = rng.integers(23, size=6)
        posts = Posts(q[k] + rng.choice([0.5, 0.21, 0.77], (6, 1)) * (q[k + 1] - q[k]) + rng.normal(size=(6, 2)) * 0.01)
        apart = np.zeros(24, dtype=np.int64)
        found = clearance_along(posts, np.ones(2), MotionSamples(q, apart, apart, np.arange(24) // 12), 0.03)
        every = dense(q, np.arange(23), rng).reshape(23, -1, 2)
        for i in range(23):
            true = posts.clearances(every[i], None).distance.min()
            assert found.kept[i] <= true + 1e-9
            near += true < 0.03
    assert near > 100


def arm_of_named_pairs():
    """An arm of which most shapes collide by what a contact pair names alone, as in MJCF they may."""
    inner = close = ""
    for i, (axis, at, turn, about) in enumerate(ARM):
        bits = "" if i == 1 else 'contype="0" conaffinity="0"'
        inner += (
            f'<body name="link_{i + 1}" pos="{text(at)}"><joint name="A{i + 1}" axis="{axis}" range="-{turn} {turn}"/>'
            f'<geom name="g{i + 1}" type="sphere" size="0.3" pos="{text(about)}" {bits}/>'
        )
        close += "</body>"
    return (
        f'<mujoco><compiler angle="degree"/><worldbody><body name="base_link">{inner}<site name="flange" '
        f'pos="0.185 0 0"/>{close}</body></worldbody><contact><pair geom1="g2" geom2="g6"/></contact></mujoco>'
    )


def test_what_a_contact_pair_alone_lets_collide_moves_with_its_link(tmp_path):
    write_meshes(tmp_path)
    (tmp_path / "robot.xml").write_text(arm_of_named_pairs(), encoding="utf-8")
    content = {
        "part": {"sub_volumes": ["boss.stl"], "body": {"radius_mm": 9, "z_mm": [0, 40]}},
        "robot": {"model": "robot.xml", "max_speed_deg_s": [100.0] * 6},
        "positioner": {"position_mm": [4500, 0, 0]},
        "floor": False,
    }
    case = parse_case(content, tmp_path / "cell.case.yaml")
    scene = compose(case, prepare(case).shape)
    checker, rng = Checker(scene, (0.0, 0.0), REACH), np.random.default_rng(1)
    starts = rng.uniform(scene.chain.lower, scene.chain.upper, (400, 6))
    near = checker.clearances(starts, np.zeros(400, dtype=np.int64))
    two = {scene.geom_name(g): g for g in range(scene.model.ngeom)}
    named = np.isin(near.pair, [two["g2"], two["g6"]]).all(axis=1)
    mine = named & (near.distance > 0.02) & (near.distance < 0.2)
    assert mine.sum() > 4
    for q in np.repeat(starts[mine], 2, axis=0):
        way = q + np.linspace(-1, 1, 30)[:, None] * rng.normal(size=6)
        laid = np.zeros(30, dtype=np.int64)
        proved = PlaneProofs(Checker(scene, (0.0, 0.0), REACH)).along(way, np.arange(29), laid[:29], 0.02, 1e-3)
        true = np.minimum(checker.clearances(way, laid).distance, REACH)
        assert (np.minimum(proved.kept, REACH) <= np.minimum(true[:-1], true[1:]) + 1e-7).all()
