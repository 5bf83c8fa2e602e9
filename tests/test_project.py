"""Rules of the project itself: who imports whom, and documents that are made from code."""

import ast
import runpy
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
MAY_IMPORT = {"slicing": {"slicing"}, "ik": {"ik"}, "cell": {"cell", "ik", "slicing"}}


def imported(path):
    """Absolute names of the modules a file imports."""
    package = path.relative_to(ROOT).parts[0]
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield package if node.level else str(node.module)


@pytest.mark.parametrize("package", MAY_IMPORT)
def test_imports_go_one_way(package):
    files = list((ROOT / package).rglob("*.py"))
    assert files
    for path in files:
        tops = {name.split(".")[0] for name in imported(path)}
        assert tops & {*MAY_IMPORT, "models"} <= MAY_IMPORT[package], path.name
        if package != "cell":
            assert "mujoco" not in tops, path.name


def test_the_case_reference_is_up_to_date():
    made = runpy.run_path(str(ROOT / "docs" / "make_case_reference.py"))["reference"]()
    assert (ROOT / "docs" / "cases.md").read_text(encoding="utf-8") == made


def test_every_public_name_has_a_docstring_with_a_module_example():
    for package in MAY_IMPORT:
        for path in (ROOT / package).rglob("*.py"):
            assert ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))), path
