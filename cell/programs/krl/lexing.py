"""Lines of KRL as tokens.

Use:

    tokens("LIN XP1 C_DIS ;last", where)      # [Token("name", "LIN"), Token("name", "XP1"), ..]

Names are in capitals, since the language knows no others.
"""

from __future__ import annotations

import math
import re
from typing import NamedTuple

from ...errors import InputError
from ...printable import printable
from ..program import SourceLine

MOST_DIGITS = 40
_TOKEN = re.compile(
    r"""\s*(?:
      (?P<number>(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?)
    | (?P<name>[A-Za-z_$][A-Za-z0-9_$]*)
    | (?P<enum>\#[A-Za-z_$][A-Za-z0-9_$]*)
    | (?P<text>"[^"]*")
    | (?P<bits>'[BbHh]?[0-9A-Fa-f]+')
    | (?P<op>==|<>|<=|>=|[-+*/()\[\]{},.:<>=])
    )""",
    re.VERBOSE | re.ASCII,
)


class Token(NamedTuple):
    """A word, number or sign of a line.

    Attributes:
        kind: name, enum, number, text, op, or end.
        text: as it stands there, names and enums in capitals.
        value: of a number.
    """

    kind: str
    text: str
    value: int | float = 0


END = Token("end", "the end of the line")


def refuse(where: SourceLine, text: str) -> InputError:
    """An error at a line; to be raised."""
    return InputError(f"{where}: {text}")


def quoted(text: str, most: int = 60) -> str:
    """A piece of a program as messages show it."""
    text = printable(text.strip()[: 4 * most])
    text = "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)
    return text if len(text) <= most else text[: most - 2] + ".."


def without_comment(line: str) -> tuple[str, str]:
    """A line's statement and its comment (with its semicolon)."""
    start = line.find(";")
    while start >= 0 and line.count('"', 0, start) % 2:
        start = line.find(";", start + 1)
    return (line, "") if start < 0 else (line[:start], line[start:])


def tokens(text: str, where: SourceLine) -> list[Token]:
    """The tokens of a statement without its comment.

    Args:
        text: of the statement.
        where: it stands, for messages.

    Returns:
        The tokens, an end among them.

    Raises:
        InputError: something is no token, or a number is not finite.
    """
    found, place, text = [], 0, text.rstrip()
    while place < len(text):
        match = _TOKEN.match(text, place)
        if match is None or match.lastgroup is None:
            raise refuse(where, f"cannot be read from here on: {quoted(text[place:])}")
        place = match.end()
        kind, word = match.lastgroup, match.group(match.lastgroup)
        if kind == "number":
            found.append(Token("number", word, number_of(word, where)))
        elif kind == "bits":
            found.append(Token("number", word, _bits(word, where)))
        else:
            found.append(Token(kind, word if kind == "text" else word.upper()))
    return [*found, END]


def number_of(text: str, where: SourceLine) -> int | float:
    """A number: an integer without point and exponent.

    Raises:
        InputError: it is beyond what the language's numbers hold.
    """
    if len(text) > MOST_DIGITS:
        raise refuse(where, f"number of {len(text)} digits: {quoted(text)}")
    if text.isdigit():
        return int(text)
    value = float(text)
    if not math.isfinite(value):
        raise refuse(where, f"{quoted(text)} is not finite")
    return value


def _bits(text: str, where: SourceLine) -> int:
    body = text[1:-1]
    base = {"B": 2, "H": 16}.get(body[0].upper())
    try:
        return int(body[1:] if base else body, base or 10)
    except ValueError:
        raise refuse(where, f"{quoted(text)} is not a number: 'B01..' or 'H0A..' is") from None
