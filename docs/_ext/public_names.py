"""The public names of a package, from its docstrings: ``.. public-names:: cell`` inside ``eval-rst``.

What `__init__.pyi` exports is listed and nothing else: functions, then classes with their methods, then constants.
"""

from __future__ import annotations

import importlib
import inspect
import re
from typing import Any

from docutils import nodes
from docutils.statemachine import StringList
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

LONGEST_VALUE = 60
ALIAS = re.compile(r"TypeAliasForwardRef\('(\w+)'\)")  # how autodoc prints an alias within another type


def lines_of(package: str) -> list[str]:
    """The package's names as reStructuredText."""
    module = importlib.import_module(package)
    things = {name: getattr(module, name) for name in sorted(module.__all__, key=str.lower)}
    functions = [name for name, thing in things.items() if inspect.isfunction(thing)]
    classes = [name for name, thing in things.items() if inspect.isclass(thing)]
    others = [name for name in things if name not in functions and name not in classes]
    lines = []
    for name in functions:
        lines += [f".. autofunction:: {package}.{name}", ""]
    for name in classes:
        lines += _class_lines(package, name, things[name])
    for name in others:
        lines += [f".. py:data:: {package}.{name}", *_value(things[name]), ""]
    return lines


def _class_lines(package: str, name: str, kind: type) -> list[str]:
    if hasattr(kind, "model_fields"):  # its keys are the case reference
        return [f".. autoclass:: {package}.{name}()", ""]
    return [f".. autoclass:: {package}.{name}", "   :members:", ""]


def _value(thing: Any) -> list[str]:
    text = repr(thing)
    return [f"   :value: {text}"] if len(text) <= LONGEST_VALUE and "<" not in text else []


class PublicNames(SphinxDirective):
    """The names of a package."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """Their descriptions."""
        holder = nodes.container(classes=["public-names"])
        self.state.nested_parse(StringList(lines_of(self.arguments[0]), source=self.arguments[0]), 0, holder)
        return holder.children


def _plain_aliases(*event: Any) -> tuple[str | None, str | None]:
    """A signature whose aliases are their names."""
    signature, returned = event[-2:]
    return tuple(None if text is None else ALIAS.sub(r"\1", text) for text in (signature, returned))


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the directive."""
    app.add_directive("public-names", PublicNames)
    app.connect("autodoc-process-signature", _plain_aliases)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
