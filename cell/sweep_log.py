"""The log of a sweep: finished poses, one JSON a line, which an interrupted sweep goes on from.

    with Log("sweep.jsonl", fingerprint(case)) as log:
        log.done                       # poses that need not be computed again
        log.add(row)

The first line names what the results depend on: the case, the files it names, and this program's version.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Iterator
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import IO, Any

from .config import is_path
from .errors import InputError
from .files import check_writable, write_bytes
from .sections import Case
from .sweep_grid import Pose

SCHEMA = "rbam-sweep-log/1"
ROWS = 2  # raised when rows of an older program would lack something
NO_MATTER = {"table", "expect", "name", "description", "extends", "sweep"}  # a row says its own pose


def fingerprint(case: Case) -> str:
    """What a sweep's results depend on, as a short hash.

    Args:
        case: the case; of its files the content counts, not the name.

    Returns:
        16 hexadecimal digits.
    """
    try:
        program = version("rbam-cell")
    except PackageNotFoundError:
        program = "not installed"
    digest = hashlib.sha256(f"{program} {ROWS} {case.model_dump_json(exclude=NO_MATTER)}".encode())
    for path in _files(case):
        digest.update(path.read_bytes() if path.is_file() else b"")
    return digest.hexdigest()[:16]


def _files(case: Case) -> Iterator[Path]:
    body = case.part.body.mesh if case.part.body else None
    for name in (case.part.mesh, *case.part.sub_volumes, body, *(f.mesh for f in case.fixtures)):
        if name:
            yield case.path_of(name)
    for model in (case.robot.model, case.tool.model, case.positioner.model):
        if not is_path(model):
            continue  # a shipped one changes with the program
        path = case.path_of(model)
        yield path
        if path.is_file():
            named = re.findall(r'file="([^"]+)"', path.read_text(encoding="utf-8", errors="replace"))
            for name in sorted({Path(name).name for name in named}):
                yield from sorted(path.parent.rglob(name))


class Log:
    """An open log; without a file it only remembers."""

    def __init__(self, file: str | None, case_hash: str) -> None:
        """Read what is there and make ready to add to it.

        Args:
            file: the file; None for none.
            case_hash: from :func:`fingerprint`.

        Raises:
            InputError: it cannot be written, is something else, or belongs to another case.
        """
        self.done: dict[Pose, dict[str, Any]] = {}
        self._file: IO[str] | None = None
        if file is None:
            return
        path = check_writable(file)
        head = {"schema": SCHEMA, "case": case_hash}
        try:
            lines = path.read_text(encoding="utf-8").split("\n") if path.exists() else []
        except (OSError, UnicodeDecodeError):
            lines = ["?"]
        if any(lines):
            _check_head(file, lines[0], head)
        rows = [row for row in map(_row, lines[1:]) if row is not None]
        self.done = {Pose.of(row): row for row in rows}
        # whole or not at all: what an earlier run has found is not to be lost while the line it broke off in goes
        write_bytes(path, "".join(json.dumps(line) + "\n" for line in (head, *self.done.values())).encode())
        try:
            self._file = path.open("a", encoding="utf-8")
        except OSError as error:
            raise InputError(f"{file}: cannot be written ({error.strerror or error})") from None

    def __enter__(self) -> Log:
        return self

    def __exit__(self, *_: object) -> None:
        if self._file is not None:
            self._file.close()

    def add(self, row: dict[str, Any]) -> None:
        """Keep a finished pose; in the file before this returns."""
        self.done[Pose.of(row)] = row
        if self._file is not None:
            self._file.write(json.dumps(row) + "\n")
            self._file.flush()


def _check_head(file: str, line: str, mine: dict[str, str]) -> None:
    try:
        head = json.loads(line)
    except json.JSONDecodeError:
        head = None
    if not isinstance(head, dict) or head.get("schema") != SCHEMA:
        raise InputError(f"{file}: is not the log of a sweep; name a new file")
    if head != mine:
        raise InputError(f"{file}: belongs to another case, or the case has changed since; name a new file")


def _row(line: str) -> dict[str, Any] | None:
    """A row, or None of the line that was being written when a sweep was cut off."""
    try:
        row = json.loads(line)
    except json.JSONDecodeError:
        return None
    return row if isinstance(row, dict) and {"E1_deg", "E2_deg", "verdict"} <= row.keys() else None
