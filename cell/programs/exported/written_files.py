"""Several files, written all or none.

    folder = checked_folder("out")                    # before the work rather than after it
    write_files({Path("out/blade.src"): b"...", Path("out/blade.json"): b"..."}, folder, reads=["blade.stl"])

The folder is made if it is missing, and removed again if nothing was written.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from contextlib import ExitStack
from pathlib import Path

from ...atomic_files import beside, check_outputs
from ...errors import InputError


def checked_folder(name: str | Path) -> Path:
    """A folder that is there or can be made.

    Raises:
        InputError: it is none, or what it is to stand in is missing.
    """
    folder = Path(name)
    if folder.exists() and not folder.is_dir():
        raise InputError(f"{name}: is not a folder")
    if not folder.exists() and not folder.absolute().parent.is_dir():
        raise InputError(f"{name}: the folder {folder.absolute().parent} does not exist")
    return folder


def write_files(contents: Mapping[Path, bytes], folder: Path | None, reads: Iterable[str | Path]) -> None:
    """Write all files or none.

    Args:
        contents: of each file.
        folder: made if it is missing, and gone again if nothing is written; None: every folder is there.
        reads: files that are not to be replaced.

    Raises:
        InputError: the folder cannot be made, or a file cannot be written or is one of those read.
    """
    made = folder is not None and not folder.exists()
    if made and folder is not None:
        try:
            folder.mkdir()
        except OSError as error:
            raise InputError(f"{folder}: cannot be made ({error.strerror})") from None
    done = False
    try:
        check_outputs({f"file {n}": str(path) for n, path in enumerate(contents)}, reads)
        with ExitStack() as stack:
            for path, content in contents.items():
                stack.enter_context(beside(path)).write_bytes(content)
        done = True
    finally:
        if made and not done and folder is not None:
            folder.rmdir()
