"""A checked motion as a program: what is thinned, compared, refused, and handed over beside it."""

from __future__ import annotations

import csv
import json
import re
import sys
import types
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from support.jobs.boss_motion import NEAR_HOME, boss_case, result_of
from support.programs.boss_program import boss_program

import cell.programs.export as export_module
from cell.case.read import with_changes
from cell.cli.main import main
from cell.motion.motion_file import write_motion
from cell.programs.cell_controller import cell_controller, frames_of
from cell.programs.export import export_program
from cell.programs.from_motion import PointThinning, _cut_beads, _farthest, _size_warnings, program_of_motion
from cell.programs.orientation import frames_of_poses
from cell.programs.pose_rows import pose_rows
from cell.programs.program import Event, EventKind, MoveKind, Program
from cell.programs.robodk_script import robodk_script
from cell.programs.round_trip import OFF, TURNED, compared, difference_of
from cell.programs.running.interpolation import angles_between
from cell.programs.running.simulate import run_program


def test_the_text_is_the_checked_motion() -> None:
    made = boss_program().made
    assert made.fault is None
    assert made.gap is not None
    assert made.gap.position < 2e-6
    assert made.gap.angle < np.deg2rad(0.001)
    assert made.result is not None
    assert made.result.feasible


def test_a_bead_is_lines_and_a_way_retracts_crosses_and_approaches() -> None:
    program = boss_program().made.written.program
    kinds = "".join("PLC"[k] for k in program.moves.kind)
    arc_on = [e.before for e in program.events if e.kind == EventKind.ARC_ON]
    arc_off = [e.before for e in program.events if e.kind == EventKind.ARC_OFF]
    for a, b in zip(arc_on, arc_off, strict=True):
        assert set(kinds[a:b]) == {"L"}
        # exact where the arc starts and ends, rounded between
        assert program.moves.blend[a - 1] == 0.0
        assert program.moves.blend[b - 1] == 0.0
        assert (program.moves.blend[a : b - 1] == 1e-3).all()
    for a, b in zip(arc_off[:-1], arc_on[1:], strict=True):
        assert kinds[a:b] == "LPL"
    assert kinds[0] == "P"
    assert np.isfinite(program.moves.external).all()


def test_the_farthest_row_that_fits_is_found() -> None:
    assert _farthest(lambda a, b: b - a <= 7, 3, 50) == 10
    assert _farthest(lambda a, b: False, 3, 50) == 4
    assert _farthest(lambda a, b: True, 3, 50) == 50


def test_a_bent_bead_keeps_what_the_chord_needs() -> None:
    boss = boss_program()
    program = boss.made.written
    rows = program.row
    p = boss.job.scene.chain.forward(boss.motion.q)[:, :3, 3]
    worst = 0.0
    for k in range(1, len(rows)):
        a, b = rows[k - 1], rows[k]
        if program.program.moves.kind[k] != MoveKind.LINEAR or b - a < 2:
            continue
        way = p[b] - p[a]
        f = np.clip((p[a + 1 : b] - p[a]) @ way / (way @ way), 0, 1)
        worst = max(worst, float(np.linalg.norm(p[a + 1 : b] - p[a] - f[:, None] * way, axis=1).max()))
    assert worst <= program.thinning.chord


def test_no_line_turns_the_tcp_so_far_that_it_may_go_the_other_way() -> None:
    boss = boss_program()
    frames = frames_of(boss.job, cell_controller(boss.job))
    thinning = PointThinning.of(boss.job.case)

    def most_turn(thinning: PointThinning) -> float:
        moves = program_of_motion(boss.job, boss.motion, frames, thinning).program.moves
        lines = np.flatnonzero((moves.kind[1:] == MoveKind.LINEAR) & (moves.kind[:-1] == MoveKind.LINEAR))
        R = frames_of_poses(moves.pose)[:, :3, :3]
        return float(np.rad2deg(angles_between(R[lines], R[lines + 1]).max()))

    assert 10 < most_turn(thinning) < np.rad2deg(thinning.turn) < 180
    assert most_turn(replace(thinning, turn=np.deg2rad(5.0))) <= 5.0 + 1e-9


def test_thinning_is_at_most_half_of_what_the_checks_allow() -> None:
    case = boss_program().job.case
    loose = case.controller.model_copy(
        update={"thinning": case.controller.thinning.model_copy(update={"chord_mm": 9.0})}
    )
    assert PointThinning.of(with_changes(case, controller=loose)).chord == pytest.approx(0.025e-3)


def test_dense_points_and_small_memories_are_told() -> None:
    boss = boss_program()
    tight = boss.job.case.controller.model_copy(update={"points_a_second": 0.2, "memory_mb": 0.1})
    job = replace(boss.job, case=with_changes(boss.job.case, controller=tight))
    frames = frames_of(job, cell_controller(job))
    # 29 points of 100 bytes are far from any memory, more than a thousand are not
    assert [line.code for line in program_of_motion(job, boss.motion, frames).warnings] == ["program_dense"]
    assert [line.code for line in _size_warnings(job.case, 1100, 0.1)] == ["program_memory"]
    assert not _size_warnings(job.case, 1000, 0.1)
    events = [Event(EventKind.ARC_ON, 3), Event(EventKind.ARC_OFF, 1004)]
    assert [line.code for line in _cut_beads(job.case, events)] == ["program_bead_cut"]
    assert not _cut_beads(job.case, [events[0], Event(EventKind.ARC_OFF, 1003)])
    assert not boss.made.written.warnings


def test_slow_stretches_are_written_slower() -> None:
    boss = boss_program()
    t = boss.motion.t_s.copy()
    weld = np.flatnonzero(boss.motion.arc == 1)
    row = int(weld[len(weld) // 2])
    target = boss.motion.target[row]
    same = np.flatnonzero((boss.motion.target[:-1] == target) & boss.motion.welding)
    dt = np.diff(t)
    dt[same] *= 2.0
    slow = replace(boss.motion, t_s=np.concatenate([[0.0], np.cumsum(dt)]))
    program = program_of_motion(boss.job, slow, frames_of(boss.job, cell_controller(boss.job))).program
    welding = program.moves.speed[np.isfinite(program.moves.speed) & (program.moves.speed < 0.02)]
    assert sorted(set(np.round(welding, 5))) == pytest.approx([0.004, 0.008], abs=3e-4)


def test_a_program_that_says_something_else_is_no_export(monkeypatch: pytest.MonkeyPatch) -> None:
    boss = boss_program()
    true = export_module.write_krl

    def wrong(program: Any, controller: Any) -> dict[str, str]:
        files = true(program, controller)
        name = "boss_L001.src"
        return files | {name: files[name].replace("Z 24.0000", "Z 24.2000", 1)}

    monkeypatch.setattr(export_module, "write_krl", wrong)
    made = export_program(boss.job, boss.motion)
    assert made.fault is not None
    assert made.fault.startswith("boss_L001.src:")
    assert "off the checked motion" in made.fault


def test_a_move_that_is_lost_is_no_export(monkeypatch: pytest.MonkeyPatch) -> None:
    boss = boss_program()
    true = export_module.write_krl

    def wrong(program: Any, controller: Any) -> dict[str, str]:
        files = true(program, controller)
        return files | {"boss.src": files["boss.src"].replace("boss_L001 ( )\r\n", "")}

    monkeypatch.setattr(export_module, "write_krl", wrong)
    made = export_program(boss.job, boss.motion)
    assert made.fault is not None
    assert "moves were read back" in made.fault
    assert made.result is None


def test_two_programs_differ_where_one_number_does() -> None:
    program = boss_program().made.written.program
    assert difference_of(program, program) is None
    for name, by in (("speed", 1e-4), ("blend", 1e-4), ("external", 1e-4)):
        column = getattr(program.moves, name).copy()
        column[7] += by
        found = difference_of(program, replace(program, moves=replace(program.moves, **{name: column})))
        assert found is not None
        assert found[0] == 7
        assert name in found[1]
    assert difference_of(program, replace(program, events=program.events[:-2])) is not None
    k = next(k for k, event in enumerate(program.events) if event.kind is EventKind.ARC_ON)
    for change in ({"before": program.events[k].before + 1}, {"kind": EventKind.ARC_OFF}):
        events = list(program.events)
        events[k] = replace(events[k], **change)
        found = difference_of(program, replace(program, events=tuple(events)))
        assert found is not None
        assert found[0] == program.events[k].before


def test_the_limits_of_the_comparison_are_those_that_are_promised() -> None:
    assert (0.05e-3, pytest.approx(np.deg2rad(0.05))) == (OFF, TURNED)
    boss = boss_program()
    assert boss.made.result is not None
    for column, by, allowed in ((1, 60e-6, False), (1, 20e-6, True), (3, np.deg2rad(0.09), False)):
        pose = boss.made.result.program.moves.pose.copy()
        linear = np.flatnonzero(np.isfinite(pose[:, 0]))
        pose[linear[5], column] += by + (boss.made.written.thinning.chord if column == 1 and not allowed else 0)
        program = boss.made.result.program
        run = run_program(replace(program, moves=replace(program.moves, pose=pose)), boss.job)
        gap = compared(boss.job, boss.motion, boss.made.written, run)
        assert (gap.share(boss.made.written.thinning) <= 1) == allowed


def test_between_two_rows_of_a_program_the_tcp_goes_on_a_curve() -> None:
    boss = boss_program()
    # all axes turn a degree from row to row; the motion's own rows stand half-way between them
    turn = np.array([1.0, -0.4, 0.9, 1.0, -0.8, 1.0, 0.5, 1.0])
    start = np.concatenate([boss.motion.q[0], boss.motion.table[0]])
    of_run, own = (start + np.deg2rad(t)[:, None] * turn for t in (np.arange(21.0), np.arange(-0.5, 20.0)[1:]))
    own = np.concatenate([start[None], own, of_run[-1:]])

    def motion(axes: Any) -> Any:
        return replace(boss.motion, t_s=np.arange(float(len(axes))), q=axes[:, :-2], table=axes[:, -2:])

    program = SimpleNamespace(moves=SimpleNamespace(kind=np.full(2, MoveKind.AXES)))
    written: Any = SimpleNamespace(
        row=np.array([0, len(own) - 1]), thinning=boss.made.written.thinning, program=program
    )
    run: Any = SimpleNamespace(motion=motion(of_run), move=np.minimum(np.arange(21), 1))
    p = boss.job.scene.chain.forward(of_run[:, :-2])[:, :3, 3]
    middle = boss.job.scene.chain.forward((of_run[1:] + of_run[:-1])[:, :-2] / 2)[:, :3, 3]
    # the chord alone would be called another motion
    assert np.linalg.norm(middle - (p[1:] + p[:-1]) / 2, axis=1).max() > OFF
    gap = compared(boss.job, motion(own), written, run)
    assert gap.position < 1e-8
    assert gap.angle < 1e-8
    # a torch that is turned between the rows is found to be, by as much
    tilted = own.copy()
    tilted[1:-1, 5] += np.deg2rad(0.3)
    gap = compared(boss.job, motion(tilted), written, run)
    assert gap.angle == pytest.approx(np.deg2rad(0.3), rel=0.05)


def test_every_point_is_handed_over_in_the_base_and_in_the_part() -> None:
    boss = boss_program()
    assert boss.made.result is not None
    header, rows = pose_rows(boss.job, boss.made.result.run)
    moves = boss.made.result.program.moves
    assert len(rows) == len(moves)
    table = [dict(zip(header, row, strict=True)) for row in rows]
    for k, row in enumerate(table):
        assert row["kind"] == "PL"[moves.kind[k]] + ("TP" if moves.kind[k] == 0 else "IN")
        assert row["line"] == moves.line[k]
        T = {}
        for frame in ("base", "part"):
            numbers = [float(row[f"{frame}_{c}"]) for c in ("X_mm", "Y_mm", "Z_mm", "A_deg", "B_deg", "C_deg")]
            T[frame] = frames_of_poses(np.array([*(np.array(numbers[:3]) / 1e3), *np.deg2rad(numbers[3:])]))
            w, x, y, z = (float(row[f"{frame}_{c}"]) for c in ("qw", "qx", "qy", "qz"))
            assert w >= 0
            # the first column of a quaternion's rotation
            first = [1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)]
            assert np.allclose(T[frame][:3, 0], first, atol=1e-6)
        if moves.kind[k] == MoveKind.LINEAR:
            assert np.allclose(T["base"][:3, 3], moves.pose[k, :3], atol=1e-7)
        # the base is the part's own frame in this case
        assert np.allclose(T["base"], T["part"], atol=1e-6)
    assert [row["arc"] for row in table].count(1) == sum(1 for row in table if row["speed_mm_s"] == "8.0000")


class Station:
    """Stands for a RoboDK station: notes every call, and hands out items that do."""

    def __init__(self, calls: list[tuple[Any, ...]], name: str = "station") -> None:
        self.calls, self.name = calls, name

    def __getattr__(self, method: str) -> Any:
        def call(*args: Any) -> Station:
            item = Station(self.calls, f"{method} {args[0] if args else ''}".strip())
            self.calls.append((self.name, method, args, item))
            return item

        return call


def built_in_robodk(program: Program) -> list[tuple[Any, ...]]:
    """The calls that the script of a program makes: of what, which, with what, and what came of it."""
    robomath = pytest.importorskip("robodk.robomath")
    calls: list[tuple[Any, ...]] = []
    link = types.ModuleType("robolink")
    for n, name in enumerate(("ITEM_TYPE_ROBOT", "ITEM_TYPE_FRAME", "INSTRUCTION_CALL_PROGRAM", "INSTRUCTION_COMMENT")):
        setattr(link, name, n)
    package = types.ModuleType("robodk")
    package.robolink, package.robomath = link, robomath  # type: ignore[attr-defined]
    before = {name: sys.modules.get(name) for name in ("robodk",)}
    sys.modules["robodk"] = package
    try:
        space: dict[str, Any] = {"__name__": "script"}
        exec(compile(robodk_script(program, "BOSS"), "boss.py", "exec"), space)
        space["build"](Station(calls))
    finally:
        for name, module in before.items():
            if module is None:
                del sys.modules[name]
            else:
                sys.modules[name] = module
    return calls


def test_the_robodk_script_makes_every_target_with_its_external_axes() -> None:
    program = boss_program().made.written.program
    calls = built_in_robodk(program)
    moves = program.moves
    made = [(method, args) for _, method, args, _ in calls]
    assert [m[4] for m, _ in made if m in ("MoveJ", "MoveL")] == ["JL"[k] for k in moves.kind]
    poses = [args[0] for name, method, args, _ in calls if method == "setPose" and name.startswith("AddTarget")]
    linear = np.flatnonzero(moves.kind == MoveKind.LINEAR)
    assert len(poses) == len(linear)
    for pose, k in zip(poses, linear, strict=True):
        T = frames_of_poses(moves.pose[k])
        T[:3, 3] *= 1e3
        assert np.allclose(np.array(pose.Rows()), T, atol=1e-4)
    joints = [args[0] for method, args in made if method == "setJoints"]
    assert len(joints) == len(moves)
    for k, values in enumerate(joints):
        assert values[6:] == pytest.approx(np.rad2deg(moves.external[k]), abs=1e-5)
        if moves.kind[k] == MoveKind.AXES:
            assert values[:6] == pytest.approx(np.rad2deg(moves.joints[k]), abs=1e-5)
    speeds = [args[0] for method, args in made if method == "setSpeed"]
    assert 8.0 in speeds
    called = [args[0] for method, args in made if method == "RunInstruction" and args[1] == 2]
    assert called == ["ARC_ON", "ARC_OFF"] * 3
    table = [args for name, method, args, item in calls if method == "AddFrame"]
    assert table[0][1].name.startswith("Item Table")


def test_a_base_that_no_table_moves_stands_in_the_arms_base_in_robodk() -> None:
    program = boss_program().made.written.program
    still = replace(program, bases=tuple(replace(base, coupled=False) for base in program.bases))
    calls = built_in_robodk(still)
    parents = {args[1].name for _, method, args, _ in calls if method == "AddFrame"}
    parents |= {args[1].name for _, method, args, _ in calls if method == "AddTarget" and "Frame" not in args[1].name}
    assert parents == {"Parent"}  # of the arm: the station's own frame may be anywhere
    assert [name for name, method, _, _ in calls if method == "Parent"] == ["Item"]


def test_the_points_say_how_long_the_arm_waits_at_them(tmp_path: Path) -> None:
    process = {"arc_on_s": 0.5, "arc_off_s": 0.25, "dwell_s": 2.0}
    result = result_of(boss_case(tmp_path, process=process, roll={"fixed_deg": 20.0}, robot=NEAR_HOME))
    assert result.motion is not None
    made = export_program(result.job, result.motion)
    assert made.result is not None
    header, rows = pose_rows(result.job, made.result.run)
    arc, waits = (np.array([float(row[header.index(name)]) for row in rows]) for name in ("arc", "wait_s"))
    burns = np.append(arc[1:], 0.0)  # on the way from the point
    assert (waits[(arc == 0) & (burns == 1)] == 0.5).all()
    assert (waits[(arc == 1) & (burns == 0)] == 0.25).all()
    assert not waits[(arc == 1) & (burns == 1)].any()
    assert sorted(waits[(arc == 0) & (burns == 0)])[-2:] == [2.0, 2.0]  # between three layers
    assert waits.sum() == pytest.approx(3 * 0.75 + 2 * 2.0)


def test_percents_are_written_as_the_controller_holds_them(tmp_path: Path) -> None:
    percents = {"axis_speed_percent": 12.7, "axis_acceleration_percent": 0.4, "external_speed_percent": 33.9}
    result = result_of(boss_case(tmp_path, controller=percents, roll={"fixed_deg": 20.0}, robot=NEAR_HOME))
    assert result.motion is not None
    made = export_program(result.job, result.motion)
    assert made.fault is None
    text = "".join(made.files.values())
    for name, most in (("VEL_AXIS", 12), ("ACC_AXIS", 1), ("VEL_EXTAX", 33)):
        given = {float(value) for value in re.findall(rf"^\${name}\[\d\] = (\S+)", text, re.MULTILINE)}
        assert max(given) == most
        assert all(value.is_integer() and value > 0 for value in given)


def test_the_command_writes_everything_or_nothing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    case = boss_case(tmp_path, roll={"fixed_deg": 20.0}, robot=NEAR_HOME, controller={"program": "KNOB"})
    out, points, script = tmp_path / "krl", tmp_path / "points.csv", tmp_path / "station.py"
    assert main(["export", str(case), "--krl", str(out), "--csv", str(points), "--robodk", str(script)]) == 0
    names = sorted(path.name for path in out.iterdir())
    assert names == ["KNOB.json", "KNOB.src", "KNOB_L000.src", "KNOB_L001.src", "KNOB_L002.src"]
    document = json.loads((out / "KNOB.json").read_text())
    assert document["schema"] == "rbam-program/1"
    assert document["verdict"] == "feasible"
    assert [one["name"] for one in document["files"]] == [name for name in names if name.endswith(".src")]
    for bead in document["beads"]:
        text = (out / bead["file"]).read_text().splitlines()
        assert text[bead["line"] - 1].startswith("LIN")
        assert len(bead["target_lines"]) == bead["to_target"] - bead["target"] + 1
        assert text[bead["to_line"]].startswith("ARC_OFF")
    assert document["deviation"]["position_mm"] < 0.002
    with points.open() as file:
        assert len(list(csv.DictReader(file))) == sum(one["points"] for one in document["files"])
    assert "read back, run and checked: feasible" in capsys.readouterr().out
    assert main(["check", str(case), "--program", str(out / "KNOB.src"), "--json", str(tmp_path / "r.json")]) == 0
    report = json.loads((tmp_path / "r.json").read_text())
    assert report["schema"] == "rbam-motion-report/1"
    assert report["program"]["points"] == document["points"]["ptp"] + document["points"]["lin"]


def test_a_motion_from_a_file_is_written_as_it_is(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    boss = boss_program()
    case = boss_case(tmp_path, roll={"fixed_deg": 20.0}, robot=NEAR_HOME)
    write_motion(tmp_path / "boss.npz", boss.motion)
    out = tmp_path / "krl"
    out.mkdir()
    (out / "boss_L007.src").write_text("DEF boss_L007 ( )\nEND\n")
    assert main(["export", str(case), "--motion-in", str(tmp_path / "boss.npz"), "--krl", str(out)]) == 0
    assert "left over from another program of this name, and not called: boss_L007.src" in capsys.readouterr().out
    for name, text in boss.made.files.items():
        assert (out / name).read_bytes() == text.encode()
    late = replace(boss.motion, q=boss.motion.q + 0.02 * np.eye(6)[0])
    write_motion(tmp_path / "off.npz", late)
    assert main(["export", str(case), "--motion-in", str(tmp_path / "off.npz"), "--krl", str(tmp_path / "no")]) == 1
    assert not (tmp_path / "no").exists()
    assert "off.npz: infeasible: no program is written; rbam check --motion-in says why" in capsys.readouterr().err


def test_an_infeasible_case_leaves_nothing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    case = boss_case(tmp_path, roll={"fixed_deg": 20.0}, robot=NEAR_HOME, checks={"clearance_mm": 200})
    out = tmp_path / "krl"
    assert main(["export", str(case), "--krl", str(out)]) == 1
    assert not out.exists()
    assert "no program is written" in capsys.readouterr().err


def test_a_program_that_does_not_hold_leaves_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    # corners rounded further than they were checked
    case = boss_case(tmp_path, roll={"fixed_deg": 20.0}, robot=NEAR_HOME, controller={"blend_mm": 5})
    out, points = tmp_path / "krl", tmp_path / "p.csv"
    assert main(["export", str(case), "--krl", str(out), "--csv", str(points)]) == 1
    assert not out.exists()
    assert not points.exists()
    assert "no program: boss_L000.src:" in capsys.readouterr().err


def test_what_is_to_be_written_has_to_be_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    case = boss_case(tmp_path)
    assert main(["export", str(case)]) == 2
    assert "give --krl DIR, --csv F.csv or --robodk F.py" in capsys.readouterr().err
    assert main(["export", str(case), "--krl", str(case)]) == 2
    assert "is not a folder" in capsys.readouterr().err
    assert main(["export", str(case), "--csv", str(tmp_path / "boss.stl")]) == 2
    assert "is read by this run" in capsys.readouterr().err
    assert main(["check", str(case), "--program", "a.src", "--motion-in", "b.csv"]) == 2
    assert "does not go with --motion-in" in capsys.readouterr().err


def test_a_program_of_numbers_reads_back_by_the_same_numbers(tmp_path: Path) -> None:
    case = boss_case(
        tmp_path, roll={"fixed_deg": 20.0}, robot=NEAR_HOME, controller={"program": "KNOB", "tool": 3, "base": 7}
    )
    out = tmp_path / "krl"
    assert main(["export", str(case), "--krl", str(out)]) == 0
    document = json.loads((out / "KNOB.json").read_text())
    assert (document["tool"]["number"], document["base"]["number"]) == (3, 7)
    assert "TOOL_DATA[3]" in (out / "KNOB_L000.src").read_text()
    told = [line for line in document["warnings"] if "must have the same" in line]
    assert [line.split(" is taken to be ")[0].split(": ")[1] for line in told] == [
        "TOOL_DATA[3]",
        "BASE_DATA[7]",
        "MACHINE_DEF[2].ROOT, seen from $ROBROOT,",
    ]
    assert "X 1500.000, Y 0.000, Z 0.000, A -90.000, B 0.000, C 0.000 (mm, deg)" in told[2]
