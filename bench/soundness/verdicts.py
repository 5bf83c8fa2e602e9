"""Verdicts of single targets against py-opw-kinematics, in full: is anything found that was proved out, or missed?

    python -m bench.soundness.verdicts  # 10,000 full poses, 10,000 targets of free roll at 720 rolls
    python -m bench.soundness.verdicts --targets 1000 --rolls 72

The shipped arm with the shipped torch, poses anywhere in and around its reach. Rolls are tried coarse ones first, and a
target that has been found is not tried again. A slice of this is a test (tests/acceptance/test_peers.py).
"""

from __future__ import annotations

import argparse
import sys
import time
from importlib.util import find_spec

import numpy as np

from ik import RollWindow

from ..bench_arguments import left_out, parsed

if find_spec("py_opw_kinematics") is None:
    left_out("py-opw-kinematics is not installed")

from ik.roll import apply_roll
from tests.support.oracles.peers import FREE, certified, found_by_opw, poses

CHUNK = 200_000  # poses that opw is given at once


def found_at_rolls(Ts: np.ndarray, count: int) -> np.ndarray:
    """Which targets, (m, 4, 4), opw finds at any of so many rolls, (m,)."""
    rolls = FREE.samples(2 * np.pi / count)
    found = np.zeros(len(Ts), dtype=bool)
    tried = np.zeros(len(rolls), dtype=bool)
    for step in (120, 30, 6, 1):
        mine = np.zeros(len(rolls), dtype=bool)
        mine[::step] = True
        now, tried = rolls[mine & ~tried], tried | mine
        left = np.flatnonzero(~found)
        per = max(CHUNK // max(len(now), 1), 1)
        for i in range(0, len(left), per):
            block = left[i : i + per]
            here = found_by_opw(apply_roll(Ts[block, None], now).reshape(-1, 4, 4)).reshape(len(block), -1)
            found[block] = here.any(axis=1)
    return found


def say(name: str, mine, theirs: np.ndarray, seconds: float) -> bool:
    wrong, missed = int((theirs & mine.unreachable).sum()), int((theirs & ~mine.reachable).sum())
    print(
        f"{name}: {len(theirs)} targets, {theirs.mean():.1%} found by opw, {seconds:.0f} s; here"
        f" {mine.reachable.mean():.1%} found, {mine.unreachable.mean():.1%} proved out, {mine.undecided.sum()} open;"
        f" proofs contradicted {wrong}, found by opw alone {missed}"
    )
    return wrong == missed == 0 and mine.undecided.mean() <= 0.001


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--targets", type=int, default=10_000, help="of each kind (default 10000)")
    parser.add_argument("--rolls", type=int, default=720, help="of each target of free roll (default 720)")
    parser.add_argument("--seed", type=int, default=0, help="of the targets (default 0)")
    args = parsed(parser, targets=20, rolls=12)
    rng = np.random.default_rng(args.seed)
    start, Ts = time.perf_counter(), poses(rng, args.targets)
    good = say("full poses", certified(Ts, RollWindow.fixed(0.0)), found_by_opw(Ts), time.perf_counter() - start)
    start, Ts = time.perf_counter(), poses(rng, args.targets)
    theirs = found_at_rolls(Ts, args.rolls)
    good &= say(f"free roll, {args.rolls} rolls", certified(Ts, FREE), theirs, time.perf_counter() - start)
    sys.exit(0 if good else 1)


if __name__ == "__main__":
    main()
