"""What a surface, a body or a chart is, is seldom asked: it answers itself, or has a function of its own in a table."""

from __future__ import annotations

import ast

import pytest
from support.paths import ROOT
from support.source_trees import nodes_of

from slicing.beads.overhang import VIEWS
from slicing.beads.regions import ISLANDS
from slicing.curves.intersect import CURVE_FINDERS
from slicing.deposits.part_shape import PIECES
from slicing.layers.outside_body import SECTIONS
from slicing.paper.adhesion import NEAR_ON_PLANE
from slicing.surfaces.offset_families import FAMILIES
from slicing.surfaces.surfaces import Round, Surface
from slicing.volume.flux_fields import FIELDS, ROUND_FIELDS

KINDS = {"Plane", "Cylinder", "Cone", "Revolved", "Round", "Surface"}
KINDS |= {"CylindricalBody", "ConicalBody", "RevolvedBody", "FlatChart", "RoundChart", "PoleChart"}
ASKED = {
    "slicing/strategies/nonuniform.py": "whether layers have become planes, which another module lays",
    "slicing/layers/poles.py": "planes have no axis that anything could go round",
    "slicing/beads/regions.py": "only the map of a pole is divided",
}


def test_kinds_are_asked_for_in_few_places_with_a_reason():
    found = []
    for path in sorted((ROOT / "slicing").rglob("*.py")):
        for node in nodes_of(path):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "isinstance":
                names = {name.id for name in ast.walk(node.args[1]) if isinstance(name, ast.Name)}
                found += [path.relative_to(ROOT).as_posix()] * bool(names & KINDS)
    assert found == sorted(ASKED)


@pytest.mark.parametrize("table", [VIEWS, ISLANDS, CURVE_FINDERS, PIECES, FAMILIES, FIELDS])
def test_tables_have_every_kind_of_surface(table):
    assert set(table) == set(Surface.__args__)


@pytest.mark.parametrize("table", [SECTIONS, NEAR_ON_PLANE, ROUND_FIELDS])
def test_tables_have_every_kind_that_goes_round_an_axis(table):
    assert set(table) == set(Round.__args__)
