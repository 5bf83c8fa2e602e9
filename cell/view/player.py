"""Which moment of a motion is shown: playing, stepping, jumping.

Use:

    player = Player(result)
    player.key(ord(" ")); player.advance(0.04); player.frame()
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ik.chain import Floats

from ..arrays import Ints
from ..errors import InputError
from ..motion.motion import Motion
from ..verdict.result import Result
from ..verdict.words import in_words
from .camera import View, still
from .colours import COLOURINGS, Colouring, target_colours
from .shown_motion import ShownMotion
from .stage_scene import Frame

KEYS = {
    **{"space": 32, "right": 262, "left": 263, "down": 264, "up": 265},  # GLFW's codes
    **{"n": 78, "t": 84, "v": 86, "c": 67, "o": 79},
}

FASTER, SLOWER = (61, 334), (45, 333)  # + and - on the main block and on the keypad

DWELL = 2.0  # s that an infeasible target is shown for

SPEEDS = (1 / 32, 256.0)

JUST = 1e-6  # s: a step counts from here

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
        colour: what the beads' colours show.
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
            colour: what the beads' colours show.

        Raises:
            InputError: the speed is not a number above 0.
        """
        if not (np.isfinite(speed) and speed > 0):
            raise InputError(f"speed {speed:g}: a number above 0 is needed")
        self.result, self.speed, self.loop = result, float(speed), loop
        self.time, self.playing, self.marks = 0.0, True, result.motion is None
        self.view, self.normals, self.colour = "cell", NORMALS[0], colour
        self._path = result.job.targets.bead
        self._bad = np.array([row.failure is not None for row in result.rows])
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

    def _table_words(self) -> str:
        """Where the table stands: as asked for, or as it moves now."""
        e1, e2 = self.result.asked
        if self.result.moved is not None:
            e1, e2 = np.rad2deg(self.frame().table)
        return f"E1 {e1:.5g}  E2 {e2:.5g} deg"

    def texts(self) -> list[tuple[str, str]]:
        """The figures at this moment, as names and values."""
        result, frame, t = self.result, self.frame(), self.result.job.targets
        i = frame.target
        sub_volume = t.sub_volume_index[i]
        layers = result.job.layers[sub_volume]
        lines = [
            (result.job.case.title, self._table_words()),
            (
                "verdict",
                "feasible"
                if result.feasible
                else f"infeasible: {result.infeasible} of {result.looked_at} targets checked, of {len(t)}"
                if result.not_looked_at
                else f"infeasible: {result.infeasible} of {len(t)} targets",
            ),
            ("target", f"{i} of 0 .. {len(t) - 1}"),
            ("layer", f"{t.layer[i]} of 0 .. {layers - 1}  {t.sub_volume[sub_volume]}"),
        ]
        row = result.rows[i]
        if not row.looked_at:
            lines += [("", "not checked")]
        elif row.reason is not None:
            lines += [
                ("reason", f"{row.reason}{' (proved)' if row.proved else ''}"),
                ("", in_words(row)),
                ("arm", "best attempt" if row.attempt is not None else "at home: no attempt reaches it"),
            ]
        if result.motion is not None:
            lines += [
                ("time", f"{self.time:.1f} of {self.end:.1f} s"),
                ("arc", "on" if frame.laying else "off"),
            ]
            if isinstance(result, ShownMotion) and result.program is not None:
                lines.append(("line", str(result.line_at(self._sample(result.motion)[0]))))
        lines.append(("colours", target_colours(result, self.colour)[1]))
        return [*lines, ("speed", f"x {self.speed:g}{'' if self.playing else '  paused'}")]


def _arrivals(motion: Motion, n: int) -> Floats:
    """When each of n targets is reached, (n,), s."""
    welding = np.flatnonzero(motion.arc)
    if not len(welding):
        return np.zeros(n)
    # a motion from a file may leave out targets, and go back
    reached = np.searchsorted(np.maximum.accumulate(motion.target[welding]), np.arange(n))
    return motion.t_s[welding[np.minimum(reached, len(welding) - 1)]]
