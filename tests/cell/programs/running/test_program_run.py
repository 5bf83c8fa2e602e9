"""A program as it is run: poses against MuJoCo alone, the table, circles, configurations, times."""

from __future__ import annotations

import re
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import mujoco
import numpy as np
import pytest
from support.programs.boss_program import LAYER, boss_program

from cell.errors import InputError
from cell.failure import Kind
from cell.programs.cell_controller import cell_controller
from cell.programs.cell_frames import tables_seen_from_base
from cell.programs.export import export_program
from cell.programs.krl_read import read_krl
from cell.programs.program import Event, EventKind, MoveKind
from cell.programs.program_check import check_program
from cell.programs.running.configuration_tracking import ConfigurationTracker
from cell.programs.running.interpolation import Circles, on_lines
from cell.programs.running.program_path import OFF, TURNED, interpolate_program
from cell.programs.running.simulate import SimulatedProgram, run_program
from cell.rigid import inverse


def rotation(a: float, b: float, c: float) -> np.ndarray:
    """KUKA's A, B, C, rad, by hand."""
    ca, sa, cb, sb, cc, sc = np.cos(a), np.sin(a), np.cos(b), np.sin(b), np.cos(c), np.sin(c)
    z = np.array([[ca, -sa, 0], [sa, ca, 0], [0, 0, 1]])
    y = np.array([[cb, 0, sb], [0, 1, 0], [-sb, 0, cb]])
    return z @ y @ np.array([[1, 0, 0], [0, cc, -sc], [0, sc, cc]])


def in_mujoco(q: np.ndarray, table: np.ndarray, site: str) -> tuple[np.ndarray, np.ndarray]:
    """Place and orientation of a site in the world, by MuJoCo's kinematics and nothing else."""
    scene = boss_program().job.scene
    data = mujoco.MjData(scene.model)
    data.qpos[scene.arm_qpos], data.qpos[scene.table_qpos] = q, table
    mujoco.mj_kinematics(scene.model, data)
    return data.site_xpos[scene.sites[site]].copy(), data.site_xmat[scene.sites[site]].reshape(3, 3).copy()


def test_the_run_hits_the_programs_own_poses_in_mujoco(tmp_path: Path) -> None:
    result = boss_program().read(tmp_path)
    run, moves = result.run, result.program.moves
    last = np.flatnonzero(np.append(np.diff(run.move) != 0, True))
    base = result.program.bases[0]
    seen = 0
    for row in last:
        k = run.move[row]
        if moves.kind[k] == MoveKind.AXES:
            assert np.abs(run.motion.q[row] - moves.joints[k]).max() < 1e-9
            continue
        place, R = in_mujoco(run.motion.q[row], run.motion.table[row], "table")
        x = place + R @ (base.T[:3, 3] + base.T[:3, :3] @ moves.pose[k, :3])
        wanted = R @ base.T[:3, :3] @ rotation(*moves.pose[k, 3:])
        tcp, is_ = in_mujoco(run.motion.q[row], run.motion.table[row], "tcp")
        assert np.abs(tcp - x).max() < 1e-6
        assert np.abs(is_ - wanted).max() < 1e-6
        seen += 1
    assert seen == 24


def test_the_tcp_runs_on_the_line_in_the_base_while_the_table_turns() -> None:
    # each point a little further about E1 and E2: the arm has to follow the table
    boss = boss_program()
    program = boss.made.written.program
    turn = np.linspace(0, np.deg2rad(8.0), len(program.moves))[:, None] * [1.0, -1.0]
    # from the last point before the first bead on: the home is left from where it is
    start = np.flatnonzero(program.moves.kind == MoveKind.LINEAR)[0]
    external = program.moves.external + np.where(np.arange(len(turn))[:, None] > start, turn, turn[start])
    moved = replace(program, moves=replace(program.moves, external=external))
    path = interpolate_program(moved, boss.job)
    k = int(np.flatnonzero((moved.moves.kind[1:] == 1) & (moved.moves.kind[:-1] == 1))[2]) + 1
    rows = np.flatnonzero(path.move == k)
    start_pose, end_pose = moved.moves.pose[k - 1], moved.moves.pose[k]
    base, checked = moved.bases[0], 0
    rows = np.append(rows[0] - 1, rows)
    for a, b in pairwise(rows):
        for share in (0.25, 0.5, 1.0):
            axes = path.axes[a] + share * (path.axes[b] - path.axes[a])
            place, R = in_mujoco(axes[:6], axes[6:], "table")
            tcp, _ = in_mujoco(axes[:6], axes[6:], "tcp")
            in_base = base.T[:3, :3].T @ (R.T @ (tcp - place) - base.T[:3, 3])
            way = end_pose[:3] - start_pose[:3]
            f = (in_base - start_pose[:3]) @ way / (way @ way)
            assert np.linalg.norm(in_base - start_pose[:3] - f * way) < 2 * OFF
            # E1 and E2 are where the way is
            expected = external[k - 1] + f * (external[k] - external[k - 1])
            assert np.abs(axes[6:] - expected).max() < np.deg2rad(0.02)
            checked += 1
    assert checked > 6
    assert np.deg2rad(0.01) > TURNED


def test_an_orientation_turns_about_one_axis_by_the_shorter_way() -> None:
    rng = np.random.default_rng(3)
    for _ in range(50):
        a, b = (rotation(*rng.uniform(-3, 3, 3)) for _ in range(2))
        T = np.tile(np.eye(4), (2, 1, 1))
        T[0, :3, :3], T[1, :3, :3] = a, b
        R = on_lines(T[:1], T[1:], np.array([0.3]))[0, :3, :3]
        whole, part = (np.arccos(np.clip((np.trace(a.T @ M) - 1) / 2, -1, 1)) for M in (b, R))
        assert part == pytest.approx(0.3 * whole, abs=1e-6)
        axis = [M - M.T for M in (a.T @ b, a.T @ R)]
        assert np.allclose(axis[0] / np.linalg.norm(axis[0]), axis[1] / np.linalg.norm(axis[1]), atol=1e-6)


def test_a_circle_passes_its_auxiliary_point_and_is_as_long_as_it_is() -> None:
    rng = np.random.default_rng(4)
    for _ in range(50):
        centre, R = rng.normal(size=3), rotation(*rng.uniform(-3, 3, 3))
        radius, angle = rng.uniform(0.1, 2), rng.uniform(0.2, 6.0)
        via = rng.uniform(0.1, 0.9)

        def at(f: float, centre=centre, R=R, radius=radius, angle=angle) -> np.ndarray:
            return centre + R @ (radius * np.array([np.cos(f * angle), np.sin(f * angle), 0.0]))

        arc = Circles.through(at(0.0)[None], at(via)[None], at(1.0)[None])
        assert arc.length[0] == pytest.approx(radius * angle, rel=1e-6)
        for f in (0.0, 0.3, via, 1.0):
            assert np.allclose(arc.at(np.array([f]))[0], at(f), atol=1e-7)


def test_three_points_in_a_line_are_a_line() -> None:
    p = np.array([[0.0, 0, 0]]), np.array([[1.0, 0, 0]]), np.array([[2.0, 0, 0]])
    arc = Circles.through(*p)
    assert arc.length[0] == 2.0
    assert np.allclose(arc.at(np.array([0.25])), [[0.5, 0, 0]])


def test_a_wait_takes_its_time_and_the_arm_stands() -> None:
    boss = boss_program()
    program = boss.made.written.program
    plain = run_program(program, boss.job)
    first = next(e for e in program.events if e.kind == EventKind.ARC_ON)
    at = program.events.index(first) + 1
    events = (*program.events[:at], Event(EventKind.WAIT, first.before, 1.5), *program.events[at:])
    longer = run_program(replace(program, events=events), boss.job)
    assert np.ptp(longer.motion.t_s) - np.ptp(plain.motion.t_s) == pytest.approx(1.5, abs=1e-6)
    assert longer.motion.arc_time - plain.motion.arc_time == pytest.approx(1.5, abs=1e-6)


def test_a_bead_is_welded_at_the_speed_that_is_set() -> None:
    boss = boss_program()
    program = boss.made.written.program
    run = run_program(program, boss.job)
    p = boss.job.scene.chain.forward(run.motion.q)[:, :3, 3]  # the table stands still
    speed = np.linalg.norm(np.diff(p, axis=0), axis=1) / np.diff(run.motion.t_s)
    welding = run.motion.welding
    assert speed[welding].max() == pytest.approx(0.008, rel=1e-3)
    assert np.median(speed[welding]) == pytest.approx(0.008, rel=1e-2)


def test_axes_keep_their_share_of_speed_and_acceleration() -> None:
    boss = boss_program()
    run = run_program(boss.made.written.program, boss.job)
    moves, drives = boss.made.written.program.moves, boss.job.drives
    axes = np.concatenate([run.motion.q, run.motion.table], axis=1)
    dt = np.diff(run.motion.t_s)
    use = np.abs(np.diff(axes, axis=0)) / dt[:, None] / drives.speed
    ptp = moves.kind[run.move[1:]] == MoveKind.AXES
    share = np.nan_to_num(moves.axis_share[run.move[1:]], nan=1.0)
    assert (use[ptp].max(axis=1) <= share[ptp] * (1 + 1e-6)).all()
    assert (use[ptp].max(axis=1) >= 0.9 * share[ptp]).any()


def test_the_configuration_of_the_ptp_before_a_line_is_kept() -> None:
    # the same points from the wrist turned over: the whole bead is run in that configuration
    boss = boss_program()
    program = boss.made.written.program
    first = int(np.flatnonzero(program.moves.kind == MoveKind.LINEAR)[0])
    path = interpolate_program(program, boss.job)
    q = path.axes[np.flatnonzero(path.move == first - 1)[-1], :6]
    half = np.where(q < 0, np.pi, -np.pi)
    other = np.append(q[:3], [q[3] + half[3], -q[4], q[5] + half[5]])
    joints = program.moves.joints.copy()
    joints[first - 1] = other
    turned = interpolate_program(replace(program, moves=replace(program.moves, joints=joints)), boss.job)
    rows = np.flatnonzero(turned.move == first)
    assert np.sign(turned.axes[rows, 4]).tolist() == [np.sign(-q[4])] * len(rows)
    T = boss.job.scene.chain.forward(turned.axes[rows[-1:], :6])
    end = path.axes[np.flatnonzero(path.move == first)[-1:], :6]
    assert np.allclose(T, boss.job.scene.chain.forward(end), atol=1e-8)


def test_a_pose_out_of_reach_is_a_finding_on_its_move_and_no_exception() -> None:
    boss = boss_program()
    program = boss.made.written.program
    pose = program.moves.pose.copy()
    k = int(np.flatnonzero(program.moves.kind == MoveKind.LINEAR)[3])
    pose[k, 2] += 9.0
    run = run_program(replace(program, moves=replace(program.moves, pose=pose)), boss.job)
    assert run.failures[k].reason == "unreachable"


def moving(boss, turn: np.ndarray):
    """The boss' motion with a table that is turned further from row to row, the torch on the part as before."""
    motion, scene, solver = boss.motion, boss.job.scene, boss.job.solver
    before = tables_seen_from_base(scene, motion.table)
    table = motion.table + turn
    T = tables_seen_from_base(scene, table) @ inverse(before) @ scene.chain.forward(motion.q)
    q = ConfigurationTracker(solver).along(T, motion.q[0])
    assert np.isfinite(q).all()
    return replace(motion, q=q, table=table)


@pytest.mark.slow
def test_a_table_that_moves_along_a_bead_goes_there_and_back(tmp_path: Path) -> None:
    boss = boss_program()
    # home, where all stands still, is left out: from the first row off it on the table turns by 6 and 10 degrees
    m = len(boss.motion.t_s)
    share = np.clip((np.arange(m) - 5) / (m - 10), 0, 1)
    motion = moving(boss, share[:, None] * np.deg2rad([6.0, -10.0]))
    made = export_program(boss.job, motion)
    assert made.gap is not None
    assert made.gap.share(made.written.thinning) < 1
    assert made.result is not None
    moves = made.result.program.moves
    linear = moves.kind == MoveKind.LINEAR
    assert (np.ptp(moves.external[linear], axis=0) > np.deg2rad([2.5, 4.5])).all()
    # what is welded is where it was, and the table is told to move
    assert made.result.found.welded == len(boss.job.targets)
    assert not [f for f in made.result.findings if f.reason in ("off_bead", "order", "not_welded")]
    assert [line.code for line in made.result.warnings if getattr(line, "code", "") == "program_table"]
    # the same text with the base in the world follows nothing
    name = "boss_L001.src"
    text = re.sub(r"^\$BASE = EK\(.*?(\{.*\})\)", r"$BASE = \1", made.files[name], flags=re.MULTILINE)
    for other, content in {**made.files, name: text}.items():
        (tmp_path / other).write_bytes(content.encode())
    found = check_program(boss.job, read_krl(tmp_path / "boss.src", cell_controller(boss.job)))
    assert not found.feasible


def test_a_rounded_corner_between_a_ptp_and_a_line_is_looked_at() -> None:
    boss = boss_program()
    program = boss.made.written.program
    k = int(np.flatnonzero((program.moves.kind[:-1] == 0) & (program.moves.kind[1:] == 1))[0])
    blend = program.moves.blend.copy()
    blend[k] = 0.012
    plain = run_program(program, boss.job)
    run = run_program(replace(program, moves=replace(program.moves, blend=blend)), boss.job)
    assert len(run.runs) == len(plain.runs) + 1
    corner = next(one for one in run.runs if run.move[one.first + 1] == k)
    assert run.move[corner.last] == k + 1
    # from 12 mm before the corner to 12 mm behind it, by MuJoCo's kinematics; on the part, as the line's base is
    at = int(np.searchsorted(run.move, k + 1)) - 1
    s = corner.s - corner.s[at - corner.first]
    places = np.array([in_base(run, row) for row in range(corner.first, corner.last + 1)])
    for where in (-corner.zone, corner.zone):
        reached = [np.interp(where, s, places[:, axis]) for axis in range(3)]
        assert np.linalg.norm(reached - places[at - corner.first]) == pytest.approx(0.012, abs=2e-5)
    # the times are those of a stop
    assert np.ptp(run.motion.t_s) == pytest.approx(np.ptp(plain.motion.t_s))


def in_base(run: SimulatedProgram, row: int) -> np.ndarray:
    """The TCP on the table, where that stands still, by MuJoCo's kinematics."""
    q, table = run.motion.q[row], run.motion.table[row]
    place, R = in_mujoco(q, table, "table")
    return R.T @ (in_mujoco(q, table, "tcp")[0] - place)


BEGIN = "$TOOL=$NULLFRAME\n$BASE=$NULLFRAME\n$VEL.CP=0.2\nPTP {A1 0,A2 -90,A3 90,A4 0,A5 45,A6 0,E1 0,E2 0}\n"
AWAY = "PTP {A1 40,A2 -90,A3 90,A4 0,A5 45,A6 0}"
CORNERS = {  # statements, and what has to be rounded of the moves at the corner: mm of the line, % of half the PTP
    "a line, then a PTP": ("$APO={CDIS 5,CPTP 80}\nLIN_REL {Z -100} C_DIS\nAWAY\n", (5.0, None), (None, 80)),
    "a line, then a PTP, CPTP never set": ("LIN_REL {Z -100} C_DIS\nAWAY\n", (3.0, None), (None, 100)),
    "a line, CPTP set behind it": (
        "$APO.CPTP=1\nLIN_REL {Z -100} C_DIS\n$APO.CPTP=60\nAWAY\n",
        (3.0, None),
        (None, 60),
    ),
    "a PTP, then a line": (
        "$APO={CDIS 7,CPTP 30}\nPTP_REL {A1 40} C_PTP C_DIS\nLIN_REL {Z -100}\n",
        (None, 30),
        (7.0, None),
    ),
    "a PTP with C_PTP alone": (
        "$APO={CDIS 30,CPTP 1}\nPTP_REL {A1 40} C_PTP\nLIN_REL {Z -100}\n",
        (None, 1),
        (30.0, None),
    ),
}


CORNERS |= {  # with a move in between that goes nowhere
    "a PTP, a line to where it is, a line": (
        "$APO={CDIS 7,CPTP 30}\nPTP_REL {A1 40} C_PTP C_DIS\nLIN_REL {Z 0} C_DIS\nLIN_REL {Z -100}\n",
        (None, 30),
        (7.0, None),
    ),
    "a line, a PTP to where it is, a PTP": (
        "$APO={CDIS 5,CPTP 80}\nLIN_REL {Z -100} C_DIS\nPTP_REL {X 0} C_PTP\nAWAY\n",
        (5.0, None),
        (None, 80),
    ),
}


@pytest.mark.parametrize("what", CORNERS)
def test_a_corner_reaches_into_a_move_by_the_measure_of_that_move(what: str, tmp_path: Path) -> None:
    boss = boss_program()
    text, *sides = CORNERS[what]
    (tmp_path / "T.src").write_text(f"DEF T ( )\n{BEGIN}{text.replace('AWAY', AWAY)}END\n")
    run = run_program(read_krl(tmp_path / "T.src", cell_controller(boss.job)), boss.job)
    (corner,) = run.runs
    at = int(np.searchsorted(run.move, 1, side="right")) - 1
    s, q = corner.s - corner.s[at - corner.first], run.motion.q[corner.first : corner.last + 1]
    tcp = np.array([in_mujoco(one, run.motion.table[0], "tcp")[0] for one in q])
    for where, rows, (mm, percent) in zip((-corner.zone, corner.zone), (s <= 0, s >= 0), sides, strict=True):
        if mm is not None:
            gone = [np.interp(where, s, tcp[:, axis]) for axis in range(3)] - tcp[at - corner.first]
            assert np.linalg.norm(gone) * 1e3 > mm - 0.02
        else:
            turned = abs(np.interp(where, s, q[:, 0]) - q[at - corner.first, 0])
            assert turned > (percent / 100 - 0.001) * np.ptp(q[rows, 0]) / 2


def test_moves_of_axes_are_joined_by_the_share_that_holds_at_the_second(tmp_path: Path) -> None:
    boss = boss_program()
    body = "$APO.CPTP=5\nPTP_REL {A1 40} C_PTP\n$APO.CPTP=90\nPTP_REL {A2 -20}\n"
    (tmp_path / "T.src").write_text(f"DEF T ( )\n{BEGIN}{body}END\n")
    run = run_program(read_krl(tmp_path / "T.src", cell_controller(boss.job)), boss.job)
    (corner,) = run.runs
    at = int(np.searchsorted(run.move, 2)) - 1
    turned = np.interp(corner.s[at - corner.first] + corner.zone, corner.s, run.motion.q[corner.first :, 1])
    assert abs(turned - run.motion.q[at, 1]) > np.deg2rad(0.9 * 20 / 2) * 0.999


@pytest.mark.parametrize(
    ("slow", "move", "least_s"),
    [
        ("$VEL.ORI1=10\n$VEL.ORI2=10\n", "LIN_REL {X 50,A 30} #TOOL\n", 3.0),  # 30 degrees at 10 a second
        ("$VEL.ORI1=10\n", "LIN_REL {A 30} #TOOL\n", 3.0),
        # E1 starts over half of the way and brakes over the other
        ("$ACC_EXTAX[1]=2\n", "LIN_REL {Z -5,E1 20}\n", None),
        ("$ACC_EXTAX[1]=2\n", "PTP_REL {E1 20}\n", None),
    ],
)
def test_what_a_program_slows_down_takes_its_time(slow: str, move: str, least_s: float | None, tmp_path: Path) -> None:
    boss, taken = boss_program(), []
    for body in (move, slow + move):
        (tmp_path / "T.src").write_text(f"DEF T ( )\n{BEGIN}{body}END\n")
        run = run_program(read_krl(tmp_path / "T.src", cell_controller(boss.job)), boss.job)
        taken.append(float(run.motion.t_s[-1]))
    if least_s is None:
        full = float(boss.job.drives.acceleration[6])
        least_s = 2 * np.sqrt(np.deg2rad(20) / (0.02 * full))
    assert taken[1] == pytest.approx(least_s, rel=0.02)
    assert taken[0] < 0.6 * taken[1]


def test_a_circle_comes_near_its_end_earlier_than_its_length_says(tmp_path: Path) -> None:
    boss = boss_program()
    circle = "CIRC_REL {X 50,Y 50},{X 0,Y 100} C_DIS\n"  # of 50 mm
    (tmp_path / "T.src").write_text(f"DEF T ( )\n{BEGIN}$APO.CDIS=70\n{circle}LIN_REL {{Y 300}}\nEND\n")
    run = run_program(read_krl(tmp_path / "T.src", cell_controller(boss.job)), boss.job)
    (corner,) = run.runs
    assert corner.zone == pytest.approx(2 * 0.05 * np.arcsin(0.7), rel=1e-3)


def test_points_that_repeat_the_one_before_change_nothing() -> None:
    boss = boss_program()
    program = boss.made.written.program
    twice = np.sort(np.append(np.arange(len(program.moves)), [4, 5, 5, 12]))
    columns = {name: getattr(program.moves, name)[twice] for name in program.moves.__dataclass_fields__}
    events = tuple(replace(e, before=int(np.searchsorted(twice, e.before))) for e in program.events)
    plain = run_program(program, boss.job)
    again = replace(program, moves=replace(program.moves, **columns), events=events)
    run = run_program(again, boss.job)
    assert np.ptp(run.motion.t_s) == pytest.approx(np.ptp(plain.motion.t_s))
    assert len(run.runs) == len(plain.runs)
    assert check_program(boss.job, again).feasible


def test_a_program_of_one_move_and_one_that_is_lost_at_once_are_judged_all_the_same() -> None:
    boss = boss_program()
    program = boss.made.written.program
    first = {name: getattr(program.moves, name)[:1] for name in program.moves.__dataclass_fields__}
    pose = program.moves.pose.copy()
    pose[:, 2] += 9.0
    lost = int(np.flatnonzero(program.moves.kind == MoveKind.LINEAR)[0])
    for moves, where in ((first, None), ({"pose": pose}, lost)):
        found = check_program(boss.job, replace(program, moves=replace(program.moves, **moves), events=()))
        assert not found.feasible
        assert "not_welded" in {f.reason for f in found.findings}
        assert where is None or where in [f.move for f in found.findings if f.reason == "unreachable"]
        assert ("program_cut" in [getattr(line, "code", "") for line in found.warnings]) == (where is not None)


def test_each_circle_that_ends_at_an_angle_ends_there(tmp_path: Path) -> None:
    boss = boss_program()
    begin = "$TOOL=$NULLFRAME\n$BASE=$NULLFRAME\n$VEL.CP=0.2\nPTP {A1 0,A2 -90,A3 90,A4 0,A5 45,A6 0,E1 0,E2 0}\n"
    path, its = tmp_path / "CA.src", cell_controller(boss.job)
    path.write_text(f"DEF CA ( )\n{begin}LIN_REL {{Z 0}}\nEND\n")
    x, y, z, *angles = read_krl(path, its).moves.pose[1] * [1e3, 1e3, 1e3, *[180 / np.pi] * 3]

    def on(angle: float, left: float = 0.0) -> str:
        """A point of a circle of 50 mm beside the start, which is at 0 degrees."""
        at = np.array([x + 50 * np.sin(np.deg2rad(angle)) + left, y + 50 - 50 * np.cos(np.deg2rad(angle)), z])
        return "{" + ",".join(f"{name} {value:.5f}" for name, value in zip("XYZABC", [*at, *angles], strict=True)) + "}"

    arc = f"CIRC {on(90)},{on(180)},CA "
    for asked in ((45.0, 45.0), (-90.0, 30.0), (100.0, -20.0)):
        path.write_text(f"DEF CA ( )\n{begin}{arc}{asked[0]}\nLIN {on(0)}\n{arc}{asked[1]}\nLIN {on(0)}\nEND\n")
        program = read_krl(path, its)
        found = interpolate_program(program, boss.job)
        for move, angle in zip((1, 3), asked, strict=True):
            places = np.concatenate([found.begins[move][None], found.Ts_frame_tcp[found.move == move]])[:, :3, 3] * 1e3
            length = np.linalg.norm(np.diff(places, axis=0), axis=1).sum()
            assert length == pytest.approx(np.deg2rad(abs(angle)) * 50, rel=1e-2)
            end = [x + 50 * np.sin(np.deg2rad(angle)), y + 50 - 50 * np.cos(np.deg2rad(angle)), z]
            np.testing.assert_allclose(places[-1], end, atol=1e-2)
    # a circle right behind it begins where it ends
    path.write_text(f"DEF CA ( )\n{begin}{arc}45\nCIRC {on(90)},{on(180)}\nEND\n")
    found = interpolate_program(read_krl(path, its), boss.job)
    places = np.concatenate([found.begins[2][None], found.Ts_frame_tcp[found.move == 2]])[:, :3, 3] * 1e3
    radius = np.linalg.norm(places - [x, y + 50, z], axis=1)
    np.testing.assert_allclose(radius, 50, atol=1e-2)


def test_an_arc_that_is_on_before_the_first_move_is_a_fault(tmp_path: Path) -> None:
    def burn(files: dict[str, str]) -> None:
        arc = next(line for line in files[LAYER].splitlines() if line.startswith("ARC_ON"))
        files["boss.src"] = re.sub(r"(?m)^PTP", f"{arc}\\nPTP", files["boss.src"], count=1)

    found = boss_program().read(tmp_path, burn)
    assert not found.feasible
    text = (tmp_path / "boss.src").read_text().splitlines()
    first = next(number for number, line in enumerate(text, start=1) if line.startswith("PTP"))
    burning = [finding.line for finding in found.findings if finding.failure.kind == Kind.PTP_WITH_ARC]
    assert first in [line.number for line in burning if line is not None and line.file.endswith("boss.src")]


def test_a_pose_without_status_is_gone_to_where_the_configuration_stays(tmp_path: Path) -> None:
    boss = boss_program()
    begin = "$TOOL=$NULLFRAME\n$BASE=$NULLFRAME\nPTP {A1 0,A2 -90,A3 90,A4 0,A5 45,A6 0,E1 0,E2 0}\n"
    path, its = tmp_path / "T.src", cell_controller(boss.job)

    def end(body: str) -> np.ndarray:
        path.write_text(f"DEF T ( )\n{begin}{body}END\n")
        return np.degrees(interpolate_program(read_krl(path, its), boss.job).axes[-1, :6])

    path.write_text(f"DEF T ( )\n{begin}PTP {{A1 40,A2 -80,A3 70,A4 30,A5 60,A6 -20}}\nLIN_REL {{Z 0}}\nEND\n")
    x, y, z, a, b, c = read_krl(path, its).moves.pose[2] * [1e3, 1e3, 1e3, *[180 / np.pi] * 3]
    point = f"X {x:.6f},Y {y:.6f},Z {z:.6f},A {a:.6f},B {b:.6f},C {c:.6f}"
    np.testing.assert_allclose(end(f"PTP {{{point}}}\n"), [40, -80, 70, 30, 60, -20], atol=1e-3)
    # the wrist turned over is as good for S alone, and nearer where the arm comes from it
    with pytest.raises(InputError, match="S 2 without T: the pose has several such configurations"):
        end(f"PTP {{{point},S 2}}\n")
    with pytest.raises(InputError, match="without S the arm may keep its configuration or take a nearer one"):
        end(
            "PTP {A1 40,A2 -80,A3 70,A4 -140,A5 -5,A6 150}\nPTP {A1 40,A2 -80,A3 70,A4 -140,A5 5,A6 150}\n"
            f"PTP {{{point}}}\n"
        )
