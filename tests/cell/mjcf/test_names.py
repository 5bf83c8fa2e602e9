"""Names that users give: none is taken for the cell's own, for markup, or for another model's."""

import numpy as np
import pytest
from support.cells.cell_models import ARM, TABLE, TORCH, write_case

from cell.case.read import load_case
from cell.cli.main import main
from cell.errors import InputError
from cell.job.job import prepare
from cell.report.scene_contents import look_into_scene
from cell.scene.composition import BodyOwner


def scene_of(path):
    return prepare(load_case(path)).scene


@pytest.mark.parametrize("name", ["support", "support_visual", "floor", "deposit/0/SV1/0", "body/0", "SV1_visual"])
def test_a_users_shape_may_be_called_what_the_cell_calls_its_own(name, tmp_path):
    scene = scene_of(write_case(tmp_path, "cell", table=TABLE.replace('"beam"', f'"{name}"')))
    names = [scene.geom_name(g) for g in range(scene.model.ngeom)]
    mine = names.index(f"positioner/{name}")
    assert scene.piece_of_geom[mine] == BodyOwner.POSITIONER
    assert scene.deposit_of_geom[mine] == -1
    assert not scene.put_on_table[mine]
    assert names.count(name) <= 1
    # the wire must not touch it, as it may the part
    assert scene.contact_bits[1, mine] & scene.contact_bits[0, scene.wire_geom.argmax()]


@pytest.mark.parametrize("name", ["part", "workpiece", "pieces_0", "fixture_x", "robot", "torch", "link_1"])
def test_a_users_body_may_be_called_what_another_is(name, tmp_path):
    table = TABLE.replace('"tilt"', f'"{name}"')
    scene = scene_of(write_case(tmp_path, "cell", table=table))
    assert scene.model.body(scene.model.jnt_bodyid[scene.table_joints[0]]).name in (f"positioner/{name}", name)


def test_shapes_without_names_are_called_after_their_bodies(tmp_path):
    torch = TORCH.replace('name="barrel" ', "").replace('name="neck" ', "")
    arm = ARM.replace('name="wrist" ', "").replace('name="guide" ', "")
    scene = scene_of(write_case(tmp_path, "cell", torch=torch, arm=arm))
    names = {scene.geom_name(g) for g in range(scene.model.ngeom)}
    assert {"torch (geom 1)", "torch (geom 3)", "link_5 (geom 1)", "link_5 (geom 2)"} <= names
    assert len(names) == scene.model.ngeom


@pytest.mark.parametrize(
    ("name", "said"),
    [("clamp/left", "already used, or contains a /"), ("barrel", "already used"), ("a\nb", "name"), (" ", "name")],
)
def test_a_fixtures_name_that_cannot_be_is_refused(name, said, tmp_path):
    box = {"name": name, "box": {"size_mm": [9, 9, 9]}, "position_mm": [0, 2000, 50]}
    with pytest.raises(InputError, match=said):
        scene_of(write_case(tmp_path, "cell", fixtures=[box]))


def test_two_fixtures_of_one_name_are_refused_and_names_of_ours_are_theirs(tmp_path):
    box = {"box": {"size_mm": [9, 9, 9]}, "position_mm": [0, 2000, 50]}
    names = ("part", "workpiece", "clamp", "clamp_visual")
    scene = scene_of(write_case(tmp_path, "cell", fixtures=[{"name": name, **box} for name in names]))
    assert (scene.piece_of_geom == BodyOwner.FIXTURE).sum() == 2 * len(names)
    with pytest.raises(InputError, match="already used"):
        scene_of(write_case(tmp_path, "cell", fixtures=[{"name": "clamp", **box}] * 2))


def test_names_are_printed_as_they_are(tmp_path, capsys):
    wall = {"box": {"size_mm": [300, 300, 300]}, "position_mm": [1500, 250, 550]}
    path = write_case(tmp_path, "cell", fixtures=[{"name": "clamp [left]", **wall}])
    path.write_text("name: 'rig [/rev] :smile:'\n" + path.read_text())
    assert main(["check", str(path), "--no-remedies"]) == 1
    out = capsys.readouterr().out
    assert "rig [/rev] :smile:" in out
    assert "clamp [left]" in out


@pytest.mark.parametrize("place", ['pos="0 0 0.357" euler="180 0 0"', 'pos="0 0 0.357" zaxis="0 0 -1"'])
def test_a_tcp_that_points_back_into_the_nozzle_is_refused(place, tmp_path):
    torch = TORCH.replace('<site name="tcp" pos="0 0 0.357"/>', f'<site name="tcp" {place}/>')
    with pytest.raises(InputError, match=r"tool\.tcp: .* points back along the wire"):
        scene_of(write_case(tmp_path, "cell", torch=torch))


def test_a_wire_of_several_shapes_or_a_tcp_a_little_inside_it_is_no_wrong_tcp(tmp_path):
    two = TORCH.replace("<site", '<geom name="tip" type="capsule" size="0.0006" fromto="0 0 0.35 0 0 0.356"/><site')
    scene_of(write_case(tmp_path, "two", torch=two, tool={"wire": ["wire", "tip"]}))
    scene_of(write_case(tmp_path, "inside", torch=TORCH.replace('pos="0 0 0.357"', 'pos="0 0 0.355"')))


def test_the_table_stands_where_frames_and_angles_put_its_site(tmp_path):
    site = '<site name="table" pos="0 0 0.15"/>'
    framed = '<frame pos="0 0 0.1" euler="0 0 90"><site name="table" pos="0.05 0 0.05" euler="0 0 -30"/></frame>'
    plain = '<site name="table" pos="0 0.05 0.15" euler="0 0 60"/>'
    poses = [
        scene_of(write_case(tmp_path, f"cell{k}", table=TABLE.replace(site, text))).T_base_part(0.3, 0.2)
        for k, text in enumerate((site, framed, plain))
    ]
    assert np.allclose(poses[1], poses[2], atol=1e-9)
    assert np.linalg.norm(poses[1][:3, 3] - poses[0][:3, 3]) == pytest.approx(0.05, abs=1e-9)


def test_a_probe_names_what_always_touches_and_what_is_not_planned(tmp_path, capsys):
    arm = ARM.replace('size="0.12 0.04" pos="0 0 0.04"', 'size="0.12 0.1" pos="0 0 0.1"')
    arm = arm.replace('<exclude body1="base_link" body2="link_1"/>', "")
    arm = arm.replace("<keyframe>", "<!--").replace("</keyframe>", "-->")
    torch = TORCH.replace(
        "</body>",
        '<body name="cover"><joint name="lid" type="slide" axis="0 0 1"/>'
        '<geom name="lid" size="0.01" pos="0 0.05 0.1" contype="0" conaffinity="0"/></body></body>',
    )
    path = write_case(tmp_path, "cell", arm=arm, torch=torch)
    found = look_into_scene(scene_of(path), (0.0, 0.0), count=40)
    assert found.always == (("foot", "waist"),)
    assert found.home_deg is None
    (standing,) = found.standing
    assert "joint lid is not planned" in standing
    assert "it stands at 0 mm" in standing
    assert [name for name, _ in found.turning] == ["A1", "A6"]
    assert ("tool", 4, 1) in found.links
    assert main(["scene", str(path)]) == 0
    out = capsys.readouterr().out
    for words in ("always touch", "foot - waist", "it stands at 0 mm", "robot.home_deg", "A6 has a range of 699.0"):
        assert words in out


def test_a_cell_in_order_is_said_to_be(tmp_path):
    found = look_into_scene(scene_of(write_case(tmp_path, "cell")), (0.0, 0.0), count=40)
    assert found.always == found.at_home == found.standing == ()
    assert found.home_deg == (0, -90, 90, 0, 0, 90)
    assert all(hard for _, hard, _ in found.links)
