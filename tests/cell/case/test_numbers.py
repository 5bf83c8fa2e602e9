"""Every number of a case has its range, and a case that was changed is held against the same ranges."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pytest
import yaml

from cell.case.read import load_case, parse_case, with_changes
from cell.case.roll_text import parse_roll
from cell.case.sections import Case
from cell.case.yaml12 import MOST_DEPTH, load_yaml
from cell.errors import InputError

MINIMAL = {"part": {"sub_volumes": ["a.stl"], "body": {"radius_mm": 20}}}


def numbers(schema: Any, where: str = "") -> Iterator[tuple[str, dict[str, Any]]]:
    """All places of a JSON schema that hold a number."""
    if isinstance(schema, dict):
        if schema.get("type") in ("number", "integer"):
            yield where, schema
        for key, value in schema.items():
            yield from numbers(value, f"{where}.{key}")
    elif isinstance(schema, list):
        for i, value in enumerate(schema):
            yield from numbers(value, f"{where}.{i}")


def test_every_number_of_a_case_has_its_range() -> None:
    found = list(numbers(Case.model_json_schema()))
    assert len(found) > 60
    bare = [where for where, one in found if not {"minimum", "maximum"} <= one.keys()]
    assert bare == []


NUMBERS = [
    ("sampling", "min_segment_mm", "0.01 to 100000"),
    ("beads", "width_mm", "0.05 to 1000"),
    ("checks", "clearance_mm", "0 to 1000"),
    ("slicing", "tolerance_mm", "0.0001 to 100"),
    ("ik", "roll_step_deg", "0.5 to 90"),
    ("process", "retract_mm", "0.01 to 10000"),
    ("process", "travel_speed_mm_s", "0.01 to 100000"),
    ("process", "dwell_s", "0 to 86400"),
    ("robot", "home_deg", "-3600 to 3600"),
    ("sweep", "E1_deg", "-3600 to 3600"),
    ("support", "height_mm", "0.001 to 100000"),
]


@pytest.mark.parametrize(("section", "key", "allowed"), NUMBERS)
@pytest.mark.parametrize("value", [1e300, -1e300, 10**400])
def test_what_is_beyond_is_one_line_with_key_value_and_range(
    section: str, key: str, allowed: str, value: float
) -> None:
    given: Any = [value] if key == "home_deg" else value
    content = {**MINIMAL, section: {"radius_mm": 1, key: given} if section == "support" else {key: given}}
    with pytest.raises(InputError) as caught:
        parse_case(content, "c.yaml")
    said = str(caught.value)
    assert said.startswith(f"c.yaml: {section}.{key}")
    assert f"must be {allowed} (is " in said or value == 10**400
    assert len(said) < 200
    assert "\n" not in said


def test_a_change_is_refused_where_the_case_would_be() -> None:
    case = parse_case({**MINIMAL, "support": {"radius_mm": 15, "height_mm": 100}}, "c.yaml")
    support = case.support
    assert support is not None
    lower = with_changes(case, support=support.model_copy(update={"height_mm": 50.0}))
    assert lower.support is not None
    assert lower.support.height_mm == 50.0
    assert lower.path == case.path
    assert with_changes(case, roll=parse_roll("fixed:5")).roll.fixed_deg == 5  # type: ignore[union-attr]
    with pytest.raises(InputError, match=r"support\.height_mm: must be 0.001 to 100000 \(is -5"):
        with_changes(case, support=support.model_copy(update={"height_mm": -5.0}))
    with pytest.raises(InputError, match="needs h_min_mm"):
        with_changes(case, slicing={**asdict(case.slicing), "h_layer_mm": 9.0})


LAUGHS = "name:\n" + "".join(
    f"  - &{b} [{', '.join([f'*{a}' if a else 'lol'] * 9)}]\n"
    for a, b in zip(["", *"abcdefghi"], "abcdefghij", strict=False)
)
BAD = [
    (LAUGHS, "its aliases filled in"),
    ("a: &a {x: 1}\nb: &b {<<: [*a, *a]}\n" + "c: {<<: [" + "*b, " * 90_000 + "*b]}", "its aliases filled in"),
    ("sweep: {E1_deg: &a [1, *a]}", "refers to itself"),
    ("[" * (MOST_DEPTH + 1) + "]" * (MOST_DEPTH + 1), "nests deeper"),
    ("[" * 9999, "nest"),
    ("name: 2024-13-01", "quotes"),
    ("name: !!bool maybe", "'maybe' is not of the type bool"),
    ("table: {E1_deg: !!int abc}", "'abc' is not of the type int"),
    ("a: " + "9" * 5000, "is not of the type int"),
    ("a: !!python/object:os.system x", "constructor"),
    ("table: {E1_deg: 1}\ntable: {E1_deg: 2}", "is given twice"),
    ('extends: "a\\0b"', "must be the name of a case file"),
    ("extends: " + "x" * 300, "must be the name of a case file"),
    ("a: \0", "not allowed"),
    ("# " + "x" * 2**22, "MiB"),
    ("fixtures: 5", "fixtures: must be a list"),
    ("tool: {wire: ['']}", "at least one character"),
    ('fixtures: [{name: "a\\nb", mesh: x.stl}]', "without control characters"),
    ("part: {mesh: '" + "x" * 300 + ".stl'}", "must be the name of a file"),
]


@pytest.mark.parametrize(("text", "says"), BAD, ids=[says for _, says in BAD])
@pytest.mark.parametrize("extended", [False, True])
def test_yaml_that_is_no_case_is_one_line(text: str, says: str, extended: bool, tmp_path: Path) -> None:
    more = "" if text[0] in "[" or "part:" in text else "\npart: {sub_volumes: [a.stl], body: {radius_mm: 20}}\n"
    (tmp_path / "a.yaml").write_text(text + more, encoding="utf-8")
    (tmp_path / "b.yaml").write_text("extends: a.yaml\n", encoding="utf-8")
    with pytest.raises(InputError) as caught:
        load_case(tmp_path / ("b.yaml" if extended else "a.yaml"))
    assert says in str(caught.value)
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 400


def test_numbers_and_merges_are_read_as_yaml_has_them() -> None:
    assert load_yaml("[010, 0x1F, -7, +3, 1.5, .5, 1e-3, 10:50:5]") == [10, 31, -7, 3, 1.5, 0.5, "1e-3", "10:50:5"]
    assert load_yaml("a: &a {p: 1, q: 2}\nb: {<<: *a, q: 3}")["b"] == {"p": 1, "q": 3}
    with pytest.raises(yaml.YAMLError):
        load_yaml("a: 1\na: 2")


def test_a_device_is_read_no_further_than_a_case_goes(tmp_path: Path, make_case: Callable[..., Path]) -> None:
    if Path("/dev/zero").exists():
        with pytest.raises(InputError, match="MiB"):
            load_case("/dev/zero")
    case = load_case(make_case())
    assert case.read_from == (case.path,)
