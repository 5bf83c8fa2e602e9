"""Beads that lie over their own metal, which is not in the cell while they are laid."""

from __future__ import annotations

import numpy as np
import pytest

from slicing import read_toolpath
from slicing.toolpaths.own_metal import _evenly, first_over_itself
from slicing.warning import Code


def written(folder, x, y, z, layer=None):
    """A path of one bead, or one a layer, as another slicer's table; deposited upwards."""
    layer = np.zeros(len(x), dtype=int) if layer is None else layer
    rows = [f"{a:.4f},{b:.4f},{c:.4f},{k},{k}" for a, b, c, k in zip(x, y, z, layer, strict=True)]
    path = folder / "theirs.csv"
    path.write_text("\n".join(["x,y,z,path,layer", *rows]) + "\n", encoding="utf-8")
    return read_toolpath(path, width_mm=5.0, thickness_mm=2.0, normal="up")


def vase(turns, per_turn=60, pitch=2.0):
    a = np.linspace(0, 2 * np.pi * turns, int(turns * per_turn) + 1)
    return 30 * np.cos(a), 30 * np.sin(a), pitch * a / (2 * np.pi)


@pytest.mark.parametrize("per_turn", [40, 240])
def test_a_helix_of_one_bead_is_told_from_its_second_turn_on(per_turn, tmp_path):
    path = written(tmp_path, *vase(5, per_turn))
    (bead, target), *more = first_over_itself(path.targets, 5.0).items()
    assert not more
    assert bead == 0
    # over the metal laid before by half a thickness and within half a width
    assert 0.4 * per_turn < target <= per_turn
    (line,) = [w for w in path.warnings if w.code is Code.BEAD_OVER_ITSELF]
    assert f"from target {target} on" in line


@pytest.mark.parametrize("kind", ["a ring", "a turn", "lines to and fro", "a bead and a layer a turn"])
def test_beads_that_stay_beside_themselves_are_not_told(kind, tmp_path):
    layer = None
    x, y, z = vase(1)
    if kind == "a ring":
        z = np.zeros_like(z)
    elif kind == "lines to and fro":
        x, y = np.tile([0.0, 40.0, 40.0, 0.0], 6), np.repeat(np.arange(12) * 4.0, 2)
        z = np.zeros_like(x)
    elif kind == "a bead and a layer a turn":
        x, y, z = vase(4)
        layer = np.minimum(np.arange(len(x)) // 60, 3)
    path = written(tmp_path, x, y, z, layer)
    assert first_over_itself(path.targets, 5.0) == {}
    assert Code.BEAD_OVER_ITSELF not in {w.code for w in path.warnings}


def test_a_bead_that_runs_back_below_itself_is_told(tmp_path):
    there = np.linspace(0, 60, 31)
    x, y, z = np.concatenate([there, there[::-1]]), np.zeros(62), np.repeat([20.0, 8.0], 31)
    path = written(tmp_path, x, y, z)
    assert first_over_itself(path.targets, 5.0) == {0: 31}
    (line,) = [w for w in path.warnings if w.code is Code.BEAD_OVER_ITSELF]
    assert "lies over or under its own metal from target 31 on" in line
    # beside it, it is not in the way
    assert not first_over_itself(written(tmp_path, x, np.repeat([0.0, 12.0], 31), z).targets, 5.0)


def test_how_far_targets_are_apart_does_not_say_how_much_is_compared(tmp_path):
    x = np.arange(20_000) * 1e-3  # mm: a bead of 20 mm in microns, and a step of 400 mm
    path = written(tmp_path, np.append(x, 420.0), np.zeros(20_001), np.full(20_001, 10.0))
    at, p, _, _ = _evenly(path.targets.position, path.targets.normal, path.targets.thickness_mm, 2.5)
    assert len(p) == np.ceil(420.0 / 2.5) + 1
    assert (np.diff(at) >= 0).all()
    assert at[-1] == 20_000
    assert not first_over_itself(path.targets, 5.0)
