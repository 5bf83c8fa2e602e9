"""Every parameter of slicing is refused out of its range in one line; a case file asks by the same classes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields
from typing import Annotated, Any, Literal, get_args, get_origin, get_type_hints

import pytest
from annotated_types import Ge, Le

from cell.case.read import parse_case
from cell.errors import InputError
from slicing.annotations import meaning_of
from slicing.errors import PartError
from slicing.parameters import BeadParameters, SeamPlace, SlicingParameters

CASE = {"part": {"sub_volumes": ["a.stl"], "body": {"radius_mm": 20}}}
SECTIONS: dict[str, type] = {"slicing": SlicingParameters, "beads": BeadParameters}
PLACE = {"angle_deg": 0.0}  # of a seam


def numbers(annotation: Any) -> Iterator[tuple[float, float]]:
    """The ranges of an annotation, of each number in it."""
    of = getattr(annotation, "__metadata__", ())
    low, high = ([getattr(one, name) for one in of if isinstance(one, kind)] for name, kind in (("ge", Ge), ("le", Le)))
    if low and high:
        yield low[0], high[0]
    for inner in get_args(annotation):
        if get_origin(inner) is not Literal:
            yield from numbers(inner)


def hints(cls: type) -> dict[str, Any]:
    every = get_type_hints(cls, include_extras=True)
    return {field.name: every[field.name] for field in fields(cls)}


RANGED = [
    (section, name, low, high)
    for section, cls in SECTIONS.items()
    for name, hint in hints(cls).items()
    if name != "seams" and len(found := list(numbers(hint))) == 1
    for low, high in found
]


def refused(section: str, name: str, value: Any) -> str:
    """What Python and a case file say of a value; both refuse it and name the parameter."""
    with pytest.raises(PartError, match=name):
        SECTIONS[section](**{name: value})
    with pytest.raises(InputError) as told:
        parse_case({**CASE, section: {name: value}})
    assert f"{section}.{name}: " in str(told.value)
    assert "\n" not in str(told.value)
    return str(told.value)


def test_there_are_numbers_in_both() -> None:
    assert len([one for one in RANGED if one[0] == "beads"]) >= 8
    assert len([one for one in RANGED if one[0] == "slicing"]) >= 4


@pytest.mark.parametrize(("section", "name", "low", "high"), RANGED)
def test_a_number_out_of_its_range_is_refused_alike(section: str, name: str, low: float, high: float) -> None:
    for value in (low - 1, high + 1, float("nan"), float("inf")):
        refused(section, name, value)
    assert f"must be {low:g} to {high:g}" in refused(section, name, high + 1)


@pytest.mark.parametrize("section", SECTIONS)
def test_a_word_that_is_none_of_the_choices_is_refused_alike(section: str) -> None:
    named = [name for name, hint in hints(SECTIONS[section]).items() if "Literal" in str(hint)]
    assert len(named) >= 2
    for name in named:
        refused(section, name, "spiral")


def test_what_does_not_go_together_is_refused_alike() -> None:
    for section, values, said in (
        ("slicing", {"h_layer_mm": 9.0}, "needs h_min_mm <= h_layer_mm <= h_max_mm"),
        ("beads", {"seam": "chosen"}, "chosen needs one of seam_angle_deg, seam_xyz_mm"),
        ("beads", {"seam_angle_deg": 3.0}, "go with seam: chosen"),
    ):
        with pytest.raises(PartError, match=said):
            SECTIONS[section](**values)
        with pytest.raises(InputError, match=said):
            parse_case({**CASE, section: values})
    for place, said in (
        ({}, "needs one of angle_deg, xyz_mm"),
        ({**PLACE, "xyz_mm": (0, 0, 0)}, "needs one of"),
        ({**PLACE, "layers": (4, 3)}, "first <= last"),
        ({**PLACE, "layers": (-1, 3)}, "layers"),
        ({"xyz_mm": (0, 0)}, "xyz_mm"),
        ({"xyz_mm": (0, 0, 2e5)}, "xyz_mm"),
    ):
        with pytest.raises(PartError, match=said):
            SeamPlace(**place)
        with pytest.raises(InputError, match=rf"beads\.seams\.0.*{said}"):
            parse_case({**CASE, "beads": {"seams": [place]}})
    with pytest.raises(InputError, match=r"beads\.seams\.0\.angle: unknown key; did you mean angle_deg"):
        parse_case({**CASE, "beads": {"seams": [{"angle": 3}]}})


def test_a_case_has_the_defaults_of_slicing_and_its_sections_are_what_slicing_takes() -> None:
    case = parse_case(CASE)
    assert isinstance(case.slicing, SlicingParameters)
    assert isinstance(case.beads, BeadParameters)
    for section, cls in SECTIONS.items():
        here, plain = getattr(case, section), cls()
        assert {f.name: getattr(here, f.name) for f in fields(cls)} == {
            f.name: getattr(plain, f.name) for f in fields(cls)
        }


@pytest.mark.parametrize("cls", [SlicingParameters, BeadParameters, SeamPlace])
def test_every_parameter_says_what_it_means(cls: type) -> None:
    for name, hint in hints(cls).items():
        assert get_origin(hint) is Annotated
        assert meaning_of(hint)
        assert f"    {name}: {meaning_of(hint)}." in str(cls.__doc__)


def test_the_command_line_offers_the_same_choices() -> None:
    from cell.cli.arguments import PATTERNS, STRATEGIES

    assert list(STRATEGIES) == list(get_args(get_args(hints(SlicingParameters)["strategy"])[0]))
    assert list(PATTERNS) == list(get_args(get_args(hints(BeadParameters)["pattern"])[0]))
