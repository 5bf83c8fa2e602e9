"""Every motion that a check calls feasible is feasible to the check of motions, with the same least clearance.

    python -m bench.soundness.own_motion                       # 1000 random cases
    python -m bench.soundness.own_motion --count 60 --seed 7 --keep FOLDER    # cases that fail are kept there

Placements, fixtures, patterns, leads, roll windows, clearances and tables are drawn at random; most cases of which no
motion is found are skipped quickly. Exit code 1 if any motion is refused.
"""

from __future__ import annotations

import argparse
import shutil
import sys
import tempfile
from pathlib import Path

import numpy as np

from cell import InputError
from tests.support.jobs.random_jobs import own_motion, random_job

from ..bench_arguments import parsed


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--keep", type=Path, help="folder for the cases that fail")
    args = parsed(parser, count=2)
    feasible = failed = refused = 0
    for k in range(args.count):
        with tempfile.TemporaryDirectory() as folder:
            path = random_job(np.random.default_rng((args.seed, k)), Path(folder))
            try:
                wrong = own_motion(path, ("csv", "npz")[k % 2])
            except InputError as error:
                refused += 1
                print(f"{k}: {error}", flush=True)
                continue
            feasible += wrong is not None
            if wrong:
                failed += 1
                print(f"{k}: {'; '.join(wrong)}", flush=True)
                if args.keep is not None:
                    shutil.copytree(folder, args.keep / f"{args.seed}_{k}", dirs_exist_ok=True)
    print(f"{args.count} cases, {feasible} feasible, {failed} refused by their own check, {refused} not cases at all")
    return int(failed > 0)


if __name__ == "__main__":
    sys.exit(main())
