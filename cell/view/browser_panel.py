"""The replay's own window in MuJoCo's web viewer: what is seen, in words, and the buttons and keys that lead it.

    WebViewer(config, endpoint, model=model, plugins=[Panel(player, stage)])

Imported where it is used: mujoco.studio is not to be had everywhere that MuJoCo is.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from mujoco.studio import messages, plugin
from mujoco.studio.dear_imgui import dear_imgui as imgui

from .colours import COLOURINGS
from .player import HELP, KEYS, NORMALS, SPEEDS, Player

if TYPE_CHECKING:
    from .browser_stage import BrowserStage

BUTTONS = (("Play / pause", "space"), ("< bead", "down"), ("< target", "left"), ("target >", "right"), ("bead >", "up"))
OTHER_NAMES = {"left": "LeftArrow", "right": "RightArrow", "up": "UpArrow", "down": "DownArrow", "space": "Space"}
PLUS_MINUS = (("Equal", 61), ("KeypadAdd", 334), ("Minus", 45), ("KeypadSubtract", 333))
PLACE, WIDTH = (10.0, 10.0), 380.0


class Panel(plugin.ViewerPlugin):
    """The window, and what keeps the viewer at the player's frame."""

    def __init__(self, player: Player, stage: BrowserStage) -> None:
        """Make it.

        Args:
            player: is led by it.
            stage: follows the player.
        """
        self._player, self._stage = player, stage
        named = [(OTHER_NAMES.get(name, name.upper()), code) for name, code in KEYS.items()]
        self._keys = [(getattr(imgui.Key, name), code) for name, code in (*named, *PLUS_MINUS)]

    @messages.handler
    def on_update(self, _: messages.UpdateEvent) -> None:
        """Before every frame."""
        if self._stage.update(self.viewer):
            # the browsers fetch it anew: colours of the model are not part of what is streamed
            self.viewer.dispatch(messages.ModelEvent(model=self._stage.staged.model))
            self._stage.update(self.viewer)

    @messages.handler
    def on_build_gui(self, _: messages.BuildGuiEvent) -> None:
        """Lay the window out."""
        if not imgui.IsAnyItemActive():  # a slider that is typed into
            for key, code in self._keys:
                if imgui.IsKeyPressed(key):
                    self._player.key(code)
        imgui.SetNextWindowPos(imgui.Vec2(*PLACE), imgui.Cond.FirstUseEver.value)
        imgui.SetNextWindowSize(imgui.Vec2(WIDTH, 0.0), imgui.Cond.FirstUseEver.value)
        imgui.Begin("rbam replay", flags=imgui.WindowFlags.NoDocking.value)
        self._words()
        self._leading()
        self._looks()
        imgui.End()

    def _words(self) -> None:
        if imgui.BeginTable("said", 2):
            imgui.TableSetupColumn("name", imgui.TableColumnFlags.WidthFixed.value)
            imgui.TableSetupColumn("value", imgui.TableColumnFlags.WidthStretch.value)
            for name, value in self._player.texts():
                imgui.TableNextRow()
                imgui.TableNextColumn()
                imgui.TextUnformatted(name)
                imgui.TableNextColumn()
                imgui.TextWrapped(value.replace("%", "%%"))
            imgui.EndTable()

    def _leading(self) -> None:
        player = self._player
        for k, (label, key) in enumerate(BUTTONS):
            if k:
                imgui.SameLine()
            if imgui.SmallButton(label):
                player.key(KEYS[key])
        if imgui.SmallButton("next infeasible"):
            player.key(KEYS["n"])
        imgui.SetNextItemWidth(-60.0)
        moved, time = imgui.SliderFloat("time", player.time, 0.0, max(player.end, 1e-3), "%.1f s")
        if moved:
            player.time, player.playing = min(float(time), player.end), False
        imgui.SetNextItemWidth(-60.0)
        high = max(SPEEDS[1], player.speed)
        moved, speed = imgui.SliderFloat("speed", player.speed, SPEEDS[0], high, "x %.3g", LOGARITHMIC)
        if moved:
            player.speed = float(speed)

    def _looks(self) -> None:
        player = self._player
        _, player.marks = imgui.Checkbox("targets", player.marks)
        for label, value in zip(("normal", "all normals", "no normals"), NORMALS, strict=True):
            imgui.SameLine()
            if imgui.RadioButton(label, player.normals == value):
                player.normals = value
        for k, by in enumerate(COLOURINGS):
            if k:
                imgui.SameLine()
            if imgui.RadioButton(by, player.colour == by):
                player.colour = by
        imgui.SameLine()
        if imgui.SmallButton("cell / torch"):
            player.key(KEYS["v"])
        imgui.TextDisabled("keys: " + ", ".join(f"{key} {what}" for key, what in HELP[4:]))


LOGARITHMIC = imgui.SliderFlags.Logarithmic.value
