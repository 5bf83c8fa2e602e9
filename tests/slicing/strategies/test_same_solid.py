"""The same solid as another mesh gives the same layers: areas, loops, holes and lengths."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from manifold3d import Manifold
from scipy.spatial.transform import Rotation
from support.parts.cad_parts import FORMATS, CadPart, Truth, arrays, radial_cylinder
from support.parts.same_solid import retriangulated, shuffled, split

from slicing.decomposition.decompose import decompose
from slicing.layers.body_ends import body_ends
from slicing.mesh.load import load_mesh, solid_from_arrays
from slicing.mesh.solid import Mesh
from slicing.parameters import SlicingParameters
from slicing.strategies.slice import slice_sub_volume

INCH = 25.4
THICK = (6.1, 5.0, 8.0)
STRATEGIES = ("cylindrical", "nonuniform", "planar")


@cache
def solid() -> tuple[np.ndarray, np.ndarray]:
    """A hub with a bore; a pipe with a pin in it, and a block longer than the hub with a cavity and a hole."""
    hub = Manifold.cylinder(60, 20, 20, 48) - Manifold.cylinder(80, 8, 8, 24).translate((0, 0, -5))
    pipe = radial_cylinder(9, 12, 38, 24) - radial_cylinder(6, 12, 40, 24) + radial_cylinder(3, 12, 36, 16)
    block = Manifold.cube((30, 16, 70)).translate((-42, -8, -4))
    cavity = Manifold.cube((10, 8, 12)).translate((-38, -4, 4)) - Manifold.cube((10, 2, 2)).translate((-38, -1, 9))
    hole = Manifold.cylinder(40, 4, 4, 20, True).rotate((90, 0, 0)).translate((-31, 0, 45))
    return arrays(hub + pipe.translate((0, 0, 30)) + block - cavity - hole)


@cache
def meshes() -> dict[str, tuple[Mesh, float]]:
    """The mesh as it is and otherwise, each with the factor of its lengths."""
    rng = np.random.default_rng(5)
    vertices, faces = solid()
    turn = Rotation.from_rotvec(np.deg2rad([20.0, -60.0, 35.0])).as_matrix()
    again = retriangulated(*split(vertices, faces, rng, 30), rng)
    assert len(again[1]) > len(faces)
    other = retriangulated(vertices, faces, rng)
    assert {tuple(sorted(f)) for f in other[1].tolist()} != {tuple(sorted(f)) for f in faces.tolist()}
    made = {
        "as it is": (vertices, faces),
        "other diagonals": other,
        "refined and shuffled": shuffled(*split(vertices, faces, rng, 60), rng),
        "refined, other diagonals, turned and moved": (again[0] @ turn.T + np.array([130.0, -70.0, 900.0]), again[1]),
        "in inches": (vertices / INCH, faces),
    }
    return {name: (solid_from_arrays("part", *made[name]), 1 / INCH if "inch" in name else 1.0) for name in made}


def layers(mesh: Mesh, factor: float, strategies: tuple[str, ...] = STRATEGIES) -> list[tuple[str, np.ndarray]]:
    """Of every strategy and sub-volume the layers, (n, 4): area mm², length mm, loops, holes; the smallest first."""
    parts, found = decompose(mesh), []
    order = np.argsort([one.volume for one in parts.sub_volumes]).tolist()
    for strategy in strategies:
        parameters = SlicingParameters(strategy, *(h * factor for h in THICK), tolerance_mm=0.01 * factor)
        bodies = parts.bodies_for(strategy)
        for k in order:
            ends = body_ends(parts.outline.points, bodies[k])
            sliced = slice_sub_volume(parts.sub_volumes[k], bodies[k], parameters, ends)
            rows = [
                (
                    layer.area_mm2 / factor**2,
                    sum(curve.length_mm for curve in layer.curves) / factor,
                    len(layer.curves),
                    sum(curve.area_mm2 < 0 for curve in layer.curves),
                )
                for layer in sliced.layers
            ]
            found.append((strategy, np.array(rows)))
    return found


@cache
def as_it_is() -> list[tuple[str, np.ndarray]]:
    return layers(*meshes()["as it is"])


def held(found: list[tuple[str, np.ndarray]]) -> None:
    want = as_it_is()[: len(found)]
    assert [name for name, _ in found] == [name for name, _ in want]
    for (name, rows), (_, right) in zip(found, want, strict=True):
        assert len(rows) == len(right), name
        assert rows[:, :2] == pytest.approx(right[:, :2], rel=1e-3, abs=0.02), name
        assert (rows[:, 2:] == right[:, 2:]).all(), name


@pytest.mark.slow
def test_the_part_has_holes_and_several_loops():
    assert len(as_it_is()) == 3 * len(STRATEGIES)  # pin, pipe and block
    pin, pipe, block = (rows[:, 2:].max(axis=0).tolist() for _, rows in as_it_is()[:3])
    assert (pin, pipe, block) == ([1, 0], [2, 1], [4, 1])  # two pieces beside the bore across, a hole with an island


OTHERWISE = (
    "in inches",
    "refined, other diagonals, turned and moved",
    *(pytest.param(name, marks=pytest.mark.slow) for name in ("other diagonals", "refined and shuffled")),
)


@pytest.mark.parametrize("name", OTHERWISE)
def test_the_same_solid_otherwise_has_the_same_layers(name):
    held(layers(*meshes()[name]))


@pytest.mark.parametrize(
    "kind", [kind if kind == "3mf" else pytest.param(kind, marks=pytest.mark.slow) for kind in FORMATS]
)
def test_the_same_solid_from_another_file_has_the_same_layers(kind, tmp_path):
    nothing = Truth(np.zeros(3), np.array([0.0, 0.0, 1.0]), (), 0.0, 48)
    held(layers(load_mesh(CadPart("", *solid(), nothing).save(tmp_path, kind)), 1.0, STRATEGIES[:1]))
