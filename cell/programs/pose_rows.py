"""Every point of a program as a row: where the TCP is in the base and in the part, the axes, speed, arc, bead, line.

Use:

    header, rows = pose_rows(job, run)       # for a CSV; mm, degrees, mm/s, quaternions w x y z

A point of a move of axes has its TCP's pose as well, and a point of a line its axes, as the controller would have them.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from ik.chain import Floats

from ..arrays import Ints
from ..job.job import Job
from ..rigid import inverse
from ..scene.site_frames import T_flange_tcp, T_table_part
from ..units import METRES_PER_MM
from .cell_frames import tables_seen_from_base
from .orientation import pose_of
from .program import EventKind, MoveKind, Program
from .running.simulate import SimulatedProgram

KINDS = {MoveKind.AXES: "PTP", MoveKind.LINEAR: "LIN", MoveKind.CIRCULAR: "CIRC"}
POSE = ("X_mm", "Y_mm", "Z_mm", "A_deg", "B_deg", "C_deg", "qw", "qx", "qy", "qz")


def pose_rows(job: Job, run: SimulatedProgram) -> tuple[list[str], list[list[Any]]]:
    """The points of a program that is run.

    Args:
        job: names the cell.
        run: with its beads.

    Returns:
        Names of the columns, and a row for every move that the arm gets to the end of.
    """
    motion, moves = run.motion, run.program.moves
    last = np.flatnonzero(np.append(np.diff(run.move) != 0, True))
    move = run.move[last]
    in_base, in_part = _poses(job, run, last)
    axes = np.rad2deg(np.concatenate([motion.q[last], motion.table[last]], axis=1))
    names = [f"{name}_deg" for name in (*motion.names, "E1", "E2")]
    header = ["move", "file", "line", "kind", "t_s", *(f"base_{c}" for c in POSE), *(f"part_{c}" for c in POSE)]
    header += [
        *names,
        "speed_mm_s",
        "axis_speed_percent",
        "blend_mm",
        "arc",
        "bead",
        "layer",
        "sub_volume",
        "target",
        "wait_s",
    ]
    t = job.targets
    waits = _waits(run.program)
    beads, targets = motion.called
    rows = []
    for n, (row, k) in enumerate(zip(last.tolist(), move.tolist(), strict=True)):
        line, target = run.program.line_of(k), int(motion.target[row])
        arc = int(row > 0 and motion.arc[row] and motion.arc[row - 1])
        rows.append(
            [
                *(k, "" if line is None else line.file, "" if line is None else line.number),
                *(KINDS[MoveKind(int(moves.kind[k]))], f"{motion.t_s[row]:.4f}"),
                *_numbers(in_base[n]),
                *_numbers(in_part[n]),
                *(f"{a:.5f}" for a in axes[n]),
                *(_figure(moves.speed[k] / METRES_PER_MM), _figure(moves.axis_share[k] * 100)),
                *(_figure(moves.blend[k] / METRES_PER_MM), arc, int(beads[row]), int(motion.layer[row])),
                *(t.sub_volume[t.sub_volume_index[target]], int(targets[row]), f"{waits[k]:.4f}"),
            ]
        )
    return header, rows


def _waits(program: Program) -> Floats:
    """Seconds that the arm waits where every move ends, (m,); before the first move it waits nowhere."""
    out = np.zeros(len(program.moves))
    for event in program.events:
        if event.kind == EventKind.WAIT and event.before:
            out[event.before - 1] += event.seconds
    return out


def _poses(job: Job, run: SimulatedProgram, rows: Ints) -> tuple[Floats, Floats]:
    """The programmed TCP in the moves' bases, and the torch's in the part, (m, 4, 4) each."""
    scene, motion, moves = job.scene, run.motion, run.program.moves
    T_base_tcp = scene.chain.forward(motion.q[rows])
    table = tables_seen_from_base(scene, motion.table[rows])
    in_part = inverse(table @ T_table_part(scene)) @ T_base_tcp
    in_base = in_part.copy()  # where no base holds
    to_flange = inverse(T_flange_tcp(scene))
    for n, k in enumerate(run.move[rows].tolist()):
        if moves.base[k] < 0 or moves.tool[k] < 0:
            continue
        base, tool = run.program.bases[moves.base[k]], run.program.tools[moves.tool[k]]
        T = table[n] @ base.T if base.coupled else base.T
        in_base[n] = inverse(T) @ T_base_tcp[n] @ to_flange @ tool.T_flange_tcp
    return in_base, in_part


def _numbers(T: Floats) -> list[str]:
    """A pose's place, angles and quaternion."""
    row = pose_of(T)
    x, y, z, w = Rotation.from_matrix(T[:3, :3]).as_quat(canonical=True)
    place = [f"{v:.5f}" for v in row[:3] / METRES_PER_MM]
    return [*place, *(f"{a:.6f}" for a in np.rad2deg(row[3:])), *(f"{v:.9f}" for v in (w, x, y, z))]


def _figure(value: float) -> str:
    return f"{value:.4f}" if np.isfinite(value) else ""
