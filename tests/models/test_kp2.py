"""The positioner's model: the faceplate against a closed form, ranges, signs, and what touches what."""

import warnings

import mujoco
import numpy as np
import pytest
from support.paths import ROOT

XML = ROOT / "models" / "kp2_hv500" / "kp2_hv500.xml"
RANGE_DEG = [(-135, 135), (-185, 135)]
AXIS_HEIGHT, FACEPLATE = 0.350, 0.150  # m: tilt axis over the floor; faceplate over the axes' crossing


def load() -> tuple[mujoco.MjModel, mujoco.MjData]:
    model = mujoco.MjModel.from_xml_path(str(XML))
    return model, mujoco.MjData(model)


@pytest.fixture(scope="module")
def positioner() -> tuple[mujoco.MjModel, mujoco.MjData]:
    return load()


def table(model: mujoco.MjModel, data: mujoco.MjData, e1_deg: float, e2_deg: float) -> np.ndarray:
    data.qpos[:] = np.radians([e1_deg, e2_deg])
    mujoco.mj_kinematics(model, data)
    T = np.eye(4)
    T[:3, :3] = data.site("table").xmat.reshape(3, 3)
    T[:3, 3] = data.site("table").xpos
    return T


def closed_form(e1_deg: float, e2_deg: float) -> np.ndarray:
    """Lift to the tilt axis, Ry(-E1), Rz(E2), lift to the faceplate."""
    (s1, s2), (c1, c2) = np.sin(np.radians([e1_deg, e2_deg])), np.cos(np.radians([e1_deg, e2_deg]))
    T = np.eye(4)
    T[:3, :3] = [[c1 * c2, -c1 * s2, -s1], [s2, c2, 0], [s1 * c2, -s1 * s2, c1]]
    T[:3, 3] = [-FACEPLATE * s1, 0, AXIS_HEIGHT + FACEPLATE * c1]
    return T


def test_it_compiles_without_a_warning() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        model, data = load()
    mujoco.mj_forward(model, data)
    assert not data.warning.number.any()
    assert model.nq == model.nv == 2


def test_table_agrees_with_the_closed_form(positioner) -> None:
    low, high = np.transpose(RANGE_DEG)
    for q in np.random.default_rng(500).uniform(low, high, (500, 2)):
        np.testing.assert_allclose(table(*positioner, *q), closed_form(*q), rtol=0, atol=1e-12)


def test_home_is_the_level_faceplate(positioner) -> None:
    model, _ = positioner
    np.testing.assert_array_equal(model.key("home").qpos, [0, 0])
    expected = np.eye(4)
    expected[2, 3] = AXIS_HEIGHT + FACEPLATE
    np.testing.assert_allclose(table(*positioner, 0, 0), expected, atol=1e-15)


def test_positive_E1_turns_the_normal_from_z_towards_minus_x(positioner) -> None:
    np.testing.assert_allclose(table(*positioner, 90, 0)[:3, 2], [-1, 0, 0], atol=1e-15)
    np.testing.assert_allclose(table(*positioner, 30, 77)[:3, 2], [-0.5, 0, np.sqrt(3) / 2], atol=1e-15)


@pytest.mark.parametrize("e1_deg", [-135, -40, 0, 90, 135])
def test_positive_E2_is_counter_clockwise_about_the_normal(positioner, e1_deg: float) -> None:
    before, after = table(*positioner, e1_deg, 0), table(*positioner, e1_deg, 90)
    np.testing.assert_allclose(after[:3, 0], before[:3, 1], atol=1e-15)  # x goes where y was
    np.testing.assert_allclose(after[:3, 2], before[:3, 2], atol=1e-15)
    np.testing.assert_allclose(after[:3, 3], before[:3, 3], atol=1e-15)


def test_ranges_and_names(positioner) -> None:
    model, _ = positioner
    assert [model.joint(i).name for i in range(model.njnt)] == ["E1", "E2"]
    np.testing.assert_allclose(np.degrees(model.jnt_range), RANGE_DEG, atol=1e-9)
    assert model.jnt_limited.all()
    assert [model.site(i).name for i in range(model.nsite)] == ["table"]
    assert [model.key(i).name for i in range(model.nkey)] == ["home"]


def test_speeds_are_positive_one_an_axis(positioner) -> None:
    model, _ = positioner
    for name in ("max_speed_deg_s", "max_accel_deg_s2"):
        values = model.numeric(name).data
        assert values.shape == (2,)
        assert (values > 0).all()
    np.testing.assert_array_equal(model.numeric("payload_kg").data, [500])


def test_what_is_seen_never_collides_and_what_collides_is_named(positioner) -> None:
    model, _ = positioner
    groups = {2: [], 3: []}
    for g in range(model.ngeom):
        groups[int(model.geom_group[g])].append(model.geom(g))
    assert len(groups[2]) + len(groups[3]) == model.ngeom
    assert not any(g.contype[0] or g.conaffinity[0] for g in groups[2])
    assert all(g.contype[0] and g.conaffinity[0] for g in groups[3])
    assert {g.name for g in groups[3]} == {
        "pedestal_column",
        "pedestal_bearing",
        "tilt_arm",
        "turn_unit",
        "faceplate",
    }


def test_no_self_contact_over_the_whole_range(positioner) -> None:
    model, data = positioner
    for e1 in np.linspace(*RANGE_DEG[0], 55):
        for e2 in np.linspace(*RANGE_DEG[1], 17):
            table(model, data, e1, e2)
            mujoco.mj_collision(model, data)
            assert data.ncon == 0, (e1, e2)


def test_pairs_that_are_left_out_would_not_touch_or_belong_together(positioner) -> None:
    """The arm is 20 mm from the bearing at every E1, and free of the column."""
    model, data = positioner
    for e1 in np.linspace(*RANGE_DEG[0], 28):
        table(model, data, e1, 0)
        arm = [model.geom("tilt_arm").id]
        for other in ("pedestal_bearing", "pedestal_column"):
            g = sorted([*arm, model.geom(other).id])
            assert mujoco.mj_geomDistance(model, data, *g, 1.0, None) >= 0.0199, (e1, other)


def test_a_workpiece_on_the_faceplate_is_tested_against_the_pedestal() -> None:
    spec = mujoco.MjSpec.from_file(str(XML))
    spec.body("turn").add_geom(
        name="workpiece", type=mujoco.mjtGeom.mjGEOM_BOX, size=[0.05, 0.5, 0.05], pos=[0, 0, 0.2]
    )
    model = spec.compile()
    data = mujoco.MjData(model)
    touching = set()
    for e1 in (0, 120, 135):
        table(model, data, e1, 0)
        mujoco.mj_collision(model, data)
        touching |= {model.geom(g).name for pair in data.contact.geom for g in pair} if data.ncon else set()
    assert "workpiece" in touching
    assert touching & {"pedestal_column", "pedestal_bearing"}
