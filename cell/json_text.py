"""JSON documents as text, piece by piece, so that a long one is never whole in memory.

    rows = StreamedItems(lambda: ({"index": i} for i in range(100_000)))
    for text in json_pieces({"schema": "rbam-report/1", "rows": rows}, indent=1):
        file.write(text)

The text is that of ``json.dumps`` of the same document with lists in their places.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Any

PIECE = 1 << 16  # characters that are handed on at once, at least


@dataclass(frozen=True, eq=False)
class StreamedItems:
    """A list in a document whose items are made while they are written.

    Attributes:
        make: gives the items from the first on, whenever it is called.
    """

    make: Callable[[], Iterable[Any]]


def json_pieces(document: Any, indent: int | None = None) -> Iterator[str]:
    """The text of a document.

    Args:
        document: what ``json.dumps`` takes; values of the outermost object, whose keys are texts, may be
            StreamedItems.
        indent: as of ``json.dumps``.

    Yields:
        Texts that make it up.

    Raises:
        ValueError: a number in it is not finite.
    """
    gathered: list[str] = []
    size = 0
    for text in _texts(document, indent):
        gathered.append(text)
        size += len(text)
        if size >= PIECE:
            yield "".join(gathered)
            gathered, size = [], 0
    yield "".join(gathered)


def _texts(document: Any, indent: int | None) -> Iterator[str]:
    if not isinstance(document, dict) or not any(isinstance(v, StreamedItems) for v in document.values()):
        yield json.dumps(document, indent=indent, allow_nan=False)
        return
    inner, comma = (f"\n{' ' * indent}", ",") if indent is not None else ("", ", ")
    start = "{"
    for key, value in document.items():
        yield f"{start}{inner}{json.dumps(key)}: "
        start = comma
        if isinstance(value, StreamedItems):
            yield from _items(value, indent)
        else:
            yield _nested(value, indent, 1)
    yield "}" if indent is None else "\n}"


def _items(items: StreamedItems, indent: int | None) -> Iterator[str]:
    inner, comma = (f"\n{' ' * 2 * indent}", ",") if indent is not None else ("", ", ")
    start = "["
    for item in items.make():
        yield f"{start}{inner}{_nested(item, indent, 2)}"
        start = comma
    if start == "[":
        yield "[]"
    else:
        yield "]" if indent is None else f"\n{' ' * indent}]"


def _nested(value: Any, indent: int | None, depth: int) -> str:
    """A value some levels down; a line's end within it is one of the layout, since JSON escapes those of texts."""
    text = json.dumps(value, indent=indent, allow_nan=False)
    return text if indent is None else text.replace("\n", "\n" + " " * indent * depth)
