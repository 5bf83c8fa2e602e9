"""Functions that are called inside other statements: they may move the arm, so that none is passed over.

Use:

    called_in("($OUT[NEXT ( )], TRUE, 0.5)")          # ("NEXT",): in a line that is not followed
    list(calls_of(expression))                        # calls of functions that are not built in
    missing("NEXT")                                   # what is said of one that is not among the files
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from .expressions import Aggregate, Binary, Component, Element, Expression, FunctionCall, Unary, Variable
from .lexing import quoted
from .values.evaluation import BUILT_IN

_STANDARD = (
    "EK LK EB EO FORWARD INVERSE VARSTATE VARTYPE STRADD STRCLEAR STRCOMP STRCOPY STRDECLLEN STRFIND STRLEN "
    "COPEN CCLOSE CREAD CWRITE SREAD SWRITE SET_KRLMSG SET_KRLDLG CLEAR_KRLMSG EXISTS_KRLMSG EXISTS_KRLDLG "
    "GET_MSGBUFFER MSGNOTIFY MSGQUIT MSGSTATE MSGDIALOG CLEARMSG GET_SYSTEM_DATA"
)
STANDARD = frozenset(_STANDARD.split())  # functions of the controller that move nothing
_WORDS = frozenset(("AND", "OR", "EXOR", "NOT", "B_AND", "B_OR", "B_EXOR", "B_NOT", "FOR", "ON", "OFF", "PULSE"))
_TEXT = re.compile(r'"[^"]*"?')
_CALL = re.compile(r"(?<![\w$.#])([A-Za-z_$][A-Za-z0-9_$]*)\s*\(", re.ASCII)


def missing(name: str) -> str:
    """What is said of a sub-program or function that is not among the files.

    Args:
        name: of it.
    """
    return (
        f"sub-program {quoted(name)} is missing: neither in this file nor as {quoted(name)}.src beside it; "
        "if it moves nothing, controller.read.harmless of the case may say so"
    )


def called_in(text: str) -> tuple[str, ...]:
    """Names of functions that a text calls, but those of the controller that move nothing.

    Args:
        text: of a statement, without its first word and its comment.

    Returns:
        In capitals, each once.
    """
    names = (name.upper() for name in _CALL.findall(_TEXT.sub("", text)))
    return tuple(dict.fromkeys(name for name in names if name not in _WORDS | STANDARD | BUILT_IN))


def calls_of(of: Expression | None) -> Iterator[FunctionCall]:
    """Calls in an expression that may move the arm: those of the controller's own functions are looked into.

    Args:
        of: the expression, or None.

    Yields:
        Calls that are not in one another.
    """
    if isinstance(of, FunctionCall) and of.name not in STANDARD | BUILT_IN:
        yield of
        return
    for inner in _inside(of):
        yield from calls_of(inner)


def variables_of(of: Expression | None) -> Iterator[str]:
    """Names of the variables in an expression."""
    if isinstance(of, Variable):
        yield of.name
    for inner in _inside(of):
        yield from variables_of(inner)


def _inside(of: Expression | None) -> tuple[Expression | None, ...]:
    if isinstance(of, FunctionCall):
        return of.arguments
    if isinstance(of, Element):
        return (of.of, *of.indices)
    if isinstance(of, (Component, Unary)):
        return (of.of,)
    if isinstance(of, Binary):
        return of.left, of.right
    return tuple(item for _, item in of.items) if isinstance(of, Aggregate) else ()
