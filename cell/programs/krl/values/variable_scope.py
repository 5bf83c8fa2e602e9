"""Variables of one part or file, and parameters that stand for variables of the caller.

Use:

    scope = VariableScope({"N": 3})
    scope.kinds["N"] = "INT"
    called.references["K"] = Reference(scope, "N", (), "INT")
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

Accessors = tuple[str | tuple[int, ...], ...]  # the way to a part of a variable: components, and elements of arrays


class VariableScope(dict[str, Any]):
    """Variables by name, with the types of those that are declared.

    Attributes:
        kinds: INT, REAL, FRAME, .. by name, of parameters too.
        references: parameters that stand for what the caller gave.
    """

    def __init__(self, values: dict[str, Any] | None = None) -> None:
        super().__init__(values or {})
        self.kinds: dict[str, str] = {}
        self.references: dict[str, Reference] = {}

    def add(self, other: VariableScope) -> None:
        """Take what others hold."""
        self.update(other)
        self.kinds |= other.kinds


@dataclass(frozen=True, eq=False)
class Reference:
    """A variable, or a part of one, that a parameter stands for: a value that is not IN is the caller's own.

    Attributes:
        scope: that has it; None: it is the controller's.
        root: its name.
        accessors: the part of it.
        kind: its type, None where it is not known.
    """

    scope: VariableScope | None
    root: str
    accessors: Accessors
    kind: str | None
