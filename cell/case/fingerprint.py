"""What the results of a case depend on, as one digest.

Use:

    fingerprint(case)                         # differs where any file or key that matters differs
"""

from __future__ import annotations

import hashlib
import platform
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from ..errors import InputError
from ..streams import reason
from .files import content_files
from .sections import Case

NO_MATTER = {"table", "expect", "name", "description", "extends", "sweep", "controller"}  # a row says its own pose

PACKAGES = ("cell", "ik", "slicing")

LIBRARIES = ("mujoco", "numpy", "scipy", "trimesh", "manifold3d", "shapely", "py-opw-kinematics")


def fingerprint(case: Case) -> str:
    """What a sweep's results depend on, as a short hash.

    Args:
        case: the case; of its files the content counts, not the name.

    Returns:
        16 hexadecimal digits.

    Raises:
        InputError: a file of the case cannot be read.
    """
    digest = hashlib.sha256(f"{_program()} {case.model_dump_json(exclude=NO_MATTER)}".encode())
    for path in content_files(case):
        digest.update(_content(path))
    return digest.hexdigest()[:16]


def _content(path: Path) -> bytes:
    """The hash of a file's content; of a missing one nothing."""
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").digest()
    except FileNotFoundError:
        return b""
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: cannot be read ({reason(error)})") from None


@cache
def _program() -> str:
    """The program's own code and the libraries that compute, as a hash."""
    root = Path(__file__).resolve().parents[2]
    digest = hashlib.sha256(platform.machine().encode())
    for path in sorted(path for package in PACKAGES for path in (root / package).rglob("*.py")):
        digest.update(path.relative_to(root).as_posix().encode() + _content(path))
    for name in LIBRARIES:
        try:
            digest.update(f"{name} {version(name)}".encode())
        except PackageNotFoundError:
            continue  # an extra, or part of another package
    return digest.hexdigest()
