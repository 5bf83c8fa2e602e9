"""Single changes to a case that could make it feasible, and what each does to the targets before the arm.

    for knob in knobs(start): ...                # one key of the case in one direction
    start.poses(knob, 20.0, index)               # targets as the arm would see them, (n, 4, 4)
    start.changed(knob, 20.0)                    # the whole case, changed: job, E1, E2

``poses`` needs no new scene, so that hundreds of changes can be screened; ``changed`` is what a verdict is asked of.
Sizes are in deg, mm or mm/s.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ik.chain import Floats
from ik.roll import RollWindow, apply_roll

from ..arrays import Ints
from ..case.read import with_changes
from ..case.seam_section import SeamSection
from ..case.sections import Case, Table
from ..errors import InputError
from ..job.job import Job
from ..mjcf.torch import ALLOWED, TorchDimensions
from ..rigid import frames
from ..scene.compose import compose
from ..scene.placement import place
from ..scene.scene import table_angles
from ..units import METRES_PER_MM
from .seam_changes import KEY as SEAMS
from .seam_changes import reseamed, seams_value, with_seam

ANGLE_STEP = 5.0  # deg
SHIFT_STEPS = (10.0, 20.0, 40.0, 80.0, 160.0, 300.0)  # mm, of the positioner and the support
PART_STEPS = (5.0, 10.0, 20.0, 40.0, 80.0)  # mm, of the part on the table
STICK_OUT_STEPS = (2.0, 4.0, 8.0, 16.0, 25.0)  # mm
SLOWER_STEPS = (0.1, 0.25, 0.5, 0.75, 0.9)  # share taken off the deposition speed
SHARPER_STEPS = (0.25, 0.5, 0.75, 0.9)  # share taken off the rounding of corners
WIDER_STEPS = (5.0, 10.0, 20.0, 40.0, 80.0, 120.0, 180.0)  # deg, of the roll: a wider range only adds to what is there
PAIR_STEP, PAIR_REACH = 15.0, 90.0  # deg, of both table angles together
SCALE = {"deg": 10.0, "mm": 20.0, "share": 0.2}  # sizes that are as much of a change as one another


@dataclass(frozen=True)
class Knob:
    """One key of a case and a direction to change it in.

    Attributes:
        key: the case's key, as ``table.E1_deg``.
        how: which way where the key alone does not say: "shift", "low", "high", "free" of a roll; "x", "y", "z".
        sign: 1 or -1.
        steps: sizes to try, ascending.
        resolution: the smallest size is found to this.
        unit: "deg", "mm" or "share" of what is there; "pose" and "seam" of sizes that only number choices,
            "blend" of a share that is not worth a finer search.
        scale: what counts as much of a change as ten degrees.
        choices: what the sizes of seams number.
    """

    key: str
    how: str
    sign: int
    steps: tuple[float, ...]
    resolution: float
    unit: str
    scale: float
    choices: tuple[SeamSection, ...] = ()

    @property
    def numbered(self) -> bool:
        """Whether there are only these sizes: nothing lies between them."""
        return self.unit in ("pose", "seam", "blend")

    def effort(self, size: float) -> float:
        """How much of a change a size is, to hold knobs against one another."""
        return size / self.scale


@dataclass(frozen=True, eq=False)
class Start:
    """What changes are made to.

    Attributes:
        job: what was checked.
        E1_deg: table tilt it was checked at.
        E2_deg: table turn it was checked at.
    """

    job: Job
    E1_deg: float
    E2_deg: float
    _known: dict[tuple[float, float], Floats] = field(default_factory=dict, repr=False)
    _seams: dict[SeamSection, Job] = field(default_factory=dict, repr=False)

    def angles(self, knob: Knob, size: float) -> tuple[float, float]:
        """Table angles after a change, deg."""
        e1, e2 = self.E1_deg, self.E2_deg
        if knob.key == "table.E1_deg":
            e1 += knob.sign * size
        elif knob.key == "table.E2_deg":
            e2 = _half_turn(e2 + knob.sign * size)
        elif knob.key == "table":
            d1, d2 = pair_of(size)
            e1, e2 = e1 + d1, _half_turn(e2 + d2)
        return e1, e2

    def has(self, knob: Knob, size: float) -> bool:
        """Whether the cell has such a change at all: an axis its range, a key the values that the case file allows."""
        try:
            changed_case(self.job.case, knob, size)
        except InputError:
            return False
        e1, e2 = self.angles(knob, size)
        for value, (low, high), turn in zip((e1, e2), np.rad2deg(self.job.scene.table_range), (0, 360), strict=True):
            if not any(low - 1e-9 <= v <= high + 1e-9 for v in (value, value - turn, value + turn)):
                return False
        return True

    def window(self, knob: Knob, size: float) -> RollWindow:
        """Allowed roll after a change."""
        return roll_after(self.job.window, knob, size)

    def poses(self, knob: Knob, size: float, index: Ints) -> tuple[Floats, Floats]:
        """Targets as the arm as it is would see them after a change.

        Args:
            knob: what is changed.
            size: by how much.
            index: which targets, (n,).

        Returns:
            Frames at roll 0, (n, 4, 4), m, base frame; deposition directions, (n, 3), base frame. A longer stick-out
            shows as targets that are further out.
        """
        job, targets = self.job, self.job.targets
        T = self._T_base_part(*self.angles(knob, size))
        shift = knob.sign * size * METRES_PER_MM * np.array([knob.how == axis for axis in "xyz"])
        if knob.key == "positioner.position_mm":
            T[:3, 3] += job.scene.T_world_base()[:3, :3].T @ shift
        elif knob.key == "support.height_mm":
            T[:3, 3] += T[:3, 2] * knob.sign * size * METRES_PER_MM
        elif knob.key == "part.position_mm":
            turn = np.deg2rad(job.case.part.rotation_deg)
            c, s = np.cos(turn), np.sin(turn)
            # shifted along the table's axes: the part's own are turned against them
            T[:3, 3] += T[:3, :3] @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) @ shift
        placed = place(replace(targets, position=targets.position[index], normal=targets.normal[index]), T)
        if knob.key == "tool.dimensions.stick_out_mm":
            out = placed.position + placed.normal * size * METRES_PER_MM
            return frames(out, placed.normal, placed.reference), placed.normal
        Ts = placed.Ts_base_target
        if knob.key == "roll" and knob.how == "shift":
            # as a turn of the targets, so that all sizes share one window
            Ts = apply_roll(Ts, np.array(np.deg2rad(knob.sign * size)))
        return Ts, placed.normal

    def _T_base_part(self, e1: float, e2: float) -> Floats:
        if (e1, e2) not in self._known:
            scene = self.job.scene
            self._known[e1, e2] = scene.T_base_part(*table_angles(scene, e1, e2))
        return self._known[e1, e2].copy()

    def changed(self, knob: Knob, size: float) -> tuple[Job, float, float]:
        """The case after a change: the job and the table angles, deg.

        Raises:
            InputError: the changed scene does not compile.
        """
        e1, e2 = self.angles(knob, size)
        if knob.key == SEAMS:
            place = knob.choices[round(size)]
            self._seams[place] = self._seams.get(place) or reseamed(self.job, place)
            return self._seams[place], e1, e2
        case = with_changes(changed_case(self.job.case, knob, size), table=Table(E1_deg=e1, E2_deg=e2))
        job = replace(self.job, case=case)
        if knob.key == "process.deposition_speed_mm_s":
            speed = np.full(len(job.targets), case.process.deposition_speed_mm_s)
            job = replace(job, targets=replace(job.targets, speed_mm_s=speed))
        if knob.key.startswith(("positioner", "support", "part", "tool")):
            job = replace(job, scene=compose(case, job.shape))
        return job, e1, e2

    def describe(self, knob: Knob, size: float) -> dict[str, Any]:
        """A change as data: the case's key, the value it has and the one it should have."""
        job = self.job
        before, after = job.case, changed_case(job.case, knob, size)
        if knob.key.startswith("table"):
            was, to = (self.E1_deg, self.E2_deg), self.angles(knob, size)
            if knob.key == "table":
                names = ("E1_deg", "E2_deg")
                return {
                    "key": knob.key,
                    "from": dict(zip(names, map(_round, was), strict=True)),
                    "to": dict(zip(names, map(_round, to), strict=True)),
                }
            k = 0 if knob.key.endswith("E1_deg") else 1
            return {"key": knob.key, "from": _round(was[k]), "to": _round(to[k])}
        if knob.key == SEAMS:
            return {"key": SEAMS, "from": seams_value(before), "to": seams_value(after)}
        if knob.key == "roll":
            return {"key": "roll", "from": _roll_value(before), "to": _roll_value(after)}
        return {"key": knob.key, "from": value_of(before, knob.key), "to": value_of(after, knob.key)}


def knobs(start: Start, *, slower: bool = False, sharper: bool = False) -> list[Knob]:
    """The changes that are worth trying on a case.

    Args:
        start: what would be changed.
        slower: whether a slower deposition is one of them, where the case has one speed for all.
        sharper: whether corners that are rounded less are.

    Returns:
        Knobs without the sizes that the cell does not have.
    """
    found = [*_roll_knobs(start.job.window), *_table_knobs(start.job), *_place_knobs(start.job.case)]
    if slower and not start.job.case.process.speed_by_thickness:
        found.append(Knob("process.deposition_speed_mm_s", "", -1, SLOWER_STEPS, 0.01, "share", SCALE["share"]))
    if sharper:
        found.append(Knob("process.blend_mm", "", -1, SHARPER_STEPS, 0.01, "blend", 10 * SCALE["share"]))
    if start.job.solver.form is None:
        found = [replace(knob, steps=_growing(knob.steps)) for knob in found]
    trimmed = [replace(knob, steps=tuple(s for s in knob.steps if start.has(knob, s))) for knob in found]
    return [knob for knob in trimmed if knob.steps]


def _growing(steps: tuple[float, ...]) -> tuple[float, ...]:
    """Some of many sizes, each almost twice the one before: solving without a closed form takes its time."""
    kept: list[float] = []
    for size in steps:
        if not kept or size >= 1.9 * kept[-1] or size == steps[-1]:
            kept.append(size)
    return tuple(kept)


def _roll_knobs(window: RollWindow) -> Iterator[Knob]:
    if window.is_full:
        return
    deg = 2 * SCALE["deg"]  # the roll is the easiest to change
    for sign, how in ((-1, "low"), (1, "high")):
        if window.is_fixed:
            yield Knob("roll", "shift", sign, _angles(180.0), 1.0, "deg", deg)
        width = float(np.rad2deg(window.high - window.low))
        steps = tuple(s for s in WIDER_STEPS if s <= 355.0 - width)
        # a roll that may move is more than one that is held elsewhere
        yield Knob("roll", how, sign, steps, 1.0, "deg", deg / 1.5)
    yield Knob("roll", "free", 1, (180.0,), 180.0, "deg", deg)


def _table_knobs(job: Job) -> Iterator[Knob]:
    for axis in np.array(["E1", "E2"])[job.scene.has_axis]:
        for sign in (-1, 1):
            yield Knob(f"table.{axis}_deg", "", sign, _angles(180.0), 1.0, "deg", SCALE["deg"])


def seam_knobs(places: Mapping[str, tuple[SeamSection, ...]]) -> list[Knob]:
    """Seams elsewhere, one knob a sub-volume; sizes number the places, which change as little as some roll."""
    by = 2 * SCALE["deg"]
    return [Knob(SEAMS, k, 1, tuple(map(float, range(len(p)))), 1.0, "seam", by, p) for k, p in places.items() if p]


def pair_knob(start: Start) -> Knob | None:
    """Both table angles together, on a grid; sizes number the grid's poses, the nearest first."""
    steps = tuple(float(i) for i in range(len(_PAIRS)))
    if not start.job.scene.has_axis.all():
        return None
    knob = Knob("table", "", 1, steps, 1.0, "pose", SCALE["deg"])
    steps = tuple(s for s in steps if start.has(knob, s))
    return replace(knob, steps=steps) if steps else None


def pair_of(size: float) -> tuple[float, float]:
    """The changes of E1 and E2 that a size of the pair's knob stands for, deg."""
    return _PAIRS[round(size)]


def _pairs() -> list[tuple[float, float]]:
    values = np.arange(-PAIR_REACH, PAIR_REACH + 1, PAIR_STEP)
    both = [(float(a), float(b)) for a in values for b in values if a and b]
    return sorted(both, key=lambda p: (max(abs(p[0]), abs(p[1])), abs(p[0]) + abs(p[1])))


_PAIRS = _pairs()


def _place_knobs(case: Case) -> Iterator[Knob]:
    mm = SCALE["mm"]
    for axis in "xyz":
        for sign in (-1, 1):
            steps: tuple[float, ...] = SHIFT_STEPS
            if axis == "z" and sign < 0 and case.floor:  # not into the floor
                steps = tuple(s for s in steps if s <= case.positioner.position_mm[2])
            yield Knob("positioner.position_mm", axis, sign, steps, 5.0, "mm", mm)
    if case.support is not None:
        low = tuple(s for s in SHIFT_STEPS if s < case.support.height_mm)
        yield Knob("support.height_mm", "", -1, low, 5.0, "mm", mm)
        yield Knob("support.height_mm", "", 1, SHIFT_STEPS, 5.0, "mm", mm)
    else:
        # a support would not move with the part
        for axis in "xy":
            for sign in (-1, 1):
                yield Knob("part.position_mm", axis, sign, PART_STEPS, 5.0, "mm", mm)
    if case.tool.model == "cmt_torch":
        most = ALLOWED["stick_out_mm"][1] - stick_out(case)
        longer = tuple(s for s in STICK_OUT_STEPS if s <= most)
        yield Knob("tool.dimensions.stick_out_mm", "", 1, longer, 1.0, "mm", mm / 10)


def _angles(most: float) -> tuple[float, ...]:
    return tuple(float(v) for v in np.arange(ANGLE_STEP, most + 1e-9, ANGLE_STEP))


def stick_out(case: Case) -> float:
    """The wire's free length, mm."""
    return case.tool.dimensions.get("stick_out_mm", TorchDimensions().stick_out_mm)


def roll_after(window: RollWindow, knob: Knob, size: float) -> RollWindow:
    """Allowed roll after a change, as ``Start.poses`` needs it: a shifted roll is in the poses."""
    if knob.key != "roll" or knob.how == "shift":
        return window
    if knob.how == "free":
        return RollWindow.free()
    by = float(np.deg2rad(size))
    return RollWindow(window.low - by * (knob.how == "low"), window.high + by * (knob.how == "high"))


def changed_case(case: Case, knob: Knob, size: float) -> Case:
    """A case with one key changed; the table's angles are not the case's and stay."""
    by = knob.sign * size
    if knob.key == SEAMS:
        return with_seam(case, knob.choices[round(size)])
    if knob.key == "roll":
        return with_changes(case, roll=_changed_roll(case, knob, size))
    if knob.key == "positioner.position_mm":
        at = _shifted(case.positioner.position_mm, knob, by)
        return with_changes(case, positioner=case.positioner.model_copy(update={"position_mm": at}))
    if knob.key == "part.position_mm":
        at = _shifted(case.part.position_mm, knob, by)
        return with_changes(case, part=case.part.model_copy(update={"position_mm": at}))
    if knob.key == "support.height_mm" and case.support is not None:
        height = case.support.height_mm + by
        return with_changes(case, support=case.support.model_copy(update={"height_mm": height}))
    if knob.key == "tool.dimensions.stick_out_mm":
        dimensions = {**case.tool.dimensions, "stick_out_mm": stick_out(case) + by}
        return with_changes(case, tool=case.tool.model_copy(update={"dimensions": dimensions}))
    if knob.key == "process.deposition_speed_mm_s":
        speed = case.process.deposition_speed_mm_s * (1 + by)
        return with_changes(case, process=case.process.model_copy(update={"deposition_speed_mm_s": speed}))
    if knob.key == "process.blend_mm":
        blend = round(case.process.blend_mm * (1 + by), 6)
        return with_changes(case, process=case.process.model_copy(update={"blend_mm": blend}))
    return case


def _changed_roll(case: Case, knob: Knob, size: float) -> Any:
    if knob.how == "free" or isinstance(case.roll, str):
        return "free"
    low, high = case.roll.range_deg or (case.roll.fixed_deg or 0.0, case.roll.fixed_deg or 0.0)
    if knob.how == "shift":
        return {"fixed_deg": _half_turn(low + knob.sign * size)}
    return {"range_deg": [low - size * (knob.how == "low"), high + size * (knob.how == "high")]}


def _shifted(at: tuple[float, float, float], knob: Knob, by: float) -> tuple[float, float, float]:
    x, y, z = (value + by * (knob.how == axis) for value, axis in zip(at, "xyz", strict=True))
    return x, y, z


def _half_turn(angle: float) -> float:
    """An angle in (-180, 180]."""
    return 180.0 - (180.0 - angle) % 360.0


def _round(value: float) -> float:
    return round(value, 3) + 0.0


def _roll_value(case: Case) -> Any:
    if isinstance(case.roll, str):
        return case.roll
    if case.roll.fixed_deg is not None:
        return {"fixed_deg": _round(case.roll.fixed_deg)}
    return {"range_deg": [_round(v) for v in case.roll.range_deg or ()]}


def value_of(case: Case, key: str) -> Any:
    """A key's value in a case, rounded."""
    if key == "tool.dimensions.stick_out_mm":
        return _round(stick_out(case))
    value: Any = case
    for name in key.split("."):
        value = getattr(value, name)
    return [_round(v) for v in value] if isinstance(value, tuple) else _round(value)
