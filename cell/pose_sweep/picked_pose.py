"""A table pose picked from a sweep: from its map (``--json``) or from its log (``--out``).

Use:

    E1_deg, E2_deg = picked_pose(case, "map.json", "best")
    E1_deg, E2_deg = picked_pose(case, "sweep.jsonl", "7")     # the eighth pose of the file

A log may be that of a sweep that is still running.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from ..case.fingerprint import fingerprint
from ..case.sections import Case
from ..errors import InputError
from ..streams import reason
from .grid import Pose
from .log import DAMAGED, read_log
from .log import SCHEMA as LOG_SCHEMA
from .ranking import SCHEMA, sweep_document

MOST_BYTES = 2**28  # of a map or a log


def picked_pose(case: Case, path: str, which: str) -> Pose:
    """A pose of a sweep, with the roll, place and height that it was swept with.

    Args:
        case: what was swept.
        path: a map (rbam-sweep/1) or the log of a sweep, finished or not.
        which: "best", or the place of a pose in the file, from 0.

    Returns:
        The pose; ``applied`` to the case it is what was swept.

    Raises:
        InputError: the file is no sweep or one of another case, or has no such pose.
    """
    rows, best, roll = _read(case, path)
    if which == "best":
        if best is None:
            raise InputError(f"{path}: no pose is feasible; choose one of 0 .. {len(rows) - 1} with --pose")
        row = best
    elif not which.isdecimal() or int(which) >= len(rows):
        raise InputError(f"--pose: {which!r} is neither best nor one of 0 .. {len(rows) - 1}, the poses in {path}")
    else:
        row = rows[int(which)]
    try:
        pose = Pose.of(roll | row)
        return pose._replace(E1_deg=float(pose.E1_deg), E2_deg=float(pose.E2_deg))
    except (KeyError, TypeError, ValueError):
        raise InputError(f"{path}: pose {which} has no table angles E1_deg, E2_deg") from None


def _read(case: Case, path: str) -> tuple[list[dict[str, Any]], dict[str, Any] | None, dict[str, Any]]:
    """Poses, the best of them, and the roll of those that name none."""
    try:
        with Path(path).open("rb") as file:
            content = file.read(MOST_BYTES + 1)
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: cannot be read ({reason(error)})") from None
    if len(content) > MOST_BYTES:
        raise InputError(f"{path}: has more than {MOST_BYTES // 2**20} MiB, the most that is read")
    head = _head(content)
    roll: dict[str, Any] = {}  # a log is of this very case: its roll is the case's
    if head.get("schema") == LOG_SCHEMA:
        found = read_log(path, content)
        if found.case != fingerprint(case):
            raise InputError(f"{path}: belongs to another case or version, or the case has changed since")
        if found.damaged:
            raise InputError(f"{path}: line {found.damaged[0]} {DAMAGED}; rbam sweep --out {path} computes it again")
        rows = found.rows
        best = sweep_document(case, rows)["best"] if rows else None
    elif head.get("schema") == SCHEMA and isinstance(head.get("poses"), list):
        if head.get("case") != case.title:
            raise InputError(f"{path}: is the sweep of {head.get('case')!r}, not of {case.title!r}")
        rows, best = head["poses"], head.get("best")
        roll = {key: head[key] for key in ("roll",) if key in head}
    else:
        raise InputError(f"{path}: is not a sweep; a map of rbam sweep --json or a log of --out is needed")
    if not rows:
        raise InputError(f"{path}: has no poses yet")
    return rows, best, roll


def _head(content: bytes) -> dict[str, Any]:
    """A map as a whole, or the first line of a log; empty where it is neither."""
    for text in (content, content.split(b"\n", 1)[0]):
        try:
            found = json.loads(text)
        except (ValueError, RecursionError):
            continue
        if isinstance(found, dict):
            return found
    return {}
