"""Variables of a program: its own, those of its .dat files, and what the controller has.

Use:

    data.set("I", (), 3)
    data.variable("I")                        # 3
    data.variable("$POS_ACT")                 # {"X": .., ..}, as far as it is known

A name is looked for among the part's own variables, then in the .dat of its file, then among what .dat files give all,
in ``$config.dat`` too, and last in the case: TOOL_DATA, BASE_DATA, MACHINE_DEF and HOME. A parameter that is not IN
stands for the caller's variable: what is assigned to it that has at once.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Protocol

import numpy as np

from ..controller import Controller
from ..orientation import frames_of_poses
from ..program import SourceLine
from .bas import null_frame, run_bas
from .expressions import Component, Element, Expression, Variable
from .inner_calls import STANDARD, calls_of, missing
from .lexing import quoted, refuse
from .moving import EXTERNAL, position_now
from .sources import SHARED, Sources
from .state import ControllerState
from .statements import Declaration, ParsedFile
from .values.evaluation import (
    READ_DEG,
    CoupledFrame,
    FloatingValue,
    ImportedValue,
    ListedFrame,
    MachineReference,
    UnknownValue,
    component,
    element,
    evaluate,
    frame_as_read,
    frame_dict,
    integer,
    matrix,
    number,
    shown,
)
from .values.number_kinds import ComputedReal
from .values.value_types import EITHER, INT, REAL, ValueTypes
from .values.value_types import OF_CONTROLLER as KINDS_OF_CONTROLLER
from .values.variable_scope import Accessors, Reference, VariableScope

DEFAULTS: dict[str, Any] = {
    "PDEFAULT": {"VEL": 100.0, "ACC": 100.0, "APO_DIST": 100.0},
    "FDEFAULT": {"TOOL_NO": 0.0, "BASE_NO": 0.0, "IPO_FRAME": "#BASE"},
}
MOST_ELEMENTS = 100_000  # of all arrays together
FRAME_LISTS = ("TOOL_DATA", "BASE_DATA")
OF_MACHINE = ("MACHINE_DEF", "EX_AX_DATA")


class RunningCall(Protocol):
    """A call that is running: its file and its own variables."""

    file: ParsedFile
    variables: VariableScope


class ProgramRun(Protocol):
    """What variables ask of the run they belong to."""

    sources: Sources
    controller: Controller
    state: ControllerState
    where: SourceLine

    @property
    def calls(self) -> Sequence[RunningCall]:
        """Calls that are running, the last of them now."""

    def step(self) -> None:
        """Count a statement."""

    def calls_known(self, name: str) -> bool:
        """Whether a sub-program or function is among the files."""

    def call(self, name: str, arguments: tuple[Expression | None, ...]) -> Any:
        """Call it."""

    def variable(self, name: str) -> Any:
        """The value of a variable."""

    def function(self, name: str, arguments: tuple[Expression | None, ...]) -> Any:
        """The value of a function that is not built in."""


def _kind(scope: VariableScope, name: str) -> str | None:
    """The type of a variable; None where it is declared in none of the files."""
    return scope.kinds.get(name, KINDS_OF_CONTROLLER.get(name))


class Data:
    """The variables of a run."""

    def __init__(self, execution: ProgramRun) -> None:
        self._run = execution
        self._of_files: dict[int, VariableScope] = {}
        self._everywhere = VariableScope()
        self.types = ValueTypes()
        self.signals: dict[str, int | None] = {}  # outputs that have a name; None: several of them
        self._elements = 0
        self._shared_read = False

    # -- .dat files ----------------------------------------------------------------------------------------------

    def load(self, file: ParsedFile) -> None:
        """Read the data of a file: its own DEFDAT, and the .dat of its name."""
        if file.index in self._of_files:
            return
        if not self._shared_read:
            self._shared_read = True
            shared = self._run.sources.beside(SHARED, ".dat")
            if shared is not None:
                self._parts(shared, self._everywhere)
        beside = self._run.sources.beside(file.path.stem, ".dat")
        held = None if beside is None else self._of_files.get(beside.index)
        own = self._of_files[file.index] = VariableScope() if held is None else held
        if beside is not None and beside.index not in self._of_files:
            self._of_files[beside.index] = own
            self._parts(beside, own)
        self._parts(file, own)

    def _parts(self, file: ParsedFile, into: VariableScope) -> None:
        where, path = self._run.where, str(file.path)
        for part in file.parts.values():
            if part.kind != "DEFDAT":
                continue
            found, shared = VariableScope(), VariableScope()
            for statement in part.body:
                self._run.where = SourceLine(path, statement.line)
                self._run.step()
                if statement.op == "declare":
                    for one in statement.value:
                        self.declare(one, shared if one.everywhere or one.name in shared else found)
                elif statement.op == "assign":
                    root, accessors = self.path(statement.value[0])
                    own = shared if root in shared else found
                    self._put(own, root, accessors, evaluate(statement.value[1], self._run))
                elif statement.op == "structure":
                    self.types.declare(*statement.value)
                elif statement.op == "signal":
                    self.signals |= statement.value
                elif statement.op != "pass":
                    raise refuse(self._run.where, "a .dat file may hold only declarations and values")
            into.add(found)
            # one value for all, which any of them may change: no copy is kept for the file itself
            self._everywhere.add(shared)
        self._run.where = where

    # -- variables -----------------------------------------------------------------------------------------------

    def declare(self, one: Declaration, into: VariableScope) -> None:
        """Declare a variable among others, with its first value."""
        into.kinds[one.name] = one.kind
        if one.name in into.references:
            reference = into.references[one.name]
            if one.array:
                self._alike(one.name, one.kind, replace(reference, kind=reference.kind or EITHER), array=True)
            if one.value is not None:
                raise refuse(self._run.where, f"gives parameter {quoted(one.name)} a value where it declares it")
            return
        if one.value is None and one.name in into:  # a parameter, whose type stands in the body
            into[one.name] = self.types.held(one.kind, into[one.name], self._run)
            return
        if one.value is None:
            into[one.name] = {} if one.array else UnknownValue(f"{one.name} has no value yet")
            return
        value = evaluate(one.value, self._run)
        into.setdefault(one.name, {} if one.array else UnknownValue(f"{one.name} has no value yet"))
        indices = tuple(integer(evaluate(index, self._run), self._run) for index in one.element)
        text = isinstance(value, str) and not value.startswith("#")
        self._put(into, one.name, () if text or not indices else (indices,), value)

    def _scopes(self) -> list[VariableScope]:
        frame = self._run.calls[-1] if self._run.calls else None
        if frame is None:
            return [self._everywhere]
        return [frame.variables, self._of_files.get(frame.file.index, VariableScope()), self._everywhere]

    def variable(self, name: str) -> Any:
        """The value of a variable; ``UnknownValue`` where it has none that is known."""
        if name.startswith("$"):
            return self._of_controller(name)
        if name in FRAME_LISTS:
            return lambda indices: self.listed(name, indices[0])
        for scope in self._scopes():
            if name in scope.references:
                return self._of_caller(scope.references[name], name, scope.kinds.get(name))
            if name in scope:
                return scope[name]
        if name in OF_MACHINE:
            first = 1 if name == "EX_AX_DATA" else 0  # the first external kinematic is the second machine
            return lambda indices: MachineReference(indices[0] + first)
        self._declared_beside(name)
        return self._everywhere[name] if name in self._everywhere else self._last_resort(name)

    def reference(self, argument: Expression) -> Reference:
        """What a parameter stands for that is given a variable, or a part of one."""
        root, accessors = self.path(argument)
        if root.startswith("$") or root in FRAME_LISTS or root in OF_MACHINE:
            return Reference(None, root, accessors, None)
        known = self.parameter(root)
        if known is not None:
            kind = self._run.calls[-1].variables.kinds.get(root, known.kind)
            self._alike(root, kind, known)
            return Reference(known.scope, known.root, (*known.accessors, *accessors), self.types.along(kind, accessors))
        scope = self._scope_of(root)
        return Reference(scope, root, accessors, self.types.along(_kind(scope, root), accessors))

    def parameter(self, name: str) -> Reference | None:
        """What a parameter of the part that runs stands for; None where the name is none, or has a value of its own."""
        return self._run.calls[-1].variables.references.get(name) if self._run.calls else None

    def root_of(self, name: str) -> str:
        """The variable that a name stands for: the caller's, of a parameter that is not IN."""
        reference = self.parameter(name)
        return name if reference is None else reference.root

    def _of_caller(self, reference: Reference, name: str, kind: str | None) -> Any:
        """The value of what a parameter stands for."""
        scope, root = reference.scope, reference.root
        known = None if scope is None else scope.get(root)
        value = known if known is not None else self.variable(root) if scope is None else self._last_resort(root)
        for accessor in reference.accessors:
            if isinstance(accessor, str):
                value = component(value, accessor, self._run)
            else:
                value = element(value, accessor, self._run)
        fraction = isinstance(value, float) and not value.is_integer()
        if not isinstance(value, UnknownValue):
            self._alike(name, kind, reference)
        if fraction and kind == INT and reference.kind != INT:
            return UnknownValue(f"{quoted(name)} is INT and stands for {value:g}, of a type that is not known")
        return value if kind is None else self.types.held(kind, value, self._run)

    def _alike(self, name: str, kind: str | None, reference: Reference, *, array: bool = False) -> None:
        """Refuse a parameter whose type and that of what it stands for hold different things."""
        structures = {kind, reference.kind} - {None, EITHER, INT, REAL}
        kinds = {kind, reference.kind} - {None}
        if len(kinds) > 1 and (kinds == {INT, REAL} or len(structures) > 1 or array):
            raise refuse(
                self._run.where,
                f"parameter {quoted(name)} is {kind} and stands for {quoted(reference.root)}, which is "
                f"{reference.kind}: what it is converted to is not followed; :IN gives it a value of its own",
            )

    def _last_resort(self, name: str) -> Any:
        home = self._run.controller.home
        if name == "HOME" and home is not None:
            self._run.state.doubt("HOME is taken from the case: no .dat beside the program says where it is")
            return {f"A{i + 1}": math.degrees(x) for i, x in enumerate(home)}
        if name in DEFAULTS:
            return DEFAULTS[name]
        return UnknownValue(f"{quoted(name)} is declared neither in the program nor in a .dat file beside it")

    def path(self, target: Expression) -> tuple[str, Accessors]:
        """A variable's name and the way to what is assigned of it."""
        accessors: list[str | tuple[int, ...]] = []
        while not isinstance(target, Variable):
            if isinstance(target, Component):
                accessors.append(target.name)
            elif isinstance(target, Element):
                indices = tuple(integer(evaluate(index, self._run), self._run) for index in target.indices)
                if indices:
                    accessors.append(indices)
            else:
                raise refuse(self._run.where, "assigns to something that is not a variable")
            target = target.of
        return target.name, tuple(reversed(accessors))

    def set(self, name: str, accessors: Accessors, value: Any, *, whole: bool = False) -> None:
        """Assign to a variable of the program's own, or to what a parameter stands for.

        Args:
            name: of the variable.
            accessors: the part of it.
            value: given to it.
            whole: whether it is all of a variable of the same type: what that has no value for has none then.
        """
        reference = self.parameter(name)
        if reference is not None and reference.scope is None and not reference.root.startswith("$"):
            self.set(reference.root, (*reference.accessors, *accessors), value, whole=whole)
            return
        if reference is not None and reference.scope is not None:
            kind = self._run.calls[-1].variables.kinds.get(name)
            if not accessors:
                self._alike(name, kind, reference)
            value = self.types.held(self.types.along(kind, accessors), value, self._run)
            self._assign(reference.scope, reference.root, (*reference.accessors, *accessors), value, whole=whole)
            return
        self._assign(self._scope_of(name), name, accessors, value, whole=whole)

    def is_declared(self, name: str) -> bool:
        """Whether a variable is known, be it from a .dat beside that declares it for all."""
        scope = self._scope_of(name)  # which may read the .dat that has it, be it as the name of an output
        return name in scope or name in self.signals

    def _scope_of(self, name: str) -> VariableScope:
        """Where a variable is; what is declared nowhere belongs to all: a part's own have to be declared in it."""
        if all(name not in scope for scope in self._scopes()):
            self._declared_beside(name)
        return next((scope for scope in self._scopes() if name in scope), self._everywhere)

    def _assign(
        self, scope: VariableScope, name: str, accessors: Accessors, value: Any, *, whole: bool = False
    ) -> None:
        if isinstance(scope.get(name), ImportedValue):
            raise refuse(self._run.where, f"assigns to {quoted(name)}, which is imported: its file has it as well")
        kind = self.types.along(_kind(scope, name), accessors)
        value = self.types.assigned(name, kind, value)
        before: Any = scope.get(name)
        for accessor in accessors:
            before = before.get(accessor) if isinstance(before, dict) else None
        # what an aggregate gives no value may keep its old one or lose it
        if type(value) is dict and isinstance(before, dict) and not whole:
            left = [part for part in before if part not in value and isinstance(part, str)]
            value = value | {
                part: UnknownValue(f"{part} of {quoted(name)}, which was given without it") for part in left
            }
        self._put(scope, name, accessors, value)

    def _declared_beside(self, name: str) -> None:
        """Read the .dat beside that declares a variable for all, if there is one."""
        if (file := self._run.sources.with_variable(name)) is not None:
            self.load(file)

    def _put(self, scope: VariableScope, name: str, accessors: Accessors, value: Any) -> None:
        value = self.types.held(self.types.along(_kind(scope, name), accessors), value, self._run)
        known = self._before(scope, name, accessors)
        if isinstance(known, FloatingValue):
            return
        if not accessors:
            scope[name] = value
            return
        held = dict(known) if isinstance(known, dict) else {}
        if isinstance(known, UnknownValue) and "no value yet" not in known.why:
            return  # a component of what is not known: it stays so
        scope[name] = held
        for accessor in accessors[:-1]:
            inner = held.get(accessor)
            if isinstance(inner, UnknownValue):
                return
            inner = dict(inner) if isinstance(inner, dict) else {}
            held[accessor] = inner
            held = inner
        if isinstance(held.get(accessors[-1]), FloatingValue):
            return
        self._elements += accessors[-1] not in held
        if self._elements > MOST_ELEMENTS:
            raise refuse(self._run.where, f"more than {MOST_ELEMENTS} elements of arrays")
        held[accessors[-1]] = value

    def _before(self, scope: VariableScope, name: str, accessors: Accessors) -> Any:
        """What a variable holds before something is assigned to it, or to a part of it."""
        if name in FRAME_LISTS and accessors and isinstance(accessors[0], tuple):
            if isinstance(scope.get(name), UnknownValue):
                return scope[name]
            held = dict(scope.get(name, {}))
            if len(accessors) > 1 and accessors[0] not in held:
                frame = self.listed(name, accessors[0][0])
                held[accessors[0]] = dict(frame) if isinstance(frame, dict) else frame
            return held
        return scope[name] if name in scope else self._last_resort(name) if accessors else None

    # -- what the controller has ---------------------------------------------------------------------------------

    def listed(self, name: str, place: int) -> Any:
        """TOOL_DATA[n] or BASE_DATA[n]: of a .dat beside the program, or else of the case."""
        if place == 0:
            return null_frame(name)
        for scope in self._scopes():
            held = scope.get(name)
            if isinstance(held, UnknownValue):
                return held
            if isinstance(held, dict) and (place,) in held:
                frame = element(held, (place,), self._run)
                return ListedFrame(frame, name, place) if isinstance(frame, dict) else frame
        controller = self._run.controller
        T = controller.tool_data.get(place) if name == "TOOL_DATA" else None
        if name == "BASE_DATA" and (base := controller.base_data.get(place)) is not None:
            T = base.T
        if T is not None:
            return ListedFrame(frame_dict(T), name, place)
        return UnknownValue(
            f"{name}[{place}] is neither in a .dat file beside the program nor in controller.read of the case"
        )

    def _of_controller(self, name: str) -> Any:
        state = self._run.state
        if name in ("$NULLFRAME", "$WORLD"):
            return null_frame("")
        if name == "$AXIS_ACT":
            state.stop()
            return self._axes_now() | self._external()
        if name == "$POS_ACT":
            state.stop()
            pose = position_now(state, self._run)
            if pose is None:
                return UnknownValue(f"{name} after a motion of axes")
            unknown = UnknownValue(f"S or T of {name}")
            return frame_as_read(frames_of_poses(np.array(pose))) | {"S": unknown, "T": unknown} | self._external()
        if name == "$TOOL" and state.tool is not None:
            return state.numbers[name] or frame_as_read(state.tool.T_flange_tcp)
        if name == "$BASE" and state.base is not None:
            if state.base.coupled:
                return UnknownValue("$BASE while an external kinematic carries it")
            return state.numbers[name] or frame_as_read(state.base.T)
        if name == "$VEL":
            return {} if math.isnan(state.speeds.speed) else {"CP": state.speeds.speed}
        if name == "$ASYNC_AXIS":
            return 0
        return UnknownValue(f"{quoted(name)} of the controller")

    def _axes_now(self) -> dict[str, Any]:
        state = self._run.state
        if state.joints is None:
            unknown = UnknownValue("$AXIS_ACT after a motion to a point")
            return {f"A{i + 1}": unknown for i in range(state.controller.axes)}
        return {f"A{i + 1}": ComputedReal(math.degrees(x), READ_DEG) for i, x in enumerate(state.joints)}

    def _external(self) -> dict[str, float]:
        external = self._run.state.external
        return {
            name: ComputedReal(math.degrees(value), READ_DEG)
            for name, value in zip(EXTERNAL, external, strict=False)
            if not math.isnan(value)
        }

    def function(self, name: str, arguments: tuple[Expression | None, ...]) -> Any:
        """The value of EK, or of a function of the program's own.

        Raises:
            InputError: it is missing and may move the arm.
        """
        if name == "EK":
            return self._coupled([evaluate(one, self._run) for one in arguments if one is not None])
        if not self._run.calls_known(name):
            if name not in STANDARD:
                raise refuse(self._run.where, missing(name))
            self.run_calls(arguments)
            self.forget(arguments)
            return UnknownValue(f"function {quoted(name)} is not among the files")
        return self._run.call(name, arguments)

    def _coupled(self, values: list[Any]) -> Any:
        """EK(root, kind, frame)."""
        run = self._run
        if len(values) != 3:
            raise refuse(run.where, f"EK takes a root, a kind and a frame, not {len(values)} values")
        root, kind, frame = values
        if isinstance(root, MachineReference) and root.component == "ROOT":
            machine = root.machine
            held = run.controller.machines.get(machine)
        elif isinstance(root, dict):
            machine, held = run.controller.machine, matrix(root, run)
        else:
            raise refuse(run.where, f"EK: the root is MACHINE_DEF[n].ROOT or a frame, not {shown(root)}")
        if isinstance(kind, MachineReference) and kind.component not in ("MECH_TYPE", "EX_KIN"):
            raise refuse(run.where, f"EK: the kind is MACHINE_DEF[n].MECH_TYPE, not .{quoted(kind.component)}")
        if isinstance(kind, MachineReference) and kind.machine != machine:
            raise refuse(run.where, f"EK: the root is of machine {machine}, the kind of machine {kind.machine}")
        place = frame.number if isinstance(frame, ListedFrame) else None
        if isinstance(frame, ListedFrame) and frame.place == "TOOL_DATA" and place:
            raise refuse(run.where, f"EK: TOOL_DATA[{place}] is not a base")
        if isinstance(frame, MachineReference):
            raise refuse(run.where, f"EK: the frame .{quoted(frame.component)} of machine {frame.machine} is not known")
        return CoupledFrame(matrix(frame, run), machine, held, place)

    def run_calls(self, arguments: Sequence[Expression | None]) -> None:
        """Run the functions that are called in arguments of what is not followed itself."""
        for argument in arguments:
            for inner in calls_of(argument):
                self.function(inner.name, inner.arguments)

    def forget(self, arguments: Sequence[Expression | None], *, structures: bool = True, later: bool = False) -> None:
        """Variables that were given to what is not followed: it may have set them.

        Args:
            arguments: as they were given.
            structures: whether structures as well that are no points: hooks get those of their technology, which they
                only read.
            later: whether it may do so at a time that is not known.
        """
        for argument in arguments:
            if isinstance(argument, (Variable, Component, Element)):
                root, accessors = self.path(argument)
                value = evaluate(argument, self._run)
                kept = not structures and isinstance(value, dict) and not {"X", "A1"} & value.keys()
                if not root.startswith("$") and not kept:
                    kind = FloatingValue if later else UnknownValue
                    self.set(root, accessors, kind(f"{quoted(root)} is set by what is not followed"))

    def bas(self, arguments: tuple[Expression | None, ...]) -> None:
        """Run BAS."""
        values = [evaluate(one, self._run) for one in arguments if one is not None]
        if not values or not isinstance(values[0], str):
            raise refuse(self._run.where, "BAS needs a word like #TOOL first")
        for value in values[1:]:
            if not isinstance(value, UnknownValue):
                number(value, self._run)
        run_bas(self._run.state, values[0], tuple(values[1:]), _BasView(self))


class _BasView:
    """What BAS asks for: variables, lists of frames, the line."""

    def __init__(self, data: Data) -> None:
        self._data = data
        self.where = data._run.where

    def variable(self, name: str) -> Any:
        return self._data.variable(name)

    def function(self, name: str, arguments: tuple[Expression | None, ...]) -> Any:
        return self._data.function(name, arguments)

    def listed(self, name: str, place: int) -> Any:
        return self._data.listed(name, place)
