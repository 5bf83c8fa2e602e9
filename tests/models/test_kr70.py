"""The robot's model: kinematics against the closed form's library, limits, names, and what touches what."""

import importlib.util
import itertools
import warnings
from pathlib import Path

import mujoco
import numpy as np
import pytest
from support.paths import ROOT

MODEL = ROOT / "models" / "kr70_r2100"
XML = MODEL / "kr70_r2100.xml"
LINKS = ["base_link", *(f"link_{i}" for i in range(1, 7))]
JOINTS = [f"A{i}" for i in range(1, 7)]
RANGE_DEG = [(-185, 185), (-175, 60), (-120, 165), (-180, 180), (-125, 125), (-350, 350)]
HOME_DEG = [0, -90, 90, 0, 0, 0]
# The arm as py-opw-kinematics takes it: lengths in m, angles in deg.
OPW = {"a1": 0.175, "a2": -0.050, "b": 0.0, "c1": 0.575, "c2": 0.890, "c3": 1.035, "c4": 0.185}
OPW_OFFSETS_DEG = (0, -90, 0, 0, 0, 0)
OPW_FLIPS = (True, False, False, True, False, True)


def load() -> tuple[mujoco.MjModel, mujoco.MjData]:
    model = mujoco.MjModel.from_xml_path(str(XML))
    return model, mujoco.MjData(model)


@pytest.fixture(scope="module")
def robot() -> tuple[mujoco.MjModel, mujoco.MjData]:
    return load()


def forward(model: mujoco.MjModel, data: mujoco.MjData, q_deg: object) -> set[tuple[str, ...]]:
    """Put the arm at a configuration; return the pairs of bodies that touch."""
    data.qpos[:] = np.radians(q_deg)
    mujoco.mj_kinematics(model, data)
    mujoco.mj_collision(model, data)
    bodies = model.geom_bodyid[data.contact.geom]
    return {tuple(sorted(model.body(b).name for b in pair)) for pair in bodies}


def flange_pose(data: mujoco.MjData) -> np.ndarray:
    T = np.eye(4)
    T[:3, :3] = data.site("flange").xmat.reshape(3, 3)
    T[:3, 3] = data.site("flange").xpos
    return T


def abc(a: float, b: float, c: float) -> np.ndarray:
    """KUKA's angles A, B, C (deg) as a rotation: Rz(A) Ry(B) Rx(C)."""
    (sa, sb, sc), (ca, cb, cc) = np.sin(np.radians([a, b, c])), np.cos(np.radians([a, b, c]))
    Rz = np.array([[ca, -sa, 0], [sa, ca, 0], [0, 0, 1]])
    Ry = np.array([[cb, 0, sb], [0, 1, 0], [-sb, 0, cb]])
    Rx = np.array([[1, 0, 0], [0, cc, -sc], [0, sc, cc]])
    return Rz @ Ry @ Rx


def test_it_compiles_without_a_warning() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        model, data = load()
    mujoco.mj_forward(model, data)
    assert not data.warning.number.any()
    assert model.nq == model.nv == 6


def test_flange_agrees_with_the_closed_form_library(robot) -> None:
    opw = pytest.importorskip("py_opw_kinematics")
    model, data = robot
    arm = opw.Robot(opw.KinematicModel(**OPW, offsets=OPW_OFFSETS_DEG, flip_axes=OPW_FLIPS), degrees=True)
    low, high = np.transpose(RANGE_DEG)
    q_deg = np.random.default_rng(70).uniform(low, high, (1000, 6))
    ours = np.empty((1000, 4, 4))
    for i, q in enumerate(q_deg):
        data.qpos[:] = np.radians(q)
        mujoco.mj_kinematics(model, data)
        ours[i] = flange_pose(data)
    np.testing.assert_allclose(ours, arm.batch_forward(q_deg).as_matrix(), rtol=0, atol=1e-9)


def test_home_is_where_the_source_says(robot) -> None:
    model, data = robot
    np.testing.assert_allclose(np.degrees(model.key("home").qpos), HOME_DEG, atol=1e-12)
    forward(model, data, HOME_DEG)
    T = flange_pose(data)
    np.testing.assert_allclose(T[:3, 3], [1.395, 0, 1.515], atol=1e-12)
    np.testing.assert_allclose(T[:3, :3], abc(0, 90, 0), atol=1e-12)
    np.testing.assert_allclose(T[:3, 2], [1, 0, 0], atol=1e-12)  # z away from the flange


def test_reach_is_2101_mm(robot) -> None:
    """The wrist's centre, furthest from A1's axis: the elbow stretched, arm level."""
    model, data = robot
    forward(model, data, [0, 0, np.degrees(np.arctan2(0.05, 1.035)), 0, 0, 0])
    wrist = data.body("link_5").xpos
    assert wrist[2] == pytest.approx(0.575)
    assert wrist[0] == pytest.approx(2.101, abs=5e-4)


def test_signs_are_those_of_the_teach_pendant(robot) -> None:
    model, data = robot

    def tip(joint: int, deg: float = 10.0) -> np.ndarray:
        forward(model, data, np.add(HOME_DEG, deg * np.eye(6)[joint]))
        return flange_pose(data)

    home = tip(0, 0.0)
    assert tip(0)[1, 3] < home[1, 3]  # A1 > 0: clockwise seen from above
    assert tip(1)[0, 3] > home[0, 3]  # A2 > 0: forward
    for pitch in (1, 2, 4):
        assert tip(pitch)[2, 3] < home[2, 3]  # A2, A3, A5 > 0: down
    for roll in (3, 5):  # A4, A6 > 0: about the flange's -z
        np.testing.assert_allclose(home[:3, :3].T @ tip(roll)[:3, :3], abc(-10, 0, 0), atol=1e-12)


def test_ranges_and_names(robot) -> None:
    model, _ = robot
    assert [model.joint(i).name for i in range(model.njnt)] == JOINTS
    np.testing.assert_allclose(np.degrees(model.jnt_range), RANGE_DEG, atol=1e-9)
    assert model.jnt_limited.all()
    assert [model.body(i).name for i in range(1, model.nbody)] == LINKS
    assert [model.site(i).name for i in range(model.nsite)] == ["flange"]
    assert [model.key(i).name for i in range(model.nkey)] == ["home"]
    assert model.body("link_6").id == model.site("flange").bodyid[0]


def test_speeds_and_accelerations_are_the_sources(robot) -> None:
    model, _ = robot
    speed = model.numeric("max_speed_deg_s").data
    assert speed.shape == (6,)
    assert (speed > 0).all()
    np.testing.assert_array_equal(speed, [180, 158, 160, 230, 230, 320])
    np.testing.assert_array_equal(model.numeric("max_accel_deg_s2").data, [350.2, 68.9, 80.0, 1007.9, 857.5, 966.4])
    np.testing.assert_array_equal(model.numeric("payload_kg").data, [70])
    np.testing.assert_allclose(
        [model.body(name).mass[0] for name in LINKS], [108.84, 175.3, 110.2, 77.2, 37.5, 16.9, 3.9]
    )


@pytest.mark.parametrize("link", LINKS)
def test_every_link_is_seen_in_group_2_and_checked_in_group_3(robot, link: str) -> None:
    model, _ = robot
    geoms = [model.geom(g) for g in range(model.ngeom) if model.geom_bodyid[g] == model.body(link).id]
    seen = [g for g in geoms if g.group[0] == 2]
    solid = [g for g in geoms if g.group[0] == 3]
    assert seen
    assert solid
    assert len(seen) + len(solid) == len(geoms)
    assert not any(g.contype[0] or g.conaffinity[0] for g in seen)
    assert all(g.contype[0] and g.conaffinity[0] for g in solid)
    assert [g.name for g in solid] == [f"{link}_collision_{i}" for i in range(1, len(solid) + 1)]


def test_collision_shapes_of_a_link_hang_together(robot) -> None:
    model, data = robot
    forward(model, data, HOME_DEG)
    for link in LINKS:
        left = {
            g for g in range(model.ngeom) if model.geom_group[g] == 3 and model.body(link).id == model.geom_bodyid[g]
        }
        front = {left.pop()}
        while front:
            g = front.pop()
            near = {k for k in left if mujoco.mj_geomDistance(model, data, min(g, k), max(g, k), 0.1, None) <= 1e-3}
            left -= near
            front |= near
        assert not left, [model.geom(g).name for g in left]


def test_no_link_touches_another_at_home_or_at_work(robot) -> None:
    model, data = robot
    assert forward(model, data, HOME_DEG) == set()
    low, high = [-120, -110, 40, -120, -100, -180], [120, -20, 130, 120, 100, 180]
    for q in np.random.default_rng(2).uniform(low, high, (400, 6)):
        assert forward(model, data, q) == set(), q


@pytest.mark.parametrize(
    ("q_deg", "pair"),
    [
        ([0, 0, 165, 0, 0, 0], ("link_1", "link_4")),  # forearm folded back onto the shoulder
        ([0, -175, -120, 0, 0, 0], ("base_link", "link_4")),  # laid back, forearm driven down behind
        ([0, 0, 150, 0, 0, 0], ("base_link", "link_5")),  # wrist into the base
    ],
)
def test_a_folded_arm_is_refused(robot, q_deg: list[float], pair: tuple[str, str]) -> None:
    model, data = robot
    low, high = np.transpose(RANGE_DEG)
    assert ((low <= q_deg) & (q_deg <= high)).all()
    assert pair in forward(model, data, q_deg)


def test_neighbours_are_free_over_their_own_ranges(robot) -> None:
    """What A1 and A5 alone can do is no contact: the two excludes hold."""
    model, data = robot
    pairs = [{model.body(e >> 16).name, model.body(e & 0xFFFF).name} for e in model.exclude_signature]
    assert sorted(map(sorted, pairs)) == [["base_link", "link_1"], ["link_4", "link_6"]]
    for a1, a5 in itertools.product(np.linspace(-185, 185, 9), np.linspace(-125, 125, 11)):
        assert forward(model, data, [a1, -90, 90, 0, a5, 0]) == set()


def test_a_tool_on_the_flange_stays_tested_against_the_forearm() -> None:
    spec = mujoco.MjSpec.from_file(str(XML))
    tool = mujoco.MjSpec()
    body = tool.worldbody.add_body(name="tool")
    body.add_geom(name="ball", type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.15, 0, 0], pos=[0, 0, 0.1])
    spec.attach(tool, site=spec.site("flange"), prefix="torch_")
    model = spec.compile()
    data = mujoco.MjData(model)
    assert forward(model, data, HOME_DEG) == set()
    assert forward(model, data, [0, -90, 90, 0, 125, 0]) == {("link_4", "torch_tool")}


def read_obj(path: Path) -> tuple[np.ndarray, np.ndarray]:
    rows = [line.split() for line in path.read_text(encoding="ascii").splitlines()]
    vertices = np.array([row[1:] for row in rows if row[0] == "v"], float)
    return vertices, np.array([row[1:] for row in rows if row[0] == "f"], int)


def test_shipped_meshes_are_what_the_builder_writes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    spec = importlib.util.spec_from_file_location("build_visuals", MODEL / "build_visuals.py")
    assert spec is not None
    assert spec.loader is not None
    builder = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(builder)
    monkeypatch.setattr(builder, "ASSETS", tmp_path)
    builder.main()
    shipped = sorted(p.name for p in (MODEL / "assets").iterdir())
    assert shipped == sorted(p.name for p in tmp_path.iterdir())
    for name in shipped:
        (v, f), (v_new, f_new) = read_obj(MODEL / "assets" / name), read_obj(tmp_path / name)
        np.testing.assert_array_equal(f, f_new)
        np.testing.assert_allclose(v, v_new, rtol=0, atol=1.01e-4)  # the last decimal written
