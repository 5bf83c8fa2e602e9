"""Python files as syntax trees, each read once a process: many rules of the project look at all of them."""

from __future__ import annotations

import ast
import gc
from functools import cache
from pathlib import Path


@cache
def tree_of(path: Path) -> ast.Module:
    """The file's tree; whoever asks changes nothing in it."""
    collects = gc.isenabled()
    gc.disable()  # of all that is made here nothing is garbage, and looking for it takes longer than the rest
    try:
        return ast.parse(path.read_text(encoding="utf-8"))
    finally:
        if collects:
            gc.enable()


@cache
def nodes_of(path: Path) -> tuple[ast.AST, ...]:
    """All nodes of the file's tree, as ``ast.walk`` gives them."""
    return tuple(ast.walk(tree_of(path)))
