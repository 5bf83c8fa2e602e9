"""A program that was exported: its text, its check, and the files that are written of it.

made = export_program(job, motion)
made.fault                                # one line, or None: it may be written
made.write("programs/blade")              # the KRL modules and blade.json
made.write(csv="blade.csv")               # or the poses for other controllers
"""

from __future__ import annotations

import csv as csv_text
import io
import json
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from slicing import Warning

from ...case.files import case_files
from ...errors import InputError
from ...job.job import Job
from ..from_motion import ProgramOfMotion
from ..pose_rows import pose_rows
from ..program_check import ProgramResult
from ..robodk_script import robodk_script
from ..round_trip import ProgramDeviation
from .export_document import export_document
from .written_files import checked_folder, write_files


@dataclass(frozen=True, eq=False)
class Exported:
    """A program that was made of a motion, and the result of its check.

    Attributes:
        job: whose program it is.
        files: text of each KRL file by its name, the main module first.
        written: what was made of the motion.
        gap: greatest distance of the text's motion from the checked one; None where the text is another program.
        result: the check of the text; None likewise.
        fault: why the program may not be used, one line; None where it may.
        warnings: typed.
    """

    job: Job
    files: dict[str, str]
    written: ProgramOfMotion
    gap: ProgramDeviation | None
    result: ProgramResult | None
    fault: str | None
    warnings: tuple[Warning, ...]

    def write(
        self,
        folder: str | Path | None = None,
        *,
        csv: str | Path | None = None,
        robodk: str | Path | None = None,
        reads: Iterable[str | Path] = (),
    ) -> tuple[Path, ...]:
        """Write the program as ``rbam export`` does: all files or none, each whole.

        Args:
            folder: for the KRL files and the document beside them, ``NAME.json``; it is made if it is missing.
            csv: file for the poses of the program's path, for other controllers.
            robodk: file for a script that RoboDK runs.
            reads: files that are not to be replaced, besides those that the case reads.

        Returns:
            The files.

        Raises:
            InputError: the program has a fault, no output is named, or a file cannot be written or is one of those
                read; one line, and nothing is written.
        """
        if self.fault is not None:
            raise InputError(f"no program: {self.fault}")
        if folder is None and csv is None and robodk is None:
            raise InputError("no output: give a folder, csv or robodk")
        place = None if folder is None else checked_folder(folder)
        contents = self._krl(place) if place is not None else {}
        for path, content in ((csv, self._csv), (robodk, self._robodk)):
            if path is None:
                continue
            if Path(path) in contents:
                raise InputError(f"{path}: is another file of this program as well; give another name")
            contents[Path(path)] = content()
        write_files(contents, place, [*case_files(self.job.case), *reads])
        return tuple(contents)

    def _krl(self, folder: Path) -> dict[Path, bytes]:
        assert self.gap is not None
        assert self.result is not None
        out = {folder / name: text.encode("ascii") for name, text in self.files.items()}
        document = export_document(self.job, self.files, self.written, self.gap, self.result, self.warnings)
        text = json.dumps(document, indent=1, allow_nan=False)
        return out | {folder / f"{self.written.program.name}.json": f"{text}\n".encode()}

    def _csv(self) -> bytes:
        assert self.result is not None
        text = io.StringIO()
        header, rows = pose_rows(self.job, self.result.run)
        writer = csv_text.writer(text, lineterminator="\n")
        writer.writerow(header)
        writer.writerows(rows)
        return text.getvalue().encode()

    def _robodk(self) -> bytes:
        assert self.result is not None
        return robodk_script(self.result.program, self.written.program.name).encode("ascii", "replace")
