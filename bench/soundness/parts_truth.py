"""Decompose parts of known truth by the hundred: right, refused, doubted or silently wrong.

python -m bench.soundness.parts_truth 200  # seeds 0 .. 199
python -m bench.soundness.parts_truth 200 --first 1000 --log parts.jsonl
python -m bench.soundness.parts_truth 200 --varied  # parts of tests/support/parts/varied_parts.py instead
python -m bench.soundness.parts_truth 200 --machined  # parts of tests/support/parts/machined_parts.py instead
python -m bench.soundness.parts_truth --sum parts.jsonl  # what the log holds

The log takes a line a part as it is judged, so that a run may be ended at any time; seeds that it holds are not judged
again.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np

from slicing import PartError, load_mesh
from tests.support.parts.cad_parts import FORMATS, CadPart, cad_part
from tests.support.parts.machined_parts import machined_part
from tests.support.parts.part_truth import Judgement, judged
from tests.support.parts.varied_parts import varied_part

from ..bench_arguments import parsed


def one(seed: int, make: Callable[[int], CadPart]) -> dict[str, Any]:
    """The judgement of a seed's part, its words, and processor seconds to make, read and decompose it."""
    start = time.process_time()
    part = make(seed)
    kind = FORMATS[seed % len(FORMATS)]
    made = time.process_time()
    with tempfile.TemporaryDirectory() as folder:
        path = part.save(Path(folder), kind)
        written = time.process_time()
        try:
            mesh = load_mesh(path)
        except PartError as error:
            mesh, found = None, Judgement("refused", str(error))
    read = time.process_time()
    if mesh is not None:
        found = judged(part, mesh)
    row = {
        "seed": seed,
        "kind": found.kind,
        "why": found.why,
        "sides": part.truth.sides,
        "words": f"{kind}, {part.words}",
    }
    seconds = {"make_s": made - start, "read_s": read - written, "judge_s": time.process_time() - read}
    return {**row, **{key: round(value, 3) for key, value in seconds.items()}}


def said(row: dict[str, Any]) -> str:
    """One line of a part that is not right."""
    return f"{row['seed']}: {row['kind']}: {row['why']} [{row['words']}]"


def figures(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """What is kept of many parts."""
    times = {key: [row[key] for row in rows] for key in ("make_s", "read_s", "judge_s")}
    return {
        "parts": len(rows),
        **dict(Counter(row["kind"] for row in rows).most_common()),
        **{f"median_{key}": round(float(np.median(values)), 3) for key, values in times.items()},
        "most_judge_s": max(times["judge_s"]),
    }


def rows_of(log: Path) -> list[dict[str, Any]]:
    """What a log holds."""
    return [json.loads(line) for line in log.read_text(encoding="utf-8").splitlines()] if log.is_file() else []


def run(seeds: Iterable[int], log: Path | None, make: Callable[[int], CadPart]) -> list[dict[str, Any]]:
    """Judge the parts of seeds, but those that the log holds."""
    rows = rows_of(log) if log else []
    known = {row["seed"] for row in rows}
    for seed in seeds:
        if seed in known:
            continue
        rows.append(one(seed, make))
        if log:
            with log.open("a", encoding="utf-8") as file:
                file.write(json.dumps(rows[-1]) + "\n")
        if rows[-1]["kind"] != "right":
            print(said(rows[-1]), flush=True)
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("count", type=int, nargs="?", default=200, help="how many parts (default 200)")
    parser.add_argument("--first", type=int, default=0, help="seed of the first")
    parser.add_argument(
        "--varied", action="store_true", help="twisted and drafted blades, hoops, flanges with holes .."
    )
    parser.add_argument(
        "--machined", action="store_true", help="grooves, keyways, letters, gussets, shrouds, lattices, worm flights .."
    )
    parser.add_argument("--log", type=Path, help="file that takes a line a part; what it holds is not judged again")
    parser.add_argument("--sum", type=Path, metavar="LOG", help="judge nothing: what a log holds")
    args = parsed(parser, count=3)
    make = machined_part if args.machined else varied_part if args.varied else cad_part
    rows = rows_of(args.sum) if args.sum else run(range(args.first, args.first + args.count), args.log, make)
    if args.sum:
        print(*[said(row) for row in rows if row["kind"] != "right"], sep="\n")
    print(figures(rows))


if __name__ == "__main__":
    main()
