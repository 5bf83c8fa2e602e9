"""Parts as machine shops get them are taken apart right; bars that are not round are told from what stands on them."""

from __future__ import annotations

import numpy as np
import pytest
from manifold3d import CrossSection, JoinType, Manifold
from support.parts.cad_parts import FORMATS, arrays, radial_cylinder
from support.parts.machined_parts import STANDS, TAKEN, machined_part
from support.parts.part_truth import DOUBTS, judged

from slicing.decomposition.body_hint import BodyHint
from slicing.decomposition.decompose import Decomposition, decompose
from slicing.mesh.load import load_mesh
from slicing.mesh.solid import Mesh, mesh_from_arrays
from slicing.warning import Code, Warning

SEEDS = (2, 20, 23, 25, 28, 34, 37, 41)


@pytest.mark.parametrize("seed", [2, 20, *(pytest.param(seed, marks=pytest.mark.slow) for seed in SEEDS[2:])])
def test_parts_of_known_truth_are_found(seed, tmp_path):
    part = machined_part(seed)
    path = part.save(tmp_path, FORMATS[seed % len(FORMATS)])
    found = judged(part, load_mesh(path))
    assert found.kind == "right", found.why


def test_the_seeds_have_every_kind():
    words = " ".join(machined_part(seed).words for seed in SEEDS)
    assert [kind for kind in (*STANDS, *TAKEN) if kind not in words] == ["through_keyway"]


def mesh_of(solid: Manifold) -> Mesh:
    return mesh_from_arrays("part", *arrays(solid))


def bar(sides: int, rounded: float = 0.0) -> Manifold:
    """A polygonal bar, 20 mm from its axis to its edges (before they are rounded), from z = 0 to 60, and a boss."""
    angles = 2 * np.pi * np.arange(sides) / sides
    section = CrossSection([20.0 * np.column_stack([np.cos(angles), np.sin(angles)])])
    if rounded:
        section = section.offset(-rounded).offset(rounded, JoinType.Round, 2.0, 48)
    return Manifold.extrude(section, 60.0) + boss(5.0, 40.0, 30.0)


def boss(radius: float, reach: float, height: float) -> Manifold:
    return radial_cylinder(radius, 5.0, reach, 32).translate((0, 0, height))


def shaft(radius: float, low: float, high: float, sides: int = 48) -> Manifold:
    return Manifold.cylinder(high - low, radius, radius, sides).translate((0, 0, low))


def doubts(parts: Decomposition) -> list[Warning]:
    return [line for line in parts.warnings if isinstance(line, Warning) and line.code in DOUBTS]


@pytest.mark.parametrize(
    ("sides", "rounded"),
    [
        *[(6, 0.0), (8, 2.0)],
        *(pytest.param(*one, marks=pytest.mark.slow) for one in ((4, 0.0), (6, 5.0), (8, 0.0), (10, 0.0))),
    ],
)
def test_a_spigot_longer_than_its_bar_is_doubted_as_a_body(sides, rounded):
    parts = decompose(mesh_of(bar(sides, rounded) + shaft(12, 60, 220)))
    assert parts.body.radius_mm == pytest.approx(12.0, abs=1e-3)
    (line,) = doubts(parts)
    assert line.code is Code.BODY_RIVAL
    assert line.sub_volume == "SV1"
    assert "along 60 mm of its 220 mm" in line
    told = decompose(mesh_of(bar(sides, rounded) + shaft(12, 60, 220)), BodyHint(radius_mm=12.0))
    assert doubts(told) == []


@pytest.mark.parametrize("rounded", [2.0, pytest.param(10.0, marks=pytest.mark.slow)])
def test_rounded_edges_of_an_octagonal_bar_are_doubted_as_sub_volumes(rounded):
    parts = decompose(mesh_of(bar(8, rounded) + shaft(12, 60, 90)))
    assert len(parts.sub_volumes) == 8  # the boss and seven edges
    assert [line.code for line in doubts(parts)] == [Code.BODY_RADIUS]


@pytest.mark.slow
def test_nuts_flanges_and_low_pads_are_no_reason_to_doubt_a_shaft():
    nut = Manifold.extrude(CrossSection.circle(26, 6), 20).translate((0, 0, 10))
    flange = Manifold.cube((90, 90, 8), True)
    pads = [boss(5, 20.3, 50).rotate((0, 0, 60 * k)) for k in range(4)]
    for solid, count in (
        (shaft(20, 0, 100) + nut + boss(3, 35, 75), 2),
        (shaft(20, 0, 100) + flange.translate((0, 0, 4)) + flange.translate((0, 0, 96)) + boss(5, 45, 50), 3),
        (sum(pads, shaft(20, 0, 100, 24)), 4),
    ):
        parts = decompose(mesh_of(solid))
        assert len(parts.sub_volumes) == count
        assert doubts(parts) == []
