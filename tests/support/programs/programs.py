"""Random robot programs, controllers, and programs written to folders."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from hypothesis import strategies as st

from cell.case.read import parse_case
from cell.programs.controller import Controller, controller_of
from cell.programs.orientation import frames_of_poses
from cell.programs.program import BaseFrame, Event, EventKind, MoveKind, Moves, Program, ToolFrame

FRAMES = "$TOOL={X 0,Y 0,Z 100,A 0,B 0,C 0}\n$BASE=$NULLFRAME\n"
LIN = "LIN {X 100,Y 0,Z 50,A 0,B 90,C 0,E1 0,E2 0}\n"


def controller(name: str = "random", **section: Any) -> Controller:
    """The controller of a case that says nothing else; ``section`` is the case's controller section."""
    part = {"sub_volumes": ["a.stl"], "body": {"radius_mm": 20}}
    return controller_of(parse_case({"name": name, "part": part, "controller": section}))


def written(folder: Path, files: dict[str, str]) -> Path:
    """Write a program's files; the path of the first."""
    for name, text in files.items():
        (folder / name).write_bytes(text.encode("ascii"))
    return folder / next(iter(files))


def module(folder: Path, body: str, name: str = "T") -> Path:
    """Write one module around statements; line 1 is DEF."""
    path = folder / f"{name}.src"
    path.write_text(f"DEF {name} ( )\n{body}END\n", encoding="utf-8")
    return path


@st.composite
def programs(draw: st.DrawFn) -> Program:
    """Programs with all kinds of moves, frames, speeds, blends and events."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    n = draw(st.integers(1, 40))
    moves = Moves.empty(n)
    kind = rng.choice([int(MoveKind.AXES), int(MoveKind.LINEAR), int(MoveKind.LINEAR), int(MoveKind.CIRCULAR)], n)
    kind[0] = int(MoveKind.AXES)
    to_pose = (kind == MoveKind.AXES) & (rng.random(n) < 0.3)
    to_pose[0] = False
    cartesian = (kind != MoveKind.AXES) | to_pose
    pose = np.concatenate((rng.uniform(-2, 2, (n, 3)), rng.uniform(-np.pi, np.pi, (n, 3))), axis=1)
    pose[:, 4] = np.where(rng.random(n) < 0.2, rng.choice([-np.pi / 2, np.pi / 2], n), pose[:, 4])
    via = np.concatenate((rng.uniform(-2, 2, (n, 3)), rng.uniform(-np.pi, np.pi, (n, 3))), axis=1)
    circular = (kind == MoveKind.CIRCULAR)[:, None]
    coupled = [BaseFrame(frames_of_poses(rng.uniform(-1, 1, 6)), coupled=True, machine=2)]
    bases = (*coupled, BaseFrame(frames_of_poses(rng.uniform(-1, 1, 6)), coupled=False))
    tools = tuple(ToolFrame(frames_of_poses(rng.uniform(-1, 1, 6))) for _ in range(2))
    blended = rng.random(n) < draw(st.sampled_from([0.0, 0.5, 1.0]))
    by_speed = rng.random(n) < 0.2
    events = _events(rng, n)
    for event in events:
        if event.before:
            blended[event.before - 1] = False
    moves = replace(
        moves,
        kind=kind,
        joints=np.where((~cartesian)[:, None], rng.uniform(-3, 3, (n, 6)), np.nan),
        pose=np.where(cartesian[:, None], pose, np.nan),
        via=np.where(circular, via, np.nan),
        arc_angle=np.where(circular[:, 0] & (rng.random(n) < 0.5), rng.uniform(-6, 6, n), np.nan),
        external=rng.uniform(-10, 10, (n, 2)),
        status=np.where(to_pose, rng.integers(0, 8, n), -1),
        turn=np.where(to_pose, rng.integers(0, 64, n), -1),
        tool=np.where(cartesian, rng.integers(0, 2, n), -1),
        base=np.where(cartesian, rng.integers(0, 2, n), -1),
        speed=np.where(kind == MoveKind.AXES, np.nan, rng.choice([0.008, 0.1, 1.23456], n)),
        turn_speed=np.full(n, np.radians(200)),
        acceleration=rng.choice([1.0, 2.3], n),
        axis_share=rng.choice([0.3, 1.0], n),
        axis_acceleration=np.full(n, 0.5),
        external_share=np.full(n, 1.0),
        blend=np.where(blended & ~by_speed, rng.choice([0.001, 0.0125], n), 0.0),
        blend_share=np.where(blended & (by_speed | (kind == MoveKind.AXES)), rng.choice([0.3, 1.0], n), 0.0),
    )
    return Program("RANDOM", moves, events, tools, bases)


def _events(rng: np.random.Generator, n: int) -> tuple[Event, ...]:
    """Arcs on and off in turn, waits, and layers one behind the other."""
    places = sorted(rng.integers(0, n + 1, rng.integers(0, 8)).tolist())
    found, arc, layer, found_end = [], False, -1, False
    for place in places:
        choice = rng.integers(0, 3)
        if choice == 0:
            arc = not arc
            fields = {"bead": float(rng.integers(0, 99)), "layer": 2.0, "target": 7.0, "sub_volume": "SV1"}
            found.append(Event(EventKind.ARC_ON if arc else EventKind.ARC_OFF, place, fields=fields))
        elif choice == 1:
            found.append(Event(EventKind.WAIT, place, seconds=float(rng.choice([0.0, 0.5, 12.25]))))
        else:
            fields = {"layer": float(max(layer, 0)), "sub_volume": "SV1"}
            if layer < 0 or found_end:
                layer, found_end = layer + 1, False
                fields = {"layer": float(layer), "sub_volume": "SV1"}
                found.append(Event(EventKind.LAYER_START, place, fields=fields))
            else:
                found_end = True
                found.append(Event(EventKind.LAYER_END, place, fields=fields))
    return tuple(found)
