"""What would help, as reports have it.

remedy.sentence, remedy.document()
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..arrays import Ints
from ..plain import plain


@dataclass(frozen=True, eq=False)
class Remedy:
    """A change that helps, or that none was found.

    Attributes:
        targets: what it helps, ascending.
        reason: what these are infeasible for; None for all infeasible targets together.
        change: ``key``, ``from``, ``to`` in the case's terms; None where none was found.
        checked: "part" where the whole part is feasible with it, "group" where these targets are; None without one.
        left: targets of the part that are infeasible with it.
        sentence: all this in words.
        effort: how much of a change it is.
    """

    targets: Ints
    reason: str | None
    change: dict[str, Any] | None
    checked: str | None
    left: int
    sentence: str
    effort: float = np.inf

    def document(self) -> dict[str, Any]:
        """As the report has it."""
        return {
            "targets": [int(i) for i in self.targets],
            "reason": self.reason,
            "change": plain(self.change),
            "checked": self.checked,
            "infeasible_left": self.left,
            "sentence": self.sentence,
        }
