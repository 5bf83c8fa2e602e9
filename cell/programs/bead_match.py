"""Which bead, layer and target every row of a program's run belongs to, by where it welds.

    run = on_beads(job, run_program(program, job))
    run.motion.bead, run.motion.target        # as a motion of our own has them

A stretch with the arc on belongs to the bead that most of its points lie nearest to; where they lie alike on several,
to the one that is next. Whether it lies *on* that bead is not asked here: the check of the motion says how far off it
is. Ways with the arc off belong to the bead that they lead to, the last one to the bead it comes from. Metres.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from ik.chain import Floats

from ..arrays import Ints
from ..job.job import Job
from ..rigid import inverse
from ..scene.site_frames import T_table_part
from ..units import METRES_PER_MM
from ..verification.bead_samples import along_beads
from .cell_frames import tables_seen_from_base
from .running.simulate import SimulatedProgram, with_beads

STRETCH_POINTS = 40  # points of a stretch by which its bead is known
NEIGHBOURS = 6  # targets next to each of them, whose beads come into question
SAME_DISTANCE = 2e-5  # m: beads that are as near as that are equally near
WINDOW = 3e-3  # m along a bead beyond the way gone since the last point
BACK = 5e-4  # m along a bead before the last point


def on_beads(job: Job, run: SimulatedProgram) -> SimulatedProgram:
    """A run whose rows say what they weld.

    Args:
        job: has the targets.
        run: from ``cell.programs.running.simulate.run_program``.

    Returns:
        The same with bead, layer and target of every row.
    """
    t, motion = job.targets, run.motion
    if not len(t):
        return run
    table = tables_seen_from_base(job.scene, motion.table) @ T_table_part(job.scene)
    x = (inverse(table) @ job.scene.chain.forward(motion.q))[:, :3, 3]
    beads = _Beads(job)
    target = np.full(len(x), -1, dtype=np.int64)
    expected = 0
    for k in range(int(run.weld.max(initial=-1)) + 1):
        rows = np.flatnonzero(run.weld == k)
        bead = beads.nearest(x[rows], expected)
        target[rows] = beads.targets(bead, x[rows], np.append(np.diff(run.move[rows]) != 0, True))
        expected = bead + 1
    target = _led_to(target)
    return with_beads(run, t.bead[target].astype(np.int64), t.layer[target].astype(np.int64), target, job.order)


def _led_to(target: Ints) -> Ints:
    """Rows without a target take that of the next row that has one; after the last, of the last."""
    known = np.flatnonzero(target >= 0)
    if not len(known):
        return np.zeros_like(target)
    after = np.minimum(np.searchsorted(known, np.arange(len(target))), len(known) - 1)
    out: Ints = target[known[after]]
    return out


class _Beads:
    """The targets as chords."""

    def __init__(self, job: Job) -> None:
        self.path = np.asarray(job.targets.bead)
        self.p = job.targets.position * METRES_PER_MM
        self.along = along_beads(job)
        self.first = np.searchsorted(self.path, np.arange(int(self.path.max()) + 2))
        # long chords are found by what lies between their ends as well
        self.tree = cKDTree(np.concatenate([self.p, (self.p[1:] + self.p[:-1]) / 2]))
        self.owner = np.concatenate([self.path, np.where(self.path[1:] == self.path[:-1], self.path[1:], -1)])

    def nearest(self, x: Floats, expected: int) -> int:
        """The bead that most of some points (m, 3) lie nearest to."""
        some = x[np.unique(np.linspace(0, len(x) - 1, STRETCH_POINTS).astype(int))]
        _, found = self.tree.query(some, k=min(NEIGHBOURS, len(self.owner)))
        beads = np.unique(self.owner[found])
        beads = np.unique(np.append(beads[beads >= 0], min(expected, len(self.first) - 2)))
        off = [float(np.median(self._off(int(bead), some))) for bead in beads]
        best = beads[np.array(off) <= min(off) + SAME_DISTANCE]
        return int(best[int(np.argmin(np.abs(best - expected)))])

    def _off(self, bead: int, x: Floats) -> Floats:
        """Distance of points (m, 3) from a bead, (m,)."""
        off, _ = self._on_chords(slice(self.first[bead], self.first[bead + 1]), x)
        return np.asarray(off.min(axis=1))

    def _on_chords(self, targets: slice, x: Floats) -> tuple[Floats, Floats]:
        """Distance of points from each chord, (m, k), and the length along the bead at its nearest point, (m, k)."""
        p, along = self.p[targets], self.along[targets]
        if len(p) == 1:
            return np.linalg.norm(x - p, axis=1)[:, None], np.full((len(x), 1), along[0])
        chord = np.diff(p, axis=0)
        size = np.maximum((chord**2).sum(axis=1), 1e-30)
        since = x[:, None] - p[:-1]
        share = np.clip((since * chord).sum(axis=2) / size, 0.0, 1.0)
        off = np.linalg.norm(since - share[:, :, None] * chord, axis=2)
        return off, along[:-1] + share * np.diff(along)

    def targets(self, bead: int, x: Floats, ends: np.ndarray) -> Ints:
        """The target that each row of a stretch has passed last, (m,); never going back.

        Args:
            bead: that it belongs to.
            x: the TCP in the part, (m, 3), m.
            ends: rows at which moves end, (m,).
        """
        low, high = int(self.first[bead]), int(self.first[bead + 1])
        along = self.along[low:high]
        gone = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(x, axis=0), axis=1))])
        points = np.flatnonzero(np.append(True, ends[1:]))
        s = np.empty(len(points))
        off, at = self._on_chords(slice(low, high), x[points[:1]])
        s[0] = at[0, int(np.argmax(off[0] <= off[0].min() + SAME_DISTANCE))]  # of a closed bead the beginning
        for n in range(1, len(points)):
            way = float(gone[points[n]] - gone[points[n - 1]])
            window = s[n - 1] - BACK, s[n - 1] + way * 1.5 + WINDOW
            a = max(int(np.searchsorted(along, window[0], side="right")) - 1, 0)
            b = max(int(np.searchsorted(along, window[1])) + 1, a + 2)
            off, at = self._on_chords(slice(low + a, min(low + b, high)), x[points[n] : points[n] + 1])
            inside = (at[0] >= window[0] - 1e-9) & (at[0] <= window[1] + 1e-9)
            away = np.where(inside, off[0], off[0] + 1.0)
            near = np.flatnonzero(away <= away.min() + SAME_DISTANCE)
            s[n] = max(at[0, near[int(np.argmin(np.abs(at[0, near] - s[n - 1] - way)))]], s[n - 1])
        here = np.interp(gone, gone[points], s)
        passed = np.searchsorted(along, here + 1e-7, side="right") - 1
        out: Ints = low + np.clip(passed, 0, high - low - 1)
        return out
