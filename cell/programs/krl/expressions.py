"""Expressions of KRL: tokens as trees.

Use:

    cursor = Cursor(tokens("BASE_DATA[1]:{X 0, Y 0}", where), where)
    expression(cursor)                        # Binary(":", Index(Name("BASE_DATA"), ..), Aggregate(..))
"""

from __future__ import annotations

from dataclasses import dataclass

from ..program import SourceLine
from .lexing import Token, quoted, refuse

MOST_DEPTH = 40  # expressions in each other
MOST_ITEMS = 4096  # of an aggregate, a list of indices or of arguments


@dataclass(frozen=True, slots=True)
class Constant:
    """A number, truth, text or word of an enumeration."""

    value: object


@dataclass(frozen=True, slots=True)
class Variable:
    """A variable by its name, in capitals."""

    name: str


@dataclass(frozen=True, slots=True)
class Element:
    """An element of an array; without indices the whole."""

    of: Expression
    indices: tuple[Expression, ...]


@dataclass(frozen=True, slots=True)
class Component:
    """A component of a structure."""

    of: Expression
    name: str


@dataclass(frozen=True, slots=True)
class FunctionCall:
    """A call."""

    name: str
    arguments: tuple[Expression | None, ...]


@dataclass(frozen=True, slots=True)
class Aggregate:
    """A structure written out."""

    kind: str
    items: tuple[tuple[str, Expression], ...]


@dataclass(frozen=True, slots=True)
class Unary:
    """A sign or a negation."""

    operator: str
    of: Expression


@dataclass(frozen=True, slots=True)
class Binary:
    """Two operands; ``:`` puts a frame into a frame."""

    operator: str
    left: Expression
    right: Expression


Expression = Constant | Variable | Element | Component | FunctionCall | Aggregate | Unary | Binary


class Cursor:
    """A place in a line's tokens."""

    def __init__(self, found: list[Token], where: SourceLine) -> None:
        self._tokens, self._place, self.where = found, 0, where
        self.depth = 0

    @property
    def token(self) -> Token:
        """The token at the place."""
        return self._tokens[self._place]

    def next(self) -> Token:
        """The token at the place, and on."""
        token = self.token
        self._place += token.kind != "end"
        return token

    def take(self, *texts: str) -> str | None:
        """Take one of these words or signs; None where the next one is another."""
        if self.token.kind in ("name", "op") and self.token.text in texts:
            return self.next().text
        return None

    def need(self, *texts: str) -> str:
        """One of these words or signs.

        Raises:
            InputError: another stands there.
        """
        found = self.take(*texts)
        if found is None:
            raise refuse(self.where, f"needs {' or '.join(texts)} where {quoted(self.token.text)} stands")
        return found

    def need_name(self, what: str) -> str:
        """A name.

        Raises:
            InputError: none stands there.
        """
        if self.token.kind != "name":
            raise refuse(self.where, f"needs {what} where {quoted(self.token.text)} stands")
        return self.next().text

    def ended(self) -> bool:
        """Whether nothing is left."""
        return self.token.kind == "end"

    def need_end(self) -> None:
        """Nothing may be left.

        Raises:
            InputError: something is.
        """
        if not self.ended():
            raise refuse(self.where, f"has {quoted(self.token.text)} where the line should end")


# from what binds least to what binds most, as the language has it
LEVELS = (
    ("==", "<>", "<=", ">=", "<", ">"),
    ("OR", "B_OR"),
    ("EXOR", "B_EXOR"),
    ("AND", "B_AND"),
    ("+", "-"),
    ("*", "/"),
    (":",),
)


def expression(cursor: Cursor, level: int = 0) -> Expression:
    """The expression at a place.

    Raises:
        InputError: there is none, or it is too deep.
    """
    if level == len(LEVELS):
        return _signed(cursor)
    left = expression(cursor, level + 1)
    terms = 0
    while (operator := cursor.take(*LEVELS[level])) is not None:
        terms += 1
        if terms > MOST_DEPTH:
            raise refuse(cursor.where, f"has more than {MOST_DEPTH} operations in one expression")
        left = Binary(operator, left, expression(cursor, level + 1))
    return left


def _signed(cursor: Cursor) -> Expression:
    cursor.depth += 1
    if cursor.depth > MOST_DEPTH:
        raise refuse(cursor.where, f"has more than {MOST_DEPTH} expressions in each other")
    operator = cursor.take("-", "+", "NOT", "B_NOT")
    if operator is None:
        found = _selected(cursor, _operand(cursor))
    else:
        of = _signed(cursor)
        number = isinstance(of, Constant) and isinstance(of.value, (int, float)) and not isinstance(of.value, bool)
        found = Constant(-of.value) if operator == "-" and number else Unary(operator, of)  # type: ignore[operator,union-attr]
    cursor.depth -= 1
    return found


def _operand(cursor: Cursor) -> Expression:
    token = cursor.next()
    if token.kind == "number":
        return Constant(token.value)
    if token.kind == "text":
        return Constant(token.text[1:-1])
    if token.kind == "enum":
        return Constant(token.text)
    if token.text == "(":
        found = expression(cursor)
        cursor.need(")")
        return found
    if token.text == "{":
        return _aggregate(cursor)
    if token.kind == "name":
        if token.text in ("TRUE", "FALSE"):
            return Constant(token.text == "TRUE")
        if cursor.take("("):
            return FunctionCall(token.text, arguments(cursor))
        return Variable(token.text)
    raise refuse(cursor.where, f"needs a value where {quoted(token.text)} stands")


def _selected(cursor: Cursor, found: Expression) -> Expression:
    """An operand with its indices and components."""
    for _ in range(MOST_DEPTH):
        if cursor.take("["):
            indices: list[Expression] = []
            while not cursor.take("]"):
                if len(indices) > 3:
                    raise refuse(cursor.where, "an array has at most three indices")
                if cursor.take(","):
                    continue
                indices.append(expression(cursor))
            found = Element(found, tuple(indices))
        elif cursor.take("."):
            found = Component(found, cursor.need_name("a component"))
        else:
            return found
    raise refuse(cursor.where, f"has more than {MOST_DEPTH} components in each other")


def _aggregate(cursor: Cursor) -> Aggregate:
    kind = ""
    items: list[tuple[str, Expression]] = []
    while not cursor.take("}"):
        if len(items) > MOST_ITEMS:
            raise refuse(cursor.where, f"a structure of more than {MOST_ITEMS} components")
        name = cursor.need_name("a component")
        if not items and not kind and cursor.take(":"):
            kind = name
            continue
        if cursor.take("["):  # a text: NAME[] "..", or an element of an array
            while not cursor.take("]"):
                if cursor.next().kind == "end":
                    raise refuse(cursor.where, "] is missing")
        if any(name == known for known, _ in items):
            raise refuse(cursor.where, f"component {quoted(name)} is given twice")
        items.append((name, expression(cursor)))
        if not cursor.take(","):
            cursor.need("}")
            break
    return Aggregate(kind, tuple(items))


def arguments(cursor: Cursor) -> tuple[Expression | None, ...]:
    """The arguments of a call, whose opening parenthesis is taken already.

    Raises:
        InputError: it cannot be read.
    """
    found: list[Expression | None] = []
    while not cursor.take(")"):
        if len(found) > MOST_ITEMS:
            raise refuse(cursor.where, f"a call with more than {MOST_ITEMS} arguments")
        found.append(None if cursor.token.text in (",", ")") else expression(cursor))
        if not cursor.take(","):
            cursor.need(")")
            break
    return tuple(found)
