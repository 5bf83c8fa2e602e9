"""A table pose picked from a sweep: from its map (``--json``) or from its log (``--out``).

E1_deg, E2_deg = picked_pose(case, "map.json", "best")
E1_deg, E2_deg = picked_pose(case, "sweep.jsonl", "7")     # the eighth pose of the file

A log may be that of a sweep that is still running.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from .errors import InputError
from .sections import Case
from .sweep_grid import Pose
from .sweep_log import SCHEMA as LOG_SCHEMA
from .sweep_log import fingerprint
from .sweep_rank import SCHEMA, sweep_document


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
        text = Path(path).read_text(encoding="utf-8")
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror or error})") from None
    except UnicodeDecodeError:
        raise InputError(f"{path}: is no sweep (neither a map of rbam sweep --json nor a log of --out)") from None
    documents = _objects(text)
    head = documents[0] if documents else {}
    roll: dict[str, Any] = {}  # a log is of this very case: its roll is the case's
    if head.get("schema") == LOG_SCHEMA:
        if head.get("case") != fingerprint(case):
            raise InputError(f"{path}: is the sweep of another case, or the case has changed since")
        rows = documents[1:]
        best = sweep_document(case, rows)["best"] if rows else None
    elif head.get("schema") == SCHEMA and isinstance(head.get("poses"), list):
        if head.get("case") != case.title:
            raise InputError(f"{path}: is the sweep of {head.get('case')!r}, not of {case.title!r}")
        rows, best = head["poses"], head.get("best")
        roll = {key: head[key] for key in ("roll",) if key in head}
    else:
        raise InputError(f"{path}: is no sweep (neither a map of rbam sweep --json nor a log of --out)")
    if not rows:
        raise InputError(f"{path}: has no poses yet")
    return rows, best, roll


def _objects(text: str) -> list[dict[str, Any]]:
    """One JSON object, or one a line; a line that was cut off is left out."""
    try:
        pieces = [json.loads(text)]
    except json.JSONDecodeError:
        pieces = []
        for line in text.splitlines():
            try:
                pieces.append(json.loads(line))
            except json.JSONDecodeError:
                continue
    return [piece for piece in pieces if isinstance(piece, dict)]
