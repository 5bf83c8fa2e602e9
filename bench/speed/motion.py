"""Cost of planning a motion, a target, as parts grow: ``python -m bench.speed.motion [--targets 1000 10000 100000]``.

Round bosses of thin layers on a shaft, as many as give the wanted number of targets. Of every part the same number of
targets is planned, whole beads spread evenly over it with the travels between them, once with the growing part and once
without any of it, in alternating runs. What is told is time a target: of planning (with and without), and of making the
job ready (slicing, sampling, composing the cell).
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import trimesh
import yaml

from cell import Failure, Job, load_case, prepare
from cell.planning.bead_plan import plan_bead
from cell.planning.context import Context
from cell.planning.edges.edge_check import Stretch
from cell.planning.travels.travel import travel
from cell.scene.scene import table_angles

from ..bench_arguments import parsed

LAYER = 0.3  # mm
RADIUS, HEIGHT, PITCH, SHAFT = 14.0, 60.0, 75.0, 30.0  # mm; with room for the torch beside a boss
AROUND = 58  # targets a layer, about


def boss(height: float, z: float) -> trimesh.Trimesh:
    """A round boss along -x, its foot inside the shaft, mm."""
    mesh = trimesh.creation.cylinder(RADIUS, height + SHAFT / 2, sections=120)
    mesh.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, [0, 1, 0]))
    mesh.apply_translation([-(SHAFT / 2 + (height + SHAFT / 2) / 2), 0, z])
    return mesh


def job_of(targets: int, folder: Path) -> Job:
    """A job of about so many targets."""
    layers = max(targets // AROUND, 1)
    per_boss = int(HEIGHT / LAYER)
    names = []
    for k in range(-(-layers // per_boss)):
        mine = min(per_boss, layers - k * per_boss)
        names.append(f"boss{k}.stl")
        boss(mine * LAYER, PITCH / 2 + k * PITCH).export(folder / names[-1])
    case = {
        "part": {"sub_volumes": names, "body": {"radius_mm": SHAFT, "z_mm": [0, PITCH * len(names)]}},
        "slicing": {"strategy": "planar", "h_layer_mm": LAYER, "h_min_mm": LAYER, "h_max_mm": LAYER},
        "sampling": {"chord_tolerance_mm": 0.02, "min_segment_mm": 1.0},
        "support": {"radius_mm": 20, "height_mm": 120},
        "positioner": {"position_mm": [1550, 0, 0], "rotation_deg": [0, 0, -90]},
        "table": {"E1_deg": 90, "E2_deg": 180},
    }
    path = folder / "bosses.case.yaml"
    path.write_text(yaml.safe_dump(case), encoding="utf-8")
    return prepare(load_case(path))


def setup_of(job: Job) -> Context:
    """What ``cell.verdict.check.check_fixed`` plans with."""
    table = table_angles(job.scene, job.case.table.E1_deg, job.case.table.E2_deg)
    return Context.of(job, table)


def plan(context: Context, beads: Sequence[tuple[int, int]]) -> tuple[float, int]:
    """Plan beads and the travels to them: seconds, and how many of both failed."""
    start, failed = time.perf_counter(), 0
    last: Stretch | None = None
    for first, stop in beads:
        bead = plan_bead(context, first, stop, None if last is None else last.q_targets[-1])
        failed += not bead.whole
        if last is not None and bead.whole:
            failed += isinstance(travel(context, last, bead.stretches[0], int(context.laid[last.stop - 1])), Failure)
        last = bead.stretches[-1] if bead.stretches else last
    return time.perf_counter() - start, failed


def measure(targets: int, sample: int, repeat: int) -> dict[str, float]:
    """Milliseconds a target of one size of part."""
    with tempfile.TemporaryDirectory() as folder:
        start = time.perf_counter()
        job = job_of(targets, Path(folder))
        ready = time.perf_counter() - start
    path = job.targets.bead
    firsts = np.flatnonzero(np.diff(path, prepend=-1))
    stops = np.append(firsts[1:], len(path))
    picked = np.unique(np.linspace(0, len(firsts) - 1, max(sample // AROUND, 2)).astype(int))
    beads = [(int(firsts[i]), int(stops[i])) for i in picked]
    count = sum(stop - first for first, stop in beads)
    context = setup_of(job)
    bare = context.without(range(job.shape.n_deposits))
    runs = [(plan(context, beads), plan(bare, beads)) for _ in range(repeat)]
    growing, without = (min(run[k][0] for run in runs) for k in range(2))
    return {
        "targets": len(path),
        "deposits": job.shape.n_deposits,
        "ready": ready / len(path) * 1e3,
        "growing": growing / count * 1e3,
        "without": without / count * 1e3,
        "failed": sum(run[k][1] for run in runs for k in range(2)),
    }


def main() -> None:
    """Measure and print a table."""
    parser = argparse.ArgumentParser(description="Cost of planning a target as parts grow.")
    parser.add_argument("--targets", type=int, nargs="+", default=[1000, 10_000, 100_000], help="sizes of parts")
    parser.add_argument("--sample", type=int, default=900, help="targets planned of each part")
    parser.add_argument("--repeat", type=int, default=3, help="runs; the fastest counts")
    arguments = parsed(parser, targets=[100], sample=20, repeat=1)
    print(
        "| targets | deposits | ready, ms | planned, ms | ratio | without deposits, ms | growing part costs | failed |"
    )
    print("|--:|--:|--:|--:|--:|--:|--:|--:|")
    least = None
    for targets in arguments.targets:
        m = measure(targets, arguments.sample, arguments.repeat)
        least = least or m["growing"]
        cells = [f"{m['targets']:,.0f}", f"{m['deposits']:.0f}", f"{m['ready']:.2f}", f"{m['growing']:.2f}"]
        cells += [f"{m['growing'] / least:.2f}", f"{m['without']:.2f}", f"x {m['growing'] / m['without']:.2f}"]
        print(f"| {' | '.join(cells)} | {m['failed']:.0f} |", flush=True)


if __name__ == "__main__":
    main()
