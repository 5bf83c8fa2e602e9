"""Shapes that a model fits to a mesh stand in a cell as they stand in the model's own file."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from cell.case.read import load_case
from cell.job.job import prepare

TABLE = """<mujoco><compiler autolimits="true" angle="degree" fitaabb="{fitaabb}"/>
<asset><mesh name="m" vertex="{vertex}" scale="-1 1 1.5" refpos="0.1 0.2 0.3" refquat="0.5 0.1 0.2 0.8"/></asset>
<worldbody><body name="stand" pos="0 1 0"><frame pos="0.1 0.2 0.9" euler="10 20 30">{shapes}</frame></body>
<body><joint name="E1" range="-9 9"/><geom size=".1"/><body><joint name="E2" range="-9 9"/><geom size=".1"/>
<site name="table"/></body></body></worldbody></mujoco>"""
KINDS = ("box", "capsule", "cylinder", "ellipsoid", "sphere")


def both_placed(text: str, make_case, tmp_path) -> tuple[mujoco.MjData, mujoco.MjData]:
    """A table's model as the cell has it, and compiled from its own file."""
    (tmp_path / "table.xml").write_text(text, encoding="utf-8")
    where = {"model": "./table.xml", "position_mm": [0, 0, 0], "rotation_deg": [0, 0, 0]}
    model, own = prepare(load_case(make_case(positioner=where))).scene.model, mujoco.MjModel.from_xml_string(text)
    placed = mujoco.MjData(model), mujoco.MjData(own)
    for data in placed:
        mujoco.mj_kinematics(data.model, data)
    return placed


@pytest.mark.parametrize("fitaabb", ["false", "true"])
def test_fitted_shapes_are_as_large_and_where_their_own_file_has_them(fitaabb, make_case, tmp_path):
    rng = np.random.default_rng(4)
    shapes = "".join(
        f'<geom name="{kind}" type="{kind}" mesh="m" fitscale="1.1" pos="0 0 {k}" euler="{20 * k} 5 40"/>'
        for k, kind in enumerate(KINDS)
    )
    vertex = " ".join(f"{v:.6f}" for v in (rng.normal(size=(12, 3)) * (0.05, 0.1, 0.2) + 0.1).ravel())
    text = TABLE.format(fitaabb=fitaabb, vertex=vertex, shapes=shapes)
    mine, at = both_placed(text, make_case, tmp_path)
    model, own = mine.model, at.model
    for kind in KINDS:
        here, there = mine.geom(kind), at.geom(kind)
        assert here.xpos == pytest.approx(there.xpos, abs=1e-9)
        # a box has become a mesh of its corners, whose axes may be others
        held = model.geom_aabb[model.geom(kind).id, 3:] if kind == "box" else model.geom(kind).size
        assert np.sort(held) == pytest.approx(np.sort(own.geom(kind).size), abs=1e-6)
        if kind in ("capsule", "cylinder"):
            assert here.xmat[[2, 5, 8]] == pytest.approx(there.xmat[[2, 5, 8]], abs=1e-6)


def test_a_shape_is_fitted_once_though_its_body_has_a_class_that_fits(make_case, tmp_path):
    """What the class says is in the numbers already: the mesh was fitted again, and turned twice."""
    shape = '<geom name="lug" pos="0 0 0.2"/>'
    text = TABLE.format(fitaabb="false", vertex="0 0 0 .3 0 0 0 .1 0 0 0 .2", shapes="")
    fits = '<default><default class="fits"><geom type="capsule" mesh="m" euler="20 10 5"/></default></default>'
    text = text.replace("<asset>", fits + "<asset>").replace(
        '<body name="stand"', '<body name="stand" childclass="fits"'
    )
    text = text.replace("</frame></body>", f"</frame>{shape}</body>")
    mine, at = both_placed(text, make_case, tmp_path)
    model, own = mine.model, at.model
    assert model.geom("lug").size == pytest.approx(own.geom("lug").size, abs=1e-9)
    assert mine.geom("lug").xpos == pytest.approx(at.geom("lug").xpos, abs=1e-9)
    assert mine.geom("lug").xmat == pytest.approx(at.geom("lug").xmat, abs=1e-9)
