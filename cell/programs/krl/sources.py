"""Files of a program: the one that is named, and what it calls beside it.

Use:

    sources = Sources(Path("BLADE.src"), controller)
    sources.main                              # ParsedFile
    sources.beside("BLADE_L000")              # the file BLADE_L000.src of the same folder, None where there is none

Names of files are found whether capitals or not. A program's data stands in a .dat of the same name, what all programs
share in $config.dat.
"""

from __future__ import annotations

import re
import stat
from pathlib import Path

from ...errors import InputError
from ...printable import printable
from ...streams import reason
from ..controller import Controller
from .statements import ParsedFile
from .syntax import parse

MOST_BESIDE = 100_000  # entries of a folder that are checked
SHARED = "$CONFIG"
CALLED = (".SRC", ".DAT")  # programs and data beside a program, which it may call


class Sources:
    """The files that have been read.

    Attributes:
        main: the program that was named.
        files: names of all read, in order.
        passed: lines passed over, by kind.
    """

    def __init__(self, path: Path, controller: Controller) -> None:
        self._controller = controller
        self._left = controller.limits.file_bytes
        self._read: dict[Path, ParsedFile] = {}
        self._texts: dict[str, dict[Path, str]] = {}
        self._found: dict[tuple[str, str], Path | None] = {}
        self.files: list[str] = []
        self._folder = path.parent
        self._names: dict[str, Path] | None = None
        self._alike: dict[str, Path] = {}  # files whose names differ from another's in capitals alone
        self.main = self._file(path)

    @property
    def passed(self) -> dict[str, int]:
        """Lines passed over, by kind."""
        total: dict[str, int] = {}
        for parsed in self._read.values():
            for kind, count in parsed.passed.items():
                total[kind] = total.get(kind, 0) + count
        return total

    def beside(self, name: str, suffix: str = ".src") -> ParsedFile | None:
        """A module's file in the folder of the main one.

        Args:
            name: of the module.
            suffix: of the file.

        Returns:
            The file, None where there is none.

        Raises:
            InputError: it cannot be read.
        """
        asked = f"{name}{suffix}".upper()
        path = self._beside().get(asked)
        if asked in self._alike and path is not None:
            raise InputError(
                f"{printable(path)}: {printable(self._alike[asked].name)} beside it is the same name to a controller"
            )
        return None if path is None else self._file(path)

    def with_variable(self, name: str) -> ParsedFile | None:
        """A .dat beside that declares a variable for all (GLOBAL), None where there is none."""
        word = re.compile(rf"\bGLOBAL\b[^\n;]*(?<![\w$]){re.escape(name)}(?![\w$])", re.ASCII)
        return self._holding(".DAT", name, word)

    def with_global(self, name: str) -> ParsedFile | None:
        """A .src beside that holds a sub-program or function for all (GLOBAL), None where there is none."""
        word = re.compile(rf"^\s*GLOBAL\s+DEF(?:FCT\s+\w+)?\s+{re.escape(name)}\s*\(", re.ASCII | re.MULTILINE)
        return self._holding(".SRC", name, word)

    def _holding(self, suffix: str, name: str, word: re.Pattern[str]) -> ParsedFile | None:
        """The file beside in whose capitals a pattern is found."""
        if suffix not in self._texts:
            paths = [path for shown, path in sorted(self._beside().items()) if shown.endswith(suffix)]
            self._texts[suffix] = self._searched(paths[: self._controller.limits.files])
        if (suffix, name) not in self._found:
            texts = self._texts[suffix].items()
            found = [path for path, text in texts if name in text and word.search(text)]
            if len(found) > 1:
                raise InputError(f"{printable(found[0])}: {name} is GLOBAL here and in {printable(found[1].name)}")
            self._found[suffix, name] = found[0] if found else None
        path = self._found[suffix, name]
        return None if path is None else self._file(path)

    def _searched(self, paths: list[Path]) -> dict[Path, str]:
        """Texts to search in, in capitals, as many as the bound allows; what is not a text holds nothing."""
        found, left = {}, self._controller.limits.file_bytes
        for path in paths:
            if path.stat().st_size <= left:
                raw = path.read_bytes()[:left]
                left -= len(raw)
                found[path] = raw.decode("latin-1").upper()
        return found

    def _beside(self) -> dict[str, Path]:
        if self._names is None:
            self._names = {}
            for number, path in enumerate(self._folder.iterdir()):
                if number >= MOST_BESIDE:
                    raise InputError(f"{self._folder}: has more than {MOST_BESIDE} files beside the program")
                if path.suffix.upper() in CALLED and path.is_file():
                    before = self._names.setdefault(path.name.upper(), path)
                    if before is not path:
                        self._alike[path.name.upper()] = path
        return self._names

    def _file(self, path: Path) -> ParsedFile:
        if path not in self._read:
            if len(self.files) >= self._controller.limits.files:
                raise InputError(f"{path}: is more than file {self._controller.limits.files} of one program")
            text = self._text(path)
            self.files.append(path.name)
            self._read[path] = parse(text, path, len(self.files) - 1, self._controller)
        return self._read[path]

    def _text(self, path: Path) -> str:
        shown, most = printable(path), self._controller.limits.file_bytes
        try:
            if not stat.S_ISREG(path.stat().st_mode):
                raise InputError(f"{shown}: is not an ordinary file; a KRL program (.src) is needed")
            with path.open("rb") as file:
                raw = file.read(self._left + 1)
        except FileNotFoundError:
            raise InputError(f"{shown}: no such file") from None
        except (OSError, ValueError) as error:
            if isinstance(error, InputError):
                raise
            raise InputError(f"{shown}: cannot be read ({reason(error)})") from None
        if len(raw) > self._left:
            raise InputError(
                f"{shown}: the program has more than {most / 2**20:g} MiB with its sub-programs; "
                "a controller's memory for programs is 4 to 8 MB"
            )
        self._left -= len(raw)
        if b"\0" in raw:
            line = raw.count(b"\n", 0, raw.index(b"\0")) + 1
            raise InputError(f"{shown}:{line}: has a byte 0; a program must be text")
        try:
            text = raw.decode("utf-8-sig")
        except UnicodeDecodeError:
            text = raw.decode("cp1252", "replace")  # what older controllers write comments in
        text = text.replace("\r\n", "\n")
        if "\r" in text and "\n" in text:
            line = text.count("\n", 0, text.index("\r")) + 1
            raise InputError(
                f"{shown}:{line}: has a CR without LF, in a file whose lines end in LF: "
                "whether the line ends there is not known"
            )
        return text.replace("\r", "\n")
