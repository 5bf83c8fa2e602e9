"""Writing results: beside the target first, renamed when whole, so that nothing is ever half-written.

    check_outputs({"--json": args.json, "--html": args.html}, case_files(case))      # before the work
    write_json(args.json, document)

No output replaces what the run reads, nor another output, nor anything that is no ordinary file. A symbolic link is
followed: the file it leads to is written, and the link stays.
"""

from __future__ import annotations

import csv
import os
import stat
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from .errors import InputError
from .json_text import json_pieces
from .streams import reason

NO_FILES = ("/dev/", "/proc/")  # of the system: devices, and links to what is open
STEM = 60  # characters of a name that an unfinished file carries
STDOUT = "-"
JSON_OPTION = "--json"

_unfinished: set[str] = set()  # files that are being written


def check_writable(path: str | Path) -> Path:
    """Refuse an output path before the work is done rather than after.

    Args:
        path: where an output is to go.

    Returns:
        The file that is meant, symbolic links followed.

    Raises:
        InputError: its folder is missing or not to be written to, or it is a folder, a device or anything else that is
            no ordinary file.
    """
    shown = Path(path)
    try:
        if os.path.abspath(path).startswith(NO_FILES):
            raise InputError(f"{shown}: is a device; give the name of a file (- writes to standard output)")
        target = Path(os.path.realpath(path))
        mode = target.stat().st_mode if target.exists() else None
        if mode is not None and stat.S_ISDIR(mode):
            raise InputError(f"{shown}: is a folder; give the name of a file")
        if mode is not None and not stat.S_ISREG(mode):
            raise InputError(f"{shown}: is not an ordinary file; give the name of a file (- writes to standard output)")
        if not target.parent.is_dir():
            raise InputError(f"{shown}: the folder {target.parent} does not exist")
        if os.path.islink(target):
            raise InputError(f"{shown}: is a symbolic link that leads in a circle")
        if not os.access(target.parent, os.W_OK) or (mode is not None and not os.access(target, os.W_OK)):
            raise InputError(f"{shown}: cannot be written (Permission denied)")
    except (OSError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{shown}: cannot be written ({reason(error)})") from None
    return target


def check_outputs(outputs: Mapping[str, str | None], inputs: Iterable[str | Path] = ()) -> None:
    """Refuse outputs that would destroy something.

    Args:
        outputs: paths by the option that names them; None and - are no files.
        inputs: files that the run reads.

    Raises:
        InputError: an output is no place to write to, is one of the inputs or names the same file as another output,
            by whatever name or link; one line.
    """
    taken: dict[object, str] = {}
    for option, path in outputs.items():
        if path == STDOUT and option != JSON_OPTION:
            raise InputError(f"{option}: {path}: only {JSON_OPTION} goes to standard output; give the name of a file")
        if path in (None, STDOUT):
            continue
        key = _identity(check_writable(str(path)))
        if key in taken:
            raise InputError(f"{option}: {path} is also the file of {taken[key]}; each needs a file of its own")
        taken[key] = option
    for name in inputs if taken else ():
        found = taken.get(_identity(name))
        if found is not None:
            raise InputError(f"{found}: {outputs[found]} is read by this run ({name}); give another file")


def _identity(path: str | Path) -> object:
    """Equal for two names of one file."""
    try:
        found = os.stat(path)
    except (OSError, ValueError):
        return os.path.normcase(os.path.realpath(path)) if "\0" not in str(path) else path
    return found.st_dev, found.st_ino


def discard_unfinished() -> None:
    """Remove what was being written when the program was ended."""
    for name in list(_unfinished):
        Path(name).unlink(missing_ok=True)
        _unfinished.discard(name)


@contextmanager
def beside(path: str | Path) -> Iterator[Path]:
    """A file beside the target to write into; it takes the target's place when all went well and is gone otherwise.

    Args:
        path: the target.

    Yields:
        The file to write, with the target's ending.

    Raises:
        InputError: the place cannot be written to.
    """
    target = check_writable(path)
    name = str(target.with_name(f".{target.stem[:STEM]}.{os.urandom(4).hex()}{target.suffix}"))
    _unfinished.add(name)  # first, so that whatever ends the program here leaves nothing
    try:
        mode = stat.S_IMODE(target.stat().st_mode) if target.exists() else 0o666 & ~_umask()
        os.close(os.open(name, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o600))
        yield Path(name)
        os.chmod(name, mode)
        os.replace(name, target)
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({reason(error)})") from None
    finally:
        Path(name).unlink(missing_ok=True)
        _unfinished.discard(name)


def write_bytes(path: str | Path, content: bytes) -> None:
    """Write a file whole or not at all.

    Raises:
        InputError: the place cannot be written to.
    """
    with beside(path) as name:
        name.write_bytes(content)


def write_text(path: str | Path, text: str) -> None:
    """Write a text as UTF-8; characters of a file name that UTF-8 lacks become question marks."""
    write_bytes(path, text.encode("utf-8", "replace"))


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def write_json(path: str | Path, document: Any) -> None:
    """Write a JSON document, piece by piece where it has `cell.json_text.StreamedItems`."""
    with beside(path) as name, open(name, "w", encoding="utf-8", newline="\n") as file:
        file.writelines(json_pieces(document, indent=1))
        file.write("\n")


def write_csv(path: str | Path, header: Sequence[str], rows: Iterable[Sequence[Any]]) -> None:
    """Write a CSV with one header row; characters of a file name that UTF-8 lacks become question marks."""
    with beside(path) as name, open(name, "w", encoding="utf-8", errors="replace", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(header)
        writer.writerows(rows)
