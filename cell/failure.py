"""What is wrong with a target, a bead, a travel or the rows of a motion: one record for all of them.

Use:

    failure = Failure(Kind.JOINT_LIMIT, measure=2.1, axis="A5")
    failure.reason, failure.measure, failure.unit         # "joint_limit", 2.1, "deg"
    failure.document()                                    # {"axis": "A5", "over_deg": 2.1}, as documents write it

Searches make these records, ``cell.verdict.words`` says them, and ``document`` writes what docs/formats.md describes.
Millimetres and degrees, as in the documents.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from enum import Enum, unique
from typing import Any

from .failure_facts import AT_TARGET as AT_TARGET
from .failure_facts import IN_ROWS as IN_ROWS
from .failure_facts import ON_BEAD as ON_BEAD
from .failure_facts import ON_TRAVEL as ON_TRAVEL
from .failure_facts import BeadOrder as BeadOrder
from .failure_facts import CollisionPlace as CollisionPlace
from .failure_facts import Contact as Contact
from .failure_facts import FailurePlace as FailurePlace
from .failure_facts import LaidLayer as LaidLayer
from .failure_facts import OverhangArea as OverhangArea
from .failure_facts import SearchEffort as SearchEffort
from .failure_facts import SlowdownCause as SlowdownCause
from .failure_facts import Where as Where
from .plain import plain
from .units import MARGIN_UNITS


@unique
class Kind(Enum):
    """What is wrong: its reason in reports, its word on the way, the keys of its measure and limit, and their unit.

    Attributes:
        reason: of a target by itself, or of the rows of a motion.
        word: what ``on_the_way`` and ``because`` call it.
        measure_key: of the measure in a document.
        limit_key: of the limit; empty where the kind has none.
        unit: of both; empty where the document writes it ("deg", "mm" or "1" with the measure).
    """

    # the wrist's distance from what it reaches: positive beyond, negative too close
    UNREACHABLE = ("unreachable", "unreachable", "beyond_reach_mm", "", "mm")
    JOINT_LIMIT = ("joint_limit", "joint_limit", "over_deg", "", "deg")  # axis
    SINGULAR = ("singular", "singular", "margin", "limit", "")  # singularity: which margin
    COLLISION = ("collision", "collision", "distance_mm", "required_mm", "mm")  # contact
    JUMP = ("no_path", "jump", "turns_deg", "", "deg")
    ARRIVES_OFF = ("no_path", "jump", "arrives_off_deg", "", "deg")  # axis
    CONFIGURATION_CHANGE = ("no_path", "configuration change", "", "", "1")  # because
    JOINT_SPEED = ("speed", "speed", "needed_deg_s", "allowed_deg_s", "deg/s")  # axis
    DEPOSITION_SPEED = ("speed", "speed", "share", "limit", "1")  # slowed; axis where one is the cause
    DRIVE_SPEED = ("speed", "drive speed", "needed_deg_s", "limit_deg_s", "deg/s")  # axis
    DRIVE_ACCELERATION = ("speed", "drive acceleration", "needed_deg_s2", "limit_deg_s2", "deg/s2")  # axis
    STANDSTILL = ("speed", "standstill", "seconds", "limit_s", "s")
    GRAVITY = ("gravity", "gravity", "angle_deg", "limit_deg", "deg")
    OVERHANG = ("overhang", "overhang", "out_mm", "limit_mm", "mm")  # hanging; no measure: nothing below anywhere
    OFF_BEAD = ("off_bead", "off_bead", "off_mm", "limit", "mm")
    OFF_WIRE = ("off_bead", "off_wire", "off_wire_deg", "limit", "deg")
    ROLL_OUTSIDE = ("off_bead", "roll_outside", "roll_outside_deg", "limit", "deg")
    BEAD_ORDER = ("order", "bead_order", "", "", "1")  # beads
    GOES_BACK = ("order", "goes_back", "goes_back_mm", "", "mm")
    SKIPS = ("order", "skips", "skips_mm", "", "mm")
    NOT_WELDED = ("not_welded", "not_welded", "", "", "1")  # from the place's target to its to_target
    # of a robot program
    OUT_OF_REACH = ("unreachable", "out_of_reach", "", "", "1")  # in the configuration that the arm is in
    NO_CONFIGURATION = ("no_path", "no_configuration", "turns_deg", "", "deg")  # the arm would jump
    TOOL_OFF = ("tool", "tool_off", "off_mm", "limit", "mm")
    TOOL_TURNED = ("tool", "tool_turned", "off_deg", "limit", "deg")
    BASE_STANDS = ("base", "base_stands", "table_moves_deg", "", "deg")
    BASE_ROOT = ("base", "base_root", "off_mm", "limit_mm", "mm")  # the table's root
    NOT_GIVEN = ("external", "not_given", "", "", "1")  # axis
    HALF_TURN = ("external", "half_turn", "turns_deg", "", "deg")  # axis; of an endless one
    BLEND = ("blend", "blend", "blend_mm", "limit_mm", "mm")
    ARC_CORNER = ("blend", "arc_corner", "blend_mm", "limit_mm", "mm")  # no measure: of a PTP by its share
    PTP_WITH_ARC = ("arc", "ptp_with_arc", "", "", "1")
    ARC_LEFT_ON = ("arc", "arc_left_on", "", "", "1")
    ARC_ON_AGAIN = ("arc", "arc_on_again", "", "", "1")
    ARC_OFF_AGAIN = ("arc", "arc_off_again", "", "", "1")
    PATH_SPEED = ("speed", "path_speed", "speed_m_s", "limit_m_s", "m/s")

    def __init__(self, reason: str, word: str, measure_key: str, limit_key: str, unit: str) -> None:
        """Name the parts of a kind's value."""
        self.reason, self.word = reason, word
        self.measure_key, self.limit_key, self.unit = measure_key, limit_key, unit

    @property
    def says_unit(self) -> bool:
        """Whether a document writes the unit beside the measure."""
        return self in (Kind.SINGULAR, Kind.OFF_BEAD, Kind.OFF_WIRE, Kind.ROLL_OUTSIDE)


@dataclass(frozen=True, slots=True)
class RollBetween:
    """What becomes of a target at a roll between the samples, where kinematics alone reaches it.

    Attributes:
        roll_deg: that roll.
        collision: with the nearest pair; None where the arm stands there free.
    """

    roll_deg: float
    collision: Failure | None = None


@dataclass(frozen=True, slots=True)
class Failure:
    """What is wrong, by how much, and where. Which attributes a failure has goes by its kind.

    Attributes:
        kind: what is wrong.
        measure: the amount, in ``unit``; None where it is not known.
        limit: the amount that is allowed or needed, in ``unit``.
        axis: the axis concerned.
        contact: the pair of a collision.
        singularity: the margin that is too small: "wrist", "elbow", "shoulder" or "sigma".
        sigma: smallest singular value there.
        roll_deg: roll of the configuration that was measured.
        between: a roll between the samples at which the target is reached.
        because: the failure of the configuration that the arm would have to keep.
        place: the target, bead, travel or rows concerned.
        effort: how far the search went.
        locked_by: layers that cause the collision: without them the target is free.
        cause: details of a slow deposition, of an overhang, or of beads out of order.
        proved: whether it is proved that no configuration can do it.
    """

    kind: Kind
    measure: float | None = None
    limit: float | None = None
    axis: str = ""
    contact: Contact | None = None
    singularity: str = ""
    sigma: float | None = None
    roll_deg: float | None = None
    between: RollBetween | None = None
    because: Failure | None = None
    place: FailurePlace = AT_TARGET
    effort: SearchEffort | None = None
    locked_by: tuple[LaidLayer, ...] = field(default=())
    cause: SlowdownCause | OverhangArea | BeadOrder | None = None
    proved: bool = False

    @property
    def reason(self) -> str:
        """The reason in reports; between targets it is "no_path" for everything but a speed."""
        if self.place.where in (Where.TARGET, Where.ROWS) or self.kind.reason == "speed":
            return self.kind.reason
        return "no_path"

    @property
    def root(self) -> Failure:
        """The failure behind this one, or this one itself."""
        return self if self.because is None else self.because

    @property
    def pair(self) -> tuple[str, ...]:
        """Names of the geoms that are too near; empty where none are."""
        contact = self.root.contact
        return () if contact is None else contact.pair

    @property
    def unit(self) -> str:
        """Unit of measure and limit."""
        return MARGIN_UNITS[self.singularity][0] if self.kind is Kind.SINGULAR and self.singularity else self.kind.unit

    @property
    def where(self) -> Where:
        """Whether it concerns a target, a bead, a travel or rows."""
        return self.place.where

    @property
    def target(self) -> int | None:
        """The target that the verdict is on."""
        return self.place.target

    @property
    def from_target(self) -> int | None:
        """The target from which the way leads on."""
        return self.place.from_target

    @property
    def to_target(self) -> int | None:
        """The target that a travel leads to."""
        return self.place.to_target

    @property
    def rounded(self) -> bool:
        """Whether only the rounded corner comes too near."""
        return self.contact is not None and self.contact.seen is CollisionPlace.ROUNDED

    def at(self, place: FailurePlace) -> Failure:
        """The same failure at another place.

        Args:
            place: where.
        """
        return replace(self, place=place)

    def seen(self, seen: CollisionPlace) -> Failure:
        """The same collision, found in another way.

        Args:
            seen: how; of a failure that is no collision nothing is changed.
        """
        return self if self.contact is None else replace(self, contact=replace(self.contact, seen=seen))

    def document(self) -> dict[str, Any]:
        """As documents write it: see "detail" in docs/formats.md."""
        found = dict(self._place_items())
        if self._is_on_a_way:
            found["on_the_way"] = self.kind.word
        if self.because is not None:
            found["because"] = self.because.kind.word
            found.update(self.because._measure_items())
        found.update(self._measure_items())
        found.update(self._other_items())
        return dict(plain(found))

    @property
    def _is_on_a_way(self) -> bool:
        ways = (Where.BEAD, Where.TRAVEL, Where.FROM_HOME, Where.TO_HOME, Where.TABLE_TURN)
        return self.where in ways or self.kind in (Kind.JUMP, Kind.ARRIVES_OFF, Kind.CONFIGURATION_CHANGE)

    def _place_items(self) -> Iterator[tuple[str, Any]]:
        place = self.place
        if place.where is Where.FROM_HOME:
            yield from (("from", "home"), ("travel", True), ("to_target", place.to_target))
            return
        if place.from_target is not None:
            yield "from_target", place.from_target
        if place.where is Where.TO_HOME:
            yield from (("travel", True), ("to", "home"))
        elif place.where is Where.TABLE_TURN:
            yield from (("table_turns", True), ("to_target", place.to_target))
        elif place.where is Where.TRAVEL and place.from_target is not None:
            yield from (("travel", True), ("to_target", place.to_target))
        elif self.kind is Kind.NOT_WELDED:
            yield from (("target", place.target), ("to_target", place.to_target))

    def _measure_items(self) -> Iterator[tuple[str, Any]]:
        """The kind's own keys."""
        kind, contact = self.kind, self.contact
        if self.axis or (kind is Kind.DEPOSITION_SPEED and self.where is not Where.ROWS):
            yield "axis", self.axis
        yield from self._cause_items()
        if contact is not None:
            yield "pair", list(contact.pair)
        if self.singularity:
            yield "singularity", self.singularity
        if self.measure is not None and kind is Kind.UNREACHABLE:
            beyond = math.copysign(1.0, self.measure) > 0
            yield "beyond_reach_mm" if beyond else "inside_reach_mm", abs(self.measure)
        elif self.measure is not None or contact is not None or kind is Kind.OVERHANG:
            yield kind.measure_key, self.measure
        if self.limit is not None:
            yield kind.limit_key, self.limit
        if kind.says_unit and self.measure is not None:
            yield "unit", self.unit
        if contact is not None and contact.world_xyz_mm is not None:
            yield "world_xyz_mm", list(contact.world_xyz_mm)
        if contact is not None and contact.note:
            yield "note", contact.note
        if self.sigma is not None:
            yield "smallest_singular_value", self.sigma
        if self.roll_deg is not None:
            yield "roll_deg", self.roll_deg

    def _cause_items(self) -> Iterator[tuple[str, Any]]:
        by = {Kind.DRIVE_SPEED: "speed", Kind.DRIVE_ACCELERATION: "acceleration", Kind.STANDSTILL: "standing still"}
        by[Kind.PATH_SPEED] = "path"
        if self.kind in by:
            yield "by", by[self.kind]
        if isinstance(self.cause, SlowdownCause):
            yield "by", "deposition" if self.where is Where.ROWS else self.cause.by
            yield "seconds", self.cause.seconds
        elif isinstance(self.cause, OverhangArea):
            yield "area_mm2", self.cause.area_mm2
            yield "begins_mm2", self.cause.begins_mm2
            yield "place_mm", list(self.cause.place_mm)
        elif isinstance(self.cause, BeadOrder):
            yield from (("bead", self.cause.bead), ("after_bead", self.cause.after))

    def _other_items(self) -> Iterator[tuple[str, Any]]:
        if self.between is not None:
            roll = self.between.roll_deg
            if self.between.collision is None:
                yield "reached_alone_at_roll_deg", roll
            else:
                yield "reached_in_collision_at_roll_deg", roll
                yield "in_collision", self.between.collision.document()
        if self.kind.reason == "arc":
            yield "what", self.kind.word
        seen = CollisionPlace.AT_SAMPLE if self.contact is None else self.contact.seen
        if seen is not CollisionPlace.AT_SAMPLE:
            key = {
                CollisionPlace.BETWEEN_SAMPLES: "between_samples",
                CollisionPlace.BETWEEN_ROWS: "between_rows",
                CollisionPlace.ROUNDED: "rounded",
            }
            yield key[seen], True
        if self.place.at_home:
            yield "at_home", True
        if self.effort is not None:
            yield from _effort_items(self.effort)
        if self.locked_by:
            yield "blocked_by_layers", [{"sub_volume": x.sub_volume, "layer": x.layer} for x in self.locked_by]


def _effort_items(effort: SearchEffort) -> Iterator[tuple[str, Any]]:
    if effort.seeds is not None:
        yield "search", f"not found from {effort.seeds} seeds at {effort.rolls} roll{'s' * (effort.rolls != 1)}"
    for key, value in (("reached_mm", effort.reached_mm), ("retract_mm", effort.retract_mm)):
        if value is not None:
            yield key, value
    if effort.attempts is not None:
        yield "attempts", effort.attempts
    if effort.shut_in:
        yield "while", effort.shut_in
    if effort.searches is not None:
        yield "searches", effort.searches
    if effort.note:
        yield "note", effort.note
