"""Every kind of failure is written as docs/formats.md says, and has its reason and its words."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from typing import Any

import pytest
from support.paths import ROOT

from cell.case.sections import REASONS
from cell.failure import (
    IN_ROWS,
    ON_BEAD,
    BeadOrder,
    CollisionPlace,
    Contact,
    Failure,
    FailurePlace,
    Kind,
    LaidLayer,
    OverhangArea,
    RollBetween,
    SearchEffort,
    SlowdownCause,
    Where,
)
from cell.programs.program_check import PROGRAM_REASONS
from cell.verdict.failure_words import failure_in_words
from cell.verification.bead_order import REASONS as OF_ROWS

PAIR = Contact(("a", "b"), (1.0, 2.0, 3.0))
BEAD = FailurePlace(Where.BEAD, target=4, from_target=3)
TRAVEL = FailurePlace(Where.TRAVEL, target=4, from_target=3, to_target=4)
LIMIT = Failure(Kind.JOINT_LIMIT, 2.1, axis="A5")
HIT = Failure(Kind.COLLISION, -1.0, 5.0, contact=PAIR)
WRITTEN: list[tuple[Failure, str, dict[str, Any]]] = [
    (LIMIT, "joint_limit", {"axis": "A5", "over_deg": 2.1}),
    (Failure(Kind.UNREACHABLE, 3.0, roll_deg=15.0), "unreachable", {"beyond_reach_mm": 3.0, "roll_deg": 15.0}),
    (Failure(Kind.UNREACHABLE, -3.0), "unreachable", {"inside_reach_mm": 3.0}),
    (Failure(Kind.UNREACHABLE, -0.0), "unreachable", {"inside_reach_mm": 0.0}),
    (
        Failure(Kind.UNREACHABLE, effort=SearchEffort(seeds=20, rolls=3)),
        "unreachable",
        {"search": "not found from 20 seeds at 3 rolls"},
    ),
    (
        Failure(Kind.SINGULAR, 1.5, 30.0, singularity="shoulder", sigma=0.01),
        "singular",
        {"singularity": "shoulder", "margin": 1.5, "limit": 30.0, "unit": "mm", "smallest_singular_value": 0.01},
    ),
    (HIT, "collision", {"pair": ["a", "b"], "distance_mm": -1.0, "required_mm": 5.0, "world_xyz_mm": [1.0, 2.0, 3.0]}),
    (
        replace(LIMIT, between=RollBetween(12.5), place=ON_BEAD),
        "no_path",
        {"on_the_way": "joint_limit", "axis": "A5", "over_deg": 2.1, "reached_alone_at_roll_deg": 12.5},
    ),
    (
        replace(LIMIT, between=RollBetween(12.5, replace(HIT, contact=Contact(("a", "b"))))),
        "joint_limit",
        {
            "axis": "A5",
            "over_deg": 2.1,
            "reached_in_collision_at_roll_deg": 12.5,
            "in_collision": {"pair": ["a", "b"], "distance_mm": -1.0, "required_mm": 5.0},
        },
    ),
    (
        Failure(Kind.CONFIGURATION_CHANGE, because=LIMIT, place=BEAD, effort=SearchEffort(searches=60)),
        "no_path",
        {
            "from_target": 3,
            "on_the_way": "configuration change",
            "because": "joint_limit",
            "axis": "A5",
            "over_deg": 2.1,
            "searches": 60,
        },
    ),
    (
        Failure(Kind.COLLISION, 5.5, 5.0, contact=Contact(("a", "b"), seen=CollisionPlace.BETWEEN_SAMPLES), place=BEAD),
        "no_path",
        {
            "from_target": 3,
            "on_the_way": "collision",
            "pair": ["a", "b"],
            "distance_mm": 5.5,
            "required_mm": 5.0,
            "between_samples": True,
        },
    ),
    (
        Failure(
            Kind.JUMP,
            place=TRAVEL,
            effort=SearchEffort(attempts=60, shut_in="leaving", reached_mm=2.0, retract_mm=30.0),
            locked_by=(LaidLayer("SV1", 3), LaidLayer("SV1", 4)),
        ),
        "no_path",
        {
            "from_target": 3,
            "travel": True,
            "to_target": 4,
            "on_the_way": "jump",
            "reached_mm": 2.0,
            "retract_mm": 30.0,
            "attempts": 60,
            "while": "leaving",
            "blocked_by_layers": [{"sub_volume": "SV1", "layer": 3}, {"sub_volume": "SV1", "layer": 4}],
        },
    ),
    (
        Failure(Kind.UNREACHABLE, place=FailurePlace(Where.FROM_HOME, to_target=0, at_home=True)),
        "no_path",
        {"from": "home", "travel": True, "to_target": 0, "on_the_way": "unreachable", "at_home": True},
    ),
    (
        Failure(Kind.UNREACHABLE, place=FailurePlace(Where.TO_HOME, from_target=9)),
        "no_path",
        {"from_target": 9, "travel": True, "to": "home", "on_the_way": "unreachable"},
    ),
    (
        Failure(Kind.ARRIVES_OFF, 4.0, axis="A4", place=BEAD),
        "no_path",
        {"from_target": 3, "on_the_way": "jump", "axis": "A4", "arrives_off_deg": 4.0},
    ),
    (
        Failure(Kind.JOINT_SPEED, 120.0, 100.0, axis="A4", place=BEAD),
        "speed",
        {"from_target": 3, "on_the_way": "speed", "axis": "A4", "needed_deg_s": 120.0, "allowed_deg_s": 100.0},
    ),
    (
        Failure(Kind.DEPOSITION_SPEED, 0.5, 0.9, cause=SlowdownCause("", 2.0), place=BEAD),
        "speed",
        {
            "from_target": 3,
            "on_the_way": "speed",
            "share": 0.5,
            "limit": 0.9,
            "axis": "",
            "by": "",
            "seconds": 2.0,
        },
    ),
    (
        Failure(
            Kind.DEPOSITION_SPEED, 0.5, 0.9, cause=SlowdownCause("", 2.0), place=FailurePlace(Where.ROWS, from_target=3)
        ),
        "speed",
        {"by": "deposition", "from_target": 3, "share": 0.5, "limit": 0.9, "seconds": 2.0},
    ),
    (
        Failure(Kind.DRIVE_SPEED, 120.0, 100.0, axis="E1", place=IN_ROWS),
        "speed",
        {"axis": "E1", "by": "speed", "needed_deg_s": 120.0, "limit_deg_s": 100.0},
    ),
    (
        Failure(Kind.DRIVE_ACCELERATION, 120.0, 100.0, axis="E1", place=IN_ROWS),
        "speed",
        {"axis": "E1", "by": "acceleration", "needed_deg_s2": 120.0, "limit_deg_s2": 100.0},
    ),
    (
        Failure(Kind.STANDSTILL, 3.0, 0.5, place=IN_ROWS),
        "speed",
        {"by": "standing still", "seconds": 3.0, "limit_s": 0.5},
    ),
    (Failure(Kind.GRAVITY, 50.0, 45.0), "gravity", {"angle_deg": 50.0, "limit_deg": 45.0}),
    (
        Failure(Kind.OVERHANG, None, 2.0, cause=OverhangArea(20.0, 10.0, (1.0, 2.0, 3.0))),
        "overhang",
        {"out_mm": None, "area_mm2": 20.0, "begins_mm2": 10.0, "place_mm": [1.0, 2.0, 3.0], "limit_mm": 2.0},
    ),
    (
        Failure(Kind.COLLISION, None, 5.0, contact=Contact(("a",), seen=CollisionPlace.BETWEEN_ROWS), place=IN_ROWS),
        "collision",
        {"between_rows": True, "pair": ["a"], "distance_mm": None, "required_mm": 5.0},
    ),
    (Failure(Kind.OFF_BEAD, 0.5, 0.1, place=IN_ROWS), "off_bead", {"off_mm": 0.5, "limit": 0.1, "unit": "mm"}),
    (Failure(Kind.OFF_WIRE, 0.5, 0.1, place=IN_ROWS), "off_bead", {"off_wire_deg": 0.5, "limit": 0.1, "unit": "deg"}),
    (
        Failure(Kind.ROLL_OUTSIDE, 0.5, 0.1, place=IN_ROWS),
        "off_bead",
        {"roll_outside_deg": 0.5, "limit": 0.1, "unit": "deg"},
    ),
    (Failure(Kind.BEAD_ORDER, cause=BeadOrder(2, None), place=IN_ROWS), "order", {"bead": 2, "after_bead": None}),
    (Failure(Kind.GOES_BACK, 1.0, place=IN_ROWS), "order", {"goes_back_mm": 1.0}),
    (Failure(Kind.SKIPS, 1.0, place=IN_ROWS), "order", {"skips_mm": 1.0}),
    (
        Failure(Kind.NOT_WELDED, place=FailurePlace(Where.ROWS, target=2, to_target=5)),
        "not_welded",
        {"target": 2, "to_target": 5},
    ),
    (Failure(Kind.JUMP, 40.0, place=IN_ROWS), "no_path", {"on_the_way": "jump", "turns_deg": 40.0}),
    (Failure(Kind.OUT_OF_REACH, place=IN_ROWS), "unreachable", {}),
    (Failure(Kind.NO_CONFIGURATION, 170.0, place=IN_ROWS), "no_path", {"turns_deg": 170.0}),
    (Failure(Kind.TOOL_OFF, 1.0, 0.05, place=IN_ROWS), "tool", {"off_mm": 1.0, "limit": 0.05}),
    (Failure(Kind.TOOL_TURNED, 1.0, 0.05, place=IN_ROWS), "tool", {"off_deg": 1.0, "limit": 0.05}),
    (Failure(Kind.BASE_STANDS, 9.0, place=IN_ROWS), "base", {"table_moves_deg": 9.0}),
    (Failure(Kind.BASE_ROOT, 5.0, 0.05, place=IN_ROWS), "base", {"off_mm": 5.0, "limit_mm": 0.05}),
    (Failure(Kind.NOT_GIVEN, axis="E1", place=IN_ROWS), "external", {"axis": "E1"}),
    (Failure(Kind.HALF_TURN, 180.0, axis="E2", place=IN_ROWS), "external", {"axis": "E2", "turns_deg": 180.0}),
    (Failure(Kind.BLEND, 10.0, 1.0, place=IN_ROWS), "blend", {"blend_mm": 10.0, "limit_mm": 1.0}),
    (Failure(Kind.ARC_CORNER, 1.0, 0.0, place=IN_ROWS), "blend", {"blend_mm": 1.0, "limit_mm": 0.0}),
    (Failure(Kind.PTP_WITH_ARC, place=IN_ROWS), "arc", {"what": "ptp_with_arc"}),
    (Failure(Kind.ARC_LEFT_ON, place=IN_ROWS), "arc", {"what": "arc_left_on"}),
    (Failure(Kind.ARC_ON_AGAIN, place=IN_ROWS), "arc", {"what": "arc_on_again"}),
    (Failure(Kind.ARC_OFF_AGAIN, place=IN_ROWS), "arc", {"what": "arc_off_again"}),
    (Failure(Kind.PATH_SPEED, 8.0, 3.0, place=IN_ROWS), "speed", {"by": "path", "speed_m_s": 8.0, "limit_m_s": 3.0}),
    (
        Failure(Kind.CONFIGURATION_CHANGE, singularity="wrist", place=IN_ROWS),
        "no_path",
        {"on_the_way": "configuration change", "singularity": "wrist"},
    ),
]


@pytest.mark.parametrize(("failure", "reason", "document"), WRITTEN)
def test_a_failure_is_written_as_the_contract_has_it(failure: Failure, reason: str, document: dict[str, Any]) -> None:
    rows = failure.where is Where.ROWS
    assert failure.reason == reason
    assert reason in ((*OF_ROWS, *PROGRAM_REASONS) if rows else REASONS)
    assert json.loads(json.dumps(failure.document())) == document
    words = failure_in_words(failure)
    assert words
    assert "None" not in words
    assert failure.axis in words


def test_every_kind_is_written_and_every_key_is_in_the_documentation() -> None:
    assert {failure.kind for failure, _, _ in WRITTEN} == set(Kind)
    text = (ROOT / "docs" / "formats.md").read_text(encoding="utf-8")
    known = set(re.findall(r"[a-z_0-9]+", text))
    for _, _, document in WRITTEN:
        assert set(document) <= known


def test_what_stops_a_change_of_configuration_is_what_counts() -> None:
    change = Failure(Kind.CONFIGURATION_CHANGE, because=HIT, place=BEAD)
    assert change.pair == ("a", "b")
    assert change.root is HIT
    assert not change.rounded
    assert HIT.seen(CollisionPlace.ROUNDED).rounded
    assert (LIMIT.unit, Failure(Kind.SINGULAR, 1.0, 2.0, singularity="sigma").unit) == ("deg", "1")


def test_a_rounding_that_is_not_proved_free_is_not_said_to_be_too_near() -> None:
    unproved = replace(HIT, measure=12.0).seen(CollisionPlace.ROUNDED)
    for place, words in (
        (IN_ROWS, "not proved free where a corner is rounded: a - b 12.0 mm"),
        (ON_BEAD, "are not proved"),
    ):
        assert words in failure_in_words(replace(unproved, place=place))
    assert "not proved" not in failure_in_words(replace(HIT, place=IN_ROWS).seen(CollisionPlace.ROUNDED))
