"""JSON piece by piece: the text of the whole document, made while it is written."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cell.atomic_files import write_json
from cell.json_text import PIECE, StreamedItems, json_pieces

VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
    max_leaves=8,
)


@given(before=VALUES, items=st.lists(VALUES, max_size=4), after=VALUES, indent=st.sampled_from([None, 0, 1, 3]))
def test_the_text_is_that_of_the_whole_document(before: Any, items: list[Any], after: Any, indent: int | None) -> None:
    streamed = {"before\n": before, "rows": StreamedItems(lambda: iter(items)), "after": after}
    whole = {"before\n": before, "rows": items, "after": after}
    assert "".join(json_pieces(streamed, indent)) == json.dumps(whole, indent=indent)
    assert "".join(json_pieces(whole, indent)) == json.dumps(whole, indent=indent)


def test_items_are_made_while_they_are_written() -> None:
    made = []

    def rows() -> Iterator[str]:
        for i in range(1000):
            made.append(i)
            yield "x" * 1000

    pieces = json_pieces({"rows": StreamedItems(rows)}, 1)
    first = next(pieces)
    assert PIECE <= len(first) < 2 * PIECE
    assert len(made) < 2 * PIECE / 1000
    assert len(json.loads(first + "".join(pieces))["rows"]) == 1000


def test_a_number_that_json_has_not_is_refused_and_no_file_is_left(tmp_path: Path) -> None:
    target = tmp_path / "report.json"
    for document in ({"a": float("nan")}, {"rows": StreamedItems(lambda: [1.0, float("inf")])}):
        with pytest.raises(ValueError, match="not JSON compliant"):
            write_json(target, document)
    assert list(tmp_path.iterdir()) == []
    write_json(target, {"rows": StreamedItems(lambda: [{"ü": 1}, {}])})
    assert target.read_text(encoding="utf-8") == json.dumps({"rows": [{"ü": 1}, {}]}, indent=1) + "\n"
