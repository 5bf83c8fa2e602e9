"""A cell has all that its models' own files have where these have it, whatever MJCF they use."""

from __future__ import annotations

import re
from pathlib import Path

import mujoco
import numpy as np
import pytest
import trimesh
import yaml
from support.cells.cell_models import ARM, TABLE, TORCH, write_case
from support.oracles.raw_models import differences

from cell.case.files import case_files
from cell.case.read import load_case
from cell.errors import InputError
from cell.job.job import prepare

HEAVY = '<inertial pos="0 0 0" mass="1" diaginertia=".1 .1 .1"/>'
TWISTED = (
    '<geom quat=".9 .3 .1 .2" pos=".1 .2 .3" mesh="top" material="grey"/><site quat=".9 .3 .1 .2" pos=".1 .1 .1"/>'
)
CLAMP = {"name": "clamp", "on": "table", "position_mm": [80, 10, 0], "box": {"size_mm": [30, 30, 60]}}
# of an attached model in radians and other Euler angles
OTHER = (
    '<mujoco><compiler angle="radian" eulerseq="ZYX"/><worldbody><body name="o" euler="0.5 0.3 0.2">'
    f'<joint name="h" axis="0 1 0" pos=".02 0 0" range="-1 1" ref="0.2"/>{HEAVY}'
    '<geom type="box" size=".02 .03 .04" pos="0.1 0 0" euler="0.3 0.2 0.1"/></body></worldbody></mujoco>'
)


def put(text: str, more: str, before: str) -> str:
    assert before in text
    return text.replace(before, more + before, 1)


def in_degrees(text: str) -> str:
    def degrees(found: re.Match[str]) -> str:
        return f'range="{np.rad2deg(float(found[1]))} {np.rad2deg(float(found[2]))}"'

    return re.sub(r'range="([-\d.]+) ([-\d.]+)"', degrees, text).replace('angle="radian"', 'angle="degree"')


def test_cells_as_they_are_have_no_differences(tmp_path):
    assert differences(write_case(tmp_path, "cell")) == []


@pytest.mark.parametrize("joints", [2, 0])
def test_what_is_put_on_the_table_has_no_defaults_of_its_body(tmp_path, joints):
    """A class that turns, moves or replaces shapes is the model's own affair: the part stood up to 0.7 m off."""
    classes = f'<default><default class="plates">{TWISTED}<joint ref="30" axis="1 1 0"/></default></default>'
    mesh = '<asset><material name="grey"/><mesh name="top" vertex="0 0 0 .1 0 0 0 .1 0 0 0 -.1"/></asset>'
    table = put(TABLE, classes + mesh, "<worldbody>").replace(
        '<body name="turn">', '<body name="turn" childclass="plates">'
    )
    table = table.replace('<geom name="plate"', '<geom class="main" name="plate"')
    more = {"fixtures": [CLAMP]}
    if not joints:
        table = re.sub(r"<joint [^>]*>", "", table)
        more |= {"positioner": {"joints": []}}
    path = fixed_if(not joints, write_case(tmp_path, "cell", table=table, **more))
    assert differences(path) == []
    plain = re.sub(r"<joint [^>]*>", "", TABLE) if not joints else TABLE
    there = re.search(r'<site name="table"[^>]*>', TABLE)[0]
    twisted = there.replace("/>", ' quat=".9 .3 .1 .2"/>')
    other = fixed_if(not joints, write_case(tmp_path, "plain", table=plain.replace(there, twisted), **more))
    assert where(path) == where(other)


def fixed_if(fixed: bool, path: Path) -> Path:
    """A case, without angles of a table that has no axes."""
    if fixed:
        content = yaml.safe_load(path.read_text(encoding="utf-8"))
        del content["table"]
        path.write_text(yaml.safe_dump(content), encoding="utf-8")
    return path


def where(path) -> dict[str, list[float]]:
    """Places of the part's and the fixtures' shapes, all axes at zero."""
    model = prepare(load_case(path)).scene.model
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    names = [n for n in (model.geom(g).name for g in range(model.ngeom)) if re.match(r"body/|deposit/|clamp", n)]
    assert {"clamp", "body/0"} <= set(names)
    return {n: np.round([*data.geom(n).xpos, *data.geom(n).xmat], 6).tolist() for n in names}


@pytest.mark.parametrize("model", ["arm", "torch", "table"])
def test_frames_with_a_scale_are_refused(tmp_path, model):
    """MuJoCo scales all below them, the torch on the flange and the part on the table as well."""
    text = {"arm": ARM, "torch": TORCH, "table": TABLE}[model]
    text = text.replace("<worldbody>", '<worldbody><frame name="units" scale="0.9">').replace(
        "</worldbody>", "</frame></worldbody>"
    )
    with pytest.raises(InputError, match=rf"cell_{model}\.xml: a frame units has scale 0\.9 0\.9 0\.9, .*savecompiled"):
        prepare(load_case(write_case(tmp_path, "cell", **{model: text})))


def test_a_frame_with_a_scale_of_an_attached_model_is_refused_and_one_of_one_is_not(tmp_path):
    for scale, refused in (("1", False), ("1 1 1", False), (".5", True)):
        (tmp_path / "other.xml").write_text(
            f'<mujoco><worldbody><frame scale="{scale}"><body name="o"><geom size=".01"/></body></frame></worldbody>'
            "</mujoco>"
        )
        torch = put(TORCH, '<asset><model name="other" file="other.xml"/></asset>', "<worldbody>")
        torch = put(torch, '<frame pos=".1 0 .1"><attach model="other" prefix="o_"/></frame>', '<site name="tcp"')
        path = write_case(tmp_path, "cell", torch=torch)
        if refused:
            with pytest.raises(InputError, match=r"has scale 0\.5"):
                prepare(load_case(path))
        else:
            assert differences(path) == []


def test_a_held_joint_of_an_attached_model_in_other_angles_turns_its_body_as_its_own_file_says(tmp_path):
    (tmp_path / "other.xml").write_text(OTHER)
    arm = put(in_degrees(ARM), '<asset><model name="other" file="other.xml"/></asset>', "<worldbody>")
    frame = '<frame pos="0.1 0.1 0.1" euler="10 20 30"><attach model="other" body="o" prefix="p_"/></frame>'
    arm = put(arm, frame, '<body name="link_4"').replace('qpos="0 -1.57079633 1.57079633', r"\g<0> 0.7")
    arm = arm.replace(r"\g<0> 0.7", 'qpos="0 -1.57079633 1.57079633 0.7')
    assert differences(write_case(tmp_path, "cell", arm=arm)) == []
    assert differences(write_case(tmp_path, "cell", arm=arm, robot={"held_deg": {"p_h": 25}})) == []


def test_meshes_are_those_that_the_model_itself_reads(tmp_path):
    """With strippath the folders that a model names do not count."""
    (tmp_path / "sub").mkdir()
    trimesh.creation.box((0.5, 0.5, 0.5)).export(tmp_path / "sub/lug.stl")
    trimesh.creation.box((0.1, 0.1, 0.1)).export(tmp_path / "lug.stl")
    for strip in ("true", "false"):
        arm = ARM.replace("<compiler ", f'<compiler strippath="{strip}" ')
        arm = put(arm, '<asset><mesh name="lug" file="sub/lug.stl"/></asset>', "<worldbody>")
        arm = put(arm, '<geom name="lug" type="mesh" mesh="lug" pos="0 0.4 0"/>', '<body name="link_3"')
        path = write_case(tmp_path, "cell", arm=arm)
        assert differences(path) == []
        model = prepare(load_case(path)).scene.model
        half = model.geom_aabb[model.geom("lug").id, 3]
        assert half == pytest.approx(0.05 if strip == "true" else 0.25)
        # what a sweep's results depend on, and no output may be written over
        there = {file.resolve() for file in case_files(load_case(path))}
        assert (tmp_path / ("lug.stl" if strip == "true" else "sub/lug.stl")).resolve() in there


def test_the_folder_of_another_system_that_a_model_names_does_not_count_either(tmp_path):
    trimesh.creation.box((0.1, 0.1, 0.1)).export(tmp_path / "lug.stl")
    arm = ARM.replace("<compiler ", '<compiler strippath="true" ')
    arm = put(arm, r'<asset><mesh name="lug" file="D:\\cad\\lug.stl"/></asset>', "<worldbody>")
    arm = put(arm, '<geom name="lug" type="mesh" mesh="lug" pos="0 0.4 0"/>', '<body name="link_3"')
    case = load_case(write_case(tmp_path, "cell", arm=arm))
    assert (tmp_path / "lug.stl").resolve() in {file.resolve() for file in case_files(case)}
    model = prepare(case).scene.model
    assert model.geom_aabb[model.geom("lug").id, 3] == pytest.approx(0.05)


def test_a_box_whose_inertia_is_a_shells_is_a_box_like_any_other(tmp_path):
    shell = '<geom name="cover" type="box" shellinertia="true" size=".1 .05 .02" pos="0 .3 0" euler=".1 .2 .3"/>'
    assert differences(write_case(tmp_path, "cell", arm=put(ARM, shell, '<body name="link_3"'))) == []


def test_an_arms_speeds_are_never_a_tools(tmp_path):
    numeric = '<custom><numeric name="max_speed_deg_s" data="180 158 160 230 230 320"/></custom>'
    torch = put(TORCH, numeric.replace("180", "999"), "<worldbody>")
    with pytest.raises(InputError, match=r"robot\.max_speed_deg_s: needed"):
        prepare(load_case(write_case(tmp_path, "cell", arm=ARM.replace(numeric, ""), torch=torch)))
    chain = prepare(load_case(write_case(tmp_path, "cell", torch=torch))).scene.chain
    assert np.rad2deg(chain.max_speed[0]) == pytest.approx(180)
