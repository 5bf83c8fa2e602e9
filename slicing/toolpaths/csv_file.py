"""A toolpath from another slicer's table: one row a target, in the order of deposition.

    path = read_toolpath("theirs.csv", width_mm=5.0, thickness_mm=1.7)
    path.targets, path.warnings

Columns are found by their names, in any order; others are passed over and named in a warning:

- ``x_mm y_mm z_mm`` (or ``x y z``): the target, part frame, mm;
- ``nx ny nz`` (or ``i j k``): the deposition direction, out of the part; where they are missing ``normal`` says it;
- ``path`` (or ``bead``): number of the bead; or ``on`` (or ``arc``, ``kind``): a bead is a run of rows on which it is 1
  (``kind``: anything but travel); with both, a bead ends where either does;
- ``layer``, ``sub_volume``, ``thickness_mm`` (or ``height_mm``), ``speed_mm_s``: each may be missing.

Columns are separated by comma, semicolon or tab; with semicolons or tabs a decimal comma is understood. It is what
``rbam slice --targets`` writes as well.
"""

from __future__ import annotations

import csv
import io
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from ..mesh.solid import Bools, Floats, Ints, PartError
from ..parameters import BeadParameters
from ..targets.speeds import BeadSpeed
from ..targets.targets import Targets
from ..warning import Code, Warning
from .own_metal import own_metal_warnings
from .toolpath import Toolpath, require_order

MOST_BYTES = 2**28
MOST_ROWS = 1_000_000
SAME_MM = 1e-6  # targets nearer than this are one
CLOSED_MM = 1e-3  # a bead whose ends are nearer than this is closed
FARTHEST_MM = 1e6
NAMES = {
    "x": ("x_mm", "x"),
    "y": ("y_mm", "y"),
    "z": ("z_mm", "z"),
    "nx": ("nx", "i"),
    "ny": ("ny", "j"),
    "nz": ("nz", "k"),
    "bead": ("path", "bead"),
    "on": ("on", "arc"),
    "kind": ("kind",),
    "layer": ("layer",),
    "sub_volume": ("sub_volume",),
    "thickness": ("thickness_mm", "height_mm"),
    "speed": ("speed_mm_s",),
}
KNOWN_KINDS = ("travel", "print", "contour", "infill")  # the first is not welded
OWN = ("index", "tx", "ty", "tz")  # written by rbam slice, found again from the rest


@dataclass(frozen=True, eq=False)
class _CsvRows:
    """A table's rows as text.

    Attributes:
        source: the file.
        columns: by meaning, each a list of cells.
        line: line of the file that each row stands in.
        decimal_comma: whether numbers have one.
    """

    source: str
    columns: dict[str, list[str]]
    line: list[int]
    decimal_comma: bool

    def has(self, *names: str) -> bool:
        return all(name in self.columns for name in names)

    def numbers(self, name: str) -> Floats:
        """A column's numbers, finite and no further than any part is."""
        out = np.empty(len(self.line))
        for k, cell in enumerate(self.columns[name]):
            text = cell.replace(",", ".") if self.decimal_comma else cell
            try:
                # Python alone reads 4_0 as forty, and digits of other scripts
                out[k] = float(text if text.isascii() and "_" not in text else "none")
            except ValueError:
                raise self.wrong(k, name, cell, "a number is needed") from None
            if not abs(out[k]) <= FARTHEST_MM:
                raise self.wrong(k, name, cell, f"a number within +-{FARTHEST_MM:g} is needed")
        return out

    def whole(self, name: str) -> Ints:
        """A column's whole numbers, none below 0."""
        values = self.numbers(name)
        bad = np.flatnonzero((values != np.round(values)) | (values < 0))
        if len(bad):
            k = int(bad[0])
            raise self.wrong(k, name, self.columns[name][k], "a whole number from 0 is needed")
        return values.astype(np.int64)

    def wrong(self, k: int, name: str, cell: str, needed: str) -> PartError:
        return PartError(f"{self.source}: line {self.line[k]}: {NAMES[name][0]}: {cell[:40]!r}: {needed}")


def read_toolpath(
    path: str | Path,
    *,
    width_mm: float = 5.0,
    thickness_mm: float | None = None,
    speed_mm_s: float | None = None,
    normal: Literal["up", "radial"] | None = None,
    metal: Literal["above", "below"] = "above",
) -> Toolpath:
    """Read a toolpath.

    Args:
        path: the table.
        width_mm: of a bead.
        thickness_mm: of a bead where the table has no column for it.
        speed_mm_s: of the deposition where the table has no column for it.
        normal: the deposition direction where the table has none: up (along the part's z) or radial (off that axis).
        metal: whether a bead's metal lies above its targets (along the deposition direction: targets on the surface
            that it is laid on) or below (targets on its top, as planar slicers write them).

    Returns:
        The toolpath.

    Raises:
        PartError: the file cannot be read, or a column or a value cannot be used; one line with file, line and what
            is needed.
    """
    file = Path(path)
    table = _read(file)
    bead, rows = _beads(table)
    position = np.stack([table.numbers(name) for name in "xyz"], axis=1)
    normals = _normals(table, position, normal)
    sub_volume = table.columns.get("sub_volume", ["SV1"] * len(table.line))
    names = tuple(dict.fromkeys(sub_volume[k] for k in rows))
    if any(not name.isprintable() or not name or "/" in name for name in names):
        raise PartError(f"{file}: sub_volume: every row needs a name on one line, without / and control characters")
    if "body" in names:
        raise PartError(f"{file}: sub_volume: body is what the sub-volumes stand on; give it another name")
    volume = np.array([names.index(name) if name in names else 0 for name in sub_volume])
    layer = table.whole("layer") if table.has("layer") else _one_a_bead(bead, volume)
    _require_whole_beads(table, bead, rows, layer, volume)
    rows = _without_repeats(rows, bead, position)
    thickness = _given(table, "thickness", rows, thickness_mm, "thickness_mm")
    speed = _given(table, "speed", rows, speed_mm_s or BeadSpeed().constant_mm_s, "speed_mm_s")
    bead = np.unique(bead[rows], return_inverse=True)[1]
    p, n = position[rows], normals[rows]
    lengths = np.bincount(bead)
    if (lengths < 2).any():
        k = rows[int(np.argmax(bead == int(np.argmax(lengths < 2))))]
        raise PartError(f"{file}: line {table.line[k]}: a bead of one target; at least two are needed")
    closed = _closed(bead, p)
    tangents = _tangents(bead, p, n, closed)
    targets = Targets(names, volume[rows], layer[rows], bead, p, n, tangents, thickness, closed, speed)
    require_order(targets, [table.line[k] for k in rows], str(file))
    text = (
        f"toolpath {file.name}: metal and layer areas are not checked: "
        "they are known only for layers that rbam-cell slices itself"
    )
    reported = (Warning(Code.TOOLPATH_NOT_SLICED, text), *_passed_over(table), *own_metal_warnings(targets, width_mm))
    return Toolpath(targets, BeadParameters(width_mm=width_mm), (), metal == "below", reported, str(file))


def _read(file: Path) -> _CsvRows:
    if not file.is_file():
        raise PartError(f"{file}: {'not a file' if file.exists() else 'no such file'}")
    if file.stat().st_size > MOST_BYTES:
        raise PartError(f"{file}: has more than {MOST_BYTES // 2**20} MiB, the most that is read")
    try:
        text = file.read_bytes().decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise PartError(f"{file}: cannot be read as text ({error.reason} at byte {error.start})") from None
    head = text.split("\n", 1)[0]
    delimiter = max(";\t,", key=head.count)
    rows = csv.reader(io.StringIO(text, newline=""), delimiter=delimiter)
    try:
        header = [cell.strip() for cell in next(rows)]
        found = [(rows.line_num, cells) for cells in rows if any(cell.strip() for cell in cells)]
    except StopIteration:
        raise PartError(f"{file}: the file is empty") from None
    except csv.Error as error:
        raise PartError(f"{file}: line {rows.line_num}: {error}") from None
    if len(found) > MOST_ROWS:
        raise PartError(f"{file}: has {len(found)} rows; at most {MOST_ROWS} are taken")
    if not found:
        raise PartError(f"{file}: has a header but no rows; a row for each target is needed")
    for number, cells in found:
        if len(cells) != len(header):
            raise PartError(f"{file}: line {number}: has {len(cells)} columns, the header {len(header)}")
    at = _places(file, header)
    columns = {name: [cells[k].strip() for _, cells in found] for name, k in at.items()}
    columns["_others"] = [name for k, name in enumerate(header) if k not in at.values() and name not in OWN]
    return _CsvRows(str(file), columns, [number for number, _ in found], delimiter != ",")


def _places(file: Path, header: list[str]) -> dict[str, int]:
    """Where each column stands."""
    low = [name.lower() for name in header]
    at: dict[str, int] = {}
    for meaning, names in NAMES.items():
        places = [k for k, name in enumerate(low) if name in names]
        if len(places) > 1:
            raise PartError(f"{file}: columns {header[places[0]]} and {header[places[1]]} mean the same; one is needed")
        if places:
            at[meaning] = places[0]
    missing = [NAMES[name][0] for name in "xyz" if name not in at]
    if missing:
        raise PartError(
            f"{file}: no column {missing[0]}; the columns are x_mm, y_mm, z_mm, nx, ny, nz, path, layer, .."
        )
    return at


def _beads(table: _CsvRows) -> tuple[Ints, Ints]:
    """Bead of every row, -1 of those that are not welded, and the rows that are."""
    n = len(table.line)
    on = np.ones(n, dtype=bool)
    if table.has("kind"):
        on &= np.array([cell.lower() != "travel" for cell in table.columns["kind"]])
    if table.has("on"):
        on &= table.numbers("on") != 0
    if not on.any():
        raise PartError(f"{table.source}: no row is welded (on is 0, or kind is travel, in all of them)")
    if not table.has("bead") and not table.has("on") and not table.has("kind"):
        raise PartError(
            f"{table.source}: no column path (the number of the bead) and none on (1 where the arc is on); "
            "one is needed"
        )
    rows = np.flatnonzero(on)
    number = table.whole("bead")[rows] if table.has("bead") else np.zeros(len(rows), dtype=np.int64)
    back = np.flatnonzero(np.diff(number) < 0)
    if len(back):
        k = int(rows[back[0] + 1])
        raise table.wrong(k, "bead", table.columns["bead"][k], "numbers of beads must not fall from row to row")
    # where the arc is off in between a bead ends, whatever its number
    ends = (np.diff(number) != 0) | (np.diff(rows) > 1)
    bead = np.full(n, -1, dtype=np.int64)
    bead[rows] = np.append(0, np.cumsum(ends))
    return bead, rows


def _normals(table: _CsvRows, position: Floats, normal: str | None) -> Floats:
    some = [name for name in ("nx", "ny", "nz") if table.has(name)]
    if 0 < len(some) < 3:
        lost = next(name for name in ("nx", "ny", "nz") if name not in some)
        raise PartError(
            f"{table.source}: has a column {some[0]} and none {lost}; the deposition direction needs all three"
        )
    if len(some) == 3:
        given = np.stack([table.numbers(name) for name in ("nx", "ny", "nz")], axis=1)
    elif normal == "up":
        given = np.tile([0.0, 0.0, 1.0], (len(position), 1))
    elif normal == "radial":
        given = np.column_stack([position[:, :2], np.zeros(len(position))])
    else:
        raise PartError(
            f"{table.source}: no columns nx, ny, nz (the deposition direction); set normal (in a case "
            "part.toolpath_normal): up or radial"
        )
    length = np.linalg.norm(given, axis=1)
    if (length < 1e-9).any():
        k = int(np.argmin(length))
        raise PartError(f"{table.source}: line {table.line[k]}: its deposition direction has length 0")
    return np.asarray(given / length[:, None])


def _given(table: _CsvRows, name: str, rows: Ints, default: float | None, key: str) -> Floats:
    """A column of which the rows that are welded are above 0, (rows,); the default where the table has none."""
    if not table.has(name):
        if default is None:
            raise PartError(f"{table.source}: no column {NAMES[name][0]}; set {key}")
        return np.full(len(rows), float(default))
    values = table.numbers(name)[rows]
    if (values <= 0).any():
        k = int(rows[int(np.argmax(values <= 0))])
        raise table.wrong(k, name, table.columns[name][k], "a number above 0 is needed")
    return values


def _one_a_bead(bead: Ints, volume: Ints) -> Ints:
    """Layers where the table has none: every bead is one of its sub-volume."""
    out = np.zeros(len(bead), dtype=np.int64)
    for k in np.unique(volume):
        mine = (volume == k) & (bead >= 0)
        out[mine] = np.unique(bead[mine], return_inverse=True)[1]
    return out


def _require_whole_beads(table: _CsvRows, bead: Ints, rows: Ints, layer: Ints, volume: Ints) -> None:
    """Refuse a bead of several layers or sub-volumes: a layer's metal joins the cell when the layer is done."""
    same = np.diff(bead[rows]) == 0
    for name, of in (("layer", layer), ("sub_volume", volume)):
        changes = np.flatnonzero(same & (np.diff(of[rows]) != 0))
        if len(changes):
            k = int(rows[changes[0] + 1])
            needed = "it changes within a bead; a bead belongs to one (give each its own number in column path)"
            raise table.wrong(k, name, table.columns[name][k], needed)


def _without_repeats(rows: Ints, bead: Ints, position: Floats) -> Ints:
    same = np.linalg.norm(np.diff(position[rows], axis=0), axis=1) <= SAME_MM
    return np.asarray(rows[~np.append(False, same & (np.diff(bead[rows]) == 0))])


def _closed(bead: Ints, p: Floats) -> Bools:
    first = np.searchsorted(bead, np.arange(bead[-1] + 1))
    last = np.append(first[1:], len(bead)) - 1
    return np.asarray((np.linalg.norm(p[last] - p[first], axis=1) <= CLOSED_MM) & (last - first >= 3))


def _tangents(bead: Ints, p: Floats, n: Floats, closed: Bools) -> Floats:
    """Unit directions of travel across the normals, (n, 3): means of the segments on either side."""
    step = np.diff(p, axis=0)
    step /= np.maximum(np.linalg.norm(step, axis=1), 1e-12)[:, None]
    within = (np.diff(bead) == 0)[:, None]
    out = np.zeros_like(p)
    out[:-1] += np.where(within, step, 0.0)
    out[1:] += np.where(within, step, 0.0)
    first = np.searchsorted(bead, np.arange(bead[-1] + 1))
    last = np.append(first[1:], len(bead)) - 1
    both = out[first[closed]] + out[last[closed]]
    out[first[closed]], out[last[closed]] = both, both
    out -= (out * n).sum(axis=1)[:, None] * n
    length = np.linalg.norm(out, axis=1)
    for k in np.flatnonzero(length < 1e-6).tolist():
        # a reversal, or a way along the normal: any direction across it
        out[k] = np.cross(n[k], np.eye(3)[int(np.argmin(np.abs(n[k])))])
    return np.asarray(out / np.linalg.norm(out, axis=1)[:, None])


def _passed_over(table: _CsvRows) -> tuple[Warning, ...]:
    """Warnings of columns that are not used, and of kinds of rows that are welded though they may not be meant so."""
    found, name = [], Path(table.source).name
    others = table.columns["_others"]
    if others:
        found.append(f"toolpath {name}: unused columns: {_listed(others)}")
    kinds = [kind for kind in dict.fromkeys(table.columns.get("kind", [])) if kind.lower() not in KNOWN_KINDS]
    if kinds:
        found.append(f"toolpath {name}: rows of kind {_listed(kinds)} are welded; only those of kind travel are not")
    return tuple(Warning(Code.TOOLPATH_COLUMNS, text) for text in found)


def _listed(names: list[str]) -> str:
    return ", ".join(name[:40] for name in names[:6]) + (", .." if len(names) > 6 else "")
