"""Rules of the tests: what they share is in support/, what they vary comes as an argument, and long ones are marked."""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator, Sequence
from functools import cache
from pathlib import Path

import pytest
from support.paths import ROOT
from support.source_trees import nodes_of

TESTS = ROOT / "tests"

# tuning constants that tests replace, and why they are no arguments; all others come as arguments
REPLACED = {
    "ASSETS": "no tuning: the folder that a builder of models writes into",
    "CHUNK": "of all measures of faces: an argument of each would be in the way of all that call them",
    "CONNECT_S": "of a command: how long it waits for a scheduler that is not there",
    "FLOOR": "of a whole check: a part that is large enough would take a minute",
    "LARGE": "of a whole check: groups that are large enough would take a minute",
    "LARGE_PART": "of a whole check: a part that is large enough would take a minute",
    "LEAST_CHUNK": "of a whole check, likewise",
    "LEAST_PIECE": "of the check of a motion: one that is long enough would take a minute",
    "MANY_GEOMS": "of every checker: a cell that is large enough takes seconds to compile",
    "MANY_VERTICES": "of every cell, likewise",
    "MOST_FACES": "of every reader of meshes: a mesh that is large enough takes a gigabyte",
    "SMALL": "of a whole check, likewise",
    "WORTH_A_START": "of a whole check, as LARGE_PART",
}


@cache
def modules() -> tuple[tuple[Path, Sequence[ast.AST]], ...]:
    return tuple((path, nodes_of(path)) for path in sorted(TESTS.rglob("*.py")))


def imported(nodes: Iterable[ast.AST]) -> Iterator[str]:
    for node in nodes:
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield from (f"{node.module or ''}.{alias.name}" for alias in node.names)


def replaced(nodes: Iterable[ast.AST]) -> Iterator[str]:
    """Names of constants that `monkeypatch.setattr` replaces: by themselves, or at the end of a dotted name."""
    for node in nodes:
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr == "setattr":
            for given in node.args[:2]:
                if isinstance(given, ast.Constant) and isinstance(given.value, str):
                    name = given.value.rpartition(".")[2]
                    if name.isupper():
                        yield name


def test_no_test_imports_another_test() -> None:
    wrong = [
        f"{path.relative_to(ROOT)} imports {name}"
        for path, nodes in modules()
        for name in imported(nodes)
        if any(part.startswith("test_") or part in ("tests", "conftest") for part in name.split("."))
    ]
    assert not wrong


def test_tests_are_skipped_for_want_of_other_peoples_packages_alone() -> None:
    """A module of our own that is not found is an error, and no reason to skip."""
    wrong = [
        f"{path.relative_to(ROOT)} line {node.lineno}"
        for path, nodes in modules()
        for node in nodes
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr == "importorskip"
        if str(getattr(node.args[0], "value", "cell")).partition(".")[0] in ("support", "cell", "ik", "slicing")
    ]
    assert not wrong


def test_support_holds_no_tests() -> None:
    for path, nodes in modules():
        if "support" in path.parts and not path.name.startswith("test_"):
            names = [node.name for node in nodes if isinstance(node, ast.FunctionDef | ast.ClassDef)]
            assert not [name for name in names if name.lower().startswith("test_")], path


def test_tuning_constants_come_as_arguments_or_say_why_not() -> None:
    assert {name for _, nodes in modules() for name in replaced(nodes)} == set(REPLACED)


@pytest.mark.parametrize("text", ["monkeypatch.setattr(part, 'MOST', 1)", "monkeypatch.setattr('a.b.MOST', 1)"])
def test_a_constant_that_is_replaced_is_seen(text: str) -> None:
    assert list(replaced(ast.walk(ast.parse(text)))) == ["MOST"]
