"""What a failure says beside its measure: where it is, what is in the way, how far a search went, and why.

Use:

    FailurePlace(Where.BEAD, from_target=3)
    Contact(("torch_nozzle", "deposit/3/SV1/0"), seen=Seen.ROUNDED)

``cell.failure`` has the failure itself, and these names as well. Millimetres and degrees, as in the documents.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class Where(Enum):
    """On what something is wrong."""

    TARGET = "a target by itself"
    BEAD = "the way from a target to the next"
    TRAVEL = "the way from one bead to the next"
    FROM_HOME = "the way from home to the first bead"
    TO_HOME = "the way from the last bead home"
    TABLE_TURN = "the table's turn from one pose to the next, before a bead"
    ROWS = "rows of a motion"


@dataclass(frozen=True, slots=True)
class FailurePlace:
    """Where something is wrong. Targets are None where they are not known, or where it is none.

    Attributes:
        where: on what.
        target: the target that the verdict is on; of rows the first that is concerned.
        from_target: that the way leaves.
        to_target: that a travel leads to; of rows the last that is concerned.
        at_home: whether it is the arm's home itself that is in the way.
    """

    where: Where = Where.TARGET
    target: int | None = None
    from_target: int | None = None
    to_target: int | None = None
    at_home: bool = False


AT_TARGET = FailurePlace()
ON_BEAD = FailurePlace(Where.BEAD)
ON_TRAVEL = FailurePlace(Where.TRAVEL)
IN_ROWS = FailurePlace(Where.ROWS)


class CollisionPlace(Enum):
    """Where a pair of geoms is too near."""

    AT_SAMPLE = "at a sample"
    BETWEEN_SAMPLES = "between samples, where nothing proves the clearance"
    BETWEEN_ROWS = "between rows, where nothing proves the clearance"
    ROUNDED = "where a corner is rounded"


@dataclass(frozen=True, slots=True)
class Contact:
    """Two geoms that are too near one another.

    Attributes:
        pair: their names.
        world_xyz_mm: where they are nearest; None where that is not known.
        seen: at a sample, or how else it was found.
        note: anything else about it, in words.
    """

    pair: tuple[str, ...]
    world_xyz_mm: tuple[float, ...] | None = None
    seen: CollisionPlace = CollisionPlace.AT_SAMPLE
    note: str = ""


@dataclass(frozen=True, slots=True)
class SearchEffort:
    """How far a search went that found nothing.

    Attributes:
        attempts: configurations tried for a travel.
        searches: of a bead, each with something blocked.
        shut_in: end of a travel that did not come free: "leaving" or "arriving".
        reached_mm: of a way out of a bead, as far as the arm can follow it.
        retract_mm: how far that was to lead.
        seeds: from which each roll was searched.
        rolls: that were searched.
        note: anything else, in words.
    """

    attempts: int | None = None
    searches: int | None = None
    shut_in: str = ""
    reached_mm: float | None = None
    retract_mm: float | None = None
    seeds: int | None = None
    rolls: int | None = None
    note: str = ""


@dataclass(frozen=True, slots=True)
class SlowdownCause:
    """What holds the deposition up.

    Attributes:
        by: "speed" or "acceleration" of the failure's axis; empty where it is unknown.
        seconds: that the way takes.
    """

    by: str
    seconds: float


@dataclass(frozen=True, slots=True)
class OverhangArea:
    """The part of a layer that overhangs.

    Attributes:
        area_mm2: of what hangs.
        begins_mm2: of that, where metal begins with nothing below.
        place_mm: where, part frame.
    """

    area_mm2: float
    begins_mm2: float
    place_mm: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class BeadOrder:
    """Beads out of order: the one welded, and the last one before it (None: it is the first)."""

    bead: int
    after: int | None


@dataclass(frozen=True, slots=True)
class LaidLayer:
    """A layer that locks the torch out."""

    sub_volume: str
    layer: int
