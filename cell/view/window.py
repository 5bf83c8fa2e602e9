"""Replay of a checked motion in MuJoCo's viewer.

    replay(check(prepare(case), 90, 180), speed=5)     # returns when the window is closed

    player = Player(result)                            # the same without a window
    player.key(KEYS["right"]); player.frame().q, player.texts()

A feasible result plays its motion with the beads growing behind the torch. An infeasible one shows the arm at
one infeasible target after another, at its best attempt. Seconds and radians.
"""

from __future__ import annotations

import os
import queue
import sys
import threading
import time
import warnings
from typing import TYPE_CHECKING, Any

import mujoco
import numpy as np

from ..errors import InputError
from ..verdict.result import Result
from .camera import View, camera, still, target_to_show
from .colours import Colouring
from .player import HELP, Player
from .stage_scene import VISIBLE, Frame, StagedScene

if TYPE_CHECKING:
    import mujoco.viewer

_FLAG = mujoco.mjtVisFlag
OURS = [int(flag) for flag in (_FLAG.mjVIS_TRANSPARENT, _FLAG.mjVIS_CONTACTPOINT, _FLAG.mjVIS_PERTOBJ)]
FRAME_TIME = 1 / 60  # s
CLOSING = 3.0  # s given to the window's thread
ASPECT = 1.5  # that the camera is chosen for; the window is the user's to size
INSTEAD = (
    "without a display use rbam replay --web, --picture F.png and --video F.mp4, and rbam check --html F.html; "
    "or run it under Xvfb (xvfb-run)"
)


def replay(result: Result, *, speed: float = 1.0, loop: bool = False, colour: Colouring = "layer") -> None:
    """Show a result in MuJoCo's viewer until its window is closed or Ctrl-C is pressed.

    Args:
        result: from ``cell.check``.
        speed: times real time.
        loop: whether to start again at the end.
        colour: what the beads' colours mean at first.

    Raises:
        InputError: the speed is not above 0, or there is no display; one line.
    """
    player = Player(result, speed, loop, colour)
    require_display()
    staged = StagedScene(result)
    staged.pose(player.frame())
    pressed: queue.SimpleQueue[int] = queue.SimpleQueue()
    others = set(threading.enumerate())
    viewer = _opened(staged, pressed)
    mine = [thread for thread in threading.enumerate() if thread not in others]
    try:
        with viewer:
            _play(viewer, staged, player, pressed)
    except KeyboardInterrupt:
        pass  # the other way of closing it
    finally:
        for thread in mine:  # a window torn down by the interpreter's end would crash
            thread.join(CLOSING)


def require_display() -> None:
    """Refuse to go on where no window can be opened: MuJoCo's viewer would wait for ever.

    Raises:
        InputError: no display; one line that names the alternatives.
    """
    if not sys.platform.startswith("linux"):
        return  # the others always have one, and macOS opens windows on the main thread alone
    if not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise InputError(f"no display (DISPLAY and WAYLAND_DISPLAY are not set): {INSTEAD}")
    try:
        import glfw
    except ImportError as error:
        raise InputError(f"no window can be opened ({error}): {INSTEAD}") from None
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # GLFW's own words for it
        works = bool(glfw.init())
        if works:
            glfw.window_hint(glfw.VISIBLE, False)
            window = glfw.create_window(64, 64, "", None, None)
            glfw.default_window_hints()
            works = bool(window)
            if window:
                glfw.destroy_window(window)
    if not works:
        name = os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
        raise InputError(f"no window can be opened on display {name}: {INSTEAD}")


def _opened(staged: StagedScene, pressed: queue.SimpleQueue[int]) -> mujoco.viewer.Handle:
    try:
        import mujoco.viewer

        viewer = mujoco.viewer.launch_passive(
            staged.model, staged.data, key_callback=pressed.put, show_left_ui=False, show_right_ui=False
        )
    except ImportError as error:
        raise InputError(f"MuJoCo's viewer cannot be loaded ({error}): {INSTEAD}") from None
    except RuntimeError as error:
        if sys.platform != "darwin":
            raise
        raise InputError(f"on macOS the viewer needs mjpython: mjpython -m cell replay ... ({error})") from None
    with viewer.lock():
        viewer.opt.geomgroup[:] = VISIBLE
    return viewer


def _look(viewer: mujoco.viewer.Handle, staged: StagedScene, frame: Frame, view: View) -> None:
    """Turn the camera to what a view frames; from there on it is the user's."""
    # the whole cell is looked at from one side: the best for the middle of the motion
    staged.pose(frame if view == "torch" else still(staged.result, target_to_show(staged.result)))
    best = camera(staged, view, ASPECT)
    with viewer.lock():
        viewer.cam.lookat[:] = best.lookat
        viewer.cam.distance, viewer.cam.azimuth = best.distance, best.azimuth
        viewer.cam.elevation = best.elevation


def _play(viewer: mujoco.viewer.Handle, staged: StagedScene, player: Player, pressed: queue.SimpleQueue[int]) -> None:
    laid, table, last = 0, player.frame().table, time.perf_counter()
    said: list[tuple[str, str]] = []
    view: View | None = None
    colour: Colouring = "layer"
    recoloured = True
    while viewer.is_running():
        while not pressed.empty():
            player.key(pressed.get())
        now = time.perf_counter()
        player.advance(now - last)
        last = now
        frame = player.frame()
        if view != player.view:
            view = player.view
            _look(viewer, staged, frame, view)
            recoloured = True
        if colour != player.colour:
            colour, laid = player.colour, 0
            staged.colour(colour)
        recoloured |= staged.pose(frame)
        # beads stay in the scene from frame to frame, unless some are taken back or the table turns
        count = staged.laid(frame)
        laid = laid if count >= laid and np.array_equal(table, frame.table) else 0
        table = frame.table
        with viewer.lock():
            viewer.user_scn.ngeom = laid
            laid = staged.draw(viewer.user_scn, frame, laid)
            for flag in OURS:
                viewer.opt.flags[flag] = 0  # t, c and o are the viewer's keys as well
        texts = player.texts()
        if texts != said:
            viewer.set_texts(_overlay(texts))
            said = texts
        viewer.sync(state_only=not recoloured)
        recoloured = False
        time.sleep(max(0.0, FRAME_TIME - (time.perf_counter() - now)))


def _overlay(texts: list[tuple[str, str]]) -> list[tuple[Any, Any, str, str]]:
    font = mujoco.mjtFontScale.mjFONTSCALE_100
    top, bottom = mujoco.mjtGridPos.mjGRID_TOPLEFT, mujoco.mjtGridPos.mjGRID_BOTTOMLEFT
    return [
        (font, where, "\n".join(name for name, _ in rows), "\n".join(value for _, value in rows))
        for where, rows in ((top, texts), (bottom, list(HELP)))
    ]
