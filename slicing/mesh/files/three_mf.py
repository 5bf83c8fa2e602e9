"""Triangles of a 3MF file: what its build lists, put together by components, as slicers and CAD systems write it.

    found = read_3mf(Path("part.3mf"))
    found.vertices, found.faces, found.lines, found.unit

Read are the core specification and the production extension (objects in files of their own, named by path), as Bambu
Studio, OrcaSlicer and PrusaSlicer write them. Of the objects those of type `model` count: supports, and parts that only
modify settings or block supports, are left out with a line. A part that is to be subtracted is refused.

Source: 3MF Core Specification 1.3, sections 3 to 4 (transforms: row vectors, row by row); 3MF Production Extension 1.1.
"""

from __future__ import annotations

import posixpath
import zipfile
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from ...arrays import Floats, Ints, PartError
from ...warning import Code, Warning
from ..solid import require_few_faces
from .polygons import Triangles

MODEL_TYPE = "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"
PRODUCTION = "http://schemas.microsoft.com/3dmanufacturing/production/2015/06"
UNDERSTOOD = (
    PRODUCTION,
    "http://schemas.microsoft.com/3dmanufacturing/material/2015/02",
    "http://schemas.microsoft.com/3dmanufacturing/core/2015/02",
)
MOST_BYTES = 2_000_000_000  # of one file in the archive, unpacked
DEEPEST = 64  # components within components
SETTINGS = ("Metadata/model_settings.config", "Metadata/Slic3r_PE_model.config")
# what parts are for, as the two settings files say it
LEFT_OUT = {
    **{"modifier_part": "modifier", "support_blocker": "support blocker", "support_enforcer": "support enforcer"},
    **{"ParameterModifier": "modifier", "SupportBlocker": "support blocker", "SupportEnforcer": "support enforcer"},
}
TAKEN = ("normal_part", "ModelPart", "")
ERRORS = (zipfile.BadZipFile, zlib.error, ElementTree.ParseError, KeyError, EOFError, NotImplementedError, OSError)


@dataclass(eq=False)
class _Object:
    """An object of a model file: a mesh, or components (path, object id, transform)."""

    kind: str
    points: Floats = field(default_factory=lambda: np.zeros((0, 3)))
    faces: Ints = field(default_factory=lambda: np.zeros((0, 3), dtype=np.int64))
    components: list[tuple[str, str, Floats]] = field(default_factory=list)


@dataclass(eq=False)
class _Model:
    """A model file: its unit, objects by id, and what is to be built (path, object id, transform, printable)."""

    unit: str
    objects: dict[str, _Object]
    items: list[tuple[str, str, Floats, bool]]


def read_3mf(file: Path) -> Triangles:
    """Read a 3MF file.

    Args:
        file: its path.

    Returns:
        The triangles of what it builds, in the unit that it states.

    Raises:
        PartError: damaged, an extension it requires is not known here, an object that is not there, parts to be
            subtracted; one line.
    """
    try:
        with zipfile.ZipFile(file) as archive:
            return _Reader(file, archive).all()
    except ERRORS as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise PartError(f"{file}: not readable as a 3MF mesh ({reason[:120]})") from None


class _Reader:
    """One archive; model files are read once each."""

    def __init__(self, file: Path, archive: zipfile.ZipFile) -> None:
        self.file, self.archive = file, archive
        self.models: dict[str, _Model] = {}
        self.points: list[Floats] = []
        self.faces: list[Ints] = []
        self.count = [0, 0]  # vertices, faces
        self.left_out: dict[str, int] = {}
        self.purposes, self.ranges = self._settings()

    def all(self) -> Triangles:
        """What the root model builds."""
        root = self._root()
        model = self._model(root)
        for path, number, transform, printable in model.items:
            if not printable:
                self._leave_out("object marked as not printable")
                continue
            self._place(path or root, number, transform, ())
        lines = [
            Warning(Code.MESH_FILE, f"{self.file}: left out {count} {what}{'s'[: count - 1]}")
            for what, count in sorted(self.left_out.items())
        ]
        if not self.faces:
            detail = "".join(f"; {line.split(': ', 1)[1]}" for line in lines)
            raise PartError(f"{self.file}: the file builds no triangles; a closed solid is needed{detail}")
        return Triangles(np.concatenate(self.points), np.concatenate(self.faces), tuple(lines), model.unit)

    def _leave_out(self, what: str) -> None:
        self.left_out[what] = self.left_out.get(what, 0) + 1

    def _bytes(self, name: str) -> bytes:
        info = self.archive.getinfo(name.lstrip("/"))
        if info.file_size > MOST_BYTES:
            raise PartError(
                f"{self.file}: {name} unpacks to {info.file_size:,} bytes; at most {MOST_BYTES:,} are taken"
            )
        if info.flag_bits & 1:
            raise PartError(f"{self.file}: {name} is encrypted")
        return self.archive.read(info)

    def _root(self) -> str:
        """The path of the root model: where the archive's relationships say."""
        names = set(self.archive.namelist())
        if "_rels/.rels" in names:
            for element in ElementTree.fromstring(self._bytes("_rels/.rels")):
                if element.get("Type") == MODEL_TYPE:
                    return "/" + str(element.get("Target", "")).lstrip("/")
        found = sorted(name for name in names if name.lower().endswith(".model"))
        if "3D/3dmodel.model" in found:
            return "/3D/3dmodel.model"
        if not found:
            raise PartError(f"{self.file}: not readable as a 3MF mesh (there is no model in it)")
        return "/" + found[0]

    def _model(self, path: str) -> _Model:
        path = posixpath.normpath(path)
        if path not in self.models:
            if path.lstrip("/") not in self.archive.namelist():
                raise PartError(f"{self.file}: the file names the model {path}, which is not in it")
            self.models[path] = _parsed(self.file, self._bytes(path))
        return self.models[path]

    def _place(self, path: str, number: str, transform: Floats, above: tuple[tuple[str, str], ...]) -> None:
        """Add an object, and what it is made of, in its place."""
        if (path, number) in above or len(above) > DEEPEST:
            raise PartError(f"{self.file}: object {number} of {path} is a component of itself")
        model = self._model(path)
        found = model.objects.get(number)
        if found is None:
            raise PartError(f"{self.file}: the file names object {number}, which is not in {path}")
        root = next(iter(self.models.values()))
        if model.unit != root.unit:
            raise PartError(f"{self.file}: {path} is in {model.unit}, the file in {root.unit}; one unit is needed")
        purpose = self._purpose(found, number, above)
        if purpose:
            self._leave_out(purpose)
            return
        for other, part, own in found.components:
            self._place(other or path, part, _after(own, transform), (*above, (path, number)))
        self._add(number, found, transform)

    def _purpose(self, found: _Object, number: str, above: tuple[tuple[str, str], ...]) -> str:
        """What an object is left out as; empty for a part of the solid."""
        said = self.purposes.get((above[-1][1], number) if above else (number, number), "")
        if said.lower().startswith("negative"):
            raise PartError(
                f"{self.file}: part {number} is to be subtracted ({said}), which rbam-cell does not do: "
                "export the result"
            )
        if said not in TAKEN:
            return LEFT_OUT.get(said, f"part of the kind {said}")
        if found.kind == "model":
            return ""
        return {"support": "support", "solidsupport": "support"}.get(found.kind, f"object of type {found.kind}")

    def _add(self, number: str, found: _Object, transform: Floats) -> None:
        faces = found.faces
        for first, last, said in self.ranges.get(number, []):
            if said.lower().startswith("negative"):
                raise PartError(
                    f"{self.file}: a part of object {number} is to be subtracted, which rbam-cell does not do"
                )
            if said not in TAKEN:
                self._leave_out(LEFT_OUT.get(said, f"part of the kind {said}"))
                faces = np.where(_between(len(faces), first, last)[:, None], -1, faces)
        faces = faces[faces[:, 0] >= 0] if len(faces) else faces
        if len(faces) == 0:
            return
        require_few_faces(str(self.file), self.count[1] + len(faces))
        mirrored = np.linalg.det(transform[:3]) < 0
        self.points.append(found.points @ transform[:3] + transform[3])
        self.faces.append((faces[:, ::-1] if mirrored else faces) + self.count[0])
        self.count = [self.count[0] + len(found.points), self.count[1] + len(faces)]

    def _settings(self) -> tuple[dict[tuple[str, str], str], dict[str, list[tuple[int, int, str]]]]:
        """What parts are for, by (object, part), and of objects in one mesh by their triangles."""
        purposes: dict[tuple[str, str], str] = {}
        ranges: dict[str, list[tuple[int, int, str]]] = {}
        names = self.archive.namelist()
        for name in SETTINGS:
            if name not in names:
                continue
            for own in ElementTree.fromstring(self._bytes(name)).iter("object"):
                number = str(own.get("id"))
                for part in own.iter("part"):
                    purposes[number, str(part.get("id"))] = str(part.get("subtype", ""))
                for volume in own.iter("volume"):
                    said = {str(m.get("key")): str(m.get("value")) for m in volume.iter("metadata")}
                    kind = said.get("volume_type", "ParameterModifier" if said.get("modifier") == "1" else "")
                    ends = [str(volume.get(key, "")) for key in ("firstid", "lastid")]
                    if all(end.isdecimal() for end in ends):
                        ranges.setdefault(number, []).append((int(ends[0]), int(ends[1]), kind))
        return purposes, ranges


def _after(first: Floats, then: Floats) -> Floats:
    """One transform (4, 3) after another, row vectors."""
    return np.concatenate([first[:3] @ then[:3], first[3:] @ then[:3] + then[3:]])


def _between(count: int, first: int, last: int) -> np.ndarray:
    number = np.arange(count)
    inside: np.ndarray = (number >= first) & (number <= last)
    return inside


def _parsed(file: Path, data: bytes) -> _Model:
    """A model file's objects and build."""
    import io

    unit, objects, items = "millimeter", {}, []
    spaces: dict[str, str] = {}
    stack: list[Any] = []
    current = _Object("model")
    points: list[tuple[str | None, ...]] = []
    faces: list[tuple[str | None, ...]] = []
    for event, element in _events(data, io.BytesIO):
        if event == "start-ns":
            spaces.setdefault(element[0], element[1])
            continue
        tag = element.tag.rsplit("}", 1)[-1]
        if event == "start":
            stack.append(element)
            if tag == "model":
                unit = element.get("unit", unit)
                _require_understood(file, element.get("requiredextensions", ""), spaces)
            elif tag == "object":
                current, points, faces = _Object(element.get("type", "model")), [], []
            continue
        stack.pop()
        if tag == "vertex":
            points.append((element.get("x"), element.get("y"), element.get("z")))
        elif tag == "triangle":
            faces.append((element.get("v1"), element.get("v2"), element.get("v3")))
            if len(faces) % 100_000 == 0:
                require_few_faces(str(file), len(faces))
        elif tag == "beam":
            raise PartError(f"{file}: has a beam lattice, which is not read: export triangles")
        elif tag == "component":
            place = _transform(file, element.get("transform"))
            current.components.append((_path(element), str(element.get("objectid")), place))
        elif tag == "item":
            printable = element.get("printable", "1").lower() not in ("0", "false")
            place = _transform(file, element.get("transform"))
            items.append((_path(element), str(element.get("objectid")), place, printable))
        elif tag == "object":
            current.points, current.faces = _arrays(file, element.get("id"), points, faces)
            objects[str(element.get("id"))] = current
        if tag in ("vertex", "triangle") and stack:
            stack[-1].clear()  # they are many
    return _Model(unit, objects, items)


def _events(data: bytes, opened: Any) -> Iterator[tuple[str, Any]]:
    yield from ElementTree.iterparse(opened(data), events=("start", "end", "start-ns"))


def _path(element: Any) -> str:
    return str(element.get(f"{{{PRODUCTION}}}path", ""))


def _require_understood(file: Path, required: str, spaces: dict[str, str]) -> None:
    """Refuse extensions without which the file cannot be read right."""
    for prefix in required.split():
        space = spaces.get(prefix, prefix)
        if space not in UNDERSTOOD:
            raise PartError(f"{file}: needs the 3MF extension {space}, which rbam-cell does not read")


def _transform(file: Path, text: str | None) -> Floats:
    """A transform (4, 3) for row vectors (x y z 1)."""
    if not text:
        return np.concatenate([np.eye(3), np.zeros((1, 3))])
    try:
        numbers = np.array([float(word) for word in text.split()])
    except ValueError:
        numbers = np.zeros(0)
    if numbers.shape != (12,) or not np.isfinite(numbers).all():
        raise PartError(f"{file}: transform {text[:60]!r} is not twelve numbers")
    return numbers.reshape(4, 3)


def _arrays(file: Path, number: str | None, points: list[Any], faces: list[Any]) -> tuple[Floats, Ints]:
    try:
        vertices = np.array(points, dtype=np.float64).reshape(-1, 3)
        triangles = np.array([[int(corner) for corner in face] for face in faces], dtype=np.int64).reshape(-1, 3)
    except (ValueError, TypeError):
        raise PartError(f"{file}: object {number}: a vertex or triangle without its three numbers") from None
    if len(triangles) and (triangles.min() < 0 or triangles.max() >= len(vertices)):
        raise PartError(f"{file}: object {number}: a face names a vertex outside 0 .. {len(vertices) - 1}")
    return vertices, triangles
