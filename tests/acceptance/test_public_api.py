"""What a script or a notebook starts from: the names that the packages export, and a part from mesh to verdict."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
from support.cases import boss_mesh

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


def test_importing_the_packages_loads_nothing_heavy():
    code = (
        "import sys, cell, ik, slicing; print(sorted({'mujoco', 'scipy', 'trimesh', 'pydantic'} & sys.modules.keys()))"
    )
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "[]"


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
