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
    """A change that helps, or the statement that none was found.

    Attributes:
        targets: numbers of the targets that it helps, ascending.
        reason: their reason; None for all infeasible targets together.
        change: ``key``, ``from``, ``to`` in the case's terms; None where none was found.
        checked: "part" if the whole part is feasible with it, "group" if only these targets are; None without a change.
        left: number of targets of the part that are still infeasible with it.
        sentence: the change in words.
        effort: size of the change, to rank by.
    """

    targets: Ints
    reason: str | None
    change: dict[str, Any] | None
    checked: str | None
    left: int
    sentence: str
    effort: float = np.inf

    def document(self) -> dict[str, Any]:
        """The remedy as in the report's key ``help``."""
        return {
            "targets": [int(i) for i in self.targets],
            "reason": self.reason,
            "change": plain(self.change),
            "checked": self.checked,
            "infeasible_left": self.left,
            "sentence": self.sentence,
        }
