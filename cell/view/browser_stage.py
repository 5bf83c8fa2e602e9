"""Brings a browser viewer to the moment that a player shows.

Use:

    stage = BrowserStage(staged, player)            # called once for every frame
"""

from __future__ import annotations

import time
from typing import Any

import mujoco
import numpy as np

from .camera import camera, still, target_to_show
from .player import Player
from .stage_scene import VISIBLE, StagedScene

ROOM = 1024  # geoms that the web viewer takes on top of the model

ASPECT = 1.6


class BrowserStage:
    """Brings the viewer to the player's frame, once for every frame it draws."""

    def __init__(self, staged: StagedScene, player: Player) -> None:
        """Start at the player's beginning.

        Args:
            staged: what is drawn.
            player: says when.
        """
        self.staged, self.player = staged, player
        self._scene = mujoco.MjvScene(staged.model, maxgeom=ROOM)
        self._laid, self._table, self._colour = 0, player.frame().table, "layer"
        self._last = time.perf_counter()
        self._view: str | None = None
        self._pair: tuple[str, ...] = ()  # that is red in the model the browsers have

    def update(self, viewer: Any) -> bool:
        """Let time pass and bring the viewer there.

        Args:
            viewer: of mujoco.studio.

        Returns:
            Whether colours of the model changed, so that the browsers need it anew.
        """
        now = time.perf_counter()
        # a browser that was away does not make up for it
        self.player.advance(min(now - self._last, 0.25))
        self._last = now
        if self._view != self.player.view:
            self._view = self.player.view
            self._look(viewer)
        if self._colour != self.player.colour:
            self._colour, self._laid = self.player.colour, 0
            self.staged.colour(self.player.colour)
        frame = self.player.frame()
        self.staged.pose(frame)
        tinted, self._pair = frame.pair != self._pair, frame.pair
        viewer.data.qpos[:] = self.staged.data.qpos
        count = self.staged.laid(frame)
        laid = self._laid if count >= self._laid and np.array_equal(self._table, frame.table) else 0
        self._table = frame.table
        self._scene.ngeom = laid
        self._laid = self.staged.draw(self._scene, frame, laid)
        viewer.extra_geoms = list(self._scene.geoms[: self._scene.ngeom])
        viewer.vis_options.geomgroup[:] = VISIBLE
        return tinted

    def _look(self, viewer: Any) -> None:
        torch = self.player.view == "torch"
        result = self.staged.result
        self.staged.pose(self.player.frame() if torch else still(result, target_to_show(result)))
        best = camera(self.staged, self.player.view, ASPECT)
        viewer.camera.lookat[:] = best.lookat
        viewer.camera.distance, viewer.camera.azimuth = best.distance, best.azimuth
        viewer.camera.elevation = best.elevation
