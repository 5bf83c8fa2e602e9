"""A table that moves along the beads, ours against mink's differential tasks on the same targets and rolls.

    python -m bench.speed.table_in_motion                   # the boiler's first 120 targets
    python -m bench.speed.table_in_motion --case valve --targets 300

mink follows the targets one after the other: the TCP relative to the part (RelativeFrameTask), the wire straight down
(AxisAlignTask) with a small weight, joint limits kept. Nothing else is asked of it: no clearance, no margin, nothing
between the targets. Ours is the whole check, with all of that and the time law; by itself the table's way. Uprightness
is at the targets; speeds are those that the deposition speed asks for from target to target.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np

from cell import Job, load_case, prepare, with_changes
from cell.coordination.table_schedule import Schedule
from cell.job.job import speeds
from cell.job.table_winding import freedom_of, upright_of
from cell.rigid import inverse
from cell.scene.standalone import standalone_xml
from cell.scene.table_kinematics import TableKinematics
from cell.verdict.by_table_mode import check

from ..bench_arguments import left_out, parsed

ROOT = Path(__file__).resolve().parents[2]

STEPS, DT, CLOSE = 200, 0.1, 1e-6  # of mink's solver a target; m and rad


def followed(job: Job, start: np.ndarray, Ts_part_tcp: np.ndarray, weight: float) -> tuple[np.ndarray, int]:
    """All axes at the targets as mink finds them, (n, j + 2), and how many it does not reach."""
    import mink

    model = mujoco.MjModel.from_xml_string(standalone_xml(job.scene))
    places = [model.joint(name).qposadr[0] for name in (*job.chain.names, "E1", "E2")]
    q = np.zeros(model.nq)
    q[places] = start
    at = mink.Configuration(model)
    at.update(q)
    costs = {"position_cost": 1.0, "orientation_cost": 1.0, "lm_damping": 1e-6}
    bead = mink.RelativeFrameTask("tcp", "site", "part", "site", **costs)
    down = mink.AxisAlignTask("tcp", "site", (0.0, 0.0, 1.0), cost=weight, lm_damping=1e-6)
    down.set_target(np.array([0.0, 0.0, -1.0]))
    limits, out, missed = [mink.ConfigurationLimit(model)], [], 0
    for T in Ts_part_tcp:
        bead.set_target(mink.SE3.from_matrix(T))
        for _ in range(STEPS):
            if np.abs(bead.compute_error(at)).max() < CLOSE:
                break
            step = mink.solve_ik(at, [bead, down], DT, "daqp", damping=1e-6, limits=limits)
            at.integrate_inplace(step, DT)
        else:
            missed += 1
        out.append(at.q[places].copy())
    return np.array(out), missed


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--case", default="boiler", help="a shipped case (default boiler)")
    parser.add_argument("--targets", type=int, default=120, help="its first (default 120)")
    parser.add_argument("--weight", type=float, default=1e-2, help="of the wire straight down (default 0.01)")
    args = parsed(parser, targets=9)
    try:
        import mink  # noqa: F401
    except ImportError:
        left_out("mink is not installed")
    case = load_case(ROOT / "models" / "cases" / f"{args.case}.case.yaml")
    job = prepare(with_changes(case, table=case.table.model_copy(update={"mode": "coordinated"})))
    last = int(job.targets.bead[min(args.targets, len(job.targets)) - 1])
    t = job.targets
    few = np.flatnonzero(t.bead <= last)
    columns = ("sub_volume_index", "layer", "bead", "position", "normal", "tangent", "thickness_mm", "speed_mm_s")
    some = replace(t, closed=t.closed[: last + 1], **{name: getattr(t, name)[few] for name in columns})
    job = replace(job, targets=some, beads=())
    length = np.linalg.norm(np.diff(some.position, axis=0), axis=1) * 1e-3
    begin = time.perf_counter()
    Schedule(freedom_of(job.case, job.scene), upright_of(job.case), job.drives.speed[-2:]).along(
        some.normal, some.bead, length
    )
    table_s = time.perf_counter() - begin
    begin = time.perf_counter()
    result = check(job)
    whole_s = time.perf_counter() - begin
    if not result.feasible:
        raise SystemExit(f"{args.case}: infeasible, nothing to compare")
    ours = np.concatenate([np.array([row.q for row in result.rows]), result.tables], axis=1)
    table, n = TableKinematics.of(job.scene), job.chain.n
    Ts = inverse(table.poses(ours[:, n:])) @ job.chain.forward(ours[:, :n])
    begin = time.perf_counter()
    theirs, missed = followed(job, ours[0], Ts, args.weight)
    mink_s = time.perf_counter() - begin
    same = np.diff(some.bead) == 0
    taken = (length / speeds(job)[:-1])[same]
    print(f"{args.case}: {len(few)} targets; mink misses {missed}; ours by itself the table's way", end=" ")
    print(f"{1e3 * table_s / len(few):.2f} ms a target")
    print(f"{'':6} {'ms a target':>12} {'off up, deg: max':>17} {'mean':>6}   most of its speed, by axis, %")
    for name, q, seconds in (("ours", ours, whole_s), ("mink", theirs, mink_s)):
        off = np.rad2deg(table.off(q[:, n:], some.normal))
        use = (np.abs(np.diff(q, axis=0))[same] / taken[:, None] / job.drives.speed).max(axis=0)
        axes = " ".join(f"{share:5.1f}" for share in 100 * use)
        print(f"{name:6} {1e3 * seconds / len(few):12.2f} {off.max():17.1f} {off.mean():6.1f}   {axes}")


if __name__ == "__main__":
    main()
