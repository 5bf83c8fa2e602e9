"""One motion of what is welded at several poses of the table: the groups' motions, and the table's turns between them.

motion = joined_motion(job, motions, turns)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, replace

import numpy as np

from ..job.job import Job
from ..motion.deposition_speed import HeldSpeed
from ..motion.motion import Motion
from .table_turn import STILL_S, TableTurn


def joined_motion(job: Job, motions: Sequence[Motion], turns: Sequence[TableTurn | None]) -> Motion:
    """Put the motions of groups one after the other.

    Args:
        job: the whole part.
        motions: of the groups, in order; each ends where the turn after it begins, and begins where one ends.
        turns: between them, one fewer; None where the table stays as it is.

    Returns:
        The motion.
    """
    parts = [motions[0]]
    at = float(motions[0].t_s[-1])
    for turn, motion in zip(turns, motions[1:], strict=True):
        at += max(_dwell(job, int(parts[-1].target[-1]), int(motion.target[0])), STILL_S)
        parts.append(_rows(parts[-1], slice(-1, None), np.array([at])))
        if turn is not None:
            t = at + np.cumsum(turn.dt_s)
            still = _rows(motion, np.zeros(len(t), dtype=np.int64), t)
            parts.append(replace(still, table=turn.rows[1:]))
            at = float(t[-1]) + STILL_S
            parts.append(_rows(motion, slice(None), at + motion.t_s - motion.t_s[0]))
        else:
            parts.append(_rows(motion, slice(1, None), at + motion.t_s[1:] - motion.t_s[0]))
        at = float(parts[-1].t_s[-1])
    first, last = motions[0], motions[-1]
    known = first.home_s is not None and job.scene.has_home
    out = float(first.t_s[int(np.argmax(first.arc))] - first.t_s[0])
    back = float(last.t_s[-1] - last.t_s[len(last.arc) - 1 - int(np.argmax(last.arc[::-1]))])
    names = ("t_s", "q", "table", "arc", "bead", "layer", "target")
    joined = {name: np.concatenate([getattr(part, name) for part in parts]) for name in names}
    return Motion(
        **joined,
        names=first.names,
        held_speed=_joined_speed([m.held_speed for m in motions]),
        home_s=out + back if known else None,
        order=job.order,
    )


def _rows(motion: Motion, which: slice | np.ndarray, t_s: np.ndarray) -> Motion:
    """Some rows of a motion at other times."""
    names = ("q", "table", "arc", "bead", "layer", "target")
    return replace(motion, t_s=t_s, **{name: getattr(motion, name)[which] for name in names})


def _joined_speed(speeds: Sequence[HeldSpeed | None]) -> HeldSpeed | None:
    """What is known of each target's speed by any of the groups."""
    known = [held_speed for held_speed in speeds if held_speed is not None]
    if len(known) < len(speeds):
        return None
    out = HeldSpeed.unknown(len(known[0].asked_s))
    for held_speed in known:
        mine = np.isfinite(held_speed.asked_s) | np.isfinite(held_speed.least)
        for field in fields(HeldSpeed):
            getattr(out, field.name)[mine] = getattr(held_speed, field.name)[mine]
    return out


def _dwell(job: Job, before: int, after: int) -> float:
    """Wait between two targets' layers, s."""
    t = job.targets
    same = t.sub_volume_index[before] == t.sub_volume_index[after]
    return job.case.process.dwell_s if same and t.layer[before] != t.layer[after] else 0.0
