"""Motion files: the columns of ``rbam check --motion``, as CSV or as npz, written and read.

    write_motion("blade.npz", motion)                  # by the name's suffix
    read = read_motion("blade.csv", job)               # read.motion, and what was repaired in words
    raise InputError("blade.csv: row 17: ...")         # what cannot be used

A row is a moment: ``t_s``, the arm's joints and E1, E2 (``A1_deg``, .. as the case names them), ``arc`` (1 while
welding), ``bead``, ``layer`` and ``target``; of a travel those it leads to. An npz holds one array a column. Rows count
from 1, the header of a CSV not counted.
"""

from __future__ import annotations

import csv
import io
import math
import zipfile
import zlib
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ik.chain import Floats

from ..atomic_files import write_bytes, write_csv
from ..errors import InputError
from ..job.job import Job
from ..scene.equipment import one_line
from .motion import Motion, required

JUMP_DEG = 60.0  # more between neighbouring rows is no motion: nothing says which way round
WHOLE_COLUMNS = ("arc", "bead", "layer", "target")
SUFFIXES = (".csv", ".npz")
MOST_DIGITS, NO_GRAIN = 10, 1e-3  # decimals that a file may be rounded to, and what is no unit of the last of them
MOST_WHOLE = 2.0**53  # numbers beyond it have no units' place
MOST_BYTES = 256 * 2**20  # unpacked: two million rows
_ZIP = (zipfile.BadZipFile, zlib.error, NotImplementedError, RuntimeError)  # damaged, of another packing, encrypted


@dataclass(frozen=True, eq=False)
class BlendedRows:
    """Rows of a motion that are run without a stop, their corners rounded.

    Attributes:
        first: row.
        last: row.
        s: path length from the first to every row, (last - first + 1,), ascending.
        zone: distance in it each way over which corners are rounded.
    """

    first: int
    last: int
    s: Floats
    zone: float


@dataclass(frozen=True, eq=False)
class ReadMotion:
    """A motion from a file.

    Attributes:
        motion: its rows.
        row: number of each in the file, from 1, (m,).
        repaired: what was mended, one line each.
        grain: what times, s, and angles, rad, are rounded to; 0 where they are not.
        blended: where corners are rounded, of a motion that says so itself; None: as the case says.
    """

    motion: Motion
    row: NDArray[np.int64]
    repaired: tuple[str, ...]
    grain: tuple[float, float] = (0.0, 0.0)
    blended: tuple[BlendedRows, ...] | None = None

    def __repr__(self) -> str:
        return f"<ReadMotion: {len(self.row)} rows, {len(self.repaired)} repaired>"


def check_suffix(path: str | Path) -> None:
    """Refuse a name of which it is not known what it holds.

    Raises:
        InputError: it ends neither in .csv nor in .npz.
    """
    if Path(path).suffix.lower() not in SUFFIXES:
        raise InputError(f"{path}: a motion file must end in .csv or .npz")


def write_motion(path: str | Path, motion: Motion) -> None:
    """Write a motion to a CSV or npz file.

    Args:
        path: ends in .csv or .npz.
        motion: the motion.

    Raises:
        InputError: there is no motion, another suffix, or the file cannot be written.
    """
    check_suffix(path)
    motion = required(motion)
    if Path(path).suffix.lower() == ".csv":
        write_csv(path, motion.columns(), motion.each_row_deg())
        return
    angles = np.rad2deg(np.concatenate([motion.q, motion.table], axis=1))
    values = [motion.t_s, *angles.T, motion.arc, motion.called[0], motion.layer, motion.called[1]]
    content = io.BytesIO()
    np.savez_compressed(content, **dict(zip(motion.columns(), values, strict=True)))
    write_bytes(path, content.getvalue())


def read_motion(path: str | Path, job: Job, most_bytes: int = MOST_BYTES) -> ReadMotion:
    """Read a motion and refuse what cannot be one.

    Args:
        path: ends in .csv or .npz.
        job: from ``cell.prepare``; names the joints and has the targets.
        most_bytes: of the file, unpacked.

    Returns:
        The motion (its ``.motion``), and what was repaired in it.

    Raises:
        InputError: it is larger than that, a column is missing, a value is no number, rows are out of order or too far
            apart, or a number of a bead or target does not exist; one line with the file and the row.
    """
    check_suffix(path)
    return read_columns(path, (_csv if Path(path).suffix.lower() == ".csv" else _npz)(path, most_bytes), job)


def read_columns(path: str | Path, table: Mapping[str, list[str] | Floats], job: Job) -> ReadMotion:
    """A motion of the columns of a file.

    Args:
        path: what errors call it.
        table: the columns by their names.
        job: names the joints and has the targets.

    Returns:
        The motion.

    Raises:
        InputError: as of :func:`read_motion`.
    """
    names = job.scene.chain.names
    wanted = ["t_s", *(f"{name}_deg" for name in (*names, "E1", "E2")), *WHOLE_COLUMNS]
    missing = [name for name in wanted if name not in table]
    if missing:
        raise InputError(f"{path}: has no column {missing[0]}; a motion needs {', '.join(wanted)}")
    columns = {name: _numbers(path, name, table[name]) for name in wanted}
    row, repaired = _distinct(path, columns, wanted)
    kept = {name: columns[name][row] for name in wanted}
    if len(row) < 2:
        raise InputError(f"{path}: has {len(row)} row(s); a motion needs at least two")
    angles = np.deg2rad(np.stack([kept[name] for name in wanted[1 : -len(WHOLE_COLUMNS)]], axis=1))
    arc, bead, layer, target = (_integers(path, name, kept[name], row) for name in WHOLE_COLUMNS)
    q, turned = angles[:, : len(names)], angles[:, len(names) :]
    if job.order is not None:
        bead, target = job.order.beads_of_file(bead), job.order.targets_of_file(target)
    motion = Motion(kept["t_s"], q, turned, arc, bead, layer, target, tuple(names), order=job.order)
    _check_order(path, motion, row)
    _check_numbers(path, motion, row, job)
    grain = _rounded_to(kept["t_s"]), float(np.deg2rad(_rounded_to(np.rad2deg(angles))))
    if np.ptp(np.diff(kept["t_s"])) < NO_GRAIN * grain[0]:
        grain = 0.0, grain[1]  # rows at an even beat are where they say
    return ReadMotion(motion, row + 1, repaired, grain)


def _rounded_to(values: Floats) -> float:
    """The power of ten that all values are multiples of; 0 where there is none."""
    for digits in range(MOST_DIGITS):
        scaled = values * 10.0**digits
        if (np.abs(scaled - np.round(scaled)) < NO_GRAIN).all():
            return float(10.0**-digits)
    return 0.0


def _check_size(path: str | Path, most: int) -> None:
    try:
        _check_bytes(path, Path(path).stat().st_size, most)
    except FileNotFoundError:
        raise InputError(f"{path}: no such file") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error})") from None


def _check_bytes(path: str | Path, size: int, most: int) -> None:
    if size > most:
        raise InputError(f"{path}: holds {size / 2**20:.0f} MiB; a motion is at most {most // 2**20} MiB")


def _csv(path: str | Path, most: int) -> dict[str, list[str]]:
    _check_size(path, most)
    try:
        text = Path(path).read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: cannot be read as text ({error})") from None
    _check_form(path, text)
    try:
        rows = [row for row in csv.reader(io.StringIO(text)) if row]
    except csv.Error as error:
        raise InputError(f"{path}: not a CSV ({error})") from None
    if not rows:
        raise InputError(f"{path}: is empty; a motion needs a line of column names and a row for each moment")
    header = [name.strip() for name in rows[0]]
    again = next((name for name, count in Counter(header).items() if count > 1), None)
    if again is not None:
        raise InputError(f"{path}: has the column {again} twice")
    for i, row in enumerate(rows[1:]):
        if len(row) != len(header):
            comma = "; a decimal comma?" if len(row) > len(header) else ""
            raise InputError(f"{path}: row {i + 1}: has {len(row)} values for {len(header)} columns{comma}; {FORM}")
    return {name: [row[k] for row in rows[1:]] for k, name in enumerate(header)}


FORM = "a comma between columns, a decimal point in numbers, and a first line with the columns' names are needed"


def _check_form(path: str | Path, text: str) -> None:
    """Refuse what other programs and languages write as CSV, by what is unusual in it.

    Raises:
        InputError: another character parts the columns, the first line holds no names, or a line is a comment.
    """
    lines = text.splitlines()
    for number, line in enumerate(lines, 1):
        if line.lstrip().startswith(("#", "//", "%")):
            raise InputError(
                f"{path}: line {number} is a comment ({line.strip()[:40]!r}), which is not allowed; {FORM}"
            )
    first = next((line for line in lines if line.strip()), "")
    for mark, name in ((";", "semicolons"), ("\t", "tabs"), ("|", "bars")):
        if mark in first and "," not in first:
            raise InputError(f"{path}: its columns are separated by {name}; {FORM}")
    if first and "," not in first and len(first.split()) > 1:
        raise InputError(f"{path}: its columns are separated by spaces; {FORM}")
    if first and all(_is_number(value) for value in first.split(",")):
        raise InputError(f"{path}: has no line of column names (it begins with {first[:40]!r}); {FORM}")


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _npz(path: str | Path, most: int) -> dict[str, Floats]:
    _check_size(path, most)
    try:
        # np.load takes other files as well, by what they begin with
        with zipfile.ZipFile(path) as archive:
            entries = archive.infolist()
            _check_bytes(path, sum(entry.file_size for entry in entries), most)
            for entry in entries:
                _check_array(path, archive, entry)
        with np.load(path, allow_pickle=False) as file:
            table = {name: np.asarray(file[name]) for name in file.files}
    except (OSError, ValueError, EOFError, MemoryError, *_ZIP) as error:
        raise InputError(f"{path}: not an npz of arrays ({one_line(error)})") from None
    for name, values in table.items():
        if values.dtype.kind not in "fiubSU":
            raise InputError(f"{path}: {name} does not hold numbers (holds {values.dtype})")
    sizes = {values.shape for values in table.values()}
    if len(sizes) > 1 or any(len(shape) != 1 for shape in sizes):
        shown = ", ".join(f"{name} {values.shape}" for name, values in table.items())
        raise InputError(f"{path}: its arrays must be of one dimension and equally long (are {shown[:200]})")
    return table


def _check_array(path: str | Path, archive: zipfile.ZipFile, entry: zipfile.ZipInfo) -> None:
    """Refuse an array whose header says that it is larger than what is there: room for all of it would be made."""
    with archive.open(entry) as file:
        version = np.lib.format.read_magic(file)
        read = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}.get(version)
        if read is None:
            raise ValueError(f"{entry.filename}: arrays of format {version} are not read")
        shape, _, kind = read(file)
        held = entry.file_size - file.tell()
        if any(n < 0 for n in shape) or math.prod(shape) * max(kind.itemsize, 1) > held:
            raise ValueError(f"{entry.filename}: claims {shape} values but holds {held} bytes")


def _numbers(path: str | Path, name: str, values: list[str] | Floats) -> Floats:
    """A column as finite numbers."""
    try:
        out = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError):
        out = np.full(len(values), np.nan)
        for i, value in enumerate(values):
            try:
                out[i] = float(value)
            except ValueError:
                raise InputError(f"{path}: row {i + 1}: {name} is not a number (is {str(value)[:40]!r})") from None
    bad = np.flatnonzero(~np.isfinite(out))
    if len(bad):
        raise InputError(f"{path}: row {bad[0] + 1}: {name} is not a finite number (is {out[bad[0]]})")
    return out


def _distinct(
    path: str | Path, columns: dict[str, Floats], names: list[str]
) -> tuple[NDArray[np.int64], tuple[str, ...]]:
    """Rows without those that repeat the one before, the time included."""
    table = np.stack([columns[name] for name in names], axis=1)
    again = np.flatnonzero((np.diff(table, axis=0) == 0).all(axis=1)) + 1
    row = np.setdiff1d(np.arange(len(table)), again)
    if not len(again):
        return row, ()
    return row, (
        f"{path}: {len(again)} row(s) that repeat the row before were left out, the first is row {again[0] + 1}",
    )


def _integers(path: str | Path, name: str, values: Floats, row: NDArray[np.int64]) -> NDArray[np.int64]:
    bad = np.flatnonzero((values != np.round(values)) | (np.abs(values) > MOST_WHOLE))
    if len(bad):
        raise InputError(f"{path}: row {row[bad[0]] + 1}: {name} is not a whole number (is {values[bad[0]]:g})")
    return values.astype(np.int64)


def _check_order(path: str | Path, motion: Motion, row: NDArray[np.int64]) -> None:
    late = np.flatnonzero(np.diff(motion.t_s) <= 0)
    if len(late):
        i = late[0]
        after, before = motion.t_s[i + 1], motion.t_s[i]
        raise InputError(
            f"{path}: row {row[i + 1] + 1}: t_s {after:g} is not later than that of the row before ({before:g})"
        )
    turn = np.rad2deg(np.abs(np.diff(np.concatenate([motion.q, motion.table], axis=1), axis=0)))
    far = np.argwhere(turn > JUMP_DEG)
    if len(far):
        i, k = far[0]
        name = (*motion.names, "E1", "E2")[k]
        raise InputError(
            f"{path}: row {row[i + 1] + 1}: {name} jumps by {turn[i, k]:.1f} deg from the row before; rows are at most "
            f"{JUMP_DEG:g} deg apart"
        )


def _check_numbers(path: str | Path, motion: Motion, row: NDArray[np.int64], job: Job) -> None:
    """The numbers of arc, target, bead and layer against the case's targets."""
    t = job.targets

    def refuse(bad: NDArray[np.bool_], what: str) -> None:
        if bad.any():
            i = int(np.argmax(bad))
            values = {name: int(getattr(motion, name)[i]) for name in WHOLE_COLUMNS}
            k = min(max(values["target"], 0), len(t) - 1)
            raise InputError(f"{path}: row {row[i] + 1}: " + what.format(**values, own=t.bead[k], its=t.layer[k]))

    refuse((motion.arc != 0) & (motion.arc != 1), "arc is 0 or 1 (is {arc})")
    refuse(
        (motion.target < 0) | (motion.target >= len(t)),
        f"target {{target}} does not exist; the case has 0 to {len(t) - 1}",
    )
    refuse(motion.bead != t.bead[motion.target], "target {target} belongs to bead {own}, not {bead}")
    refuse(motion.layer != t.layer[motion.target], "target {target} belongs to layer {its}, not {layer}")
    if not motion.arc.any():
        raise InputError(f"{path}: arc is 0 in every row, so nothing is welded")
    welded = np.bincount(motion.bead[motion.arc == 1], minlength=int(t.bead.max()) + 1)
    refuse(
        (motion.arc == 1) & (welded[motion.bead] < 2),
        "bead {bead} has one row with the arc on; a bead needs at least two",
    )
