"""Triangles of a GLB file: the meshes of its scene, put where the scene says.

Use:

    found = read_glb(Path("part.glb"))

What would give other triangles than the file means is refused: compressed meshes, instances, skins, shapes that are
blended, sparse arrays, numbers that are normalized, and triangle fans, which trimesh's reader passes over.

Source: glTF 2.0 specification, sections 3.6 (accessors) and 3.7 (meshes, skins); extension registry of Khronos.
"""

from __future__ import annotations

import json
import struct
import zipfile
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ...arrays import Floats, Ints, PartError
from .. import solid as part
from ..solid import require_few_faces
from .polygons import Triangles

TRIANGLES, STRIP, FAN = 4, 5, 6  # modes of primitives; those below are points and lines
# of an extension that changes no geometry, or of which the plain geometry is what is read
HARMLESS = ("KHR_materials", "KHR_texture", "EXT_texture", "KHR_lights", "KHR_mesh_quantization", "KHR_xmp", "MSFT_")
INSTANCES = "EXT_mesh_gpu_instancing"

# what trimesh's reader raises on damaged files
READ_ERRORS = (
    ArithmeticError,
    AssertionError,
    AttributeError,
    BufferError,
    EOFError,
    ImportError,
    LookupError,
    OSError,
    RuntimeError,
    SyntaxError,
    TypeError,
    ValueError,
    struct.error,
    zipfile.BadZipFile,
    zlib.error,
)


def read_glb(file: Path) -> Triangles:
    """Read a GLB file.

    Args:
        file: its path.

    Returns:
        The triangles of all meshes of its scene; an instance counts as a mesh.

    Raises:
        PartError: damaged, larger than is taken, or a face that names a vertex its mesh does not have; one line.
    """
    import trimesh  # heavy: only when such a file is read

    _require_plain(file, _described(file))
    try:
        scene: Any = trimesh.load(str(file), process=False, force="scene")
    except READ_ERRORS as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise PartError(f"{file}: not readable as a GLB mesh ({reason[:120]})") from None
    placed = [scene.graph[node] for node in scene.graph.nodes_geometry]
    placed = [(np.asarray(T), scene.geometry[name]) for T, name in placed]
    meshes = [(T, mesh) for T, mesh in placed if isinstance(mesh, trimesh.Trimesh)]
    require_few_faces(str(file), sum(len(mesh.faces) for _, mesh in meshes))
    points: list[Floats] = [np.zeros((0, 3))]
    faces: list[Ints] = [np.zeros((0, 3), dtype=np.int64)]
    count = 0
    for T, mesh in meshes:
        own = np.asarray(mesh.faces, dtype=np.int64)
        if len(own) and (own.min() < 0 or own.max() >= len(mesh.vertices)):
            raise PartError(f"{file}: a face names a vertex outside 0 .. {len(mesh.vertices) - 1}")
        points.append(np.asarray(mesh.vertices, dtype=np.float64) @ T[:3, :3].T + T[:3, 3])
        faces.append((own if np.linalg.det(T[:3, :3]) > 0 else own[:, ::-1]) + count)
        count += len(points[-1])
    return Triangles(np.concatenate(points), np.concatenate(faces))


def _described(file: Path) -> dict[str, Any]:
    """A file's description; refused where it says that it holds more than is taken, before anything is made of it."""
    with file.open("rb") as stream:
        head = stream.read(20)
        if len(head) < 20 or head[:4] != b"glTF":
            raise PartError(f"{file}: not readable as a GLB mesh (its first bytes are not glTF)")
        length = struct.unpack("<I", head[12:16])[0]
        if length > file.stat().st_size:
            raise PartError(f"{file}: not readable as a GLB mesh (it ends within its first chunk)")
        try:
            document: dict[str, Any] = json.loads(stream.read(length))
            counts = [int(accessor["count"]) for accessor in document.get("accessors", [])]
        except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
            raise PartError(f"{file}: not readable as a GLB mesh (its first chunk is not JSON)") from None
    if max(counts, default=0) > 3 * part.MOST_FACES:
        raise PartError(f"{file}: {max(counts):,} entries of one kind; at most {3 * part.MOST_FACES:,} are taken")
    return document


def _require_plain(file: Path, document: dict[str, Any]) -> None:
    """Refuse what trimesh's reader passes over though it changes or adds triangles.

    Raises:
        PartError: there is such a thing, or the description is none; one line.
    """
    try:
        found = next(_unread(document), None)
    except READ_ERRORS as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise PartError(f"{file}: not readable as a GLB mesh ({reason[:120]})") from None
    if found:
        raise PartError(f"{file}: {found}, which is not read: export plain triangles")


def _unread(document: dict[str, Any]) -> Iterator[str]:
    """What of a description would not be read as it is meant."""
    for name in document.get("extensionsRequired", []):
        if not str(name).startswith(HARMLESS):
            yield f"the file needs the extension {name}"
    accessors, meshes = document.get("accessors", []), document.get("meshes", [])
    if any("sparse" in accessor for accessor in accessors):
        yield "the file has a sparse array"
    for node in document.get("nodes", []):
        if INSTANCES in node.get("extensions", {}):
            yield f"a node has instances ({INSTANCES})"
        if "mesh" in node and "skin" in node:
            yield "a mesh has a skin"
    if any(any(owner.get("weights", ())) for owner in (*document.get("nodes", []), *meshes)):
        yield "a mesh is blended with morph targets"
    for primitive in (primitive for mesh in meshes for primitive in mesh["primitives"]):
        if not 0 <= primitive.get("mode", TRIANGLES) <= STRIP:
            yield "a mesh has triangle fans" if primitive["mode"] == FAN else "a mesh has primitives of no known mode"
        position = primitive["attributes"].get("POSITION")
        if position is not None and accessors[position].get("normalized"):
            yield "a mesh has normalized positions"
