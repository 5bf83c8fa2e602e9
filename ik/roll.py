"""The roll about the wire: the one freedom a welding target leaves to the arm.

A target fixes the TCP's position and the wire's direction; the angle about the wire is free, limited or fixed. A
:class:`RollWindow` says which, and ``apply_roll`` turns roll-0 poses into full ones::

    window = RollWindow.free()
    rolls = window.samples(step=np.deg2rad(15))          # every roll to try
    Ts = apply_roll(Ts_base_target[:, None], rolls)      # (m, r, 4, 4)

Roll is measured about z_tcp, right-handed; radians.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .chain import Floats


@dataclass(frozen=True)
class RollWindow:
    """Allowed angles about the wire, from ``low`` to ``high`` (rad, ``low <= high``, at most one turn)."""

    low: float
    high: float

    def __post_init__(self) -> None:
        if not (np.isfinite(self.low) and np.isfinite(self.high) and self.low <= self.high):
            raise ValueError(f"a roll range needs low <= high, not {self.low} .. {self.high}")

    @classmethod
    def free(cls) -> RollWindow:
        """The whole turn."""
        return cls(-np.pi, np.pi)

    @classmethod
    def fixed(cls, roll: float) -> RollWindow:
        """One angle (rad)."""
        return cls(roll, roll)

    @property
    def is_full(self) -> bool:
        """Whether every roll is allowed."""
        return self.high - self.low >= 2 * np.pi - 1e-12

    @property
    def is_fixed(self) -> bool:
        """Whether one roll alone is allowed."""
        return self.high == self.low

    def samples(self, step: float) -> Floats:
        """Rolls at most ``step`` apart that cover the window.

        Args:
            step: largest distance of neighbours, rad.

        Returns:
            (r,) rad, ascending; of a whole turn the end is left out (it is the start).
        """
        if self.is_fixed:
            return np.array([self.low])
        if self.is_full:
            count = max(int(np.ceil(2 * np.pi / step - 1e-9)), 3)
            return -np.pi + 2 * np.pi * np.arange(count) / count
        count = max(int(np.ceil((self.high - self.low) / step - 1e-9)), 1) + 1
        return np.linspace(self.low, self.high, count)

    def excess(self, roll: Floats) -> Floats:
        """How far a roll is outside the window, the short way round.

        Args:
            roll: (...) rad, any turn.

        Returns:
            Signed angle from the nearer end to the roll; 0 inside, (...) rad.
        """
        if self.is_full:
            return np.zeros_like(roll)
        middle, half = (self.low + self.high) / 2, (self.high - self.low) / 2
        off = wrap(roll - middle)
        return np.sign(off) * np.maximum(np.abs(off) - half, 0.0)


def wrap(angle: Floats) -> Floats:
    """Angles brought into [-pi, pi), rad, any shape."""
    return angle - 2 * np.pi * np.floor((angle + np.pi) / (2 * np.pi))  # a third of the time of %


def apply_roll(Ts: Floats, roll: Floats) -> Floats:
    """Turn poses about their own z axis.

    Args:
        Ts: poses, (..., 4, 4).
        roll: angles that broadcast against the poses' leading shape, rad.

    Returns:
        ``Ts @ Rz(roll)``, broadcast shape + (4, 4).
    """
    c, s = np.cos(roll)[..., None], np.sin(roll)[..., None]
    shape = np.broadcast_shapes(Ts.shape[:-2], np.shape(roll))
    out = np.array(np.broadcast_to(Ts, (*shape, 4, 4)))
    out[..., :3, 0] = c * Ts[..., :3, 0] + s * Ts[..., :3, 1]
    out[..., :3, 1] = c * Ts[..., :3, 1] - s * Ts[..., :3, 0]
    return out


def roll_of(Ts_target: Floats, Ts_tcp: Floats) -> Floats:
    """Roll of TCP poses against roll-0 target poses with the same z axis.

    Args:
        Ts_target: (m, 4, 4) at roll 0.
        Ts_tcp: (m, 4, 4).

    Returns:
        (m,) rad in (-pi, pi].
    """
    x = Ts_tcp[..., :3, 0]
    return np.arctan2(
        np.einsum("...i,...i->...", Ts_target[..., :3, 1], x), np.einsum("...i,...i->...", Ts_target[..., :3, 0], x)
    )
