"""The packages' own names: the README's example runs as it stands there."""

from __future__ import annotations

import ast
import inspect
import re
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from typing import Any

import numpy as np
import pytest
from support.jobs.cases import boss_mesh
from support.paths import ROOT
from support.source_trees import tree_of

import cell
import ik
import slicing
from cell.cli.main import main

EXPORTED = {
    "cell": "Case InputError Job Motion Result WorkerKilledError check compose load_case parse_case prepare "
    "read_motion remedies report_document sweep write_motion",
    "slicing": "BeadParameters ConicalBody CylindricalBody Targets Toolpath decompose lay load read_toolpath slice",
    "ik": "Chain RollWindow SingularityLimits Solver certify",
}


def test_every_name_of_the_public_interface_is_there():
    for package, names in EXPORTED.items():
        module = sys.modules[package]
        for name in names.split():
            assert getattr(module, name) is not None
            assert name in module.__all__


def exported() -> Iterator[tuple[str, Any]]:
    """Functions and classes that are exported, and what of a class is public, each with the name it is found by."""
    for package in EXPORTED:
        module = sys.modules[package]
        for name in module.__all__:
            thing = getattr(module, name)
            if inspect.isfunction(thing):
                yield f"{package}.{name}", thing
            elif inspect.isclass(thing) and thing.__module__.split(".")[0] in EXPORTED:
                yield f"{package}.{name}", thing
                for key, value in list(vars(thing).items()):
                    method = value.fget if isinstance(value, property) else getattr(value, "__func__", value)
                    if not key.startswith("_") and inspect.isfunction(method):
                        yield f"{package}.{name}.{key}", method


@cache
def names_of_own_code() -> set[str]:
    """Functions, classes and constants at the top of any module that cannot be mistaken for a word or a case's key."""
    found: set[str] = set()
    for package in EXPORTED:
        for path in (ROOT / package).rglob("*.py"):
            for node in tree_of(path).body:
                if isinstance(node, ast.FunctionDef | ast.ClassDef):
                    found.add(node.name)
                elif isinstance(node, ast.Assign):
                    found |= {target.id for target in node.targets if isinstance(target, ast.Name)}
    return {name for name in found if "_" in name.strip("_") or not name.islower()}


DOTTED = re.compile(r"(?<![\w./-])(?:cell|slicing|ik)(?:\.[A-Za-z_]\w*)+")
CODE = re.compile(r"(`+)([A-Za-z_][\w.]*)(?:\(.*?\))?\1")


def unknown_names(name: str, thing: Any, internal: set[str]) -> list[str]:
    """What a docstring refers to that whoever imports the packages does not find."""
    text = inspect.getdoc(thing) or ""
    wrong = []
    for dotted in DOTTED.findall(text):
        found: Any = sys.modules[dotted.split(".")[0]]
        public = set(found.__all__)
        for part in dotted.split(".")[1:]:
            if part not in public or not hasattr(found, part):
                wrong.append(dotted)
                break
            found = getattr(found, part)
            public = set(dir(found)) | set(getattr(found, "__dataclass_fields__", ()))
    package, owner = name.split(".")[:2]
    known = {one for module in EXPORTED for one in sys.modules[module].__all__}
    known |= set(dir(getattr(sys.modules[package], owner)))
    wrong += [word for _, word in CODE.findall(text) if word in internal - known]
    return wrong


def test_docstrings_refer_to_what_is_exported():
    internal = names_of_own_code()
    wrong = {name: found for name, thing in exported() if (found := unknown_names(name, thing, internal))}
    assert wrong == {}


def test_a_docstring_that_refers_to_a_module_is_found():
    def tidy() -> None:
        """As `cell.prepare`, ``slicing.solid_from_arrays`` and ``Motion``; bead.csv and models/cell.xml are files."""

    def untidy() -> None:
        """From ``cell.job.job.prepare``, `mesh_from_arrays` or slicing.mesh.solid."""

    internal = names_of_own_code()
    assert unknown_names("cell.check", tidy, internal) == []
    assert set(unknown_names("cell.check", untidy, internal)) == {
        "cell.job.job.prepare",
        "mesh_from_arrays",
        "slicing.mesh.solid",
    }


def test_a_job_comes_first_wherever_one_is_taken():
    for name, thing in exported():
        if inspect.isfunction(thing) and name.count(".") == 1:
            parameters = list(inspect.signature(thing).parameters)
            assert "job" not in parameters[1:] or name == "cell.read_motion", name


def block(mark: str) -> str:
    """The README's block below a mark."""
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    found = re.search(rf"<!-- {mark} -->\n```[a-z]*\n(.*?)```", text, re.DOTALL)
    assert found
    return found.group(1)


def example() -> str:
    return block("python example")


@pytest.mark.slow
def test_the_readmes_complete_case_is_feasible_with_the_mesh_it_names(tmp_path, monkeypatch, capsys):
    (tmp_path / "blade.case.yaml").write_text(block("complete case"), encoding="utf-8")
    (tmp_path / "propeller.stl").write_bytes((ROOT / "models" / "parts" / "propeller.stl").read_bytes())
    monkeypatch.chdir(tmp_path)
    exec(compile(example(), "README.md", "exec"), {})
    assert re.fullmatch(r"True \d+ rows\n", capsys.readouterr().out)


@pytest.mark.slow
def test_the_readmes_remedies_are_those_that_are_printed(capsys):
    assert main(["check", "propeller_tilted"]) == 1
    said = [line for line in capsys.readouterr().out.splitlines() if line.startswith("what would help")]
    assert said == block("remedies of propeller_tilted").splitlines()


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
    sliced = slicing.slice(mesh, slicing.CylindricalBody(radius_mm=20), strategy="nonuniform", h_layer_mm=1.73)
    path = slicing.lay([sliced], pattern="zigzag", width_mm=5)
    job = cell.prepare(cell.load_case(make_case()), toolpath=path)
    result = cell.check(job)
    assert result.feasible
    assert result.motion.t_s[-1] > 0
    assert list(cell.remedies(result)) == []
    proof = ik.certify(job.chain, job.Ts_base_target, ik.RollWindow.free())
    assert proof.reachable.all()
    own = cell.check(cell.prepare(cell.load_case(make_case("own", beads={"pattern": "zigzag"}))), 90, 180)
    np.testing.assert_array_equal(own.motion.q, result.motion.q)
