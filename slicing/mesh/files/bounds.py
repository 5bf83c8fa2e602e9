"""What a mesh file unpacks to, before anything of it is unpacked.

    require_bounded(Path("part.3mf"))            # PartError: a small file that would fill the memory

An archive says how large its members are, a GLB how many values it makes up.
"""

from __future__ import annotations

import json
import struct
import zipfile
from pathlib import Path

from ..solid import PartError

MOST_BYTES = 2**31  # of a file
MOST_UNPACKED = 2**29  # of an archive's members together
MOST_VALUES = 15_000_000  # of one array of a GLB: five million triangles
MOST_HEAD = 2**26  # of a GLB's description


def require_bounded(file: Path) -> None:
    """Refuse a file that takes more memory than any part does.

    Args:
        file: of any kind; what is no archive and no GLB is compared with its size alone.

    Raises:
        PartError: it is too large, or would unpack to something too large; one line.
    """
    size = file.stat().st_size
    if size > MOST_BYTES:
        raise PartError(f"{file}: has {size / 2**20:.0f} MiB; at most {MOST_BYTES // 2**20} MiB are read")
    unpacked = _unpacked(file)
    if unpacked > MOST_UNPACKED:
        most = MOST_UNPACKED // 2**20
        raise PartError(f"{file}: unpacks to {unpacked / 2**20:.0f} MiB; at most {most} MiB are read")
    for count in _counts(file):
        if count > MOST_VALUES:
            raise PartError(f"{file}: claims an array of {count:,} values; at most {MOST_VALUES:,} are taken")


def _unpacked(file: Path) -> int:
    """Bytes of an archive's members together; 0 of what is none, or damaged: its reader says so."""
    try:
        with zipfile.ZipFile(file) as archive:
            return sum(entry.file_size for entry in archive.infolist())
    except (OSError, ValueError, NotImplementedError, zipfile.BadZipFile):
        return 0


def _counts(file: Path) -> list[int]:
    """Lengths of the arrays that a GLB or glTF describes; none of what is neither, or damaged: its reader says so."""
    kind = file.suffix.lower()
    try:
        with file.open("rb") as stream:
            if kind == ".glb":
                length = min(struct.unpack("<12xI4x", stream.read(20))[0], MOST_HEAD)
            elif kind == ".gltf":
                length = MOST_HEAD
            else:
                return []
            described = json.loads(stream.read(length))
        return [int(one["count"]) for one in described.get("accessors", [])]
    except (OSError, ValueError, LookupError, TypeError, AttributeError, RecursionError, struct.error, OverflowError):
        return []
