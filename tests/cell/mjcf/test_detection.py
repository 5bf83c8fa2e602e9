"""MuJoCo's collision detection as scenes use it, against a second engine: nothing deeper than 0.2 mm is missed."""

from itertools import combinations_with_replacement, product
from types import SimpleNamespace

import mujoco
import numpy as np
import pytest
import yaml
from support.cells.random_cells import KINDS, put, random_cell, random_pair, write_meshes

from cell.case.read import load_case, parse_case
from cell.collision.checker import Checker
from cell.errors import InputError
from cell.job.job import prepare
from cell.mjcf.detection import lean_cylinders, make_detectable
from cell.scene.compose import compose

DEEP = 2e-4  # m that nothing deeper than is missed
EXACT = 1e-4  # m
REACHES = (6e-4, 0.05, 0.3)  # m: the last beyond any that is asked for
PAIRS = [pair for pair in combinations_with_replacement(KINDS, 2) if pair != ("plane", "plane")]


def detectable(spec):
    make_detectable(spec, SimpleNamespace(path="pair"))


def seen(data, reach):
    """The least distance that MuJoCo reports out to a reach, as the checker asks for it."""
    model = data.model
    model.geom_gap[:], model.body_margin[:] = reach / 2, reach / 2
    mujoco.mj_collision(model, data)
    return float(data.contact.dist.min()) if data.ncon else np.inf


@pytest.mark.parametrize(("one", "two"), PAIRS, ids=["-".join(pair) for pair in PAIRS])
def test_pairs_of_all_kinds_are_as_far_apart_as_a_second_engine_says(one, two):
    pytest.importorskip("coal")
    from support.oracles import second_engine as engine

    rng = np.random.default_rng(KINDS.index(one) * 10 + KINDS.index(two))
    hits = near = 0
    for _ in range(12):
        plain, model = random_pair(rng, one, two, detectable)
        datas = [mujoco.MjData(plain), mujoco.MjData(model)]
        shapes = [engine.shape_of(plain, g) for g in range(2)]
        for _ in range(12):
            put(rng, datas)
            poses = [engine.placed(datas[0], g) for g in range(2)]
            true = engine.signed_distance(shapes[0], poses[0], shapes[1], poses[1])
            straight = mujoco.mj_geomDistance(model, datas[1], 0, 1, 0.05, np.zeros(6))
            for reach in REACHES:
                found = seen(datas[1], reach)
                if true < -DEEP:
                    assert found < 0, (true, found, reach)
                    assert straight <= 0, (true, straight)
                    hits += 1
                elif true > EXACT:
                    assert abs(min(found, reach) - min(true, reach)) < EXACT, (true, found, reach)
                    assert abs(min(straight, 0.05) - min(true, 0.05)) < EXACT
                    near += true < 0.3
    assert hits > 60
    assert near > 5


@pytest.mark.parametrize(
    "kind", ["cylinder", *(pytest.param(kind, marks=pytest.mark.slow) for kind in ("box", "mesh"))]
)
def test_small_and_thin_shapes_are_found_out_to_a_reach_a_hundred_times_their_size(kind):
    pytest.importorskip("coal")
    from support.oracles import second_engine as engine

    rng = np.random.default_rng((6, KINDS.index("cylinder"), KINDS.index(kind)))
    hits = 0
    for _ in range(75):
        plain, model = random_pair(rng, "cylinder", kind, detectable, 5e-4)
        datas = [mujoco.MjData(plain), mujoco.MjData(model)]
        shapes = [engine.shape_of(plain, g) for g in range(2)]
        for _ in range(20):
            put(rng, datas)
            poses = [engine.placed(datas[0], g) for g in range(2)]
            true = engine.signed_distance(shapes[0], poses[0], shapes[1], poses[1])
            found = seen(datas[1], 0.3)
            if true < -DEEP:
                assert found < 0, (true, found)
                hits += 1
            elif true > EXACT:
                assert abs(min(found, 0.3) - min(true, 0.3)) < EXACT, (true, found)
    assert hits > 300


def test_random_cells_of_all_kinds_are_as_clear_as_a_second_engine_says(tmp_path):
    pytest.importorskip("coal")
    from support.oracles import second_engine as engine

    write_meshes(tmp_path)
    rng = np.random.default_rng(3)
    part = prepare(random_cell(rng, tmp_path)).shape
    hits = 0
    for _ in range(4):
        case = random_cell(rng, tmp_path)
        scene = compose(case, part)
        other = engine.SecondEngine(scene, case, part)
        table = rng.uniform(*scene.table_range.T)
        q = rng.uniform(scene.chain.lower, scene.chain.upper, (15, scene.chain.n))
        deposits_laid = rng.integers(0, scene.n_deposits + 1, len(q))
        found = Checker(scene, tuple(table), 0.05).clearances(q, deposits_laid)
        for k in range(len(q)):
            true, _ = other.nearest(q[k], table, deposits_laid[k], 0.05)
            if true < -DEEP:
                assert found.distance[k] < 0
                hits += 1
            elif true > 0:
                assert abs(min(found.distance[k], 0.05) - min(true, 0.05)) < EXACT
    assert hits > 5


def test_an_arm_of_capsules_behind_a_wall_is_in_it_whether_it_is_a_box_or_a_mesh(make_case, tmp_path):
    import trimesh

    trimesh.creation.box((20.0, 4000.0, 4000.0)).export(tmp_path / "wall.stl")
    arm = tmp_path / "arm.xml"
    joint = '<joint name="{}" axis="0 {} {}" range="-170 170"/>'
    wrist = '<site name="flange" pos="0.1 0 0"/>'
    for k in (6, 5, 4, 3):
        wrist = f'<body pos="0.02 0 0">{joint.format(f"A{k}", k % 2, 1 - k % 2)}<geom size="0.01"/>{wrist}</body>'
    link = f'<geom type="capsule" size="0.09" fromto="0.1 0 0 0.9 0 0"/><body pos="0.98 0 0">{wrist}</body>'
    arm.write_text(
        '<mujoco><compiler autolimits="true"/><custom>'
        '<numeric name="max_speed_deg_s" data="90 90 90 90 90 90"/></custom>'
        f'<worldbody><body name="base_link"><body pos="0 0 1">{joint.format("A1", 0, 1)}'
        f'<geom size=".1"/><body>{joint.format("A2", 1, 0)}{link}</body></body></body></worldbody></mujoco>',
        encoding="utf-8",
    )
    robot = {"model": "arm.xml", "joints": [f"A{k}" for k in range(1, 7)]}
    box = {"box": {"size_mm": [20, 4000, 4000]}}
    depth = []
    for name, wall in (("box", box), ("mesh", {"mesh": "wall.stl"})):
        path = make_case(name, robot=robot, fixtures=[{**wall, "name": "wall", "position_mm": [500, 0, 2000]}])
        scene = prepare(load_case(path)).scene
        found = Checker(scene, (0.0, 0.0), 0.05).clearances(np.zeros((1, 6)), np.array([0]))
        assert "wall" in [scene.geom_name(int(g)) for g in found.pair[0]]
        depth.append(found.distance[0])
    assert depth[0] < -0.09
    assert depth[0] == pytest.approx(depth[1], abs=1e-4)


def test_boxes_stay_where_they_are_and_as_large():
    spec = mujoco.MjSpec.from_string(
        '<mujoco><asset><mesh name="m" vertex="0 0 0 1 0 0 0 2 0 0 0 3"/></asset><worldbody>'
        '<geom name="a" type="box" size=".1 .2 .3" pos="1 2 3" euler="10 20 30"/><frame pos="1 1 1" euler="5 6 7">'
        '<geom name="b" type="box" size=".02" fromto="0 0 0 1 .3 -.2" margin="-.1"/></frame>'
        '<geom name="c" type="box" size=".1 .1 .1" contype="0" conaffinity="0"/>'
        '<geom name="sheet" type="box" size="1e-5 2 2"/></worldbody></mujoco>'
    )
    plain = spec.compile()
    detectable(spec)
    model = spec.compile()
    assert model.geom_type[model.geom("c").id] == mujoco.mjtGeom.mjGEOM_BOX  # nothing meets it
    assert (model.geom_margin == 0).all()
    corners = np.array(list(product((-1, 1), repeat=3)))
    datas = [mujoco.MjData(plain), mujoco.MjData(model)]
    for data in datas:
        mujoco.mj_kinematics(data.model, data)
    for name in ("a", "b", "sheet"):
        g = model.geom(name).id
        m = model.geom_dataid[g]
        mine = model.mesh_vert[model.mesh_vertadr[m] :][: model.mesh_vertnum[m]]
        at = [
            v @ d.geom_xmat[g].reshape(3, 3).T + d.geom_xpos[g]
            for v, d in zip((corners * plain.geom_size[g], mine), datas, strict=True)
        ]
        away = np.linalg.norm(at[0][:, None] - at[1], axis=2).min(axis=1)
        assert away.max() < 1e-6


def test_height_fields_are_refused_by_name(make_case, tmp_path):
    content = yaml.safe_load(make_case().read_text(encoding="utf-8"))
    (tmp_path / "table.xml").write_text(
        '<mujoco><compiler autolimits="true"/><asset><hfield name="h" nrow="3" ncol="3" size="1 1 .1 .1"/></asset>'
        '<worldbody><body><geom name="bed" type="hfield" hfield="h"/><body><joint name="E1" range="-9 9"/>'
        '<geom size=".1"/><body><joint name="E2" range="-9 9"/><geom size=".1"/><site name="table"/></body></body>'
        "</body></worldbody></mujoco>",
        encoding="utf-8",
    )
    content["positioner"]["model"] = "table.xml"
    part = prepare(load_case(make_case())).shape
    with pytest.raises(InputError, match="bed is a height field"):
        compose(parse_case(content, tmp_path / "h.case.yaml"), part)


def test_an_upright_cylinder_is_as_far_from_a_plane_as_it_stands():
    """Of MuJoCo's own distances a fifth are too small by the radius."""
    turn = 'quat="0.9 0 0 0.4358898943540674"'
    inner = f'<geom type="cylinder" size="0.07 0.2" gap="0.5" mass="1" {turn}/>'
    for place in ("0 0 0", "0 0 0", "0 0 0.5"):
        small = '<geom size="0.01" contype="0" conaffinity="0" mass="1"/>'
        inner = f'<body pos="{place}" {turn}><joint axis="0 0 1"/>{small}{inner}</body>'
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><worldbody><geom type="plane" size="1 1 1"/>{inner}</worldbody></mujoco>'
    )
    lean_cylinders(model)
    data, rng = mujoco.MjData(model), np.random.default_rng(1)
    for _ in range(500):
        data.qpos[:] = rng.uniform(-3.0, 3.0, 3)
        mujoco.mj_kinematics(model, data)
        mujoco.mj_collision(model, data)
        assert data.contact.dist.min() == pytest.approx(0.3, abs=1e-6)


def test_a_shape_that_only_a_contact_pair_of_the_table_names_is_in_the_arms_way(make_case, tmp_path):
    """MuJoCo asks no contact bits of such a shape; it is as hard as any other."""
    (tmp_path / "table.xml").write_text(
        '<mujoco><compiler autolimits="true"/><worldbody><body name="b"><geom name="guard" size="0.3"'
        ' contype="0" conaffinity="0"/><geom name="seen" pos="0 1 0" size="0.1" contype="0" conaffinity="0"/>'
        '<body><joint name="E1" range="-9 9"/><geom size=".1"/><body><joint name="E2" range="-9 9"/>'
        '<geom name="plate" size=".1"/><site name="table"/></body></body></body></worldbody>'
        '<contact><pair geom1="guard" geom2="plate"/></contact></mujoco>',
        encoding="utf-8",
    )
    scene = prepare(load_case(make_case(positioner={"model": "./table.xml"}))).scene
    hard = {name: bool(scene.contact_bits[:, scene.model.geom(name).id].any()) for name in ("guard", "seen")}
    assert hard == {"guard": True, "seen": False}
