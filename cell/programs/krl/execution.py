"""A program run as far as it moves the arm: its statements in order, sub-programs called, loops counted.

Use:

    execution = Execution(Sources(path, controller), controller)
    execution.run()
    execution.state.moves()

Loops, conditions and calls are followed where they depend on numbers of the program alone.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import Any

from ..controller import Controller
from ..program import SourceLine
from .data import OF_MACHINE, Data
from .expressions import Component, Element, Expression, FunctionCall, Variable
from .inner_calls import calls_of, missing, variables_of
from .lexing import quoted, refuse
from .moving import move
from .setting import HARMLESS, OF_TABLE, assign
from .sources import Sources
from .state import ControllerState
from .statements import Declaration, ModulePart, MotionStatement, ParsedFile, RecognisedEvent, Statement, set_in
from .triggers import CALLS
from .values.evaluation import CoupledFrame, UnknownValue, evaluate, integer, number, truth
from .values.variable_scope import Accessors, VariableScope

HARMLESS_CALLS = frozenset(
    ("MSGNOTIFY", "MSGQUIT", "MSGSTATE", "CLEARMSG", "CWRITE", "SREAD", "SWRITE", "STRCLEAR", "STRCOPY", "STRADD")
)
READING = frozenset(("MSGNOTIFY", "MSGQUIT", "MSGSTATE", "CLEARMSG"))  # of these, those that set no argument
NO_SUBPROGRAM = frozenset(("IR_STOPM", "USERSPOC"))
STOPPING = frozenset(("$IN", "$OUT", "$ANIN", "$ANOUT", "$POS_ACT", "$AXIS_ACT"))  # read, they stop the advance run
MOST_DEPTH = 120  # blocks that run in each other, over all calls


@dataclass
class CallFrame:
    """A call that is running: its file, part and own variables."""

    file: ParsedFile
    part: ModulePart
    variables: VariableScope = field(default_factory=VariableScope)
    result: Any = None


class _Left(Exception):
    """A loop or a part is left."""

    def __init__(self, what: str) -> None:
        super().__init__(what)
        self.what = what


class Execution:
    """A run of a program.

    Attributes:
        state: what the controller holds, and the moves.
        passed: statements passed over while it ran, by kind.
        where: the line that runs.
    """

    def __init__(self, sources: Sources, controller: Controller) -> None:
        self.sources, self.controller = sources, controller
        self.state = ControllerState(controller)
        self.data = Data(self)
        self.calls: list[CallFrame] = []
        self.where = SourceLine(str(sources.main.path), 1)
        self._steps = self._depth = 0
        self._seen: set[tuple[int, int, str]] = set()

    @property
    def passed(self) -> Counter[str]:
        """Lines passed over while it ran, by kind."""
        return Counter(kind for _, _, kind in self._seen)

    def run(self) -> None:
        """Run the main part.

        Raises:
            InputError: a line cannot be followed and may move the arm; it is named.
        """
        main = self.sources.main
        part = main.parts[main.first]
        if part.kind != "DEF":
            raise refuse(SourceLine(str(main.path), part.line), f"{part.name} is data or a function, not a program")
        if part.parameters:
            raise refuse(
                SourceLine(str(main.path), part.line), f"{part.name} has parameters, so it cannot be run by itself"
            )
        self._run_part(main, part, VariableScope())
        self.state.finish(self.where)

    def passing(self, kind: str) -> None:
        """Count the line that runs as passed over."""
        frame = self.calls[-1]
        self._seen.add((frame.file.index, self.where.number, kind))

    # -- parts ---------------------------------------------------------------------------------------------------

    def _run_part(self, file: ParsedFile, part: ModulePart, variables: VariableScope) -> Any:
        if len(self.calls) >= self.controller.limits.calls:
            raise refuse(self.where, f"calls more than {self.controller.limits.calls} sub-programs inside each other")
        self.data.load(file)
        frame = CallFrame(file, part, variables)
        self.calls.append(frame)
        try:
            self._block(part.body)
        except _Left as left:
            if left.what == "loop":
                raise refuse(self.where, "EXIT stands outside a loop") from None
        self.calls.pop()
        if part.kind == "DEFFCT" and frame.result is None:
            return UnknownValue(f"function {quoted(part.name)} ends without RETURN")
        return frame.result

    def call(self, name: str, arguments: tuple[Expression | None, ...], known: bool = False) -> Any:
        """Call a sub-program or function.

        Args:
            name: in capitals.
            arguments: what it is given.
            known: whether it may be missing: it is an event, which has been taken.

        Returns:
            What a function gives back.

        Raises:
            InputError: it is missing, or cannot be followed.
        """
        found = self._part(name)
        if found is None:
            if known or name in HARMLESS_CALLS:
                self.data.run_calls(arguments)
                if name not in READING:
                    self.data.forget(arguments, structures=not known)
                self.passing("calls of hooks" if known else "messages")
                return UnknownValue(f"{name} is not among the files")
            raise refuse(self.where, missing(name))
        file, part = found
        if len(arguments) > len(part.parameters):
            raise refuse(self.where, f"{quoted(name)} takes {len(part.parameters)} values, not {len(arguments)}")
        variables = VariableScope()
        for parameter in part.parameters:
            variables[parameter.name] = UnknownValue(f"parameter {parameter.name} is not given")
        for parameter, argument in zip(part.parameters, arguments, strict=False):
            if parameter.out and isinstance(argument, (Variable, Component, Element)):
                variables.references[parameter.name] = self.data.reference(argument)
            elif argument is not None:
                variables[parameter.name] = self.data.types.held(None, evaluate(argument, self), self)
        where = self.where
        result = self._run_part(file, part, variables)
        self.where = where
        return result

    def calls_known(self, name: str) -> bool:
        """Whether a sub-program or function is among the files."""
        return self._part(name) is not None

    def _part(self, name: str) -> tuple[ParsedFile, ModulePart] | None:
        here = self.calls[-1].file
        if name in here.parts and here.parts[name].kind != "DEFDAT":
            return here, here.parts[name]
        file = self.sources.beside(name)
        if file is not None and name in file.parts and file.parts[name].kind != "DEFDAT":
            return file, file.parts[name]
        file = self.sources.with_global(name) if name not in HARMLESS_CALLS else None
        return None if file is None or name not in file.parts else (file, file.parts[name])

    # -- the scope of expressions --------------------------------------------------------------------------------

    def variable(self, name: str) -> Any:
        """The value of a variable."""
        return self.data.variable(name)

    def function(self, name: str, arguments: tuple[Expression | None, ...]) -> Any:
        """The value of a function that is not built in."""
        return self.data.function(name, arguments)

    # -- statements ----------------------------------------------------------------------------------------------

    def _block(self, body: tuple[Statement, ...]) -> None:
        file, path = self.calls[-1].file.index, str(self.calls[-1].file.path)
        self._depth += 1
        if self._depth > MOST_DEPTH:
            raise refuse(self.where, f"runs in more than {MOST_DEPTH} blocks and sub-programs inside each other")
        try:
            self._statements(body, file, path)
        finally:
            self._depth -= 1

    def _statements(self, body: tuple[Statement, ...], file: int, path: str) -> None:
        for statement in body:
            self.where = SourceLine(path, statement.line)
            if statement.op == "move":
                self._move(statement.value, (file, statement.line))
            else:
                self.step()
                getattr(self, f"_do_{statement.op}")(statement)
            if statement.op != "continue":  # which holds for the statement behind it alone
                self.state.continues = False

    def step(self) -> None:
        """Count a statement; a loop without end comes to its end here."""
        self._steps += 1
        if self._steps > self.controller.limits.statements:
            raise refuse(
                self.where,
                f"more than {self.controller.limits.statements} statements have run: the program may "
                "have an endless loop",
            )

    def _move(self, motion: MotionStatement, where: tuple[int, int]) -> None:
        if len(self.state) >= self.controller.limits.moves:
            raise refuse(self.where, f"is more than move {self.controller.limits.moves}")
        if motion.word == "SPL":
            raise refuse(self.where, "SPL: the curve of a spline is not followed; use SLIN")
        if motion.spline:
            self.passing("segments of splines, taken as straight lines")
        if not motion.settings:
            move(self.state, motion, where, self)
            return
        set_back = self.state.held()
        for target, value in motion.settings:
            self._assign(target, evaluate(value, self))
        move(self.state, motion, where, self)
        set_back()

    def _do_spline(self, statement: Statement) -> None:
        settings, blends = statement.value
        set_back, before = self.state.held(), len(self.state)
        for target, value in settings:
            self._assign(target, evaluate(value, self))
        self._block(statement.body)
        if blends and len(self.state) > before:
            self.state.round_last(blends)
        set_back()

    def _do_pass(self, statement: Statement) -> None:
        self.passing(statement.value)

    def _do_refused(self, statement: Statement) -> None:
        raise refuse(self.where, statement.value)

    def _do_inner(self, statement: Statement) -> None:
        for name in statement.value:
            if not self.calls_known(name):
                raise refuse(self.where, missing(name))
            raise refuse(self.where, f"calls function {quoted(name)} where it is not followed")

    def _do_continue(self, statement: Statement) -> None:
        self.state.continues = True

    def _do_stop(self, statement: Statement) -> None:
        self.passing(statement.value)
        self.state.stand()

    def _do_harmless_stop(self, statement: Statement) -> None:
        self.passing(statement.value)
        self.state.stop()

    def _do_doubt(self, statement: Statement) -> None:
        kind, text = statement.value
        self.passing(kind)
        self.state.doubt(f"{text} ({self._named()})")

    def _do_wait(self, statement: Statement) -> None:
        seconds = number(evaluate(statement.value, self), self)
        if self.state.continues:
            raise refuse(self.where, "CONTINUE before WAIT SEC: whether the arm stops there is not known")
        if not 0 <= seconds <= 86_400:
            raise refuse(self.where, f"WAIT SEC is 0 to 86400, not {seconds:g}")
        self.state.wait(seconds, self._named())

    def _named(self) -> SourceLine:
        """The line that runs, by its file's name alone."""
        return SourceLine(self.calls[-1].file.path.name, self.where.number)

    def _do_event(self, statement: Statement) -> None:
        found: RecognisedEvent = statement.value
        self.state.happens(found.kind, dict(found.fields), found.at, self._named())

    def _do_call(self, statement: Statement) -> None:
        call: FunctionCall = statement.value[0]
        if call.name == "BAS" and "BAS" not in self.calls[-1].file.parts:
            self.data.bas(call.arguments)
        elif call.name not in NO_SUBPROGRAM or self.calls_known(call.name):
            self.call(call.name, call.arguments, known=statement.value[1])
        else:
            self.data.run_calls(call.arguments)

    def _do_structure(self, statement: Statement) -> None:
        self.data.types.declare(*statement.value)

    def _do_forget(self, statement: Statement) -> None:
        self.data.forget(statement.value, structures=False)

    def _do_triggered(self, statement: Statement) -> None:
        """A sub-program that a trigger calls, at a time that is not known."""
        name, arguments = statement.value
        found = self._part(name)
        if found is not None and not (self._moves_nothing(found[1].body) and not set_in(found[1].body)):
            raise refuse(self.where, f"a TRIGGER calls {quoted(name)}, which does more than set outputs")
        if found is None:
            self.data.forget(arguments, structures=False, later=True)
        self.passing(CALLS)
        self.state.doubt(f"a TRIGGER calls {quoted(name)}, which is not run ({self._named()})")

    def _do_switched(self, statement: Statement) -> None:
        self._switched((), None)

    def _do_floats(self, statement: Statement) -> None:
        """A variable that a trigger sets."""
        name, unknown = statement.value
        root = self.data.root_of(name)
        if root in self.data.signals or not self.data.is_declared(root):
            self._switched((), None)
        if root not in self.data.signals:
            self.data.set(name, (), unknown)

    def _do_signal(self, statement: Statement) -> None:
        self.data.signals |= statement.value

    def _do_declare(self, statement: Statement) -> None:
        declared: tuple[Declaration, ...] = statement.value
        for one in declared:
            self.data.declare(one, self.calls[-1].variables)

    def _do_assign(self, statement: Statement) -> None:
        target, value = statement.value
        found = evaluate(value, self)
        if isinstance(found, CoupledFrame) and not isinstance(value, FunctionCall):
            found = UnknownValue("a frame on an external kinematic, kept in a variable")
        whole = isinstance(value, (Variable, Element, Component)) and self._alike(target, value)
        self._assign(target, found, whole=whole)

    def _alike(self, target: Expression, value: Expression) -> bool:
        """Whether two variables are of one type that is known."""
        if self.data.path(target)[0].startswith("$") or self.data.path(value)[0].startswith("$"):
            return False
        kinds = {self.data.reference(one).kind for one in (target, value)}
        return len(kinds) == 1 and None not in kinds

    def _assign(self, target: Expression, value: Any, *, whole: bool = False) -> None:
        root, accessors = self.data.path(target)
        reference = self.data.parameter(root)
        if reference is not None and reference.scope is None:
            root, accessors = reference.root, (*reference.accessors, *accessors)
        own = self.data.root_of(root)
        if not own.startswith("$") and not self.data.is_declared(own) and isinstance(value, bool):
            self._switched((), None)  # it may be the name of an output
        if own in self.data.signals:
            place = self.data.signals[own]
            root, accessors = "$OUT", () if place is None else ((place,),)
        if root in OF_MACHINE:
            raise refuse(self.where, f"assigns to {root}: where the table stands is what the case says")
        if not root.startswith("$"):
            self.data.set(root, accessors, value, whole=whole)
            return
        if root in ("$OUT", "$OUT_C"):
            self._switched(accessors, value)
        part = next((accessor for accessor in accessors if isinstance(accessor, str)), "")
        indices = next((accessor for accessor in accessors if isinstance(accessor, tuple)), ())
        assign(self.state, (root, part), indices, value, self)
        if root in HARMLESS:
            self.passing("outputs" if root in ("$OUT", "$ANOUT", "$OUT_C") else f"settings of {root}")

    def _switched(self, accessors: Accessors, value: Any) -> None:
        """An output, by number and value: it may be the arc, however the line names them."""
        place = accessors[0][0] if accessors and isinstance(accessors[0], tuple) and accessors[0] else None
        if place is None or not isinstance(value, bool):
            if any("OUT" in pattern.lines[0].pattern.upper() for pattern in self.controller.patterns):
                self.state.doubt(f"an output is set whose number or value is not known ({self._named()})")
            return
        for text in (f"$OUT[{place}]={str(value).upper()}", f"$OUT[{place}] = {str(value).upper()}"):
            for pattern in self.controller.patterns:
                fields = pattern.match(text)
                if fields is not None:
                    self.state.happens(pattern.happens, fields, "now", self._named())
                    return

    def _do_exit(self, statement: Statement) -> None:
        raise _Left("loop")

    def _do_return(self, statement: Statement) -> None:
        if statement.value is not None:
            frame = self.calls[-1]
            frame.result = self.data.types.held(frame.part.returns, evaluate(statement.value, self), self)
        raise _Left("part")

    # -- blocks --------------------------------------------------------------------------------------------------

    def _do_if(self, statement: Statement) -> None:
        value = evaluate(statement.value, self)
        if not isinstance(value, UnknownValue):
            self._block(statement.body if truth(value, self) else statement.other)
        else:
            self._skip(statement.value, value, (*statement.body, *statement.other))

    def _skip(self, condition: Expression, value: UnknownValue, body: tuple[Statement, ...]) -> None:
        """Pass over statements that may or may not run, where they move nothing."""
        if not self._moves_nothing(body):
            raise refuse(
                self.where, f"a condition decides on moves of the arm and depends on an unknown value: {value.why}"
            )
        line = self.where.number
        self.passing("unknown conditions on statements that move nothing")
        self._doubts_in(body)
        if any(self._may_switch(one) for one in body):
            self._switched((), None)
        for root in set_in(body):
            self.data.set(root, (), UnknownValue(f"{root} is set where line {line} says so"))
        if STOPPING & set(variables_of(condition)):  # of others it is not known whether they stop the advance run
            self.state.stop()

    def _may_switch(self, statement: Statement) -> bool:
        """Whether a statement may set an output, under its own name or another."""
        if statement.op == "assign":
            root = self.data.root_of(self.data.path(statement.value[0])[0])
            return root in ("$OUT", "$OUT_C") or root in self.data.signals or not self.data.is_declared(root)
        return any(self._may_switch(one) for one in (*statement.body, *statement.other))

    def _doubts_in(self, body: tuple[Statement, ...]) -> None:
        for one in body:
            if one.op == "doubt":
                self.where = SourceLine(self.where.file, one.line)
                self._do_doubt(one)
            self._doubts_in((*one.body, *one.other))

    def _moves_nothing(self, body: tuple[Statement, ...]) -> bool:
        for one in body:
            if any(True for of in _expressions_of(one) for _ in calls_of(of)):
                return False
            if one.op == "assign":
                root = self.data.root_of(self.data.path(one.value[0])[0])
                if (root.startswith("$") and root not in HARMLESS - OF_TABLE) or root in OF_MACHINE:
                    return False
            elif one.op in ("if", "while", "loop", "repeat"):
                if not self._moves_nothing((*one.body, *one.other)):
                    return False
            elif one.op not in ("pass", "stop", "harmless_stop", "wait", "continue", "doubt"):
                return False
        return True

    def _do_switch(self, statement: Statement) -> None:
        of, cases, otherwise = statement.value
        value = evaluate(of, self)
        if isinstance(value, UnknownValue):
            self._skip(of, value, tuple(one for _, body in cases for one in body))
            return
        last = len(cases) - 1
        for place, (labels, body) in enumerate(cases):
            default = otherwise and place == last
            if default or any(self._equal(value, evaluate(label, self)) for label in labels):
                self._block(body)
                return

    def _equal(self, a: Any, b: Any) -> bool:
        if isinstance(b, UnknownValue):
            raise refuse(self.where, f"a CASE depends on an unknown value: {b.why}")
        if isinstance(a, (bool, str)) or isinstance(b, (bool, str)):
            return type(a) is type(b) and bool(a == b)
        return number(a, self) == number(b, self)

    def _loop(self, body: tuple[Statement, ...]) -> bool:
        """One round; False where the loop is left."""
        self.step()
        try:
            self._block(body)
        except _Left as left:
            if left.what != "loop":
                raise
            return False
        return True

    def _do_loop(self, statement: Statement) -> None:
        while self._loop(statement.body):
            self.where = SourceLine(self.where.file, statement.line)

    def _do_while(self, statement: Statement) -> None:
        while True:
            self.where = SourceLine(self.where.file, statement.line)
            value = evaluate(statement.value, self)
            if isinstance(value, UnknownValue):
                self._skip(statement.value, value, statement.body)
                return
            if not truth(value, self) or not self._loop(statement.body):
                return

    def _do_repeat(self, statement: Statement) -> None:
        while self._loop(statement.body):
            self.where = SourceLine(self.where.file, statement.line)
            if truth(evaluate(statement.value, self), self):
                return

    def _do_for(self, statement: Statement) -> None:
        name, low, high, step = statement.value
        count, end, stride = (integer(evaluate(of, self), self) for of in (low, high, step))
        if stride == 0:
            raise refuse(self.where, "STEP is 0")
        bounds = [(of, was) for of, was in ((high, end), (step, stride)) if not any(True for _ in calls_of(of))]
        self.data.set(name, (), count)
        while count <= end if stride > 0 else count >= end:
            if not self._loop(statement.body):
                return
            self.where = SourceLine(self.where.file, statement.line)
            if self.data.variable(name) != count:
                raise refuse(self.where, f"FOR: its block changes the counter {quoted(name)}, which is not followed")
            if any(integer(evaluate(of, self), self) != was for of, was in bounds):
                raise refuse(self.where, "FOR: its block changes where it ends, or its step, which is not followed")
            count += stride
            self.data.set(name, (), count)


def _expressions_of(statement: Statement) -> tuple[Expression, ...]:
    """The expressions of an assignment, a condition or a wait; of any other statement none."""
    if statement.op == "assign":
        return tuple(statement.value)
    return (statement.value,) if statement.op in ("if", "while", "repeat", "wait") else ()
