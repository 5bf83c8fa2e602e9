"""A program as a script for RoboDK's own API: any brand's post-processor can make a program of it there.

Use:

    text = robodk_script(program, "BLADE")    # F.py, to be run in a station with the arm and its table

The script makes a tool, a frame on the table, a target for every point, with the table's axes, and a program that
moves through them with the speeds, roundings, waits and events. Names that the station has to have stand at its top.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ik.chain import Floats

from ..units import METRES_PER_MM
from .orientation import pose_of
from .program import Event, EventKind, MoveKind, Program

MOVES = {MoveKind.AXES: "J", MoveKind.LINEAR: "L", MoveKind.CIRCULAR: "C"}

HEADER = '''"""{name}: written by rbam-cell for RoboDK.

Run it in a station that has the arm (with its table's axes synchronised as E1, E2) and a frame that moves with the
table's flange. Lengths in mm, angles in degrees, poses as KUKA's X Y Z A B C.
"""

from robodk import robolink, robomath

ROBOT = ""  # name of the arm in the station; empty: the only one, or asked for
TABLE = "{table}"  # name of the frame that moves with the table's flange; empty: the arm's base
ARC_ON, ARC_OFF = "ARC_ON", "ARC_OFF"  # programs that are called where the arc goes on and off

'''

MAIN = '''

def build(station):
    """Make the tool, the frames, the targets and the program."""
    robot = station.Item(ROBOT, robolink.ITEM_TYPE_ROBOT)
    still = robot.Parent()  # the arm's base frame
    table = station.Item(TABLE, robolink.ITEM_TYPE_FRAME) if TABLE else still
    tools = [robot.AddTool(robomath.KUKA_2_Pose(pose), name) for name, pose in TOOLS]
    bases = []
    for name, pose, coupled in BASES:
        frame = station.AddFrame(name, table if coupled else still)
        frame.setPose(robomath.KUKA_2_Pose(pose))
        bases.append(frame)
    program = station.AddProgram(NAME, robot)
    program.ShowInstructions(False)
    now = {}

    def change(key, value, how):
        if value is not None and now.get(key) != value:
            now[key] = value
            how(value)

    targets = []
    for step in STEPS:
        if step[0] == "event":
            if step[1] == "wait":
                program.Pause(1000 * step[2])
            elif step[1] in ("arc_on", "arc_off"):
                program.RunInstruction(ARC_ON if step[1] == "arc_on" else ARC_OFF, robolink.INSTRUCTION_CALL_PROGRAM)
            else:
                program.RunInstruction(step[2], robolink.INSTRUCTION_COMMENT)
            continue
        number, kind, tool, base, pose, via, joints, external, speed, share, rounding = step
        change("tool", tool, lambda k: program.setPoseTool(tools[k]))
        change("base", base, lambda k: program.setPoseFrame(bases[k]))
        change("speed", speed, program.setSpeed)
        change("share", share, lambda s: program.setSpeedJoints(s * JOINT_SPEED))
        change("rounding", rounding if rounding > 0 else -1, program.setRounding)
        frame = still if base is None else bases[base]
        made = []
        for name, at in (("V%i" % number, via), ("P%i" % number, pose)):
            if at is None:
                continue
            target = station.AddTarget(name, frame, robot)
            target.setAsCartesianTarget()
            target.setJoints([0.0] * AXES + external)
            target.setPose(robomath.KUKA_2_Pose(at))
            made.append(target)
        if joints is not None:
            target = station.AddTarget("P%i" % number, frame, robot)
            target.setAsJointTarget()
            target.setJoints(joints + external)
            made.append(target)
        getattr(program, "Move" + kind)(*made)
        targets += made
    return program, targets


if __name__ == "__main__":
    build(robolink.Robolink())
'''


def robodk_script(program: Program, name: str, table: str = "Table", joint_speed_deg_s: float = 100.0) -> str:
    """Write the script.

    Args:
        program: the program.
        name: of it in the station.
        table: name of the frame on the table's flange in the station.
        joint_speed_deg_s: full speed of the axes, of which moves of axes take their share.

    Returns:
        The text; ASCII.
    """
    moves = program.moves
    lines = [HEADER.format(name=name, table=table if any(b.coupled for b in program.bases) else "")]
    lines.append(f"NAME = {name!r}\nAXES = {moves.joints.shape[1]}\nJOINT_SPEED = {joint_speed_deg_s!r}  # deg/s")
    lines.append(
        f"TOOLS = {[(t.name or f'tool {k}', _pose(pose_of(t.T_flange_tcp))) for k, t in enumerate(program.tools)]!r}"
    )
    lines.append(
        f"BASES = {[(b.name or f'base {k}', _pose(pose_of(b.T)), b.coupled) for k, b in enumerate(program.bases)]!r}"
    )
    lines.append(
        "# (number, kind, tool, base, pose, auxiliary pose, axes, [E1, E2], mm/s, axes' share of speed, rounding in mm)"
    )
    lines.append("STEPS = [")
    lines += [f"    {step!r}," for step in _steps(program)]
    lines.append("]")
    return "\n".join(lines) + MAIN


def _steps(program: Program) -> Iterator[tuple[object, ...]]:
    """Moves and events in their order."""
    moves, events, n = program.moves, list(program.events), 0
    there = moves.table_axes
    for k in range(len(moves) + 1):
        while n < len(events) and events[n].before <= k:
            yield _event(events[n])
            n += 1
        if k == len(moves):
            return
        to_pose = bool(np.isfinite(moves.pose[k, 0]))
        external = np.rad2deg(np.nan_to_num(moves.external[k, there]))
        yield (
            k,
            MOVES[MoveKind(int(moves.kind[k]))],
            _index(moves.tool[k]) if to_pose else None,
            _index(moves.base[k]) if to_pose else None,
            _pose(moves.pose[k]) if to_pose else None,
            _pose(np.nan_to_num(moves.via[k])) if np.isfinite(moves.via[k, 0]) else None,
            None if to_pose else [round(float(a), 6) for a in np.rad2deg(moves.joints[k])],
            [round(float(a), 6) for a in external],
            round(float(moves.speed[k]) / METRES_PER_MM, 4) if np.isfinite(moves.speed[k]) else None,
            round(float(moves.axis_share[k]), 4) if np.isfinite(moves.axis_share[k]) else None,
            round(float(moves.blend[k]) / METRES_PER_MM, 4),
        )


def _event(event: Event) -> tuple[object, ...]:
    if event.kind == EventKind.WAIT:
        return ("event", "wait", round(event.seconds, 4))
    fields = " ".join(f"{key} {value}" for key, value in event.fields.items())
    return ("event", event.kind.value, f"{event.kind.value.replace('_', ' ')} {fields}".strip())


def _index(value: int) -> int | None:
    return int(value) if value >= 0 else None


def _pose(row: Floats) -> list[float]:
    """X Y Z A B C in mm and degrees."""
    return [*(round(float(v) / METRES_PER_MM, 5) for v in row[:3]), *(round(float(np.rad2deg(a)), 6) for a in row[3:])]
