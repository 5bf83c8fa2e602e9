"""One check in several processes: ``python -m bench.speed.processes [--parts pad] [--targets 6000] [--jobs 1 2]``.

The same part is checked with each number of processes. Told are wall time; processor time of all of them; that on the
critical path, which is the first process' own and what it would have waited for workers by the processor time of all
(``cell.processes.critical_path``), and so what the wall time would be on a machine with nothing else to do;
memory of the first process and of the largest worker; how long the motion takes; and a digest of verdict and motion,
which has to be one and the same. Measured is the check of a part that is sliced and a cell that is composed. Workers
are copies of the first process where they may be, as on Linux. With ``--spawned`` they begin with nothing, as
elsewhere: while the cell is composed, as they do in ``rbam check``, so that of their start counts what is not over by
then; with ``--late`` when they are needed, as they do in ``cell.check``. ``one chunk``
is the part planned bead after bead, as small ones are. Of several rounds, in turns, the least of each number of
processes is compared.

With ``--separate`` each round has as many separate checks of the whole part at once as well, each in a process of its
own with all that it needs: twice as much work, so how many times as fast as one they are is what two processes could
come to on this machine, had they nothing to wait for. Where processes can be forked.
"""

from __future__ import annotations

import argparse
import hashlib
import multiprocessing
import resource
import sys
import time
from multiprocessing.connection import Connection

if __name__ == "__main__":  # a worker runs this file as well, and needs none of them for it
    import cell.processes.worker_pool
    from cell import Job
    from cell.part_chunks.chunking import USUAL, Chunking
    from cell.planning.context import Context
    from cell.processes.worker_pool import processor_time, working
    from cell.scene.scene import table_angles
    from cell.verdict.check import SpanVerdict, check_span, off_upright

    from ..bench_arguments import parsed
    from .real_parts import FILLS, PARTS, ROLLS, job_of

MB = 1024.0  # of ru_maxrss, kB on Linux


def checked(job: Job, chunking: Chunking) -> tuple[SpanVerdict, int]:
    """The verdict of a part, and how many chunks it has."""
    context = Context.of(job, table_angles(job.scene, job.case.table.E1_deg, job.case.table.E2_deg))
    found = check_span(job, context, off_upright(job, context.placed), None, chunking)
    return found, len(chunking.chunks(job.targets, context.span))


class SeparateChecks:
    """Processes that check the whole part each, when they are told to."""

    def __init__(self, asked: tuple[str, int, str, str, bool], count: int, chunking: Chunking) -> None:
        """Have them prepare the part."""
        self._pipes = []
        for _ in range(count):
            here, there = multiprocessing.Pipe()
            fork = multiprocessing.get_context("fork")
            fork.Process(target=self._serve, args=(there, asked, chunking), daemon=True).start()
            self._pipes.append(here)
        self.times()  # the first check of a process has more to do

    @staticmethod
    def _serve(pipe: Connection, asked: tuple[str, int, str, str, bool], chunking: Chunking) -> None:
        job = job_of(*asked)
        while pipe.recv():
            with working(1):
                start = time.perf_counter()
                checked(job, chunking)
                pipe.send(time.perf_counter() - start)

    def times(self) -> float:
        """Time of the slowest of all at once, s."""
        for pipe in self._pipes:
            pipe.send(True)
        return max(pipe.recv() for pipe in self._pipes)

    def end(self) -> None:
        """Have them end."""
        for pipe in self._pipes:
            pipe.send(False)


def digest(found: SpanVerdict) -> str:
    """Of verdict and motion, to the bit."""
    out = hashlib.sha256(repr([(row.failure, found.clearance, found.singularity) for row in found.rows]).encode())
    for row in found.rows:
        out.update(b"" if row.q is None else row.q.tobytes())
    if found.motion is not None:
        for column in (found.motion.t_s, found.motion.q, found.motion.target):
            out.update(column.tobytes())
    return out.hexdigest()[:12]


def measure(
    asked: tuple[str, int, str, str, bool], processes: int, chunking: Chunking, name: str, *, late: bool = False
) -> tuple[float, float]:
    """Check a part (what ``job_of`` takes) and print a line; processor time on the critical path and wall time, s."""
    known = job_of(*asked) if late else None
    with working(processes) as pool:
        job = known or job_of(*asked)
        wall, every, here = time.perf_counter(), processor_time(), time.process_time()
        found, chunks = checked(job, chunking)
    wall, every, here = time.perf_counter() - wall, processor_time() - every, time.process_time() - here
    critical = here + pool.busiest
    n = len(job.targets)
    peak = [resource.getrusage(who).ru_maxrss / MB for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    said = "infeasible" if found.motion is None else f"{found.motion.t_s[-1]:.0f} s"
    print(
        f"| {name} | {n} | {chunks} | {processes} | {1e3 * every / n:.2f} | {1e3 * critical / n:.2f} |"
        f" {here:.1f} | {wall:.1f} | {peak[0]:.0f} + {peak[1]:.0f} | {said} | {digest(found)} |",
        flush=True,
    )
    return critical, wall


def main() -> None:
    """Measure and print a table."""
    parser = argparse.ArgumentParser(description="One check in several processes.")
    parser.add_argument("--parts", nargs="+", choices=PARTS, default=["pad"])
    parser.add_argument("--targets", type=int, default=6000, help="of each, about")
    parser.add_argument("--fill", choices=FILLS, default="zigzag")
    parser.add_argument("--roll", choices=ROLLS, default="free")
    parser.add_argument("--infeasible", action="store_true", help="the twin that cannot be built")
    parser.add_argument("--jobs", type=int, nargs="+", default=[1, 2], help="numbers of processes")
    parser.add_argument("--rounds", type=int, default=1, help="of all numbers of processes, in turns")
    parser.add_argument("--spawned", action="store_true", help="workers begin with nothing")
    parser.add_argument("--late", action="store_true", help="workers begin when they are needed")
    parser.add_argument("--separate", action="store_true", help="as many separate checks at once as well")
    parser.add_argument("--one-chunk", action="store_true", help="the part in one chunk as well")
    args = parsed(parser, targets=100, jobs=[1, 2], fill="contour")
    chunking = Chunking(0, 20) if args.smoke else USUAL
    if args.spawned:
        cell.processes.worker_pool.may_fork = lambda: False
    print(
        "| part | targets | chunks | processes | all, ms a target | critical path, ms a target |"
        " first process, s | wall, s | memory, MB | motion | digest |\n|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|---|"
    )
    for part in args.parts:
        asked = part, args.targets, args.fill, args.roll, not args.infeasible
        if args.one_chunk:
            measure(asked, 1, Chunking(sys.maxsize), f"{part}, one chunk")
        separate = [SeparateChecks(asked, count, chunking) for count in args.jobs] if args.separate else []
        rounds, apart = [], []
        for _ in range(args.rounds):
            rounds.append([measure(asked, processes, chunking, part, late=args.late) for processes in args.jobs])
            apart.append([checks.times() for checks in separate])
        for checks in separate:
            checks.end()
        for k, what in enumerate(("on the critical path", "by the clock")):
            least = [min(found[k] for found in one) for one in zip(*rounds, strict=True)]
            words = (f"{least[0] / one:.2f} with {processes}" for one, processes in zip(least, args.jobs, strict=True))
            print(f"\n{part}: times as fast {what}: {', '.join(words)}", flush=True)
        if separate:
            least = [min(one) for one in zip(*apart, strict=True)]
            alone = least[0] / args.jobs[0]
            words = (f"{n * alone / one:.2f} with {n}" for one, n in zip(least, args.jobs, strict=True))
            print(f"\n{part}: times as fast as one by one, separate checks at once: {', '.join(words)}", flush=True)


if __name__ == "__main__":
    main()
