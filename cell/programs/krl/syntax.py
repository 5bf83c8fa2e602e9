"""Files of KRL as statements in blocks.

Use:

    parsed = parse(text, path, 0, controller)
    parsed.parts["BLADE"].body                # (Statement("declare", ..), Statement("move", ..), ..)

Lines whose form is not known become statements that are refused when they are run: what is never reached does no harm.
What can never be a program (a block that is not closed, a number that is none) is refused at once.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field, replace
from pathlib import Path

from ..controller import Controller
from ..program import SourceLine
from .events import EventReader
from .expressions import Cursor
from .lexing import quoted, refuse, tokens, without_comment
from .line_forms import LineForms, constant_move
from .statements import ModulePart, Parameter, ParsedFile, Statement

OPENING = {
    "IF": ("ELSE", "ENDIF"),
    "FOR": ("ENDFOR",),
    "WHILE": ("ENDWHILE",),
    "LOOP": ("ENDLOOP",),
    "REPEAT": ("UNTIL",),
    "SWITCH": ("CASE", "DEFAULT", "ENDSWITCH"),
    "SPLINE": ("ENDSPLINE",),
}
CLOSING = {word for words in OPENING.values() for word in words}
DATA = ("DECL", "GLOBAL", "CONST", "STRUC", "ENUM", "SIGNAL", "EXT", "EXTFCT", "IMPORT", "CHANNEL")


@dataclass
class _Open:
    """A block that is not closed yet."""

    word: str
    line: int
    head: object = None
    body: list[Statement] = field(default_factory=list)
    held: list[Statement] = field(default_factory=list)  # what stands before ELSE
    cases: list[tuple[object, tuple[Statement, ...]]] = field(default_factory=list)
    labels: object = None  # of the CASE that is open; None: none is
    otherwise: bool = False  # ELSE or DEFAULT is open


def parse(text: str, path: Path, index: int, controller: Controller) -> ParsedFile:
    """Read a file's text.

    Args:
        text: of the file.
        path: of it, for messages.
        index: of it in the program's files.
        controller: patterns of events, bounds.

    Returns:
        Its parts.

    Raises:
        InputError: it is no program; one line that names file and line.
    """
    return _FileParser(path, index, controller).parse(text)


class _FileParser:
    """One file, line by line."""

    def __init__(self, path: Path, index: int, controller: Controller) -> None:
        self.path, self.index, self.controller = path, index, controller
        self.shown = str(path)
        self.parts: dict[str, ModulePart] = {}
        self.passed: Counter[str] = Counter()
        self.blocks: list[_Open] = []
        self.part: tuple[str, str, int, tuple[Parameter, ...], bool, str | None] | None = None
        self.events = EventReader(controller)
        self.forms = LineForms(controller.harmless)

    def parse(self, text: str) -> ParsedFile:
        last, most = text.count("\n") + 1, self.controller.limits.lines
        if last > most:
            raise refuse(self._where(most), f"the file has more than {most} lines")
        for number, raw in enumerate(text.split("\n"), start=1):
            line = raw.strip()
            if not line:
                continue
            if len(line) > self.controller.limits.line:
                raise refuse(self._where(number), f"has a line of more than {self.controller.limits.line} characters")
            if self.part is not None and (move := constant_move(line)) is not None:
                self.events.close()
                self._append(Statement("move", number, replace(move, spline=True) if self._in_spline() else move))
                continue
            self._line(line, number)
        if self.part is not None:
            name, _, start = self.part[:3]
            raise refuse(self._where(last), f"the file ends within {name}, which starts in line {start}")
        if not self.parts:
            raise refuse(self._where(last), "holds no program: DEF or DEFDAT is missing")
        return ParsedFile(self.path, self.index, self.parts, dict(self.passed))

    def _where(self, line: int) -> SourceLine:
        return SourceLine(self.shown, line)

    def _in_spline(self) -> bool:
        return any(block.word == "SPLINE" for block in self.blocks)

    def _append(self, statement: Statement) -> None:
        self.blocks[-1].body.append(statement)

    def _line(self, line: str, number: int) -> None:
        if line.startswith("&"):
            return
        statement, comment = without_comment(line)
        statement = statement.strip()
        where = self._where(number)
        of_hook = self.part is not None and self.events.follows(line)
        if not statement:
            if not of_hook:
                self._comment(line, number)
            return
        word = statement.split(None, 1)[0].split("(", 1)[0].upper()
        if self._frame_of_parts(statement, word, where):
            return
        if self.part is None:
            raise refuse(where, f"stands outside DEF and END: {quoted(statement)}")
        if word in OPENING or word in CLOSING:
            self._block(word, statement, where)
        else:
            spline = self._in_spline()
            for found in self.forms.statements(statement, line, where, self.events, spline=spline, of_hook=of_hook):
                if found.op == "pass":
                    self.passed[found.value] += 1
                else:
                    self._append(found)
        if comment and not of_hook and (event := self.events.of_comment(comment, where)) is not None:
            self._append(Statement("event", number, event))

    def _comment(self, line: str, number: int) -> None:
        event = self.events.of_comment(line, self._where(number)) if self.part is not None else None
        if event is not None:
            self._append(Statement("event", number, event))
        else:
            self.passed["comments"] += 1

    # -- DEF .. END ----------------------------------------------------------------------------------------------

    def _frame_of_parts(self, statement: str, word: str, where: SourceLine) -> bool:
        """Whether the line starts or ends a part, or stands between parts."""
        if word in ("DEF", "DEFFCT", "DEFDAT") or (word == "GLOBAL" and " DEF" in f" {statement.upper()[6:].strip()}"):
            if self.part is not None:
                raise refuse(where, f"{word} stands within {self.part[0]}, which is not closed")
            self._start(statement, where)
            return True
        if word in ("END", "ENDFCT", "ENDDAT"):
            self._end(word, where)
            return True
        return self.part is None and word in DATA

    def _start(self, statement: str, where: SourceLine) -> None:
        cursor = Cursor(tokens(statement, where), where)
        everywhere = cursor.take("GLOBAL") is not None
        kind = cursor.need("DEF", "DEFFCT", "DEFDAT")
        name, returns = cursor.need_name("a name"), None
        if kind == "DEFFCT" and cursor.token.kind == "name":
            returns, name = name, cursor.need_name("a name")
        elif kind == "DEFFCT" and cursor.take("["):
            cursor.need("]")
            returns, name = name, cursor.need_name("a name")
        parameters: list[Parameter] = []
        if kind != "DEFDAT" and cursor.take("("):
            while not cursor.take(")"):
                parameter = cursor.need_name("a parameter")
                if cursor.take("["):
                    while not cursor.take("]"):
                        if cursor.next().kind == "end":
                            raise refuse(where, "] is missing")
                own = bool(cursor.take(":")) and cursor.need("IN", "OUT") == "IN"
                parameters.append(Parameter(parameter, out=not own))
                if not cursor.take(","):
                    cursor.need(")")
                    break
        everywhere |= cursor.take("PUBLIC") is not None
        if name in self.parts:
            raise refuse(where, f"{quoted(name)} is declared twice")
        self.part = (name, kind, where.number, tuple(parameters), everywhere, returns)
        self.blocks = [_Open(kind, where.number)]

    def _end(self, word: str, where: SourceLine) -> None:
        if self.part is None:
            raise refuse(where, f"{word} closes nothing")
        name, kind, line, parameters, everywhere, returns = self.part
        if word != {"DEF": "END", "DEFFCT": "ENDFCT", "DEFDAT": "ENDDAT"}[kind]:
            raise refuse(where, f"{word} stands where {kind} {name} of line {line} is open")
        if len(self.blocks) > 1:
            block = self.blocks[-1]
            raise refuse(where, f"{word} stands where {block.word} of line {block.line} is open")
        body = tuple(self.blocks[0].body)
        self.parts[name] = ModulePart(name, kind, line, parameters, body, everywhere, returns)
        self.part, self.blocks = None, []

    # -- blocks --------------------------------------------------------------------------------------------------

    def _block(self, word: str, statement: str, where: SourceLine) -> None:
        if word in OPENING:
            if len(self.blocks) > self.controller.limits.depth:
                raise refuse(where, f"has more than {self.controller.limits.depth} blocks inside each other")
            self.blocks.append(_Open(word, where.number, self.forms.head(word, statement, where)))
            return
        block = self.blocks[-1]
        if word not in OPENING.get(block.word, ()):
            raise refuse(where, f"{word} stands where {block.word} of line {block.line} is open")
        if word not in ("CASE", "UNTIL", "ENDSPLINE"):
            cursor = Cursor(tokens(statement, where), where)
            cursor.need(word)
            cursor.need_end()
        if word == "ELSE":
            if block.otherwise:
                raise refuse(where, f"a second ELSE of IF in line {block.line}")
            block.held, block.body, block.otherwise = block.body, [], True
        elif word in ("CASE", "DEFAULT"):
            self._case(block, word, statement, where)
        else:
            self._close(block, word, statement, where)

    def _case(self, block: _Open, word: str, statement: str, where: SourceLine) -> None:
        if block.otherwise:
            raise refuse(where, f"{word} stands after DEFAULT")
        self._end_case(block, where)
        block.otherwise = word == "DEFAULT"
        block.labels = () if block.otherwise else self.forms.labels(statement, where)

    def _end_case(self, block: _Open, where: SourceLine) -> None:
        if block.labels is None:
            if block.body:
                raise refuse(where, f"a statement stands before the first CASE of line {block.line}")
        else:
            block.cases.append((block.labels, tuple(block.body)))
        block.body = []

    def _close(self, block: _Open, word: str, statement: str, where: SourceLine) -> None:
        self.blocks.pop()
        line, body = block.line, tuple(block.body)
        if block.word == "IF":
            then = tuple(block.held) if block.otherwise else body
            made = Statement("if", line, block.head, then, body if block.otherwise else ())
        elif block.word == "SWITCH":
            self._end_case(block, where)
            made = Statement("switch", line, (block.head, tuple(block.cases), block.otherwise))
        elif block.word == "REPEAT":
            made = Statement("repeat", line, self.forms.until(statement, where), body)
        elif block.word == "SPLINE":
            made = Statement("spline", line, (block.head, self.forms.after_spline(statement, where)), body)
        else:
            made = Statement(block.word.lower(), line, block.head, body)
        self._append(made)
