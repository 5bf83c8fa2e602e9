"""The section ``controller`` of a case: what a robot program is written with, and read with.

controller: {tool: 3, program: BLADE, hooks: {arc_on: "ARC_ON ( ) ;bead {bead}"}}
"""

from __future__ import annotations

import re
import string
from typing import Annotated

from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from .fields import Angles3, Distance, Section, Vec3, number_within

MOST_PROGRAM_NAME = 24  # characters of a module's name
MOST_HOOK_LINE = 300  # characters; lines of 344 are known to run
HOOK_FIELDS = ("program", "sub_volume", "layer", "bead", "target", "speed_mm_s")
TEXT_FIELDS = ("program", "sub_volume")  # the others are numbers
_WORDS = (
    "AND ANIN ANOUT BOOL BRAKE B_AND B_EXOR B_NOT B_OR CASE CAST_FROM CAST_TO CHAR CIRC CIRC_REL CONFIRM CONST "
    "CONST_VEL CONTINUE DECL DEF DEFAULT DEFDAT DEFFCT DELAY DIGIN DISTANCE DO ELSE END ENDDAT ENDFCT ENDFOR ENDIF "
    "ENDLOOP ENDSPLINE ENDSWITCH ENDWHILE ENUM EXIT EXOR EXT EXTFCT FALSE FOR GLOBAL GOTO HALT IF IMPORT INT "
    "INTERRUPT IS LIN LIN_REL LOOP MAXIMUM MINIMUM NOT OFF ON OR PATH PRIO PTP PTP_REL PUBLIC PULSE REAL REPEAT "
    "RESUME RETURN SCIRC SCIRC_REL SEC SIGNAL SLIN SLIN_REL SPL SPLINE SPL_REL SPTP SPTP_REL STEP STRUC SWITCH THEN "
    "TIME_BLOCK TO TRIGGER TRUE UNTIL WAIT WHEN WHILE WITH FRAME POS E6POS AXIS E6AXIS BAS CELL SPS IR_STOPM "
    "EK LOAD INVERSE FORWARD"
)
KRL_WORDS = frozenset(_WORDS.split())
_FORMAT = re.compile(r"0?\d{0,2}(\.\d)?[dfg]?")
_MOVES = re.compile(
    r"\s*(S?PTP|S?LIN|S?CIRC|SPL|SPLINE|ENDSPLINE|DEF|DEFFCT|END|ENDFCT|GOTO|LOOP|FOR|WHILE|REPEAT|IF|SWITCH|RETURN"
    r"|EXIT|RESUME|BAS|ASYPTP|ASYCONT|INTERRUPT|GLOBAL|DECL|(TOOL|BASE)_DATA|MACHINE_DEF|EX_AX_DATA|\$(TOOL|BASE|ACT_\w+|VEL\w*|ACC\w*|APO|ADVANCE|IPO_MODE|ORI_TYPE|ASYNC_AXIS|OV_PRO))"
    r"(_REL)?(?![A-Za-z0-9_])",
    re.IGNORECASE,
)


def _program_name(name: str) -> str:
    if not re.fullmatch(rf"[A-Za-z][A-Za-z0-9_]{{0,{MOST_PROGRAM_NAME - 1}}}", name):
        raise ValueError(f"must be 1 to {MOST_PROGRAM_NAME} of the characters A-Z a-z 0-9 _ and begin with a letter")
    if name.upper() in KRL_WORDS:
        raise ValueError("is a word of KRL; another name is needed")
    return name


def _lines(value: object) -> object:
    return [line for line in value.splitlines() if line.strip()] if isinstance(value, str) else value


def _hook_line(text: str) -> str:
    if not text.isascii() or not text.isprintable():
        raise ValueError("must have ASCII characters only")
    done = re.search(r"\bDO\b(.*)", text.partition(";")[0], re.IGNORECASE)  # by a TRIGGER
    if _MOVES.match(text) or (done and _MOVES.match(done.group(1))):
        raise ValueError("may not move the arm, change a frame or a speed, or branch: a hook calls a sub-program")
    if not text.strip():
        raise ValueError("must not be an empty line")
    try:
        pieces = list(string.Formatter().parse(text))
    except ValueError as error:
        raise ValueError(f"is not a template ({error}); write braces of KRL twice: {{{{ }}}}") from None
    for _, name, spec, conversion in pieces:
        if name is None:
            continue
        if name not in HOOK_FIELDS:
            raise ValueError(f"has an unknown field {{{name}}}; the fields are {', '.join(HOOK_FIELDS)}")
        if conversion is not None or not _FORMAT.fullmatch(spec or "") or (spec and name in TEXT_FIELDS):
            raise ValueError(f"field {{{name}}}: a format must be like 03d, .2f or g, and only numbers have one")
    return text


def _pattern(text: str) -> str:
    try:
        re.compile(text)
    except (re.error, RecursionError, OverflowError) as error:
        raise ValueError(f"is not a regular expression ({error})") from None
    return text


HookLine = Annotated[str, Field(max_length=MOST_HOOK_LINE), AfterValidator(_hook_line)]
HookLines = Annotated[list[HookLine], BeforeValidator(_lines), Field(max_length=50)]
ArcLines = Annotated[HookLines, Field(min_length=1)]  # or the arc could not be read back
Pattern = Annotated[str, Field(min_length=1, max_length=200), AfterValidator(_pattern)]
Patterns = Annotated[list[Pattern], Field(max_length=50)]
ProgramName = Annotated[str, AfterValidator(_program_name)]
Number = Annotated[int, number_within(0, 1000)]
Percent = Annotated[float, number_within(0.1, 100)]


class FrameSection(Section):
    """A frame as KUKA gives it."""

    position_mm: Vec3 = Field((0.0, 0.0, 0.0), description="X, Y, Z")
    abc_deg: Angles3 = Field((0.0, 0.0, 0.0), description="A, B, C: about z, then the new y, then the new x")


class BaseSection(FrameSection):
    """A base frame of the controller's list."""

    machine: Annotated[int, number_within(1, 32)] | None = Field(
        None,
        description="number of the MACHINE_DEF that moves the frame, given in that machine's faceplate; none: it "
        "stands in the world",
    )


class Thinning(Section):
    """Points of a bead that the program may leave out."""

    chord_mm: Distance = Field(
        0.02, description="largest distance between the thinned bead and the checked one; 0: no point is left out"
    )
    angle_deg: Annotated[float, number_within(0, 180)] = Field(
        0.05, description="largest angle between the tool on the thinned bead and on the checked one"
    )


class Hooks(Section):
    """Lines of the program at events; fields are {program}, {sub_volume}, {layer}, {bead}, {target}, {speed_mm_s}."""

    arc_on: ArcLines = Field(
        ["ARC_ON ( ) ;bead {bead} layer {layer} target {target} of {sub_volume}"],
        description="lines where the arc starts; default: the call of a sub-program that you write",
    )
    arc_off: ArcLines = Field(
        ["ARC_OFF ( ) ;bead {bead} layer {layer} target {target} of {sub_volume}"],
        description="lines where the arc ends; default: likewise",
    )
    layer_start: HookLines = Field([";layer {layer} of {sub_volume} starts"], description="lines where a layer starts")
    layer_end: HookLines = Field([";layer {layer} of {sub_volume} ends"], description="lines where a layer ends")

    @model_validator(mode="after")
    def _distinct_hooks(self) -> Hooks:
        first: dict[str, str] = {}
        for name in Hooks.model_fields:
            lines = getattr(self, name)
            skeleton = re.sub(r"\{\w+(:[^}]*)?\}", "{}", lines[0]).strip().upper() if lines else name
            if skeleton in first:
                raise ValueError(
                    f"{name} begins like {first[skeleton]}; make them different, so that a program that "
                    "is read can tell them apart"
                )
            first[skeleton] = name
        return self


class ReadSection(Section):
    """How programs are read: regular expressions, searched in every line without regard to case, and tables."""

    arc_on: Patterns = Field(
        [r"^ARC_?ON\s*\(", r"^;\s*process_on\b", r"#ArcOn(After)?MoveStd\b", r"^A[12]0\s*\(\s*ARC_STRT"],
        description="the arc is on after this line; named groups become fields",
    )
    arc_off: Patterns = Field(
        [r"^ARC_?OFF\s*\(", r"^;\s*process_off\b", r"#ArcOff(After)?MoveStd\b", r"^A[12]0\s*\(\s*ARC_OFF"],
        description="the arc is off after this line",
    )
    layer_start: Patterns = Field([r"^;\s*layer[ :_]*(start[ :_]*)?(?P<layer>\d+)\s*$"], description="a layer begins")
    layer_end: Patterns = Field([r"^;\s*layer[ :_]*end[ :_]*(?P<layer>\d+)\s*$"], description="a layer ends")
    harmless: Patterns = Field(
        [r"^ArcMainNG\s*\((?![^;]*\w\s*\()"], description="statements that are known to move nothing"
    )
    tool_data: dict[Number, FrameSection] = Field(
        default_factory=dict, description="TOOL_DATA[n]: frames in the flange"
    )
    base_data: dict[Number, BaseSection] = Field(
        default_factory=dict, description="BASE_DATA[n]: frames in the world, or in the faceplate of a machine"
    )
    machines: dict[Number, FrameSection] = Field(
        default_factory=dict, description="MACHINE_DEF[n].ROOT: frames in the controller's world"
    )


class ControllerSection(Section):
    """The robot's controller: how programs are written for it (KUKA KRC, KRL) and how they are read."""

    program: ProgramName | None = Field(
        None, description="name of the main module, at most 24 characters; left out: made from the case's name"
    )
    tool: Number | FrameSection | None = Field(
        None,
        description="number of the torch in TOOL_DATA, or its frame; left out: the case's torch as a literal frame",
    )
    base: Number | FrameSection | None = Field(
        None,
        description="number in BASE_DATA, or a frame in the table's faceplate (in the arm's base where no axis moves "
        "the table); left out: the part's frame",
    )
    machine: Annotated[int, number_within(1, 32)] = Field(2, description="index of the table in MACHINE_DEF")
    blend_mm: Annotated[float, number_within(0, 1000)] | None = Field(
        None, description="C_DIS within beads; left out: process.blend_mm"
    )
    advance: Annotated[int, number_within(0, 5)] = Field(
        3, description="$ADVANCE: number of points computed ahead; with 0 the arm stops in each"
    )
    points_a_module: Annotated[int, number_within(10, 100_000)] = Field(
        1000,
        description="largest number of moves in one file; longer layers are split; known programs have 500 to 2500",
    )
    axis_speed_percent: Percent = Field(30.0, description="$VEL_AXIS of PTP moves")
    axis_acceleration_percent: Percent = Field(50.0, description="$ACC_AXIS")
    external_speed_percent: Percent = Field(100.0, description="$VEL_EXTAX: the table's axes")
    acceleration_mm_s2: Annotated[float, number_within(1, 1e5)] = Field(2300.0, description="$ACC.CP")
    turn_speed_deg_s: Annotated[float, number_within(0.1, 1e4)] = Field(200.0, description="$VEL.ORI1 and $VEL.ORI2")
    memory_mb: Annotated[float, number_within(0.1, 1000)] = Field(
        4.0, description="the controller's memory for programs; a larger program gets a warning"
    )
    points_a_second: Annotated[float, number_within(0.1, 1000)] = Field(
        4.0, description="points of a bead in a second above which a controller may slow down; more get a warning"
    )
    thinning: Thinning = Thinning()
    hooks: Hooks = Hooks()
    read: ReadSection = ReadSection()

    @model_validator(mode="after")
    def _program_is_no_hook(self) -> ControllerSection:
        if self.program is not None and self.program.upper() in self.called_by_hooks():
            raise ValueError(f"program: a hook calls a sub-program named {self.program}; another name is needed")
        return self

    def called_by_hooks(self) -> set[str]:
        """The first word of every line of the hooks, in capitals: modules of these names are the controller's own."""
        return {re.split(r"\W", line.strip(), maxsplit=1)[0].upper() for line in self.all_hooks()} - {""}

    def all_hooks(self) -> list[str]:
        """Every line of the hooks."""
        hooks = self.hooks
        return [*hooks.arc_on, *hooks.arc_off, *hooks.layer_start, *hooks.layer_end]
