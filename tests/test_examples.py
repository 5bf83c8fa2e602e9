"""Examples in module docstrings: they parse, and every call of the module's own names fits its signature."""

from __future__ import annotations

import ast
import builtins
import importlib
import inspect
import re
from collections.abc import Iterator

import pytest
from support.paths import ROOT

PACKAGES = ("cell", "ik", "slicing")
NEEDS_EXTRAS = {"cell.view.browser_panel"}
MODULES = sorted(
    ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")
    for package in PACKAGES
    for path in (ROOT / package).rglob("*.py")
    if path.name != "__main__.py"
)


def example_of(module: str) -> str:
    """The indented lines of a module's docstring."""
    lines = (inspect.getdoc(importlib.import_module(module)) or "").splitlines()
    return "\n".join(line[4:] for line in lines if line.startswith("    "))


def calls(example: str) -> Iterator[ast.Call]:
    """Calls of an example; statements of several lines are read together, notes of what comes out are left out."""
    code: list[str] = []
    for line in example.splitlines():
        code.append(re.sub(r"\s+#.*$", "", line))
        try:
            tree = ast.parse("\n".join(code))
        except SyntaxError:
            try:
                tree = ast.parse("\n".join([*code, "    pass"]))
            except SyntaxError:
                continue
        yield from (node for node in ast.walk(tree) if isinstance(node, ast.Call))
        code = []


def called(module: object, call: ast.Call) -> object:
    """What of the module a call means; None where it is something else."""
    if isinstance(call.func, ast.Name):
        return getattr(module, call.func.id, None)
    if isinstance(call.func, ast.Attribute) and isinstance(call.func.value, ast.Name):
        owner = getattr(module, call.func.value.id, None)
        return getattr(owner, call.func.attr, None) if inspect.isclass(owner) else None
    return None


@pytest.mark.parametrize("package", PACKAGES)
def test_examples_fit_the_signatures_they_show(package: str) -> None:
    seen, refused = 0, []
    for name in MODULES:
        if name.split(".")[0] != package or name in NEEDS_EXTRAS:
            continue
        module = importlib.import_module(name)
        for call in calls(example_of(name)):
            what = called(module, call)
            if not callable(what) or not getattr(what, "__module__", "").startswith(PACKAGES):
                continue
            if any(isinstance(a, ast.Starred) or (isinstance(a, ast.Constant) and a.value is ...) for a in call.args):
                continue
            seen += 1
            try:
                inspect.signature(what).bind(*call.args, **{k.arg: 0 for k in call.keywords if k.arg})
            except ValueError:
                continue  # an exception's arguments are free
            except TypeError as error:
                refused.append(f"{name}: {ast.unparse(call)}: {error}")
    assert seen > 10
    assert not refused, "\n".join(refused)


# of the standard library, in examples
KNOWN = {"Path", "ThreadPoolExecutor", "escape"}


def test_examples_call_what_there_is() -> None:
    """Every name that an example calls is of some module's top level, or is made in the example itself."""
    kinds = ast.FunctionDef | ast.ClassDef
    there = set(KNOWN)
    for package in PACKAGES:
        for path in (ROOT / package).rglob("*.py"):
            body = ast.parse(path.read_text(encoding="utf-8")).body
            there |= {node.name for node in body if isinstance(node, kinds)}
    gone = []
    for name in MODULES:
        if name in NEEDS_EXTRAS:
            continue
        module, text = importlib.import_module(name), example_of(name)
        made = set(re.findall(r"(?:^|[\s,(])(\w+)(?=[\w, ]* = )", text)) | set(re.findall(r" as (\w+)", text))
        for call in calls(text):
            if isinstance(call.func, ast.Name) and called(module, call) is None:
                known = call.func.id in there | made or hasattr(builtins, call.func.id)
                gone += [] if known else [f"{name}: {ast.unparse(call)}"]
    assert not gone, "\n".join(gone)
