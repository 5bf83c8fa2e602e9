"""The composed cell: what collides with what, and that every piece can be swapped."""

import weakref

import mujoco
import numpy as np
import pytest
from support.cells.arm_models import arm

from cell.case.read import load_case
from cell.collision.checker import Checker
from cell.errors import InputError
from cell.job.job import prepare
from cell.mjcf.chain_from_model import chain_of
from cell.scene import compose
from cell.scene.composition import CellAssembly
from cell.scene.scene import table_angles
from cell.scene.standalone import standalone_xml
from cell.shipped import MODELS_DIR


def job_of(path):
    return prepare(load_case(path))


def test_the_chain_is_the_model(make_case):
    scene = job_of(make_case()).scene
    rng = np.random.default_rng(0)
    q = rng.uniform(scene.chain.lower, scene.chain.upper, (50, 6))
    data = mujoco.MjData(scene.model)
    for row, T in zip(q, scene.chain.forward(q), strict=True):
        data.qpos[scene.arm_qpos] = row
        mujoco.mj_kinematics(scene.model, data)
        assert np.allclose(data.site("tcp").xpos, T[:3, 3], atol=1e-12)
        assert np.allclose(data.site("tcp").xmat.reshape(3, 3), T[:3, :3], atol=1e-12)


def test_the_written_scene_is_the_same_cell(make_case, tmp_path):
    scene = job_of(make_case()).scene
    path = tmp_path / "cell.xml"
    path.write_text(standalone_xml(scene))
    model = mujoco.MjModel.from_xml_path(str(path))
    names = ("A1", "A2", "A3", "A4", "A5", "A6", "E1", "E2")
    for name in names:
        assert np.allclose(model.joint(name).range, scene.model.joint(name).range)
    a, b = mujoco.MjData(scene.model), mujoco.MjData(model)
    a.qpos[:] = b.qpos[:] = np.linspace(-0.5, 0.5, model.nq)
    for m, d in ((scene.model, a), (model, b)):
        mujoco.mj_kinematics(m, d)
    for site in ("flange", "tcp", "table", "part"):
        assert np.allclose(a.site(site).xpos, b.site(site).xpos, atol=1e-9)
    assert model.ngeom == scene.model.ngeom


def test_what_a_cell_was_compiled_from_is_not_kept(make_case, monkeypatch):
    """It takes two to three times the memory of the model."""
    made = []
    monkeypatch.setattr(
        compose, "CellAssembly", lambda *given: made.append(weakref.ref(it := CellAssembly(*given))) or it
    )
    job = job_of(make_case())
    assert [pieces() for pieces in made] == [None]
    assert not [value for value in vars(job.scene).values() if isinstance(value, mujoco.MjSpec)]


@pytest.mark.parametrize("many", [10**9, 0], ids=["few vertices", "many"])
def test_memory_is_given_back_once_a_large_cell_is_compiled(make_case, monkeypatch, many):
    given = []
    monkeypatch.setattr(compose, "MANY_VERTICES", many)
    monkeypatch.setattr(compose, "give_back", lambda: given.append(True))
    job_of(make_case())
    assert len(given) == (many == 0)


def test_composing_warns_of_nothing(make_case, recwarn):
    job_of(make_case())
    assert not [w for w in recwarn if "MuJoCo" in str(w.message) or "spec" in str(w.message)]


def test_only_the_wire_may_touch_the_part(make_case):
    model = job_of(make_case()).scene.model
    for g in range(model.ngeom):
        a = model.geom(g)
        if not (a.contype[0] or a.conaffinity[0]) or not a.name.startswith(("deposit/", "body/")):
            continue
        for name, meets in (("torch_wire", False), ("torch_nozzle_taper", True), ("link_3_collision_1", True)):
            b = model.geom(name)
            assert bool((a.contype & b.conaffinity) | (b.contype & a.conaffinity)) is meets
    wire, floor = model.geom("torch_wire"), model.geom("floor")
    assert (wire.contype & floor.conaffinity).item()


def test_the_torch_is_held_against_the_link_its_flange_hangs_on(make_case):
    scene = job_of(make_case()).scene
    pairs = {scene.model.pair(i).name for i in range(scene.model.npair)}
    assert any(name.startswith("torch_body~link_5") for name in pairs)


@pytest.mark.parametrize("what", ["floor", "table", "self"])
def test_collisions_are_found(what, make_case):
    scene = job_of(make_case()).scene
    checker = Checker(scene, (0.0, 0.0), 0.05)
    q = {"floor": [0, 10, 90, 0, 0, 0], "table": [0, -20, 85, 0, 60, 0], "self": [0, -60, 160, 0, 100, 0]}[what]
    found = checker.clearances(np.deg2rad([q]).astype(float), np.array([0]))
    assert found.distance[0] < 0
    assert all(scene.geom_name(int(g)) for g in found.pair[0])


def test_the_rest_position_is_free(make_case):
    scene = job_of(make_case()).scene
    assert Checker(scene, (0.0, 0.0), 0.05).clearances(scene.home[None], np.array([99])).distance[0] > 0.005


def test_a_wire_in_the_fixture_counts(make_case):
    # a plate right at the wire's end of the rest position
    scene = job_of(make_case()).scene
    tcp = (scene.T_world_base() @ scene.chain.forward(scene.home[None])[0])[:3, 3]
    plate = {"name": "plate", "box": {"size_mm": [4, 4, 4]}, "position_mm": [float(v) * 1e3 for v in tcp]}
    scene = job_of(make_case("plate", fixtures=[plate])).scene
    found = Checker(scene, (0.0, 0.0), 0.05).clearances(scene.home[None], np.array([0]))
    assert {scene.geom_name(int(g)) for g in found.pair[0]} == {"plate", "torch_wire"}


def test_moving_the_positioner_moves_the_part(make_case):
    a = job_of(make_case("a")).scene.T_base_part(0.2, 0.3)
    b = job_of(make_case("b", positioner={"position_mm": [1600, 50, 10]})).scene.T_base_part(0.2, 0.3)
    assert np.allclose(b[:3, 3] - a[:3, 3], [0.1, 0.05, 0.01], atol=1e-12)
    assert np.allclose(a[:3, :3], b[:3, :3])


def test_the_torchs_dimensions_come_from_the_case(make_case):
    a = job_of(make_case("a", tool={"dimensions": {"stick_out_mm": 12}})).scene.chain.T_last_tcp
    b = job_of(make_case("b", tool={"dimensions": {"stick_out_mm": 22}})).scene.chain.T_last_tcp
    assert np.allclose(b[:3, 3] - a[:3, 3], 0.010 * a[:3, 2], atol=1e-9)


def test_another_arm_is_a_path_and_names(make_case, tmp_path):
    # a copy under another name, with other joint names, is bound by the case alone
    text = (MODELS_DIR / "kr70_r2100" / "kr70_r2100.xml").read_text()
    for i in range(1, 7):
        text = text.replace(f'"A{i}"', f'"axis_{i}"')
    text = text.replace('meshdir="', f'meshdir="{MODELS_DIR / "kr70_r2100"}/')
    (tmp_path / "other.xml").write_text(text)
    joints = [f"axis_{i}" for i in range(1, 7)]
    scene = job_of(make_case(robot={"model": "other.xml", "joints": joints})).scene
    mine = job_of(make_case("mine")).scene
    assert scene.chain.names == tuple(joints)
    q = np.full((1, 6), 0.3)
    assert np.allclose(scene.chain.forward(q), mine.chain.forward(q))


def test_fixtures_of_every_shape_stand_where_they_are_told(make_case, tmp_path):
    import trimesh

    trimesh.creation.box((100, 100, 100)).export(tmp_path / "cube.stl")
    fixtures = [
        {"name": "box", "box": {"size_mm": [100, 100, 100]}, "position_mm": [0, 2000, 50]},
        {"name": "post", "cylinder": {"radius_mm": 50, "height_mm": 100}, "position_mm": [0, -2000, 50]},
        {"name": "cube", "mesh": "cube.stl", "position_mm": [-2000, 0, 50]},
        {"name": "clamp", "box": {"size_mm": [10, 10, 10]}, "position_mm": [200, 0, 5], "on": "table"},
    ]
    scene = job_of(make_case(fixtures=fixtures)).scene
    data = mujoco.MjData(scene.model)
    mujoco.mj_kinematics(scene.model, data)
    assert np.allclose(data.geom("box").xpos, [0, 2, 0.05])
    assert np.allclose(data.geom("post").xpos, [0, -2, 0.05])
    assert np.allclose(data.geom("cube").xpos, [-2, 0, 0.05])
    before = data.geom("clamp").xpos.copy()
    data.qpos[scene.table_qpos[1]] = np.pi / 2
    mujoco.mj_kinematics(scene.model, data)
    assert np.linalg.norm(data.geom("clamp").xpos - before) == pytest.approx(0.2 * np.sqrt(2), abs=1e-6)


def test_a_turn_outside_the_range_is_the_same_direction_inside_it(make_case):
    scene = job_of(make_case()).scene
    assert table_angles(scene, 0, 180) == pytest.approx((0, -np.pi))
    assert table_angles(scene, 0, 90) == pytest.approx((0, np.pi / 2))
    with pytest.raises(InputError, match="E1 = 140"):
        table_angles(scene, 140, 0)


def test_joints_that_cannot_be_bound_are_named(make_case):
    scene = job_of(make_case()).scene
    with pytest.raises(InputError, match="listed from the base to the flange"):
        chain_of(scene.model, ["A2", "A1", "A3", "A4", "A5", "A6"], "tcp", "base_link")
    with pytest.raises(InputError, match="no site named 'tip'"):
        chain_of(scene.model, ["A1"], "tip", "base_link")


@pytest.mark.parametrize("pedestal", ["", '<geom type="box" size="0.2 0.2 0.05"/>'])
def test_the_base_world_is_the_models_own_origin(make_case, tmp_path, pedestal):
    """As the programs' base it has to be the arm's, wherever the arm stands in the cell."""
    (tmp_path / "arm.xml").write_text(arm().replace('<body name="carriage">', f'{pedestal}<body name="carriage">', 1))
    place = {"position_mm": [300, -40, 200], "rotation_deg": [0, 0, 90]}
    scene = job_of(make_case(robot={"model": str(tmp_path / "arm.xml"), "base": "world", **place})).scene
    assert np.allclose(scene.T_world_base()[:3, 3], [0.3, -0.04, 0.2])
    assert np.allclose(scene.T_world_base()[:3, 0], [0, 1, 0])
    assert np.allclose(scene.chain.origins[0][:3, 3], 0)
