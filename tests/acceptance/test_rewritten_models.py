"""A cell stays what it is however its models are written, and wherever it stands."""

import mujoco
import numpy as np
import pytest
from support.cells.cell_models import (
    ARM,
    TABLE,
    TORCH,
    driven,
    fused,
    mirrored,
    renamed,
    unnamed,
    with_bodies_between,
    with_shapes_in_bodies,
    with_visuals,
    write_case,
)

from cell.case.read import load_case
from cell.collision.checker import Checker
from cell.collision.table_clearances import table_alone
from cell.collision.wire import wire_checker
from cell.errors import InputError
from cell.job.job import prepare
from cell.job.wire_in_metal import wire_size
from cell.scene.composition import BodyOwner
from cell.verdict.check import check_fixed
from slicing.warning import Code

REACH = 0.05
CONFIGURATIONS = 400


def clearances(path):
    """Least distances in random configurations, m, beside the cell they are of."""
    job = prepare(load_case(path))
    chain = job.scene.chain
    q = np.random.default_rng(3).uniform(chain.lower, chain.upper, (CONFIGURATIONS, chain.n))
    found = Checker(job.scene, (np.pi / 2, 0.0), REACH).clearances(q, np.zeros(len(q), dtype=np.int64))
    return job, found.distance


@pytest.fixture(scope="module")
def usual(tmp_path_factory):
    job, distance = clearances(write_case(tmp_path_factory.mktemp("cell"), "usual"))
    # the torch meets the guide on the link before at some angles, so that nothing below is proved by default
    assert 20 < (distance < 0).sum() < CONFIGURATIONS - 20
    return job, distance


@pytest.mark.parametrize(
    "change",
    [
        {
            "arm": renamed(ARM),
            "robot": {"base": "support"},
            "torch": renamed(TORCH, keep=("wire",)),
            "table": renamed(TABLE),
        },
        {"arm": unnamed(ARM, keep=("base_link",)), "torch": unnamed(TORCH, keep=("wire",)), "table": unnamed(TABLE)},
        {"arm": with_visuals(ARM), "torch": with_visuals(TORCH), "table": with_visuals(TABLE)},
        {"arm": with_bodies_between(ARM), "torch": with_bodies_between(TORCH)},
        {"arm": with_shapes_in_bodies(ARM), "torch": with_shapes_in_bodies(TORCH)},
        {"torch": fused(TORCH), "table": fused(TABLE)},
        {"arm": fused(ARM), "robot": {"base": "world"}},
        {"arm": driven(ARM), "torch": TORCH, "table": driven(TABLE)},
        {"arm": ARM, "torch": TORCH.replace('"tcp"', '"flange"'), "tool": {"tcp": "flange"}},
        {"table": TABLE.replace('"tilt"', '"link_1"').replace('"E1"', '"A1"'), "positioner": {"joints": ["A1", "E2"]}},
    ],
    ids=[
        "renamed, also as the cell's own",
        "unnamed",
        "visuals",
        "bodies between",
        "a body a shape",
        "torch and table in the worldbody",
        "base in the worldbody",
        "driven",
        "one site name twice",
        "one joint and body name twice",
    ],
)
def test_however_the_models_are_written_the_clearances_are_the_same(change, usual, tmp_path):
    job, distance = clearances(write_case(tmp_path, "other", **change))
    assert np.allclose(job.scene.T_world_base(), np.eye(4))
    assert np.allclose(distance, usual[1], atol=1e-7)
    assert job.warnings == usual[0].warnings
    assert (job.scene.wire_geom.sum(), job.scene.model.npair) == (1, usual[0].scene.model.npair)


def left_out(scene):
    """Pairs of a tool's and an arm's shape that MuJoCo reports in no configuration though they touch in some."""
    model = scene.model
    hard = scene.contact_bits.any(axis=0)
    tools = np.flatnonzero(hard & (scene.piece_of_geom == BodyOwner.TOOL)).tolist()
    arms = np.flatnonzero(hard & (scene.piece_of_geom == BodyOwner.ROBOT) & ~scene.tool_geom).tolist()
    data = mujoco.MjData(model)
    touching, reported = set(), set()
    for q in np.random.default_rng(5).uniform(scene.chain.lower, scene.chain.upper, (300, 6)):
        data.qpos[scene.arm_qpos] = q
        mujoco.mj_kinematics(model, data)
        mujoco.mj_collision(model, data)
        reported |= {frozenset(pair) for pair in data.contact.geom.tolist()}
        for t in tools:
            for a in arms:
                apart = np.linalg.norm(data.geom_xpos[t] - data.geom_xpos[a])
                near = apart < model.geom_rbound[t] + model.geom_rbound[a]
                if near and mujoco.mj_geomDistance(model, data, t, a, 1.0, np.zeros(6)) < -1e-4:
                    touching.add(frozenset((t, a)))
    return touching, touching - reported


def test_no_shape_of_the_torch_is_left_out_against_the_arm(usual, tmp_path):
    for scene in (
        usual[0].scene,
        # whatever a model excludes of its own last link says nothing of the torch
        prepare(
            load_case(
                write_case(
                    tmp_path,
                    "fused",
                    torch=fused(TORCH),
                    arm=ARM.replace("</contact>", '<exclude body1="link_3" body2="link_6"/></contact>'),
                )
            )
        ).scene,
    ):
        touching, missed = left_out(scene)
        assert touching
        assert not missed


def test_a_torch_that_is_written_into_the_arm_is_held_against_the_wrist(usual, tmp_path):
    # the torch's shapes as shapes of the last link, the tool's file with the wire alone
    barrel = '<geom name="{}" type="{}" size="{}" pos="{}" euler="0 1.5707963267948966 0"/>'
    shapes = barrel.format("barrel", "cylinder", "0.042 0.1", "0.325 0 0")
    hose = '<geom name="hose" type="capsule" size="0.015" fromto="0.285 0 0.03 0.245 0 0.08"/>'
    neck = '<geom name="neck" type="capsule" size="0.012" fromto="0.425 0 0 0.515 0 0"/>'
    arm = ARM.replace('<site name="flange"', shapes + hose + neck + '<site name="flange"')
    torch = "".join(line for line in TORCH.splitlines() if not any(n in line for n in ("barrel", "hose", "neck")))
    job, distance = clearances(write_case(tmp_path, "written", arm=arm, torch=torch))
    assert np.allclose(distance, usual[1], atol=1e-6)
    # links 4 and 6 are excluded: what stands out beyond the flange is held against both links before
    named = {job.scene.model.pair(k).name for k in range(job.scene.model.npair)}
    assert {f"barrel~{link}" for link in ("fore", "wrist", "guide")} <= named
    assert {w.code for w in job.warnings} <= {Code.LINK_WITHOUT_SHAPES, Code.DEPOSIT_SHARE}


@pytest.fixture(scope="module")
def verdicts(tmp_path_factory):
    """Verdicts by cell: how many targets, what is wrong, the least clearance."""
    folder = tmp_path_factory.mktemp("verdicts")

    def job_of(name, **change):
        return prepare(load_case(write_case(folder, name, **change)))

    def of(name, **change):
        job = job_of(name, **change)
        result = check_fixed(job, job.case.table.E1_deg, job.case.table.E2_deg)
        return result.feasible, result.reasons, result.clearance and result.clearance.value, job.warnings

    of.job = job_of
    return of


@pytest.fixture(scope="module")
def as_it_is(verdicts):
    found = verdicts("as_it_is")
    assert found[0]
    return found


def test_a_cell_that_is_moved_and_turned_as_a_whole_has_the_same_verdict(verdicts, as_it_is):
    turn = 40.0
    c, s = np.cos(np.deg2rad(turn)), np.sin(np.deg2rad(turn))
    shift = np.array([700.0, -300.0])
    table = shift + 1500 * np.array([c, s])
    found = verdicts(
        "moved",
        robot={"position_mm": [*shift.tolist(), 0], "rotation_deg": [0, 0, turn]},
        positioner={"position_mm": [*table.tolist(), 0], "rotation_deg": [0, 0, turn - 90]},
    )
    assert found[:2] == as_it_is[:2]
    assert found[2] == pytest.approx(as_it_is[2], abs=1e-4)


def test_a_cell_in_the_mirror_has_the_same_verdict(verdicts, as_it_is):
    # the table's turn about z is the other way round in the mirror
    mirror = {"arm": mirrored(ARM), "torch": mirrored(TORCH), "table": mirrored(TABLE)}
    found = verdicts("mirror", **mirror, positioner={"rotation_deg": [0, 0, 90]})
    assert found[:2] == as_it_is[:2]


def test_a_guide_through_the_torch_is_a_collision_named_or_not(verdicts):
    arm = ARM.replace('fromto="0 0 0.09 0.3 0 0.09"', 'fromto="0 0.03 0 0.32 0.03 0"')
    for name, text in (("named", arm), ("unnamed", unnamed(arm, keep=("base_link",)))):
        feasible, reasons, _, _ = verdicts(name, arm=text)
        assert not feasible
        assert reasons["collision"] == sum(reasons.values()) > 0


def test_an_arm_of_visuals_alone_is_feasible_with_a_warning_that_names_its_links(verdicts):
    arm = ARM.replace("<geom ", '<geom contype="0" conaffinity="0" ')
    _, _, _, warnings = verdicts("visual", arm=arm)
    (line,) = [w for w in warnings if w.code is Code.LINK_WITHOUT_SHAPES]
    assert all(f"link_{k}" in line for k in range(1, 7))


@pytest.mark.parametrize(
    ("wire", "words"),
    [([], "no wire that collides"), (["wire", "neck"], "neck (24 mm) is thicker than a wire"), (["wire"], None)],
)
def test_a_wire_that_is_none_is_said(wire, words, tmp_path):
    job = prepare(load_case(write_case(tmp_path, "wire", tool={"wire": wire})))
    told = [w for w in job.warnings if w.code is Code.WIRE_SHAPE]
    assert [words in line for line in told] == ([] if words is None else [True])
    # of a wire and what is no wire the wire's own thickness counts
    assert not wire or wire_size(job.scene)[1] == pytest.approx(0.6)


def test_couplings_that_are_left_out_are_said(tmp_path):
    coupling = '<equality><joint joint1="A3" joint2="A2" active="{}"/></equality><contact>'
    arm = ARM.replace("<contact>", coupling.format("false"))
    job = prepare(load_case(write_case(tmp_path, "coupled", arm=arm)))
    assert [w.code for w in job.warnings if w.code is not Code.DEPOSIT_SHARE] == [Code.MODEL_ELEMENT_LEFT_OUT]
    with pytest.raises(InputError, match="joint A3 follows A2"):
        prepare(load_case(write_case(tmp_path, "follows", arm=ARM.replace("<contact>", coupling.format("true")))))


@pytest.mark.parametrize("plinth", ["", '<geom name="plinth" type="box" size="0.2 0.2 0.01" pos="-3 0 0"/>'])
def test_what_a_model_excludes_from_its_own_world_says_nothing_of_the_floor(plinth, tmp_path):
    """Public models exclude their links from a floor of their own; the arm is not to go through this cell's."""
    held = '<exclude body1="world" body2="link_4"/><exclude body1="link_6" body2="world"/>'
    arm = ARM.replace("</contact>", held + "</contact>").replace("<worldbody>", "<worldbody>" + plinth, 1)
    torch = '<mujoco><worldbody><body name="t"><site name="tcp" pos="0 0 0.3"/></body></worldbody></mujoco>'
    scene = prepare(load_case(write_case(tmp_path, "arm", arm=arm, torch=torch, tool={"wire": []}))).scene
    excluded = np.array([divmod(int(s), 1 << 16) for s in scene.model.exclude_signature])
    assert (excluded > 0).all()
    # the forearm's end and the flange hang under the floor
    q = np.deg2rad([[180.0, 30.0, 60.0, 0.0, 0.0, 0.0]])
    found = Checker(scene, (np.pi / 2, 0.0), REACH).clearances(q, np.zeros(1, dtype=np.int64))
    assert "floor" in {scene.geom_name(int(g)) for g in found.pair[0]}
    assert found.distance[0] < -0.1


def test_a_pair_that_touches_at_zero_is_no_affair_of_the_table_nor_of_the_wire(verdicts):
    # with all joints at zero the guide stands in the hose; at home, and wherever the arm works, it does not
    torch = TORCH.replace('fromto="-0.03 0 0.1 -0.08 0 0.06"', 'fromto="-0.03 0 0.1 -0.14 0 0.03"')
    job = verdicts.job("zero", torch=torch)
    scene = job.scene
    q = np.append(scene.home[:5], 0.0)[None]  # away from the table, the last joint at zero
    at_zero = Checker(scene, (0.0, 0.0), REACH).clearances(q, np.zeros(1, dtype=np.int64))
    assert {scene.geom_name(int(g)) for g in at_zero.pair[0]} == {"guide", "hose"}
    assert -0.05 < at_zero.distance[0] < 0
    for table in np.deg2rad([[90.0, 180.0], [0.0, 0.0], [45.0, -90.0]]):
        assert table_alone(scene, tuple(table)).distance[0] > 0
    wire = wire_checker(Checker(scene, (0.0, 0.0), REACH))
    assert not np.isfinite(wire.clearances(q, np.array([scene.n_deposits])).distance[0])


def test_options_images_and_sizes_of_public_models_say_nothing_and_change_nothing(usual, tmp_path, recwarn, capfd):
    extra = (
        '<option timestep="0.001" integrator="implicitfast" gravity="0 0 -9.81"><flag filterparent="disable"/></option>'
        '<size nuser_geom="2" nkey="3" njmax="500" nconmax="10"/><visual><map znear="0.1"/><quality shadowsize="64"/>'
        '<headlight ambient="1 1 1"/><global azimuth="30"/><scale jointlength="9"/><rgba haze="1 0 0 1"/></visual>'
    )
    arm = ARM.replace("<worldbody>", extra + "<worldbody>", 1).replace('name="wrist"', 'name="wrist" user="1 2"')
    job, distance = clearances(write_case(tmp_path, "options", arm=arm))
    assert np.allclose(distance, usual[1], atol=1e-9)
    assert job.scene.model.opt.gravity.tolist() == [0, 0, 0]
    assert not [w for w in recwarn if "ttach" in str(w.message)]
    assert "conflict" not in capfd.readouterr().err


def test_a_table_by_itself_meets_nothing_of_the_arm_however_its_torch_is_written(tmp_path):
    """With all joints at zero the hose pierces the guide on the link before, which is the arm's own affair."""
    hose = '<geom name="hose" type="capsule" size="0.015" fromto="-0.03 0 0.1 -0.08 0 0.06"/>'
    own = f'<body pos="-0.055 0 0.08">{hose.replace("-0.03 0 0.1 -0.08 0 0.06", "0.025 0 0.02 -0.025 0 -0.02")}</body>'
    assert hose in TORCH
    for name, torch in (("usual", TORCH), ("own", TORCH.replace(hose, own))):
        scene = prepare(load_case(write_case(tmp_path, name, torch=torch))).scene
        zero = np.zeros((1, scene.chain.n))
        assert Checker(scene, (0.0, 0.0), REACH).clearances(zero, np.zeros(1, dtype=np.int64)).distance[0] < -0.01
        assert table_alone(scene, (np.pi / 2, np.pi)).distance[0] > 0
