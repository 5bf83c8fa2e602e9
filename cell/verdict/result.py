"""The result of a check: the verdict on every target, the motion, and the poses of the table.

    result = check(prepare(case))
    result.feasible, result.reasons, result.failures, result.motion

Radians and metres.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ik.chain import Floats

from ..case.sections import REASONS
from ..failure import Failure
from ..job.job import Job
from ..job.overhang_check import past_horizontal
from ..motion.motion import Motion
from ..part_chunks.least_values import LeastValue
from ..scene.placement import PlacedTargets

NOT_LOOKED_AT = "not_looked_at"  # in place of a reason


@dataclass(frozen=True, eq=False)
class TargetVerdict:
    """The verdict on one target.

    Attributes:
        failure: what is wrong with it or on the way to it; None where it is feasible or was not checked.
        q: the configuration it is welded in, (j,), rad; None where infeasible.
        attempt: the best attempt at an infeasible target, (j,), rad, if there is one.
        looked_at: False if the target was not checked, because the part cannot be built anyway.
    """

    failure: Failure | None
    q: Floats | None
    attempt: Floats | None = None
    looked_at: bool = True

    @property
    def reason(self) -> str | None:
        """None where it is feasible, else the reason as in reports, or "not_looked_at"."""
        if not self.looked_at:
            return NOT_LOOKED_AT
        return None if self.failure is None else self.failure.reason

    @property
    def verdict(self) -> str:
        """One word: feasible, infeasible, or not_looked_at."""
        if not self.looked_at:
            return NOT_LOOKED_AT
        return "feasible" if self.failure is None else "infeasible"

    @property
    def proved(self) -> bool:
        """Whether the target is infeasible and that is proved for every configuration."""
        return self.failure is not None and bool(self.failure.proved)

    @property
    def pair(self) -> tuple[str, ...]:
        """Names of the geoms that are too near; empty where none are."""
        return () if self.failure is None else self.failure.pair

    @property
    def detail(self) -> dict[str, Any]:
        """The failure as in reports; empty where the target is feasible."""
        return {} if self.failure is None else self.failure.document()


@dataclass(frozen=True)
class BuiltAt:
    """Layers and the pose of the table that they are built at.

    Attributes:
        sub_volume: name of the sub-volume.
        layers: first and last layer.
        E1_deg: as asked for, or found.
        E2_deg: likewise.
        first: first target.
        stop: one past the last.
    """

    sub_volume: str
    layers: tuple[int, int]
    E1_deg: float
    E2_deg: float
    first: int
    stop: int

    def document(self) -> dict[str, Any]:
        """As the case's ``table.poses`` takes it."""
        return {
            "sub_volume": self.sub_volume,
            "layers": list(self.layers),
            "E1_deg": self.E1_deg,
            "E2_deg": self.E2_deg,
        }


@dataclass(frozen=True, eq=False)
class Result:
    """The verdict on a case, with the table at one pose or moving.

    Attributes:
        job: the job that was checked.
        asked: E1, E2 as given to `check`, deg.
        table: E1, E2 of the positioner, rad.
        placed: the targets in the base frame.
        rows: the verdict on each target.
        clearance: least clearance along the stretches that were found, between samples too if there is a
            motion, m; None where nothing was nearer than 50 mm.
        singularity: least margin as a multiple of its limit, with its kind; None where no stretch was found.
        sigma: smallest singular value of the scaled Jacobian on them.
        gravity: angle between the deposition direction and up of every target, (n,), rad.
        motion: the whole motion, None where infeasible.
        seconds: processor time of the check.
        mode: the table's mode, see the case's ``table.mode``.
        poses: the table pose of each group of layers, in order; empty where there is one pose for all.
        moved: E1, E2 at every target, (n, 2), rad; None where the table stands still.
    """

    job: Job
    asked: tuple[float, float]
    table: tuple[float, float]
    placed: PlacedTargets
    rows: tuple[TargetVerdict, ...]
    clearance: LeastValue | None
    singularity: LeastValue | None
    sigma: float | None
    gravity: Floats
    motion: Motion | None
    seconds: float = field(default=0.0, kw_only=True)
    mode: str = field(default="fixed", kw_only=True)
    poses: tuple[BuiltAt, ...] = field(default=(), kw_only=True)
    moved: Floats | None = field(default=None, kw_only=True)

    def __repr__(self) -> str:
        verdict = "feasible" if self.feasible else "infeasible"
        good = self.looked_at - self.infeasible
        return f"<Result {self.job.case.title!r}: {verdict}, {good} of {len(self.rows)} targets reached>"

    @property
    def tables(self) -> Floats:
        """E1, E2 at every target, (n, 2), rad."""
        return np.tile(self.table, (len(self.rows), 1)) if self.moved is None else self.moved

    def to_frame(self) -> dict[str, Any]:
        """The targets as a dict of columns, not a data frame: ``pandas.DataFrame(result.to_frame())``.

        Returns:
            By name, each (n,): numbers, positions (part frame, mm), deposition directions, reasons ("" where
            feasible, "not_looked_at" where neither), whether they are proved, and the configurations (deg, NaN where
            there is none).
        """
        t = self.job.targets
        q = np.full((len(t), self.job.chain.n), np.nan)
        for i, row in enumerate(self.rows):
            if row.q is not None:
                q[i] = row.q
        names = np.array(t.sub_volume)[t.sub_volume_index]
        out: dict[str, Any] = {"target": np.arange(len(t)), "sub_volume": names, "layer": t.layer, "bead": t.bead}
        out |= {f"{axis}_mm": t.position[:, k] for k, axis in enumerate("xyz")}
        out |= {f"n{axis}": t.normal[:, k] for k, axis in enumerate("xyz")}
        out["thickness_mm"], out["speed_mm_s"] = t.thickness_mm, t.speed_mm_s
        out["feasible"] = np.array([row.reason is None for row in self.rows])
        out["reason"] = np.array([row.reason or "" for row in self.rows])
        out["looked_at"] = np.array([row.looked_at for row in self.rows])
        out["proved"] = np.array([row.proved for row in self.rows])
        out["off_upright_deg"] = np.rad2deg(self.gravity)
        return out | {f"{name}_deg": np.rad2deg(q[:, k]) for k, name in enumerate(self.job.chain.names)}

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings of the job and of this pose of the table, one line each."""
        return (*self.job.warnings, *past_horizontal(self.job.case, self.gravity))

    @property
    def feasible(self) -> bool:
        """Whether the whole part can be built."""
        return self.motion is not None

    @property
    def failures(self) -> dict[int, Failure]:
        """The failure of each infeasible target, by its number."""
        return {i: row.failure for i, row in enumerate(self.rows) if row.failure is not None}

    @property
    def infeasible(self) -> int:
        """Number of targets that cannot be welded, of those that were checked."""
        return sum(row.failure is not None for row in self.rows)

    @property
    def looked_at(self) -> int:
        """Number of targets that were checked; all of them if the part is feasible."""
        return sum(row.looked_at for row in self.rows)

    @property
    def not_looked_at(self) -> int:
        """Number of targets that were not checked; above 0 only for a part that cannot be built."""
        return len(self.rows) - self.looked_at

    @property
    def reasons(self) -> dict[str, int]:
        """Number of infeasible targets by reason, of those that were checked; 0 for reasons that do not occur."""
        count = Counter(row.reason for row in self.rows)
        return {reason: count[reason] for reason in REASONS}
