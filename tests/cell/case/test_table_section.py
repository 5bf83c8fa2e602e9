"""The section table: its keys, its modes, and what is refused in one line."""

from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from support.jobs.indexed import three_case, with_table
from support.paths import ROOT

from cell.case.read import load_case, parse_case
from cell.cli.main import main
from cell.errors import InputError
from cell.job.job import Job, prepare
from cell.job.table_groups import table_groups
from cell.job.table_section_check import build_runs, check_table

NAMES = ["SV1", "SV2", "SV3"]


def support(table: dict[str, Any], **sections: Any) -> Any:
    content = yaml.safe_load((ROOT / "models/cases/support.case.yaml").read_text())
    content = {"part": content["part"], "beads": content.get("beads", {}), "table": table, **sections}
    return parse_case(content, ROOT / "models/cases/x.case.yaml")


def poses(*entries: tuple[Any, ...]) -> dict[str, Any]:
    keys = ("sub_volume", "layers", "E1_deg", "E2_deg")
    return {"mode": "indexed", "poses": [dict(zip(keys, entry, strict=False)) for entry in entries]}


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ({"mode": "turning"}, "table.mode"),
        ({"poses": [{"sub_volume": "SV1"}]}, "poses need mode: indexed, not fixed"),
        ({"axes": ["E2"]}, "axes needs mode: coordinated, not fixed"),
        ({"mode": "indexed", "upright_deg": 5}, "upright_deg needs mode: coordinated, not indexed"),
        ({"mode": "indexed", "E1_deg": 5}, "mode: indexed has poses of its own; leave E1_deg out"),
        ({"mode": "coordinated", "axes": ["E2", "E2"]}, "axes: E2 is listed twice"),
        ({"mode": "coordinated", "axes": ["E3"]}, "table.axes"),
        ({"mode": "coordinated", "axes": []}, "table.axes"),
        ({"mode": "coordinated", "upright_deg": -1}, "table.upright_deg: must be 0 to 180"),
        (poses(("SV1", [3, 1])), "layers needs first <= last"),
        ({"mode": "indexed", "poses": [{"sub_volume": "SV1", "E3_deg": 0}]}, "E3_deg: unknown key"),
    ],
)
def test_keys_that_a_mode_does_not_have_are_refused(table: dict[str, Any], said: str) -> None:
    with pytest.raises(InputError, match=r"^\S+x\.case\.yaml: ") as error:
        support(table)
    assert said in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("table", "said"),
    [
        (poses(("SV9",)), "table.poses.0.sub_volume: there is no SV9; the sub-volumes are SV1, SV2, SV3"),
        (poses(("SV1",), ("SV2",)), "no pose for SV3"),
        (poses(("SV1",), ("SV2",), ("SV3",), ("SV1", [4, 4])), "layer 4 of SV1 comes twice"),
        (poses(("SV1",), ("SV1",), ("SV2",), ("SV3",)), "layer 0 of SV1 comes twice"),
        (poses(("SV1", [1, 2]), ("SV2",), ("SV3",)), "no pose for layer 0 of SV1"),
        (poses(("SV1", [0, 1]), ("SV1", [3, 4]), ("SV2",), ("SV3",)), "no pose for layer 2 of SV1"),
        (poses(("SV1", [0, 1]), ("SV2",), ("SV3",)), "no pose for layer 2 of SV1"),
        (poses(("SV1", [0, 1000]), ("SV2",), ("SV3",)), "table.poses.0.layers: SV1 has layers 0 to"),
        (poses(("SV1",), ("SV2", None, 200), ("SV3",)), "table.poses.1: E1 = 200 deg is outside"),
    ],
)
def test_poses_give_every_layer_once(table: dict[str, Any], said: str) -> None:
    case, scene = support(table), prepared().scene

    def ordered_and_checked() -> None:
        build_runs(case, NAMES, [5] * 3)
        check_table(case, scene)

    with pytest.raises(InputError, match=r"x\.case\.yaml: table") as error:
        ordered_and_checked()
    assert said in str(error.value)


@cache
def prepared() -> Job:
    return prepare(support({}))


@pytest.mark.parametrize("mode", ["indexed", "coordinated", "best"])
def test_a_table_that_stands_still_has_no_other_mode(mode: str) -> None:
    still = replace(prepared().scene, has_axis=np.array([False, False]))
    with pytest.raises(InputError, match="needs a positioner with an axis"):
        check_table(support({"mode": mode}), still)


def test_an_axis_that_the_positioner_does_not_have_is_refused() -> None:
    tilts = replace(prepared().scene, has_axis=np.array([True, False]))
    with pytest.raises(InputError, match="this positioner has no E2; it has E1"):
        check_table(support({"mode": "coordinated", "axes": ["E2"]}), tilts)


def test_a_case_asks_when_it_is_prepared(tmp_path: Path) -> None:
    case = with_table(three_case(tmp_path), {"mode": "indexed"}, positioner="none")
    with pytest.raises(InputError, match=r"table\.mode: indexed needs a positioner with an axis"):
        prepare(case)


@pytest.mark.slow
def test_groups_are_built_in_the_order_of_the_poses() -> None:
    runs = poses(("SV3", None, 0, 10), ("SV1", [0, 1], 5, 0), ("SV2",), ("SV1", [2, 4], 6, 0))
    job = prepare(support(runs))
    groups = table_groups(job)
    assert [(g.sub_volume, g.pose) for g in groups] == [
        ("SV3", (0.0, 10.0)),
        ("SV1", (5.0, 0.0)),
        ("SV2", (0.0, 0.0)),
        ("SV1", (6.0, 0.0)),
    ]
    assert [g.first for g in groups] == [0, *(g.stop for g in groups[:-1])]
    assert groups[-1].stop == len(job.targets)
    # deposits count up as they are laid, and their shapes have these numbers
    assert job.laid.max() == job.shape.n_deposits
    assert (np.diff(job.laid) >= 0).all()
    assert (np.diff(job.targets.bead) >= 0).all()
    names = {name.split("/")[1]: name.split("/")[2] for name in job.shape.hulls if name.startswith("deposit/")}
    t = job.targets
    assert all(names[str(d - 1)] == t.sub_volume[k] for d, k in zip(job.laid, t.sub_volume_index, strict=True))
    # in files they are called as if one sub-volume came after the other
    plain = prepared()
    assert job.order is not None
    assert (plain.targets.position[job.order.target] == t.position).all()
    assert (plain.targets.bead[job.order.target] == job.order.bead[t.bead]).all()
    assert (job.order.targets_of_file(job.order.target) == np.arange(len(t))).all()
    assert (plain.targets.closed[job.order.bead] == t.closed).all()


def test_a_case_that_extends_another_brings_its_own_mode() -> None:
    case = load_case(ROOT / "models/cases/propeller.case.yaml")
    assert (case.table.mode, case.table.E1_deg) == ("fixed", 90)


def test_another_mode_does_not_inherit_the_angles(tmp_path: Any) -> None:
    path = tmp_path / "x.case.yaml"
    path.write_text(f"extends: {ROOT}/models/cases/propeller.case.yaml\ntable: {{mode: indexed}}\n")
    assert load_case(path).table.model_dump(exclude_unset=True) == {"mode": "indexed"}


@pytest.mark.parametrize("option", ["--e1", "--e2"])
def test_angles_do_not_go_with_a_table_that_finds_its_own(option: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", "--table", "indexed", option, "3"]) == 2
    assert f"{option}: does not go with table mode indexed" in capsys.readouterr().err
