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
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import mujoco
import numpy as np

from ik.chain import Floats

from .check import Result
from .collision import Ints
from .colours import COLOURINGS, Colouring, target_colours
from .errors import InputError
from .motion import Motion
from .picture import View, camera, middle, still
from .report import in_words
from .staging import VISIBLE, Frame, Staging

if TYPE_CHECKING:
    import mujoco.viewer

KEYS = {
    **{"space": 32, "right": 262, "left": 263, "down": 264, "up": 265},  # GLFW's codes
    **{"n": 78, "t": 84, "v": 86, "c": 67, "o": 79},
}
FASTER, SLOWER = (61, 334), (45, 333)  # + and - on the main block and on the keypad
_FLAG = mujoco.mjtVisFlag
OURS = [int(flag) for flag in (_FLAG.mjVIS_TRANSPARENT, _FLAG.mjVIS_CONTACTPOINT, _FLAG.mjVIS_PERTOBJ)]
DWELL = 2.0  # s that an infeasible target is shown for
SPEEDS = (1 / 32, 256.0)
FRAME_TIME = 1 / 60  # s
CLOSING = 3.0  # s given to the window's thread
JUST = 1e-6  # s: a step counts from here
ASPECT = 1.5  # that the camera is chosen for; the window is the user's to size
HELP = (
    ("space", "play, pause"),
    ("left right", "target"),
    ("up down", "bead"),
    ("+ -", "speed"),
    ("n", "next infeasible"),
    ("t", "targets"),
    ("o", "normals"),
    ("c", "colours"),
    ("v", "cell, torch"),
)
INSTEAD = (
    "without one there are rbam replay --web, --picture F.png and --video F.mp4, and rbam check --html F.html; "
    "or run it under Xvfb (xvfb-run)"
)
NORMALS = ("one", "all", "none")  # of which targets normals are shown


class Player:
    """What a replay shows at any time; knows nothing of windows.

    Attributes:
        time: place in the replay, s.
        end: its length, s.
        playing: whether :meth:`advance` moves it.
        speed: times real time.
        loop: whether it starts again at its end.
        marks: whether the targets are marked.
        normals: of which targets normals are shown, "one" (the one it is about), "all" or "none".
        colour: what the beads' colours mean.
        view: what the camera is to frame, "cell" or "torch".
    """

    view: View
    colour: Colouring

    def __init__(self, result: Result, speed: float = 1.0, loop: bool = False, colour: Colouring = "layer") -> None:
        """Start at the beginning.

        Args:
            result: what is shown.
            speed: times real time.
            loop: whether to start again at the end.
            colour: what the beads' colours mean.

        Raises:
            InputError: the speed is not a number above 0.
        """
        if not (np.isfinite(speed) and speed > 0):
            raise InputError(f"speed {speed:g}: is a number above 0")
        self.result, self.speed, self.loop = result, float(speed), loop
        self.time, self.playing, self.marks = 0.0, True, result.motion is None
        self.view, self.normals, self.colour = "cell", NORMALS[0], colour
        self._path = result.job.targets.path
        self._bad = np.array([row.reason is not None for row in result.rows])
        self._stop: Ints
        self._at: Floats
        if result.motion is not None:
            # where the replay can be stepped to: targets and when they are reached
            self._stop = np.arange(len(result.rows))
            self._at = _arrivals(result.motion, len(result.rows))
            self.end = float(result.motion.t_s[-1])
        else:
            self._stop = np.flatnonzero(self._bad)
            self._at = DWELL * np.arange(len(self._stop), dtype=np.float64)
            self.end = len(self._stop) * DWELL

    def advance(self, seconds: float) -> None:
        """Let time pass.

        Args:
            seconds: of real time.
        """
        if not self.playing:
            return
        self.time += seconds * self.speed
        if self.time >= self.end:
            self.time, self.playing = (
                (self.time % self.end if self.end else 0.0, True) if self.loop else (self.end, False)
            )

    def key(self, code: int) -> None:
        """React to a key.

        Args:
            code: GLFW's key code; one that means nothing here is ignored.
        """
        if code == KEYS["space"]:
            if not self.playing and self.time >= self.end:
                self.time = 0.0
            self.playing = not self.playing
        elif code == KEYS["t"]:
            self.marks = not self.marks
        elif code == KEYS["o"]:
            self.normals = NORMALS[(NORMALS.index(self.normals) + 1) % len(NORMALS)]
        elif code == KEYS["c"]:
            self.colour = COLOURINGS[(COLOURINGS.index(self.colour) + 1) % len(COLOURINGS)]
        elif code == KEYS["v"]:
            self.view = "torch" if self.view == "cell" else "cell"
        elif code in FASTER:
            self.speed = min(self.speed * 2, max(self.speed, SPEEDS[1]))
        elif code in SLOWER:
            self.speed = max(self.speed / 2, min(self.speed, SPEEDS[0]))
        else:
            self._step(code)

    def _step(self, code: int) -> None:
        now = self._now()
        bead = self._path[self._stop]
        after, before = self._at > self.time + JUST, self._at < self.time - JUST
        if code == KEYS["right"]:
            choices = np.flatnonzero(after)[:1]
        elif code == KEYS["left"]:
            choices = np.flatnonzero(before)[-1:]
        elif code == KEYS["up"]:
            choices = np.flatnonzero(bead > bead[now])[:1]
        elif code == KEYS["down"]:
            # the start of this bead, and from there that of the one before
            starts = np.flatnonzero(np.diff(bead, prepend=-1))
            choices = starts[before[starts]][-1:]
        elif code == KEYS["n"]:
            bad = np.flatnonzero(self._bad[self._stop])
            choices = np.concatenate([bad[after[bad]], bad])[:1]
        else:
            return
        self.playing = False
        if len(choices):
            self.time = float(self._at[choices[0]])

    def _now(self) -> int:
        """The stop last passed."""
        return max(int(np.searchsorted(self._at, self.time + JUST, side="right")) - 1, 0)

    def frame(self) -> Frame:
        """What is to be seen now.

        Returns:
            The frame.
        """
        motion = self.result.motion
        if motion is None:
            shown = still(self.result, int(self._stop[self._now()]))
            return self._dressed(shown)
        i, f = self._sample(motion)
        j = min(i + 1, len(motion.t_s) - 1)
        bare = Frame(
            q=(1 - f) * motion.q[i] + f * motion.q[j],
            table=(1 - f) * motion.table[i] + f * motion.table[j],
            target=int(motion.target[j if f >= 1.0 else i]),
            done=float(np.interp(self.time, self._at, self._stop)),
            laying=bool(motion.arc[i] and motion.arc[j]),
        )
        return self._dressed(bare)

    def _dressed(self, frame: Frame) -> Frame:
        return replace(frame, marks=self.marks, arrow=self.normals != "none", normals=self.normals == "all")

    def _sample(self, motion: Motion) -> tuple[int, float]:
        """The sample before now and the fraction of the way to the next."""
        t = motion.t_s
        i = int(np.clip(np.searchsorted(t, self.time, side="right") - 1, 0, max(len(t) - 2, 0)))
        length = t[i + 1] - t[i] if i + 1 < len(t) else 0.0
        return i, float(np.clip((self.time - t[i]) / length, 0.0, 1.0)) if length > 0 else 1.0

    def texts(self) -> list[tuple[str, str]]:
        """What is said now, as names and values."""
        result, frame, t = self.result, self.frame(), self.result.job.targets
        i = frame.target
        sub_volume = t.sub_volume_index[i]
        layers = len(result.job.sliced[sub_volume].layers)
        lines = [
            (result.job.case.title, f"E1 {result.asked[0]:g}  E2 {result.asked[1]:g} deg"),
            (
                "verdict",
                "feasible" if result.feasible else f"infeasible: {result.infeasible} of {len(t)} targets",
            ),
            ("target", f"{i} of 0 .. {len(t) - 1}"),
            ("layer", f"{t.layer[i]} of 0 .. {layers - 1}  {t.sub_volume[sub_volume]}"),
        ]
        row = result.rows[i]
        if row.reason is not None:
            lines += [
                ("reason", f"{row.reason}{' (proved)' if row.proved else ''}"),
                ("", in_words(row)),
                ("arm", "best attempt" if row.attempt is not None else "at home: there is no attempt"),
            ]
        if result.motion is not None:
            lines += [
                ("time", f"{self.time:.1f} of {self.end:.1f} s"),
                ("arc", "on" if frame.laying else "off"),
            ]
        lines.append(("colours", target_colours(result, self.colour)[1]))
        return [*lines, ("speed", f"x {self.speed:g}{'' if self.playing else '  paused'}")]


def _arrivals(motion: Motion, n: int) -> Floats:
    """When each of n targets is reached, (n,), s."""
    welding = np.flatnonzero(motion.arc)
    # a motion from a file may leave out targets, and go back
    reached = np.searchsorted(np.maximum.accumulate(motion.target[welding]), np.arange(n))
    return motion.t_s[welding[np.minimum(reached, len(welding) - 1)]]


def replay(result: Result, *, speed: float = 1.0, loop: bool = False, colour: Colouring = "layer") -> None:
    """Show a result in MuJoCo's viewer until its window is closed or Ctrl-C is pressed.

    Args:
        result: from ``cell.check.check``.
        speed: times real time.
        loop: whether to start again at the end.
        colour: what the beads' colours mean at first.

    Raises:
        InputError: the speed is not above 0, or there is no display; one line.
    """
    player = Player(result, speed, loop, colour)
    require_display()
    staging = Staging(result)
    staging.pose(player.frame())
    pressed: queue.SimpleQueue[int] = queue.SimpleQueue()
    others = set(threading.enumerate())
    viewer = _opened(staging, pressed)
    mine = [thread for thread in threading.enumerate() if thread not in others]
    try:
        with viewer:
            _play(viewer, staging, player, pressed)
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


def _opened(staging: Staging, pressed: queue.SimpleQueue[int]) -> mujoco.viewer.Handle:
    try:
        import mujoco.viewer

        viewer = mujoco.viewer.launch_passive(
            staging.model, staging.data, key_callback=pressed.put, show_left_ui=False, show_right_ui=False
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


def _look(viewer: mujoco.viewer.Handle, staging: Staging, frame: Frame, view: View) -> None:
    """Turn the camera to what a view frames; from there on it is the user's."""
    # the whole cell is looked at from one side: the best for the middle of the motion
    staging.pose(frame if view == "torch" else still(staging.result, middle(staging.result)))
    best = camera(staging, view, ASPECT)
    with viewer.lock():
        viewer.cam.lookat[:] = best.lookat
        viewer.cam.distance, viewer.cam.azimuth = best.distance, best.azimuth
        viewer.cam.elevation = best.elevation


def _play(viewer: mujoco.viewer.Handle, staging: Staging, player: Player, pressed: queue.SimpleQueue[int]) -> None:
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
            _look(viewer, staging, frame, view)
            recoloured = True
        if colour != player.colour:
            colour, laid = player.colour, 0
            staging.colour(colour)
        recoloured |= staging.pose(frame)
        # beads stay in the scene from frame to frame, unless some are taken back or the table turns
        count = staging.laid(frame)
        laid = laid if count >= laid and np.array_equal(table, frame.table) else 0
        table = frame.table
        with viewer.lock():
            viewer.user_scn.ngeom = laid
            laid = staging.draw(viewer.user_scn, frame, laid)
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
