"""Targets that are called proved out of reach, against two searches that know nothing of the proof.

    python -m bench.soundness.proofs                        # about a minute; a line every EVERY seconds
    python -m bench.soundness.proofs --arms 200 --targets 200

Arms are random ones of the class of the closed form, with straight and bent wrists, tools, limits and bases at random;
their frames are exact, or off by what rounding leaves (1e-5 or 1e-4 m and rad). Targets are poses of the arm itself or
poses nearby, their roll free, limited or fixed. Every target that ``ik.reachability_proof`` calls unreachable is
looked at

1. at dense rolls, in all branches of the closed form, on the arm's own chain, and
2. by damped least squares from many seeds, with the roll left to the search.

A configuration inside the limits that keeps the margins refutes the proof; the exit code is 1 if there is any.
"""

from __future__ import annotations

import argparse
import sys
import time

import numpy as np

from ik import Chain, RollWindow, SingularityLimits, certify, dls
from ik.chain import Floats, rotation_about
from ik.closed_form import solve
from ik.joint_turns import excess
from ik.roll import apply_roll
from ik.singularity import margins
from ik.spherical_wrist import TOLERANCE, SphericalWristArm, recognise
from tests.support.cells.arms import random_class_arm, random_pose, replaced

from ..bench_arguments import parsed

NOISE = (0.0, 1e-5, 1e-4)
EVERY = 20.0  # s between two lines: a run that is cut off has told what it found
INSIDE = 1e-7  # rad; of a limit, and of margins: nearer to them a proof and a search may differ by rounding


def shaken(chain: Chain, by: float, rng: np.random.Generator) -> Chain:
    """The chain with each frame turned and moved by up to ``by`` (rad and m)."""
    off = np.tile(np.eye(4), (chain.n, 1, 1))
    for T in off:
        axis = rng.normal(size=3)
        T[:3, :3] = rotation_about(axis / np.linalg.norm(axis), np.array(by * rng.uniform(-1, 1)))
        T[:3, 3] = by * rng.uniform(-1, 1, 3)
    return replaced(chain, origins=chain.origins @ off)


def random_case(seed: int, targets: int) -> tuple[Chain, SphericalWristArm, Floats, RollWindow]:
    """An arm with narrow limits, targets around what it reaches, and a roll window."""
    rng = np.random.default_rng(seed)
    chain = shaken(random_class_arm(rng, bent_wrist=bool(seed % 2)), NOISE[seed % 3], rng)
    low = rng.uniform(-2.6, -0.3, 6)
    chain = replaced(chain, lower=low, upper=low + rng.uniform(0.8, 3.5, 6))
    form = recognise(chain, TOLERANCE)
    assert form is not None
    Ts = chain.forward(rng.uniform(chain.lower - 0.5, chain.upper + 0.5, (targets, 6)))
    Ts = Ts @ np.array([random_pose(rng, 0.05) if k % 2 else np.eye(4) for k in range(targets)])
    middle, half = rng.uniform(-3, 3), rng.uniform(0.05, 2.0)
    window = (RollWindow.free(), RollWindow(middle - half, middle + half), RollWindow.fixed(middle))[seed // 3 % 3]
    return chain, form, Ts, window


def keeps(chain: Chain, form: SphericalWristArm, q: Floats, limits: SingularityLimits) -> np.ndarray:
    """Which configurations (..., 6) are inside the limits with the margins kept, by more than rounding."""
    inside = (excess(chain, q) <= 0).all(axis=-1)
    return inside & (margins(chain, form, q) >= limits.values(True) + INSIDE).all(axis=-1)


def refuted(chain: Chain, form: SphericalWristArm, Ts: Floats, window: RollWindow, rolls: int, seeds: int) -> int:
    """How many of some targets can be reached all the same."""
    limits = SingularityLimits()
    found = np.zeros(len(Ts), dtype=bool)
    for i, T in enumerate(Ts):
        step = (window.high - window.low) / rolls or 1.0
        found[i] = keeps(chain, form, solve(form, apply_roll(T[None], window.samples(step))), limits).any()
    searched = dls.solve(chain, Ts, window, seeds=seeds)
    ok = searched.ok & keeps(chain, form, searched.q, limits)
    return int((found | ok.any(axis=1)).sum())


def main() -> int:
    """Run and print one line for each noise and a sum."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--arms", type=int, default=36)
    parser.add_argument("--targets", type=int, default=60)
    parser.add_argument("--rolls", type=int, default=720, help="rolls looked at in the window")
    parser.add_argument("--seeds", type=int, default=24)
    parser.add_argument("--first", type=int, default=0, help="number of the first arm")
    args = parsed(parser, arms=3, targets=5, rolls=36, seeds=4)
    told = time.perf_counter()
    count = {noise: np.zeros(5, dtype=int) for noise in NOISE}  # targets, reachable, undecided, proved, refuted
    for seed in range(args.first, args.first + args.arms):
        chain, form, Ts, window = random_case(seed, args.targets)
        proof = certify(chain, Ts, window, SingularityLimits(), form)
        out = Ts[proof.unreachable]
        wrong = refuted(chain, form, out, window, args.rolls, args.seeds) if len(out) else 0
        if wrong:
            print(f"arm {seed}: {wrong} of {len(out)} proofs refuted", file=sys.stderr, flush=True)
        count[NOISE[seed % 3]] += (len(Ts), proof.reachable.sum(), proof.undecided.sum(), len(out), wrong)
        if time.perf_counter() - told > EVERY:
            told, every = time.perf_counter(), sum(count.values())
            print(
                f"{seed - args.first + 1} arms, {every[0]} targets: {every[3]} proved, {every[4]} refuted", flush=True
            )
    print("frames off by   targets  reachable  undecided  proved  refuted")
    for noise, row in [*count.items(), ("all", sum(count.values()))]:
        print(f"{noise!s:>13}  {row[0]:8d}  {row[1]:9d}  {row[2]:9d}  {row[3]:6d}  {row[4]:7d}")
    return int(sum(row[4] for row in count.values()) > 0)


if __name__ == "__main__":
    sys.exit(main())
