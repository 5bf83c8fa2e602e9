"""Programs in KRL made by a grammar and broken: each ends in a program or in one line with file and line number.

    python -m bench.soundness.program_fuzz --n 2000

The grammar is tests/support/programs/broken_programs.py, of which the tests run 150. A program that is read is written
and read again, which has to give the same text.
"""

from __future__ import annotations

import argparse
import random
import re
import tempfile
import time
from collections import Counter
from dataclasses import replace
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def main() -> int:
    from cell.errors import InputError
    from cell.programs.controller import ReadLimits
    from cell.programs.krl_read import read_krl
    from cell.programs.krl_write import write_krl
    from tests.support.programs.broken_programs import broken
    from tests.support.programs.programs import controller, written

    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--n", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--smoke", action="store_true", help="50 programs")
    args = parser.parse_args()
    found: Counter[str] = Counter()
    slowest = (0.0, -1)
    its = replace(controller(), limits=ReadLimits(moves=20_000, statements=50_000))
    for seed in range(args.seed, args.seed + (50 if args.smoke else args.n)):
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            path = broken(random.Random(seed), folder)
            start = time.process_time()
            try:
                program = read_krl(path, its)
                found["read"] += 1
            except InputError as error:
                message = str(error)
                assert "\n" not in message, seed
                assert message.isprintable(), seed
                assert re.match(rf"{re.escape(name)}/[^:]*(:\d+)?: ", message), (seed, message)
                found["refused" if re.match(r"[^:]*:\d+: ", message) else "refused as a whole"] += 1
                continue
            finally:
                slowest = max(slowest, (time.process_time() - start, seed))
            try:
                files = write_krl(program, its)
            except ValueError:  # foreign programs may start the arc where a corner is rounded
                found["read, not to be written"] += 1
                continue
            out = folder / "out"
            out.mkdir()
            assert write_krl(read_krl(written(out, files), its), its) == files, seed
    print(dict(found), f"slowest {slowest[0]:.2f} s (seed {slowest[1]})")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
