"""Cells of models as other people write them: what is called feasible is looked at by a second engine.

    python -m bench.soundness.odd_cells                       # 200 random cells
    python -m bench.soundness.odd_cells --count 60 --seed 7 --keep FOLDER    # cells with a finding are kept there
    python -m bench.soundness.odd_cells --odder               # of the kinds of tests/support/cells/odder_models.py too

Arms, torches and tables are of ``tests/support/cells/odd_models.py``, parts and placements of
``tests/support/jobs/random_jobs.py``; the table stands, indexes or moves along. Every motion that a check calls
feasible is replayed by ``tests/support/oracles/witness.py``, which compiles each model from its own file and measures
by coal, and by the check of motions itself, with the same least clearance. Exit code 1 if anything is found.
"""

from __future__ import annotations

import argparse
import shutil
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

import numpy as np

from cell import InputError
from tests.support.jobs.random_jobs import odd_job, own_result
from tests.support.oracles.witness import Witness

from ..bench_arguments import parsed

EVERY = 20.0  # s between two counts


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--first", type=int, default=0, help="number of the first cell")
    parser.add_argument("--keep", type=Path, help="folder for the cells with a finding")
    parser.add_argument("--odder", action="store_true", help="more kinds of models, thin, large and far ones")
    args = parsed(parser, count=2)
    count: Counter[str] = Counter()
    told, slowest = time.perf_counter(), (0.0, -1)
    for k in range(args.first, args.first + args.count):
        with tempfile.TemporaryDirectory() as folder:
            path = odd_job(np.random.default_rng((args.seed, k)), Path(folder), odder=args.odder)
            began = time.process_time()
            try:
                result, wrong = own_result(path, ("csv", "npz")[k % 2])
            except InputError as error:
                count["refused"] += 1
                print(f"{k}: {str(error).removeprefix(folder)}", flush=True)
                continue
            if result.motion is None:
                count["infeasible"] += 1
                continue
            count["feasible"] += 1
            count["of them beside what is built"] += bool(result.job.case.part.built)
            count["of them two sub-volumes"] += len(result.job.layers) > 1
            count[f"of them {result.mode}"] += 1
            wrong = [*wrong, *Witness(result).problems()]
            slowest = max(slowest, (time.process_time() - began, k))
            if wrong:
                count["found"] += 1
                print(f"{k}: {'; '.join(wrong[:6])} ({len(wrong)})", flush=True)
                if args.keep is not None:
                    shutil.copytree(folder, args.keep / f"{args.seed}_{k}", dirs_exist_ok=True)
        if time.perf_counter() - told > EVERY:
            told = time.perf_counter()
            print(dict(count), f"slowest {slowest[0]:.0f} s ({slowest[1]})", flush=True)
    print(f"{args.count} cells: {dict(count)}")
    return int(count["found"] > 0)


if __name__ == "__main__":
    sys.exit(main())
