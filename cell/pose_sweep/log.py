"""The log of a sweep: finished poses, one JSON a line, which an interrupted sweep goes on from.

    with Log("sweep.jsonl", fingerprint(case)) as log:
        log.done                       # poses that need not be computed again
        log.add(row)

The first line names what the results depend on: the case, all files it reads, this program's code and the libraries
that compute. Each further line ends with a checksum of itself; one that does not hold what was written is reported and
computed again.
"""

from __future__ import annotations

import json
import os
import zlib
from dataclasses import dataclass
from typing import Any

from ..atomic_files import check_writable, write_bytes
from ..errors import InputError
from ..streams import reason
from .grid import Pose

SCHEMA = "rbam-sweep-log/1"
SUM = "crc32"  # key of a line's checksum, its last
DAMAGED = "is damaged"


@dataclass(frozen=True, eq=False)
class ReadLog:
    """A log as it was found.

    Attributes:
        case: fingerprint of the case it is of.
        rows: those that hold what was written, in the order of the file.
        damaged: numbers of the lines that do not, from 1; a last line that was cut off is none of them.
    """

    case: str
    rows: list[dict[str, Any]]
    damaged: list[int]


def read_log(file: str, content: bytes) -> ReadLog:
    """Take a log apart.

    Args:
        file: its name, for messages.
        content: its bytes.

    Returns:
        What holds.

    Raises:
        InputError: it is no log of a sweep, or its first line is damaged.
    """
    lines = content.split(b"\n")
    head = _json(lines[0])
    if not isinstance(head, dict) or head.get("schema") != SCHEMA or not isinstance(head.get("case"), str):
        raise InputError(f"{file}: is not the log of a sweep; give a new file")
    last = len(lines) - 1  # empty, or the line that was being written when a sweep was cut off
    found = [(number, line_row(line)) for number, line in enumerate(lines) if 0 < number < last]
    rows = [row for _, row in found if row is not None]
    return ReadLog(head["case"], rows, [number + 1 for number, row in found if row is None])


def row_line(row: dict[str, Any]) -> bytes:
    """A row as a line of the log, without its end."""
    text = json.dumps(row, allow_nan=False)
    return f'{text[:-1]}, "{SUM}": "{zlib.crc32(text.encode()):08x}"}}'.encode()


def line_row(line: bytes) -> dict[str, Any] | None:
    """The row that :func:`row_line` wrote; None where the line is not that any more."""
    row = _json(line)
    if not isinstance(row, dict) or SUM not in row:
        return None
    row.pop(SUM)
    try:
        return row if row_line(row) == line else None
    except ValueError:
        return None  # a number that is none


def _json(line: bytes) -> Any:
    try:
        return json.loads(line)
    except (ValueError, RecursionError):
        return None


class Log:
    """An open log; without a file it only remembers.

    Attributes:
        done: finished poses and their rows.
        damaged: how many lines of the file did not hold what was written; their poses are not among those done.
    """

    def __init__(self, file: str | None, case_hash: str) -> None:
        """Read what is there and make ready to add to it.

        Args:
            file: the file; None for none.
            case_hash: from :func:`fingerprint`.

        Raises:
            InputError: it cannot be read or written, is something else, or belongs to another case.
        """
        self.done: dict[Pose, dict[str, Any]] = {}
        self.damaged = 0
        self._name, self._file = file, -1
        if file is None:
            return
        path = check_writable(file)
        try:
            content = path.read_bytes() if path.exists() else b""
        except OSError as error:
            raise InputError(f"{file}: cannot be read ({reason(error)})") from None
        if content:
            found = read_log(file, content)
            if found.case != case_hash:
                raise InputError(
                    f"{file}: belongs to another case or version, or the case has changed since; give a new file"
                )
            self.done, self.damaged = {Pose.of(row): row for row in found.rows}, len(found.damaged)
        # whole or not at all: what an earlier run has found is not to be lost while damaged lines go
        head = json.dumps({"schema": SCHEMA, "case": case_hash}).encode()
        write_bytes(path, b"".join(line + b"\n" for line in (head, *map(row_line, self.done.values()))))
        try:
            self._file = os.open(path, os.O_WRONLY | os.O_APPEND)
        except OSError as error:
            raise InputError(f"{file}: cannot be written ({reason(error)})") from None

    def __enter__(self) -> Log:
        return self

    def __exit__(self, *_: object) -> None:
        if self._file >= 0:
            os.close(self._file)
            self._file = -1

    def add(self, row: dict[str, Any]) -> None:
        """Keep a finished pose; in the file before this returns.

        Raises:
            InputError: it cannot be written; what was written before stays.
        """
        if self._file >= 0:
            line = row_line(row) + b"\n"
            try:
                while line:
                    line = line[os.write(self._file, line) :]
            except OSError as error:
                raise InputError(f"{self._name}: cannot be written ({reason(error)})") from None
        self.done[Pose.of(row)] = row
