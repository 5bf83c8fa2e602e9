"""What a command is about: its case with the options of the command line, and where its outputs go.

    case = load(args)                               # --roll, --table, --e1 and --e2 are in it
    refuse_outputs(args, case, "json", "html")      # before the work rather than after it

Angles in degrees, as on the command line.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..atomic_files import check_outputs
from ..errors import InputError

if TYPE_CHECKING:
    from ..case.sections import Case

PICTURE = "--picture"


def load(args: argparse.Namespace) -> Case:
    """The case that a command is given, with its table and roll as the options ask for them.

    Raises:
        InputError: the case cannot be used, or an option does not go with it; one line.
    """
    from ..case.read import load_case, with_changes
    from ..shipped import DEFAULT_CASE

    case = load_case(args.case or DEFAULT_CASE)
    if getattr(args, "roll", None) is not None:
        case = with_changes(case, roll=roll_argument(args.roll))
    return _at_table(args, case)


def _at_table(args: argparse.Namespace, case: Case) -> Case:
    """The case with its table as the command line wants it."""
    from ..case.read import with_changes
    from ..case.table_section import Table

    given = {
        key: _finite(option, value)
        for key, option in (("E1_deg", "--e1"), ("E2_deg", "--e2"))
        if isinstance(value := getattr(args, option.removeprefix("--"), None), float)
    }
    mode = getattr(args, "table", None) or case.table.mode
    if given and mode in ("indexed", "best"):
        option = "--e1" if "E1_deg" in given else "--e2"
        raise InputError(f"{option}: does not go with table mode {mode}, which has poses of its own; add --table fixed")
    if mode == case.table.mode and not given:
        return case
    kept = case.table.model_dump(exclude_unset=True) if mode == case.table.mode else {}
    own = {} if mode in ("indexed", "best") else {"E1_deg": case.table.E1_deg, "E2_deg": case.table.E2_deg}
    return with_changes(case, table=Table(**{**own, **kept, **given, "mode": mode}))


def _finite(name: str, value: float) -> float:
    from ..case.fields import LARGEST_ANGLE_DEG

    if not abs(value) < float("inf"):
        raise InputError(f"{name}: {value} is not an angle; a finite number in degrees is needed")
    if abs(value) > LARGEST_ANGLE_DEG:
        raise InputError(f"{name}: {value:g} is not within -{LARGEST_ANGLE_DEG} to {LARGEST_ANGLE_DEG} deg")
    return value


def roll_argument(text: str) -> Any:
    """A roll as the command line writes it; see ``cell.case.roll_text``."""
    from ..case.roll_text import parse_roll as parsed

    return parsed(text)


def refuse_outputs(
    args: argparse.Namespace, case: Case | None, *names: str, reads: Sequence[str | Path | None] = ()
) -> None:
    """Refuse outputs that cannot be written or are inputs of the run, before the work rather than after it.

    A picture has to be a .png.

    Args:
        args: of the command.
        case: whose files are inputs; None where there is none.
        names: of the options that name outputs.
        reads: further inputs.

    Raises:
        InputError: which option; one line.
    """
    outputs = {f"--{name.replace('_', '-')}": getattr(args, name) for name in names}
    if all(path is None for path in outputs.values()):
        return
    from ..case.files import case_files

    inputs = () if case is None else case_files(case)
    check_outputs(outputs, [*inputs, *(path for path in reads if path is not None)])
    picture = outputs.get(PICTURE)
    if picture is not None and not picture.lower().endswith(".png"):
        raise InputError(f"{PICTURE}: {picture}: a picture is a .png")
