"""Replay: the player without a window, and the window itself on a virtual display."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest
from support.jobs.cases import little_case
from support.paths import ROOT

from cell.errors import InputError
from cell.failure import Contact, Failure, Kind
from cell.verdict.result import Result, TargetVerdict
from cell.view.picture import StagedScene
from cell.view.player import DWELL, FASTER, KEYS, SLOWER, Player
from cell.view.window import replay, require_display


@pytest.fixture
def result(little: Result) -> Result:
    return little


BAD = (2, 3, 12)


@pytest.fixture
def infeasible(result: Result) -> Result:
    """Three targets that fail: a collision with an attempt, one out of reach, one too far over."""
    rows = list(result.rows)
    contact = Contact(("torch_nozzle", "deposit/0/SV1/0"), (0.0, 0.0, 0.0))
    rows[2] = TargetVerdict(Failure(Kind.COLLISION, -1.0, 5.0, contact=contact, proved=True), None, rows[2].q)
    rows[3] = TargetVerdict(Failure(Kind.UNREACHABLE, 12.3, proved=True), None)
    rows[12] = TargetVerdict(Failure(Kind.JOINT_LIMIT, 3.0, axis="A5"), None, rows[12].q)
    return replace(result, rows=tuple(rows), motion=None)


def at(player: Player, time: float) -> Player:
    player.time = time
    return player


def test_the_configuration_is_the_motions_at_its_samples(result: Result) -> None:
    motion, player = result.motion, Player(result)
    assert player.end == motion.t_s[-1]
    for i in np.linspace(0, len(motion.t_s) - 1, 60).astype(int):
        frame = at(player, float(motion.t_s[i])).frame()
        np.testing.assert_allclose(frame.q, motion.q[i], atol=1e-12)
        np.testing.assert_allclose(frame.table, motion.table[i], atol=1e-12)
        assert frame.target == motion.target[i]


def test_between_samples_the_configuration_is_between_theirs(result: Result) -> None:
    motion, player = result.motion, Player(result)
    i = len(motion.t_s) // 3
    frame = at(player, float(motion.t_s[i : i + 2].mean())).frame()
    np.testing.assert_allclose(frame.q, motion.q[i : i + 2].mean(axis=0), atol=1e-9)


def test_a_motion_of_one_sample_can_be_shown(result: Result) -> None:
    m = result.motion
    first = int(np.argmax(m.arc))
    one = replace(
        m,
        **{
            name: getattr(m, name)[first : first + 1]
            for name in ("t_s", "q", "table", "arc", "bead", "layer", "target")
        },
    )
    player = Player(replace(result, motion=one, rows=result.rows[:1]))
    player.advance(1.0)
    np.testing.assert_array_equal(player.frame().q, m.q[first])


def test_beads_grow_and_end_at_the_wire(result: Result) -> None:
    player, staged = Player(result), StagedScene(result)
    before, laid = -1.0, 0
    for time in np.linspace(0, player.end, 80):
        frame = at(player, float(time)).frame()
        assert frame.done >= before
        staged.pose(frame)
        scn = mujoco.MjvScene(staged.model, maxgeom=1000)
        now = staged.draw(scn, frame)
        assert now == staged.laid(frame) >= laid
        # a piece that is being laid comes on top of those that are
        assert now <= scn.ngeom - 1 <= now + 1
        before, laid = frame.done, now
    assert laid == len(staged.beads.target)


def test_the_bead_under_the_torch_ends_above_the_wires_end(result: Result) -> None:
    player, staged = Player(result), StagedScene(result)
    frame = at(player, player.end / 2).frame()
    assert frame.laying
    staged.pose(frame)
    scn = mujoco.MjvScene(staged.model, maxgeom=1000)
    laid = staged.draw(scn, frame)
    assert scn.ngeom == laid + 2  # that bead and the arrow
    last = scn.geoms[laid]
    end = last.pos + last.mat[:, 2] * last.size[2]
    tip, wire = staged.tcp()
    # half a bead's thickness out along the normal, so that the wire's end is in the bead's foot
    np.testing.assert_allclose(end, tip - wire * last.size[0], atol=1e-6)


def test_a_target_is_done_when_the_wire_is_there(result: Result) -> None:
    player, staged = Player(result), StagedScene(result)
    player.key(KEYS["right"])  # from home to where the first bead begins
    for target in (0, 7, len(result.rows) - 1):
        while player.frame().done < target:
            player.key(KEYS["right"])
        frame = player.frame()
        assert frame.done == target == frame.target
        staged.pose(frame)
        np.testing.assert_allclose(staged.tcp()[0], staged.targets()[0][target], atol=2e-4)
        np.testing.assert_allclose(-staged.tcp()[1], staged.targets()[1][target], atol=1e-3)


def test_drawing_on_is_drawing_anew(result: Result) -> None:
    player, staged = Player(result), StagedScene(result)
    on = mujoco.MjvScene(staged.model, maxgeom=1000)
    laid = 0
    for time in np.linspace(0, 0.7 * player.end, 9):
        frame = at(player, float(time)).frame()
        staged.pose(frame)
        on.ngeom = laid
        laid = staged.draw(on, frame, laid)
    anew = mujoco.MjvScene(staged.model, maxgeom=1000)
    staged.draw(anew, frame)
    assert on.ngeom == anew.ngeom
    for a, b in zip(on.geoms[: on.ngeom], anew.geoms[: anew.ngeom], strict=True):
        np.testing.assert_array_equal(a.pos, b.pos)
        np.testing.assert_array_equal(a.size, b.size)


def test_time_passes_at_the_speed_and_stops_at_the_end(result: Result) -> None:
    player = Player(result, speed=2.0)
    player.advance(0.5)
    assert player.time == 1.0
    player.advance(1e6)
    assert (player.time, player.playing) == (player.end, False)
    player.key(KEYS["space"])
    assert (player.time, player.playing) == (0.0, True)


def test_a_loop_starts_again(result: Result) -> None:
    player = Player(result, loop=True)
    player.advance(player.end + 1.0)
    assert player.playing
    assert player.time == pytest.approx(1.0)


def test_space_pauses(result: Result) -> None:
    player = Player(result)
    player.key(KEYS["space"])
    player.advance(1.0)
    assert player.time == 0.0
    assert "paused" in dict(player.texts())["speed"]


def test_left_and_right_go_from_target_to_target(result: Result) -> None:
    player = Player(result)
    player.key(KEYS["right"])  # from home to where the first bead begins
    seen = []
    for _ in range(6):
        seen.append(player.frame().target)
        player.key(KEYS["right"])
    assert seen == [0, 1, 2, 3, 4, 5]
    assert not player.playing
    for _ in range(3):
        player.key(KEYS["left"])
    assert player.frame().target == 3
    for _ in range(len(result.rows) + 5):
        player.key(KEYS["right"])
    assert player.frame().target == len(result.rows) - 1


def test_up_and_down_go_from_bead_to_bead(result: Result) -> None:
    path, player = result.job.targets.bead, Player(result)
    first = [int(np.flatnonzero(path == b)[0]) for b in range(3)]
    player.key(KEYS["up"])
    player.key(KEYS["up"])
    assert player.frame().target == first[2]
    player.key(KEYS["right"])
    player.key(KEYS["down"])
    assert player.frame().target == first[2]
    player.key(KEYS["down"])
    assert player.frame().target == first[1]


def test_plus_and_minus_change_the_speed(result: Result) -> None:
    player = Player(result, speed=5.0)
    for code in FASTER:
        player.key(code)
    assert player.speed == 20.0
    for code in SLOWER * 20:
        player.key(code)
    assert 0 < player.speed < 1


def test_t_and_v_switch_and_other_keys_do_nothing(result: Result) -> None:
    player = Player(result)
    player.key(KEYS["t"])
    player.key(KEYS["v"])
    assert player.frame().marks
    assert player.view == "torch"
    for code in (0, 65, 256, 300):
        player.key(code)
    assert (player.playing, player.time) == (True, 0.0)


def test_infeasible_targets_are_shown_one_after_the_other(infeasible: Result) -> None:
    player = Player(infeasible)
    seen = []
    for _ in BAD:
        seen.append(player.frame())
        player.advance(DWELL)
    assert tuple(frame.target for frame in seen) == BAD
    np.testing.assert_array_equal(seen[0].q, infeasible.rows[2].attempt)
    np.testing.assert_array_equal(seen[1].q, infeasible.job.scene.home)
    assert [frame.pair for frame in seen] == [("torch_nozzle", "deposit/0/SV1/0"), (), ()]
    assert all(frame.marks and not frame.laying for frame in seen)
    assert not player.playing
    assert player.frame().target == BAD[-1]


def test_n_goes_round_the_infeasible_targets(infeasible: Result, result: Result) -> None:
    player = Player(infeasible)
    seen = []
    for _ in range(4):
        player.key(KEYS["n"])
        seen.append(player.frame().target)
    assert seen == [3, 12, 2, 3]
    player = Player(result)
    player.key(KEYS["n"])
    assert player.time == 0.0


def test_the_texts_say_why(infeasible: Result) -> None:
    player = Player(infeasible)
    text = "\n".join(f"{a} {b}" for a, b in player.texts())
    assert "collision (proved)" in text
    assert "torch_nozzle - deposit/0/SV1/0 -1.0 mm, needs 5" in text
    player.key(KEYS["n"])
    text = "\n".join(f"{a} {b}" for a, b in player.texts())
    assert "12.3 mm beyond" in text
    assert "no attempt" in text


def test_o_shows_the_normals_of_all_targets_or_none(result: Result) -> None:
    player, staged = Player(result), StagedScene(result)
    counts = []
    for _ in range(4):
        frame = player.frame()
        staged.pose(frame)
        scn = mujoco.MjvScene(staged.model, maxgeom=2000)
        laid = staged.draw(scn, frame)
        counts.append(scn.ngeom - laid)
        player.key(KEYS["o"])
    assert counts == [1, 1 + len(result.rows), 0, 1]


def test_c_colours_by_layer_thickness_and_verdict(infeasible: Result) -> None:
    player, staged = Player(infeasible), StagedScene(infeasible)
    said = []
    for _ in range(3):
        said.append(dict(player.texts())["colours"])
        assert staged.colour(player.colour) == said[-1]
        start = staged.beads.target[:, 0]
        if player.colour == "verdict":
            red = staged.beads.rgba[:, 0] > staged.beads.rgba[:, 1]
            np.testing.assert_array_equal(red, np.isin(start, BAD))
        if player.colour == "layer":
            of_layer = [staged.beads.rgba[infeasible.job.targets.layer[start] == k] for k in (0, 1)]
            assert all(np.ptp(rgba, axis=0).max() == 0 for rgba in of_layer)
            assert (of_layer[0][0] != of_layer[1][0]).any()
        player.key(KEYS["c"])
    assert [words.split()[0].rstrip(":") for words in said] == ["layer", "thickness", "verdict"]
    assert player.colour == "layer"


@pytest.mark.parametrize("speed", [0.0, -1.0, float("nan"), float("inf")])
def test_a_speed_that_is_none_is_refused(result: Result, speed: float) -> None:
    with pytest.raises(InputError, match="speed"):
        replay(result, speed=speed)


linux = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="displays are asked for on Linux alone")


@linux
@pytest.mark.parametrize("display", [None, ":987"])
def test_without_a_display_one_line_names_the_alternative(
    result: Result, monkeypatch: pytest.MonkeyPatch, display: str | None
) -> None:
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    monkeypatch.delenv("DISPLAY", raising=False)
    if display:
        monkeypatch.setenv("DISPLAY", display)
    for call in (require_display, lambda: replay(result)):
        with pytest.raises(InputError, match=r"display.*--web.*--picture F\.png.*--video.*--html.*Xvfb") as error:
            call()
        assert "\n" not in str(error.value)


WINDOW = """
import os, signal, sys, threading, time
from cell.verdict.check import check_fixed
from cell.case.read import load_case
from cell.job.job import prepare
from cell.view.window import replay
import cell.view.window

frames = []
texts = cell.view.player.Player.texts
cell.view.player.Player.texts = lambda player: (frames.append(player.time), texts(player))[1]
e1, e2 = map(float, sys.argv[2:4])
result = check_fixed(prepare(load_case(sys.argv[1])), e1, e2)
def stop():
    until = time.monotonic() + 60
    while len(frames) < 8 and time.monotonic() < until:
        time.sleep(0.1)
    os.kill(os.getpid(), signal.SIGINT)
threading.Thread(target=stop, daemon=True).start()
replay(result, speed=4.0)
assert len(frames) > 5 and frames[-1] > frames[0], frames
sys.stdout.write(f"closed after {len(frames)} frames, {threading.active_count()} threads")
"""


@linux
@pytest.mark.slow
@pytest.mark.parametrize("table", [("90", "180"), ("90", "0")])
def test_the_window_opens_plays_and_closes(tmp_path: Path, table: tuple[str, str]) -> None:
    if shutil.which("xvfb-run") is None:
        if os.environ.get("CI"):
            pytest.fail("xvfb-run is missing on CI")
        pytest.skip("xvfb-run is missing (Debian: xvfb)")
    command = ["xvfb-run", "-a", "-s", "-screen 0 640x480x24", sys.executable, "-c", WINDOW]
    env = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "WAYLAND_DISPLAY", "MUJOCO_GL")}
    done = subprocess.run(
        [*command, str(little_case(tmp_path)), *table],
        cwd=ROOT,
        env=env,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "closed after" in done.stdout
    assert "Traceback" not in done.stderr
