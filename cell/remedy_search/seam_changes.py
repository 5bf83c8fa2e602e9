"""Other starts for closed beads, as changes of a case: one that cannot be run from its seam may be run from elsewhere.

    seam_places(job, rows)                        # {"SV1": (SeamPlace, ..)}, those of the most promise first
    reseamed(job, place)                          # the job with the seams there

Places are tried where a bead was cut, and evenly along the bead that lost most. Beads that go round the axis get an
angle, others a point.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ik.chain import Floats
from slicing import SeamPlace

from ..case.read import with_changes
from ..case.sections import Case
from ..failure import Where
from ..job.job import Job, sample_part

if TYPE_CHECKING:
    from ..arrays import Ints
    from ..verdict.result import TargetVerdict

KEY = "beads.seams"
MOST_CUTS = 6  # places where beads were cut
ROUND = 16  # places along a bead; those farthest apart first
SAME_PLACE_SHARE = 0.02  # of a bead's length: nearer places are one


def may_be_mended(row: TargetVerdict) -> bool:
    """Whether a start elsewhere could mend a target: nothing does where it is infeasible by itself."""
    return row.reason in ("no_path", "speed") or (row.failure is not None and bool(row.failure.locked_by))


def seam_places(job: Job, rows: Sequence[TargetVerdict]) -> dict[str, tuple[SeamPlace, ...]]:
    """Places worth trying, by sub-volume, those of the most promise first.

    Args:
        job: what was checked.
        rows: its verdict.

    Returns:
        Sub-volumes with a closed bead that a start elsewhere could mend, and the places.
    """
    t = job.targets
    if not job.sliced:
        return {}  # another slicer's beads start where they start
    bad = [i for i, row in enumerate(rows) if may_be_mended(row)]
    # a travel may fail at the end of the bead that it leaves
    failures = [failure for i in bad if (failure := rows[i].failure) is not None]
    bad += [f.from_target for f in failures if f.from_target is not None and f.where in (Where.TRAVEL, Where.TO_HOME)]
    closed = [i for i in bad if t.closed[t.bead[i]]]
    out = {}
    for k, name in enumerate(t.sub_volume):
        mine = np.array([i for i in closed if t.sub_volume_index[i] == k], dtype=np.int64)
        if len(mine):
            out[name] = _places(job, name, mine)
    return out


def _places(job: Job, name: str, bad: Ints) -> tuple[SeamPlace, ...]:
    t = job.targets
    worst = int(np.bincount(t.bead[bad]).argmax())
    first, stop = np.searchsorted(t.bead, [worst, worst + 1]).tolist()
    loop = t.position[first:stop]
    step = np.linalg.norm(np.diff(loop, axis=0), axis=1)
    along = np.append(0.0, np.cumsum(step))
    cuts = sorted({i + k for i in bad[t.bead[bad] == worst].tolist() for k in (-1, 0) if first < i + k < stop - 1})
    shares = [along[i - first] / along[-1] for i in cuts[:MOST_CUTS]]
    shares += [_spread(k) for k in range(1, ROUND)]
    kept = [0.0]
    for share in shares:
        if min(abs((share - s + 0.5) % 1.0 - 0.5) for s in kept) >= SAME_PLACE_SHARE:
            kept.append(share)
    points = np.column_stack([np.interp(np.array(kept[1:]) * along[-1], along, loop[:, c]) for c in range(3)])
    axis = job.sliced[int(t.sub_volume_index[first])].body.surface.axis_point
    return tuple(_place(name, p, axis, winds=_winds(loop, axis)) for p in points)


def _spread(k: int) -> float:
    """Shares of the way round, 1/2, 1/4, 3/4, 1/8, ..: each among the farthest from those before."""
    share, part = 0.0, 0.5
    while k:
        share, k, part = share + part * (k & 1), k >> 1, part / 2
    return share


def _winds(loop: Floats, axis: tuple[float, float]) -> bool:
    angle = np.unwrap(np.arctan2(loop[:, 1] - axis[1], loop[:, 0] - axis[0]))
    return bool(abs(angle[-1] - angle[0]) > np.pi)


def _place(name: str, point: Floats, axis: tuple[float, float], *, winds: bool) -> SeamPlace:
    if winds:
        angle = float(np.rad2deg(np.arctan2(point[1] - axis[1], point[0] - axis[0])))
        return SeamPlace(sub_volume=name, angle_deg=round(angle) + 0.0)
    x, y, z = (round(float(v), 1) + 0.0 for v in point)
    return SeamPlace(sub_volume=name, xyz_mm=(x, y, z))


def with_seam(case: Case, place: SeamPlace) -> Case:
    """A case with one more place of seams, which goes before those it has."""
    kept = [s for s in case.beads.seams if s.sub_volume != place.sub_volume]
    return with_changes(case, beads=replace(case.beads, seams=(*kept, place)))


def reseamed(job: Job, place: SeamPlace) -> Job:
    """The same job with the seams of a sub-volume elsewhere: other targets on the same beads."""
    case = with_seam(job.case, place)
    _, targets, _ = sample_part(case, job.sliced)
    return replace(job, case=case, targets=targets)


def counterparts(before: Job, after: Job, targets: Ints) -> set[int]:
    """The targets of the same beads in a job with other seams.

    Where an order of little travel numbers beads anew, those of the same layers.
    """
    if before.targets is after.targets:
        return set(targets.tolist())
    if after.case.beads.short:
        same = np.isin(after.laid, before.laid[targets])
    else:
        same = np.isin(after.targets.bead, before.targets.bead[targets])
    return set(np.flatnonzero(same).tolist())


def seams_value(case: Case) -> list[dict[str, Any]]:
    """The key's value as a case file has it."""
    return [{key: value for key, value in asdict(place).items() if value is not None} for place in case.beads.seams]


def seam_in_words(places: Sequence[dict[str, Any]]) -> str:
    """The last of some places, which is the new one, as part of a sentence."""
    place = places[-1]
    where = f"{place['angle_deg']:g} deg about the axis" if "angle_deg" in place else _point(place["xyz_mm"])
    return f"seams of {place['sub_volume']} -> {where}"


def _point(xyz_mm: Sequence[float]) -> str:
    return ", ".join(f"{v:g}" for v in xyz_mm) + " mm"
