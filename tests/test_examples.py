"""Examples in module docstrings: they parse, and every call of the module's own names fits its signature."""

from __future__ import annotations

import ast
import builtins
import importlib
import inspect
import re
from collections.abc import Iterator
from functools import cache, partial
from textwrap import indent

import pytest
from support.paths import ROOT
from support.source_trees import tree_of

PACKAGES = ("cell", "ik", "slicing")
NEEDS_EXTRAS = {"cell.view.browser_panel"}
MODULES = sorted(
    ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")
    for package in PACKAGES
    for path in (ROOT / package).rglob("*.py")
    if path.name != "__main__.py"
)


@cache
def example_of(module: str) -> str:
    """The blocks of code of a module's docstring, indented or not; what is indented below a line of text is that's."""
    out, before = [], ""
    for line in as_indented(doc_of(module)).splitlines():
        if line.startswith("    ") and (not before.strip() or (out and out[-1] == before[4:])):
            out.append(line[4:])
        elif not line.strip():
            out.append("")
        before = line
    return "\n".join(out)


def as_indented(text: str) -> str:
    """A docstring with every block of code indented that begins at the margin."""
    blocks = re.split(r"\n\s*\n", text)
    return "\n\n".join(indent(b, "    ") if k and is_code(b) else b for k, b in enumerate(blocks))


def is_code(block: str) -> bool:
    """Whether a line of a block, at the margin, is Python that calls or names something."""
    return any(
        isinstance(node, ast.Call | ast.Assign)
        for line in block.splitlines()
        if not line.startswith(" ")
        for node in ast.walk(parsed(line) or parsed(f"{line}\n    pass") or ast.Module([], []))
    )


def test_blocks_at_the_margin_are_read() -> None:
    text = "What it does.\n\nrows = made(3)   # of\nwith held(rows):\n    put(1)\n\nWords (of a kind) follow.\n"
    assert as_indented(text).splitlines()[2:5] == [
        "    rows = made(3)   # of",
        "    with held(rows):",
        "        put(1)",
    ]
    assert as_indented(text).endswith("\n\nWords (of a kind) follow.\n")
    assert example_of("cell.job.reordered").strip().startswith("job = in_order(")


def doc_of(module: str) -> str:
    return inspect.getdoc(importlib.import_module(module)) or ""


@cache
def statements(example: str) -> tuple[tuple[str, ast.Module | None], ...]:
    """Statements of an example, each with what is indented below it and without notes; None of what is no Python."""
    return tuple(_statements(example))


def _statements(example: str) -> Iterator[tuple[str, ast.Module | None]]:
    code: list[str] = []
    lines = [re.sub(r"\s+#.*$", "", line) for line in example.splitlines()]
    for k, line in enumerate(lines):
        code.append(line)
        after = lines[k + 1] if k + 1 < len(lines) else ""
        if after.startswith((" ", "else:", "elif ", "except", "finally:")):
            continue  # it belongs to the statement
        text = "\n".join(code)
        tree = parsed(text) or parsed(f"{text}\n    pass")
        if tree is None and after.strip():
            continue  # of several lines
        if text.strip():
            yield text, tree
        code = []


def parsed(text: str) -> ast.Module | None:
    try:
        return ast.parse(text)
    except SyntaxError:
        return None


def calls(example: str) -> Iterator[ast.Call]:
    """Calls of an example."""
    for _, tree in statements(example):
        yield from (node for node in ast.walk(tree or ast.Module([], [])) if isinstance(node, ast.Call))


def made_of(module: object, example: str) -> dict[str, type]:
    """Names of an example that stand for objects of the module's own classes."""
    out = {}
    for _, tree in statements(example):
        for node in ast.walk(tree or ast.Module([], [])):
            if isinstance(node, ast.Assign) and isinstance(node.value, ast.Call) and len(node.targets) == 1:
                target, what = node.targets[0], called(module, node.value, {})
                if isinstance(target, ast.Name) and inspect.isclass(what):
                    out[target.id] = what
    return out


def called(module: object, call: ast.Call, made: dict[str, type]) -> object:
    """What of the module a call means; None where it is something else."""
    if isinstance(call.func, ast.Name):
        return getattr(module, call.func.id, None)
    if isinstance(call.func, ast.Attribute) and isinstance(call.func.value, ast.Name):
        name = call.func.value.id
        if name in made:
            what = inspect.getattr_static(made[name], call.func.attr, None)
            return partial(what, None) if inspect.isfunction(what) else None
        owner = getattr(module, name, None)
        return getattr(owner, call.func.attr, None) if inspect.isclass(owner) else None
    return None


# examples that are formulas, or lines of a shell
NO_PYTHON = {
    "cell.cli.main",
    "slicing.curves.ellipse_arcs",
    "slicing.paper.adhesion",
    "slicing.paper.scores",
}


def test_examples_are_python() -> None:
    wrong = {
        f"{name}: {text}"
        for name in MODULES
        if name not in NEEDS_EXTRAS | NO_PYTHON
        for text, tree in statements(example_of(name))
        if tree is None
    }
    assert not wrong


@pytest.mark.parametrize("package", PACKAGES)
def test_examples_fit_the_signatures_they_show(package: str) -> None:
    seen, refused = 0, []
    for name in MODULES:
        if name.split(".")[0] != package or name in NEEDS_EXTRAS:
            continue
        module = importlib.import_module(name)
        made = made_of(module, example_of(name))
        for call in calls(example_of(name)):
            what = called(module, call, made)
            whose = what.func if isinstance(what, partial) else what
            if not callable(what) or not getattr(whose, "__module__", "").startswith(PACKAGES):
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
            body = tree_of(path).body
            there |= {node.name for node in body if isinstance(node, kinds)}
    gone = []
    for name in MODULES:
        if name in NEEDS_EXTRAS:
            continue
        module, text = importlib.import_module(name), example_of(name)
        made = set(re.findall(r"(?:^|[\s,(])(\w+)(?=[\w, ]* = )", text)) | set(re.findall(r" as (\w+)", text))
        for call in calls(text):
            if isinstance(call.func, ast.Name) and called(module, call, {}) is None:
                known = call.func.id in there | made or hasattr(builtins, call.func.id)
                gone += [] if known else [f"{name}: {ast.unparse(call)}"]
    assert not gone, "\n".join(gone)
