"""Infeasible verdicts of random cells against searches of another kind: how many are refuted, is any of them proved?

    python -m bench.soundness.second_opinion  # 60 random cases
    python -m bench.soundness.second_opinion --cases 500 --seed 7 --keep refuted/
    python -m bench.soundness.second_opinion --samplings  # the same curves sampled in three ways: same verdict?

Targets: rolls every 0.5 deg, all branches, with limits, margins and clearance. Beads: a graph of rolls every 2 deg, in
which the roll may turn as far as the joints are fast enough for, its edges followed along the closed form. Travels: a
plain bidirectional tree in joint space, begun wherever the torch can be drawn back to. What these find refutes a
verdict; what they do not find says nothing. Needs an arm with a closed form. --keep writes the refuted cases there.
"""

from __future__ import annotations

import argparse
import shutil
import sys
import tempfile
import time
from collections import Counter
from itertools import pairwise
from pathlib import Path

import numpy as np

from cell import InputError, Result, check, load_case, prepare
from cell.planning.context import (
    Context,
    settings_of,
)
from cell.rigid import frames
from ik import closed_form
from ik.joint_turns import with_turns
from ik.roll import apply_roll, wrap
from ik.singularity import margins
from tests.support.jobs.random_bosses import random_case

from ..bench_arguments import parsed

ALONE = ("collision", "singular", "joint_limit", "unreachable")
FINE, WIDE = np.deg2rad(0.5), np.deg2rad(2.0)  # rolls of targets and of beads
TURN = np.deg2rad(60.0)  # most that the roll turns from target to target
TRIES = 40  # ways through a bead that are followed
STEP = np.deg2rad(1.5)  # between samples of a tree's edges
STRIDE = np.deg2rad(25.0)


class Search:
    """The searches of one verdict."""

    def __init__(self, result: Result, rng: np.random.Generator) -> None:
        job = result.job
        self.result, self.job, self.rng = result, job, rng
        self.settings, self.placed, self.limits = settings_of(job), result.placed, job.singularity_limits
        self.context = Context.of(job, result.table)
        self.chain, self.form = job.solver.chain, job.solver.form
        self.least = self.limits.values(True)

    def free(self, q: np.ndarray, deposits_laid: int) -> np.ndarray:
        """Which configurations keep the clearance."""
        if not len(q):
            return np.zeros(0, dtype=bool)
        found = self.context.screen.clearances(q, np.full(len(q), deposits_laid))
        return np.asarray(found.distance >= self.settings.clearance)

    def nodes(self, i: int, rolls: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Configurations of a target, (r, 8, j) in some turn, and which are inside limits and margins and free."""
        raw = closed_form.solve(self.form, apply_roll(self.placed.rows([i]).Ts_base_target[0], rolls))
        q = with_turns(self.chain, raw, packed=True)[..., 0, :]
        good = np.isfinite(q[..., 0]) & (margins(self.chain, self.form, q) >= self.least).all(axis=-1)
        good[good] = self.free(q[good], int(self.job.deposits_before[i]))
        return q, good

    def target(self, i: int) -> bool:
        """Whether a target is free at some roll."""
        return bool(self.nodes(i, self.job.window.samples(FINE))[1].any())

    def bead(self, first: int, stop: int) -> bool:
        """Whether there is a way through a bead."""
        rolls = self.job.window.samples(WIDE)
        every = [self.nodes(i, rolls) for i in range(first, stop)]
        if not all(good.any() for _, good in every):
            return False
        length = np.linalg.norm(np.diff(self.placed.position[first:stop], axis=0), axis=1)
        share = self.job.case.process.least_speed_share
        times = np.maximum(length, 5e-3) / self.settings.speed[first : stop - 1] / max(share, 1e-9)
        turn = np.abs(wrap(rolls[None] - rolls[:, None]))
        blocked: set[tuple[int, int, int, int]] = set()
        for _ in range(TRIES):
            way = self._cheapest(every, times, turn, blocked)
            if way is None:
                return False
            bad = [k for k in range(len(way) - 1) if not self._holds(first + k, way[k], way[k + 1], rolls, every, k)]
            if not bad:
                return True
            blocked |= {(k, way[k][0], way[k][1], way[k + 1][0]) for k in bad}
        return False

    def _cheapest(self, every, times, turn, blocked):  # type: ignore[no-untyped-def]
        best = None
        for g in range(8):
            here = np.where(every[0][1][:, g], 0.0, np.inf)
            back = []
            for k, ((q0, _), (q1, good)) in enumerate(pairwise(every)):
                move = np.abs(wrap(q1[None, :, g] - q0[:, None, g])) / self.chain.max_speed
                slowest = move.max(axis=-1)
                price = np.where((turn <= TURN) & (slowest <= times[k]), slowest + 0.1 * turn, np.inf)
                for kk, r0, gg, r1 in blocked:
                    if kk == k and gg == g:
                        price[r0, r1] = np.inf
                total = here[:, None] + np.where(np.isnan(price), np.inf, price)
                back.append(total.argmin(axis=0))
                here = np.where(good[:, g], total.min(axis=0), np.inf)
            r = int(here.argmin())
            if np.isfinite(here[r]) and (best is None or here[r] < best[0]):
                way = [(r, g)]
                for choice in reversed(back):
                    way.append((int(choice[way[-1][0]]), g))
                best = float(here[r]), way[::-1]
        return None if best is None else best[1]

    def _holds(self, i, a, b, rolls, every, k) -> bool:  # type: ignore[no-untyped-def]
        """Whether an edge can be followed: limits in some turn, margins, clearance at close samples."""
        p, n = self.placed.position, self.placed.normal
        t = np.linspace(0, 1, 121)
        angle = np.arccos(np.clip(n[i] @ n[i + 1], -1, 1))
        if angle < 1e-9:
            normal = np.repeat(n[i][None], len(t), axis=0)
        else:
            normal = (np.sin((1 - t) * angle)[:, None] * n[i] + np.sin(t * angle)[:, None] * n[i + 1]) / np.sin(angle)
        position = p[i] + t[:, None] * (p[i + 1] - p[i])
        roll = rolls[a[0]] + t * wrap(rolls[b[0]] - rolls[a[0]])
        Ts = apply_roll(frames(position, normal, self.placed.reference), roll)
        raw = closed_form.solve(self.form, Ts)[:, a[1]]
        if np.isnan(raw).any() or (margins(self.chain, self.form, raw) < self.least).any():
            return False
        step = wrap(np.diff(raw, axis=0))
        if np.abs(step).max() > np.deg2rad(10):
            return False
        q = every[k][0][a[0], a[1]] + np.concatenate([np.zeros((1, 6)), np.cumsum(step, axis=0)])
        low, high = q.min(axis=0), q.max(axis=0)
        turns = np.ceil((self.chain.lower - 1e-9 - low) / (2 * np.pi))
        if (high + 2 * np.pi * turns > self.chain.upper + 1e-9).any():
            return False
        return bool(self.free(q + 2 * np.pi * turns, int(self.job.deposits_before[i])).all())

    def travel(self, i: int, k: int, seconds: float) -> bool:
        """Whether a tree joins the end of one bead to the start of the next."""
        deposits_laid = int(self.job.laid[i])
        ends = [self._drawn_back(t, self.result.rows[t].q, deposits_laid) for t in (i, k)]
        if any(len(e) == 0 for e in ends):
            return False
        trees = [[np.asarray(e), np.full(len(e), -1)] for e in ends]
        until = time.process_time() + seconds
        a, b = 0, 1
        while time.process_time() < until:
            goal = self.rng.uniform(self.chain.lower, self.chain.upper)
            if self.rng.random() < 0.3:
                other = trees[b][0]
                goal = other[self.rng.integers(len(other))]
            elif self.rng.random() < 0.6:
                middle = (trees[a][0][0] + trees[b][0][0]) / 2
                goal = np.clip(middle + self.rng.normal(0, 0.6, 6), self.chain.lower, self.chain.upper)
            new = self._extended(trees[a], goal, deposits_laid)
            if new is not None:
                met = self._extended(trees[b], new, deposits_laid, all_the_way=True)
                if met is not None and np.abs(met - new).max() < 1e-9:
                    return True
            a, b = b, a
        return False

    def _drawn_back(self, i: int, q: np.ndarray | None, deposits_laid: int) -> list[np.ndarray]:
        if q is None:
            return []
        T = self.job.solver.chain.forward(q[None])[0]
        out, before = [], q
        for distance in np.arange(1, 41) * 1e-3:
            T_out = T.copy()
            T_out[:3, 3] += distance * self.placed.normal[i]
            raw = closed_form.solve(self.form, T_out[None])[0]
            near = before + wrap(raw - before)
            g = int(np.nanargmin(np.abs(near - before).max(axis=1)))
            now = near[g]
            inside = ((now >= self.chain.lower) & (now <= self.chain.upper)).all()
            if not inside or np.abs(now - before).max() > 0.3 or not self.free(now[None], deposits_laid)[0]:
                break
            before = now
            out.append(now)
        return out[4::5] or out[-1:]

    def _extended(self, tree, goal, deposits_laid, *, all_the_way: bool = False):  # type: ignore[no-untyped-def]
        nodes = tree[0]
        near = int(np.argmin(np.linalg.norm((nodes - goal) * self.context.radius, axis=1)))
        start = nodes[near]
        size = np.abs(goal - start).max()
        if not all_the_way and size > 3 * STRIDE:
            goal = start + (goal - start) * 3 * STRIDE / size
        count = max(int(np.ceil(np.abs(goal - start).max() / STEP)), 1)
        q = start + np.linspace(0, 1, count + 1)[1:, None] * (goal - start)
        good = self.free(q, deposits_laid)
        if good.all() and self.context.wire is not None:
            good &= self.context.wire.clearances(q, np.full(len(q), deposits_laid)).distance > 0
        reached = count if good.all() else int(np.argmin(good))
        if reached < 2 and reached < count:
            return None
        tree[0], tree[1] = np.vstack([nodes, q[reached - 1]]), np.append(tree[1], near)
        return q[reached - 1]


def opinions(result: Result, rng: np.random.Generator, seconds: float, most: int) -> Counter[tuple[str, str]]:
    """How many verdicts of a result of each kind there are, and how many are refuted."""
    out: Counter[tuple[str, str]] = Counter()
    search = Search(result, rng)
    rows = result.rows
    bad = [i for i, row in enumerate(rows) if row.reason in ALONE]
    for i in rng.permutation(bad)[:most].tolist():
        reason = str(rows[i].reason)
        out[reason, "all"] += 1
        out["proved", "all"] += bool(rows[i].proved)
        if "at_home" not in rows[i].detail and "the table" not in str(rows[i].detail.get("note")) and search.target(i):
            out[reason, "refuted"] += 1
            out["proved", "refuted"] += bool(rows[i].proved)
    path = result.job.targets.bead
    cut = [i for i, row in enumerate(rows) if row.reason in ("no_path", "speed") and not row.detail.get("travel")]
    beads = sorted({int(path[i]) for i in cut if "share" not in rows[i].detail})
    for bead in [b for b in beads if all(rows[i].reason not in ALONE for i in np.flatnonzero(path == b))][:most]:
        out["bead", "all"] += 1
        first, stop = np.searchsorted(path, [bead, bead + 1]).tolist()
        out["bead", "refuted"] += search.bead(first, stop)
    for i, row in list(enumerate(rows)):
        if row.detail.get("travel") and "from_target" in row.detail and "to_target" in row.detail:
            if out["travel", "all"] >= most or row.q is None or rows[row.detail["from_target"]].q is None:
                continue
            out["travel", "all"] += 1
            out["travel", "refuted"] += search.travel(row.detail["from_target"], i, seconds)
    return out


SAMPLINGS = ((8.0, 0.2), (4.0, 0.2), (2.0, 0.1))  # min_segment_mm, chord_tolerance_mm


def samplings(cases: int, seed: int) -> int:
    """Verdicts of random cases whose curves are sampled in several ways; how many are not the same."""
    differ = 0
    for k in range(cases):
        said = []
        for segment, chord in SAMPLINGS:
            with tempfile.TemporaryDirectory() as name:
                sampling = {"min_segment_mm": segment, "chord_tolerance_mm": chord}
                path = random_case(np.random.default_rng([seed, k]), Path(name), sampling=sampling)
                try:
                    case = load_case(path)
                    result = check(prepare(case), case.table.E1_deg, case.table.E2_deg)
                except InputError:
                    break
            reasons = {reason: n for reason, n in result.reasons.items() if n}
            said.append((result.feasible, len(result.rows), reasons))
        if len({feasible for feasible, *_ in said}) > 1:
            differ += 1
            print(f"case {k}: {said}", flush=True)
    print(f"{cases} cases, {differ} with verdicts that hang on the sampling")
    return differ


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=60, help="random cases (default 60)")
    parser.add_argument("--seed", type=int, default=0, help="of the cases (default 0)")
    parser.add_argument("--seconds", type=float, default=8.0, help="a travel's tree may grow (default 8)")
    parser.add_argument("--most", type=int, default=12, help="verdicts of a kind looked at in a case (default 12)")
    parser.add_argument("--keep", type=Path, help="folder to write refuted cases to")
    parser.add_argument("--samplings", action="store_true", help="sample the same curves in three ways instead")
    args = parsed(parser, cases=2, seconds=0.5, most=1)
    if args.samplings:
        sys.exit(1 if samplings(args.cases, args.seed) else 0)
    total: Counter[tuple[str, str]] = Counter()
    verdicts: Counter[str] = Counter()
    for k in range(args.cases):
        rng = np.random.default_rng([args.seed, k])
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            path = random_case(rng, folder)
            try:
                case = load_case(path)
                start = time.process_time()
                result = check(prepare(case), case.table.E1_deg, case.table.E2_deg)
            except InputError:
                verdicts["refused"] += 1
                continue
            verdicts["feasible" if result.feasible else "infeasible"] += 1
            verdicts["seconds"] += round(time.process_time() - start)
            if result.feasible:
                continue
            found = opinions(result, rng, args.seconds, args.most)
            total += found
            refuted = {what: n for (what, kind), n in found.items() if kind == "refuted" and n}
            if refuted:
                print(f"case {k}: {refuted}", flush=True)
                if args.keep:
                    shutil.copytree(folder, args.keep / f"{args.seed}_{k}", dirs_exist_ok=True)
    print(f"{args.cases} cases: {dict(verdicts)}")
    for what in (*ALONE, "proved", "bead", "travel"):
        print(f"{what:12s} {total[what, 'refuted']} of {total[what, 'all']} refuted")
    sys.exit(1 if total["proved", "refuted"] else 0)


if __name__ == "__main__":
    main()
