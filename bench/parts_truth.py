"""Decompose parts of known truth by the hundred: right, refused, doubted or silently wrong.

python bench/parts_truth.py 200                 # seeds 0 .. 199
python bench/parts_truth.py 200 --first 1000 --json out.json
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests")]  # before bench/slicing.py, which is not the package
from bench_arguments import parsed  # noqa: E402
from support.cad_parts import FORMATS, cad_part  # noqa: E402
from support.part_truth import Judgement, judged  # noqa: E402

from slicing import load_mesh  # noqa: E402


def one(seed: int) -> tuple[Judgement, str, float]:
    """The judgement of a seed's part, its words, and seconds taken to decompose it."""
    part = cad_part(seed)
    kind = FORMATS[seed % len(FORMATS)]
    with tempfile.TemporaryDirectory() as folder:
        mesh = load_mesh(part.save(Path(folder), kind))
    start = time.perf_counter()
    found = judged(part, mesh)
    return found, f"{kind}, {part.words}", time.perf_counter() - start


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("count", type=int, nargs="?", default=200, help="how many parts (default 200)")
    parser.add_argument("--first", type=int, default=0, help="seed of the first")
    parser.add_argument("--json", help="where to write figures")
    args = parsed(parser, count=3)
    kinds: Counter[str] = Counter()
    seconds = []
    for seed in range(args.first, args.first + args.count):
        found, words, took = one(seed)
        kinds[found.kind] += 1
        seconds.append(took)
        if found.kind != "right":
            print(f"{seed}: {found.kind}: {found.why} [{words}]", flush=True)
    figures = {**kinds, "parts": args.count, "median_s": round(float(np.median(seconds)), 3), "most_s": max(seconds)}
    print(figures)
    if args.json:
        Path(args.json).write_text(json.dumps(figures) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
