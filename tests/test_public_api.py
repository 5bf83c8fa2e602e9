"""The packages' own names: the README's example runs as it stands there."""

from __future__ import annotations

import re
import subprocess
import sys

import numpy as np
import pytest
from support.jobs.cases import boss_mesh
from support.paths import ROOT

import cell
import ik
import slicing

EXPORTED = {
    "cell": "Case InputError Job Motion Result check compose load_case parse_case prepare read_motion remedies "
    "report_document sweep write_motion",
    "slicing": "BeadParameters Cylinder Cone Targets Toolpath decompose lay load read_toolpath slice",
    "ik": "Chain RollWindow SingularityLimits Solver certify",
}


def test_every_name_of_the_public_interface_is_there():
    for package, names in EXPORTED.items():
        module = sys.modules[package]
        for name in names.split():
            assert getattr(module, name) is not None
            assert name in module.__all__


def example() -> str:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    found = re.search(r"<!-- python example -->\n```python\n(.*?)```", text, re.DOTALL)
    assert found
    return found.group(1)


def test_the_readmes_example_runs(make_case, tmp_path, monkeypatch, capsys):
    make_case("blade")
    monkeypatch.chdir(tmp_path)
    exec(compile(example(), "README.md", "exec"), {})
    assert re.fullmatch(r"True \d+ rows\n", capsys.readouterr().out)
    assert (tmp_path / "blade.csv").is_file()


def test_the_readmes_example_says_what_would_help(make_case, tmp_path, monkeypatch, capsys):
    make_case("blade", positioner={"position_mm": [4000, 0, 0]})
    monkeypatch.chdir(tmp_path)
    exec(compile(example(), "README.md", "exec"), {})
    assert "positioner" in capsys.readouterr().out


@pytest.mark.parametrize("package", ["cell", "slicing", "ik"])
def test_importing_a_package_loads_nothing_heavy(package):
    code = f"import sys, {package}; print([m for m in ('mujoco', 'numpy', 'scipy', 'shapely') if m in sys.modules])"
    run = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "[]"


def test_a_part_from_mesh_to_verdict_in_ten_lines(make_case, tmp_path):
    boss_mesh().export(tmp_path / "blade.stl")
    mesh = slicing.load(tmp_path / "blade.stl", units="mm")
    sliced = slicing.slice(mesh, slicing.Cylinder(radius_mm=20), strategy="nonuniform", h_layer_mm=1.73)
    path = slicing.lay([sliced], pattern="zigzag", width_mm=5)
    job = cell.prepare(cell.load_case(make_case()), toolpath=path)
    result = cell.check(job, E1_deg=90, E2_deg=180)
    assert result.feasible
    assert result.motion.t_s[-1] > 0
    assert list(cell.remedies(result)) == []
    proof = ik.certify(job.chain, job.Ts_base_target, ik.RollWindow.free())
    assert proof.reachable.all()
    own = cell.check(cell.prepare(cell.load_case(make_case("own", beads={"pattern": "zigzag"}))), 90, 180)
    np.testing.assert_array_equal(own.motion.q, result.motion.q)
