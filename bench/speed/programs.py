"""Seconds of processor time that the judge takes for programs of a ring on a welding rotator that somebody has spoiled.

    python -m bench.speed.programs [--smoke]

The ring's bead starts elsewhere, so that the rotator turns back by itself with the arc on; is run back to front at its
beginning; or is rounded far too widely. Each is infeasible, and is to be said so within seconds.
"""

from __future__ import annotations

import argparse
import re
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tests"))

Points = list[str]
SPOILED: dict[str, tuple[Callable[[Points], Points], float | None]] = {
    "as written": (lambda points: points, None),
    "starts elsewhere": (lambda points: points[7:] + points[:7], None),
    "begins back to front, rounded over 20 mm": (lambda points: points[4::-1] + points[5:], 20.0),
    "back to front": (lambda points: points[::-1], None),
    "rounded over 100 mm": (lambda points: points, 100.0),
}


def spoiled(text: str, change: Callable[[Points], Points], blend_mm: float | None) -> str:
    """A module with its bead's points in another order, and another approximation."""
    lines = text.replace("\r\n", "\n").split("\n")
    start = next(i for i, line in enumerate(lines) if line.startswith("ARC_ON"))
    at = [i for i in range(start - 1, len(lines)) if lines[i].startswith("LIN")]
    points = [re.sub(r"^LIN (\{.*\}).*$", r"\1", lines[i]) for i in at]
    for i, point in zip(at, change(points), strict=True):
        lines[i] = re.sub(r"\{.*\}", lambda _, point=point: point, lines[i])
    made = "\n".join(lines)
    return made if blend_mm is None else re.sub(r"(\$APO\.CDIS = ).*", rf"\g<1>{blend_mm:g}", made)


def main() -> int:
    from support.cells.lathes import lathe_job, ring_part

    from cell.programs.cell_controller import cell_controller
    from cell.programs.export import export_program
    from cell.programs.krl_read import read_krl
    from cell.programs.program_check import check_program
    from cell.verdict.by_table_mode import check

    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--smoke", action="store_true", help="a lower ring, one spoiled program")
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        part = ring_part(folder, high_mm=2.2 if args.smoke else 6.6)
        result = check(lathe_job(folder, part=part, table={"mode": "coordinated"}))
        assert result.motion is not None
        made = export_program(result.job, result.motion)
        assert made.fault is None, made.fault
        main_file, layer = next(iter(made.files)), next(file for file in made.files if "_L" in file)
        for kind, (change, blend_mm) in list(SPOILED.items())[: 2 if args.smoke else None]:
            for file, text in made.files.items():
                spoil = file == layer
                (folder / file).write_text(spoiled(text, change, blend_mm) if spoil else text, encoding="ascii")
            start = time.process_time()
            found = check_program(result.job, read_krl(folder / main_file, cell_controller(result.job)))
            taken = time.process_time() - start
            verdict = "feasible" if found.feasible else f"infeasible, {len(found.findings)} findings"
            print(f"{kind:42} {len(found.run.move):6} rows {taken:7.2f} s  {verdict}", flush=True)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
