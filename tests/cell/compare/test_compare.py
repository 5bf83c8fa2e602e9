"""Strategies side by side: a case of one's own, and the shipped parts beside the paper's figures."""

import json

import numpy as np
import pytest
import trimesh
from manifold3d import Manifold
from rich.console import Console

from cell.case.read import load_case, parse_case
from cell.compare.compare import (
    STRATEGIES,
    best_strategy,
    compare_case,
    compare_document,
    compare_mesh,
    compare_paper,
    orders,
    scores_by_strategy,
)
from cell.errors import InputError
from cell.report.comparison_lines import compare_lines
from slicing.layers.layer import CylindricalBody
from slicing.mesh.solid import mesh_from_arrays
from slicing.parameters import SlicingParameters

# where a question of cell.compare.compare.orders is answered otherwise on the shipped part than in the paper
ANSWERED_OTHERWISE = {("boiler/SV1", "NV_at_most_cylindrical"), ("valve/SV1", "NV_at_most_cylindrical")}
FLAT = ("support/SV2", "support/SV3", "boiler/SV1", "boiler/SV2", "valve/SV1")


@pytest.fixture(scope="module")
def whole():
    return {one.name: one for one in compare_paper()}


@pytest.fixture(scope="module", params=["support", pytest.param("all", marks=pytest.mark.slow)])
def paper(request):
    if request.param == "all":
        return request.getfixturevalue("whole")
    return {one.name: one for one in compare_paper([request.param])}


def by_strategy(rows):
    return {row.strategy: row.indices for row in rows}


def text_of(lines):
    console = Console(width=120, force_terminal=False)
    with console.capture() as shown:
        for line in lines:
            console.print(line)
    return shown.get()


@pytest.mark.slow
def test_every_row_of_the_papers_tables_is_there(whole):
    assert list(whole) == ["propeller/SV1", "support/SV1", "support/SV2", "support/SV3", *FLAT[2:]]
    assert [row.strategy for row in whole["valve/SV1"].rows] == list(STRATEGIES)
    assert by_strategy(whole["support/SV1"].paper)["nonuniform"].NV == 247


def test_the_parts_were_dimensioned_for_cylinders(paper):
    for one in paper.values():
        ours, theirs = (by_strategy(rows)["cylindrical"] for rows in (one.rows, one.paper))
        assert ours.NL == theirs.NL
        assert ours.A_mm2 == pytest.approx(theirs.A_mm2, rel=5e-3)


def test_the_papers_orders_hold_on_the_parts_but_where_said(paper):
    assert all(all(orders(one.paper).values()) for one in paper.values())
    otherwise = {(name, key) for name, one in paper.items() for key, yes in orders(one.rows).items() if not yes}
    assert otherwise == {(name, key) for name, key in ANSWERED_OTHERWISE if name in paper}


@pytest.mark.slow
def test_where_cylinders_need_fewer_targets_it_is_by_little(whole):
    for name, _ in ANSWERED_OTHERWISE:
        found = by_strategy(whole[name].rows)
        assert found["nonuniform"].NV <= 1.02 * found["cylindrical"].NV


def test_planes_and_the_proposed_strategy_meet_flat_tops_exactly(paper):
    flat = [name for name in FLAT if name in paper]
    assert len(flat) >= 2
    for name in flat:
        for rows in (paper[name].rows, paper[name].paper):
            found = by_strategy(rows)
            assert found["planar"].R_rad < 1e-6
            assert found["nonuniform"].R_rad < 1e-6
            assert found["cylindrical"].R_rad > 0.05


def test_the_best_strategy_is_the_papers(paper):
    for one in paper.values():
        assert best_strategy(one.rows) == best_strategy(one.paper)
        if one.printed_F:
            assert best_strategy(one.paper) == STRATEGIES[int(np.argmax(one.printed_F))]


def test_the_totals_are_near_the_papers(paper):
    for one in paper.values():
        ours, theirs = scores_by_strategy(one.rows), scores_by_strategy(one.paper)
        for strategy in STRATEGIES:
            assert ours[strategy]["F"] == pytest.approx(theirs[strategy]["F"], abs=0.35)


def test_a_case_is_compared_whichever_strategy_it_asks_for(make_case):
    found = [compare_case(load_case(make_case(name, slicing={"strategy": name}))) for name in STRATEGIES]
    first = compare_document("boss", found[0])
    assert [compare_document("boss", one)["sub_volumes"] for one in found[1:]] == 2 * [first["sub_volumes"]]
    assert orders(found[0][0].rows)["A_kept"]


def test_the_document_is_plain_data(make_case):
    document = compare_document("boss", compare_case(load_case(make_case())))
    assert json.loads(json.dumps(document, allow_nan=False)) == document
    assert document["schema"] == "rbam-compare/1"
    (one,) = document["sub_volumes"]
    assert one["name"] == "SV1"
    assert set(one["indices"]) == set(one["scores"]) == set(STRATEGIES)
    assert set(one["indices"]["planar"]) == {"NL", "A_mm2", "NV", "R_rad"}
    assert set(one["scores"]["planar"]) == {"I1", "I2", "I3", "I4", "F"}
    assert one["best"] in STRATEGIES
    assert one["parameters"]["h_layer_mm"] == 1.73
    assert one["parameters"]["min_segment_mm"] == 3.0
    assert "paper" not in one


def test_the_papers_figures_stand_beside_ours(paper):
    document = compare_document("paper", list(paper.values()))
    row = next(row for row in document["sub_volumes"] if row["name"] == "support/SV1")
    assert row["paper"]["indices"]["planar"] == {"NL": 36, "A_mm2": 132.0, "NV": 176, "R_rad": 0.52}
    assert row["paper"]["printed_F"]["nonuniform"] == 2.65
    unread = {row["name"] for row in document["sub_volumes"] if row["paper"]["printed_F"] is None}
    assert ("boiler/SV1" in unread) == ("boiler/SV1" in paper)
    json.dumps(document, allow_nan=False)
    shown = text_of(compare_lines("paper", list(paper.values())))
    assert "233.88 (233.88)" in shown
    assert f"best F by the same strategy as in the paper: {len(paper)} of {len(paper)}" in shown


def ring():
    """A collar right round a body of radius 10."""
    mesh = trimesh.creation.annulus(9.0, 16.0, 8.0, sections=96)
    return mesh_from_arrays("collar", mesh.vertices, mesh.faces)


def test_a_strategy_that_cannot_slice_says_why_and_is_left_out():
    found = [compare_mesh(ring(), dict.fromkeys(STRATEGIES, CylindricalBody(10.0)), SlicingParameters())]
    (planar, *others) = found[0].rows
    assert planar.indices is None
    assert "right round" in planar.problem
    assert all(row.indices for row in others)
    assert set(scores_by_strategy(found[0].rows)) == {"cylindrical", "nonuniform"}
    assert orders(found[0].rows) is None
    document = compare_document("collar", found)["sub_volumes"][0]
    assert document["indices"]["planar"] is None
    assert list(document["problems"]) == ["planar"]
    shown = text_of(compare_lines("collar", found))
    assert "planar: collar: runs right round the body" in shown
    assert "paper" not in shown


def test_a_sub_volume_that_none_can_slice_is_an_error():
    with pytest.raises(InputError, match="does not touch the body"):
        compare_mesh(ring(), dict.fromkeys(STRATEGIES, CylindricalBody(5.0)), SlicingParameters())


@pytest.mark.slow
def test_on_a_cone_conical_and_revolved_layers_are_compared_as_well(tmp_path):
    shaft = Manifold.cylinder(100, 20, 20, 128) + Manifold.cylinder(40, 20, 35, 128).translate((0, 0, 100))
    boss = Manifold.cylinder(55, 5, 5, 48).rotate((0, 90, 0)).translate((0, 0, 120))
    mesh = (shaft + boss).to_mesh()
    trimesh.Trimesh(mesh.vert_properties[:, :3], mesh.tri_verts).export(tmp_path / "cone.stl")
    (found,) = compare_case(parse_case({"part": {"mesh": "cone.stl"}}, tmp_path / "cone.case.yaml"))
    assert [row.strategy for row in found.rows] == [*STRATEGIES, "conical", "revolved"]
    rows = by_strategy(found.rows)
    assert rows["conical"].NL == rows["revolved"].NL
    assert rows["conical"].A_mm2 == pytest.approx(rows["revolved"].A_mm2, rel=1e-3)
    document = compare_document("cone", [found])
    assert document["strategies"] == [*STRATEGIES, "conical", "revolved"]
    assert "revolved" in text_of(compare_lines("cone", [found]))


def test_a_missing_mesh_is_one_line(make_case):
    with pytest.raises(InputError, match=r"gone\.stl: no such file"):
        compare_case(load_case(make_case(part={"sub_volumes": ["gone.stl"]})))


@pytest.mark.slow
def test_parts_the_paper_has(tmp_path):
    found = compare_paper(["support"])
    assert [one.name for one in found] == ["support/SV1", "support/SV2", "support/SV3"]
    with pytest.raises(
        InputError, match="pump: is not a part of the paper; allowed: propeller, support, boiler, valve"
    ):
        compare_paper(["pump"])
    with pytest.raises(InputError, match=r"no\.yaml: cannot be read"):
        compare_paper(tables=tmp_path / "no.yaml")
