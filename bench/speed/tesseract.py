"""Planning beads against Tesseract's Descartes planner: ``python -m bench.speed.tesseract --python VENV/bin/python``.

The other Python needs ``tesseract-robotics==0.5.1`` and numpy; it is a process of its own that takes turns with ours,
bead by bead. Same targets, rolls, joint limits, shapes, tested pairs and clearance; no deposits, no travels. Told are
milliseconds of processor time a target, the summed joint travel inside the beads, and what our own dense check between
the targets makes of either.
"""

from __future__ import annotations

import os

os.environ["OMP_NUM_THREADS"] = "1"  # before numpy is loaded; the other process inherits it
os.environ["OPENBLAS_NUM_THREADS"] = "1"

import argparse
import json
import subprocess
import sys
import tempfile
import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from cell import load_case, prepare
from cell.collision.proofs.between_samples import unproven_steps
from cell.planning.bead_plan import plan_bead
from cell.planning.context import Context
from cell.planning.edges.edge_check import SearchedBead as OneBead
from cell.planning.edges.edge_tracking import track_edges
from cell.planning.neighbours.beads_ahead import BeadsAhead
from cell.planning.station_search import ROUNDS, Ends, StationSearch
from ik.chain import Floats

from ..bench_arguments import left_out, parsed
from .motion import job_of, setup_of
from .tesseract_cell import write_cell

TOUCH = 2e-4  # m that two collision libraries may differ
LOCATE = "import tesseract_robotics as t; print(t.__path__[0])"
Bead = tuple[int, int]


@dataclass
class Row:
    """One line of the table.

    Attributes:
        name: the way.
        run: bead -> configurations (t, j), rad, or None, and processor seconds.
        seconds: spent so far.
        beads: configurations of each bead planned.
        failed: beads without a way.
    """

    name: str
    run: Callable[[Bead], tuple[Floats | None, float]]
    seconds: float = 0.0
    beads: dict[Bead, Floats] = field(default_factory=dict)
    failed: int = 0

    def plan(self, bead: Bead) -> None:
        """Plan one bead more."""
        q, seconds = self.run(bead)
        self.seconds += seconds
        if q is None:
            self.failed += 1
        else:
            self.beads[bead] = q


class Descartes:
    """The other process."""

    def __init__(self, python: str, folder: Path) -> None:
        """Start it on a folder with cell and targets."""
        command = [python, str(Path(__file__).with_name("tesseract_peer.py")), str(folder)]
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL}
        self._process = subprocess.Popen(command, text=True, **pipes)  # type: ignore[call-overload]
        self._folder = folder
        if not self._process.stdout.readline():
            raise SystemExit("Tesseract did not start: bench/speed/tesseract_peer.py by hand says why")

    def run(self, bead: Bead) -> tuple[Floats | None, float]:
        """Plan one bead."""
        print(*bead, "targets", file=self._process.stdin, flush=True)
        answer = json.loads(self._process.stdout.readline())
        return (np.load(self._folder / f"q_{bead[0]}.npy") if answer["found"] else None), answer["cpu"]

    def close(self) -> None:
        """End it."""
        self._process.stdin.close()
        self._process.wait(timeout=60)


def between_too(python: str, folder: Path, seconds: float) -> str:
    """What Descartes says of two targets with the edges between their nodes checked as well, if it does in time."""
    command = [python, str(Path(__file__).with_name("tesseract_peer.py")), str(folder)]
    try:
        done = subprocess.run(command, input="0 2 edges\n", capture_output=True, text=True, timeout=seconds, check=True)
    except subprocess.TimeoutExpired:
        return f"not done after {seconds:g} s"
    return f"{json.loads(done.stdout.splitlines()[-1])['cpu']:.1f} s of processor time"


def whole(context: Context) -> Callable[[Bead], tuple[Floats | None, float]]:
    """What ``rbam check`` does with a bead: dense following and proof between the targets included."""

    def run(bead: Bead) -> tuple[Floats | None, float]:
        start = time.process_time()
        plan = plan_bead(context, *bead, None)
        seconds = time.process_time() - start
        return (plan.stretches[0].q_targets if plan.whole else None), seconds

    return run


def in_a_run(context: Context, beads: list[Bead]) -> Callable[[Bead], tuple[Floats | None, float]]:
    """What ``rbam check`` does with beads that follow one another: searched ahead, and proved together."""
    ahead = BeadsAhead(context, tuple(first for first, _ in beads), beads[-1][1])
    before: list[Floats | None] = [None]

    def run(bead: Bead) -> tuple[Floats | None, float]:
        start = time.process_time()
        plan = ahead.bead(bead[0], before[0]) or plan_bead(context, *bead, before[0])
        seconds = time.process_time() - start
        before[0] = plan.stretches[-1].q_targets[-1] if plan.whole else None
        return (plan.stretches[0].q_targets if plan.whole else None), seconds

    return run


class TargetsAlone(StationSearch):
    """The search of a bead as far as Descartes goes."""

    def targets(self) -> Floats | None:
        """Configurations (t, j), rad, each free of collision; nothing is looked at between them."""
        for _ in range(ROUNDS):
            way = self.cheapest_path()
            if way is None:
                break
            q = way[2]
            found = self.context.screen.clearances(q, self.bead.deposits_before)
            hit = np.flatnonzero(found.distance < self.context.settings.clearance)
            if not len(hit):
                return q
            if not self._add(hit):
                break
        return None


def targets_alone(context: Context) -> Callable[[Bead], tuple[Floats | None, float]]:
    """As far as Descartes goes: every target free of collision, nothing looked at between them."""

    def run(bead: Bead) -> tuple[Floats | None, float]:
        start = time.process_time()
        q = TargetsAlone(OneBead.of(context, *bead), context.settings.roll_step, Ends()).targets()
        return q, time.process_time() - start

    return run


def refused(context: Context, first: int, q: Floats) -> tuple[int, int]:
    """Of a bead's configurations: targets missed or hit, and steps between them that our dense check refuses."""
    placed, chain = context.placed, context.solver.chain
    targets = first + np.arange(len(q))
    T = placed.Ts_base_target[targets]
    turned = np.linalg.solve(T, chain.forward(q))
    off = np.linalg.norm(turned[:, :3, 3], axis=1) + np.abs(turned[:, 2, 2] - 1)
    roll = np.arctan2(turned[:, 1, 0], turned[:, 0, 0])
    near = context.screen.clearances(q, context.deposits_before[targets]).distance < context.settings.clearance - TOUCH
    pairs = np.stack([np.arange(len(q) - 1), np.arange(1, len(q))], axis=1)
    track = track_edges(
        context.solver, placed, targets[:-1], roll[pairs], q[pairs], context.limits, context.settings.steps
    )
    stage = context.deposits_before[targets[:-1][track.edge]]
    clear = context.checker.clearances(track.q, stage)
    bad = set(track.broken)
    bad.update(track.edge[clear.distance < context.settings.clearance - TOUCH].tolist())
    step, _ = unproven_steps(context.checker, context.radius, track.q, stage, clear, track.edge)
    bad.update(track.edge[step].tolist())
    return int((near | (off > 1e-6)).sum()), len(bad)


def beads_of(path: np.ndarray, wanted: int) -> list[Bead]:
    """Whole beads from the first on, the last cut short, to just the number of targets."""
    firsts = np.flatnonzero(np.diff(path, prepend=-1)).tolist()
    stops = [*firsts[1:], len(path)]
    beads = [(a, min(b, wanted)) for a, b in zip(firsts, stops, strict=True) if a < wanted]
    return [(a, b) for a, b in beads if b - a > 1]


def show(rows: list[Row], context: Context) -> None:
    """The table; travel over the beads that all rows have."""
    common = set.intersection(*(set(row.beads) for row in rows))
    last = rows[-1]
    steps = {row.name: np.concatenate([np.diff(row.beads[b], axis=0) for b in sorted(common)]) for row in rows}
    count = {row.name: sum(b - a for a, b in row.beads) for row in rows}
    print(
        "| way | ms a target | Descartes / this | joint travel, rad | against Descartes | largest step, deg |", end=" "
    )
    print("beads failed | targets refused | steps refused |")
    print("|---|--:|--:|--:|--:|--:|--:|--:|--:|")
    travel = {name: float(np.abs(d).sum()) for name, d in steps.items()}
    for row in rows:
        each, peer = (r.seconds / max(count[r.name], 1) * 1e3 for r in (row, last))
        bad = np.array([refused(context, a, row.beads[a, b]) for a, b in sorted(common)]).sum(axis=0)
        cells = [f"{each:.2f}", f"{peer / each:.1f}", f"{travel[row.name]:.2f}"]
        cells += [f"{travel[row.name] / travel[last.name]:.3f}", f"{np.rad2deg(np.abs(steps[row.name]).max()):.1f}"]
        print(f"| {row.name} | {' | '.join(cells)} | {row.failed} | {bad[0]} | {bad[1]} |")


def main() -> None:
    """Measure and print a table."""
    parser = argparse.ArgumentParser(description="Planning beads against Tesseract's Descartes planner.")
    parser.add_argument("--python", help="a Python with tesseract-robotics 0.5.1")
    parser.add_argument("--targets", type=int, default=1200)
    parser.add_argument("--case", type=Path, help="a case instead of the round boss on a shaft")
    parser.add_argument("--seconds", type=float, default=240.0, help="begin no further bead after this")
    parser.add_argument("--edges", type=float, metavar="SECONDS", help="Descartes on two targets, edges checked too")
    arguments = parsed(parser, targets=30, seconds=5.0)
    if arguments.python is None:
        if arguments.smoke:
            left_out("tesseract-robotics is not installed: --python names an environment that has it")
        parser.error("--python is needed")
    located = subprocess.run([arguments.python, "-c", LOCATE], capture_output=True, text=True, check=True)
    libraries = Path(located.stdout.strip()).with_name("tesseract_robotics.libs")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        job = prepare(load_case(arguments.case)) if arguments.case else job_of(arguments.targets, folder)
        growing = setup_of(job)
        context = growing.without(range(job.shape.n_deposits))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # of Euler angles at the poles, which are exact all the same
            write_cell(job.scene, context.checker.table, folder, libraries)
        given = {"roll_step": context.settings.roll_step, "clearance": context.settings.clearance}
        np.savez(folder / "targets.npz", Ts=context.placed.Ts_base_target, **given)
        descartes = Descartes(arguments.python, folder)
        beads = beads_of(job.targets.bead, arguments.targets)
        rows = [
            Row("rbam, proven between the targets", whole(context)),
            Row("rbam, proven, beads of a run together", in_a_run(context, beads)),
            Row("rbam, targets alone", targets_alone(context)),
            Row("Descartes, targets alone", descartes.run),
        ]
        for row in rows:
            row.run(beads[0])  # loads what is loaded once
        rows[1] = Row(rows[1].name, in_a_run(context, beads))
        until = time.perf_counter() + arguments.seconds
        done = 0
        for bead in beads:
            if time.perf_counter() > until:
                print(f"out of time after {done} targets", file=sys.stderr)
                break
            for row in rows:
                row.plan(bead)
            done += bead[1] - bead[0]
        descartes.close()
        print(f"{done} targets, {len(beads)} beads, roll step {np.rad2deg(context.settings.roll_step):g} deg\n")
        show(rows, context)
        if arguments.edges:
            print("\nDescartes, two targets and between them:", between_too(arguments.python, folder, arguments.edges))


if __name__ == "__main__":
    main()
