"""The section ``controller`` of a case: what a robot program is written with, and read with.

controller: {tool: 3, program: BLADE, hooks: {arc_on: "ARC_ON ( ) ;bead {bead}"}}
"""

from __future__ import annotations

import re
import string
from typing import Annotated

from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from .fields import Angles3, Distance, Section, Vec3, within

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
        raise ValueError(f"is 1 to {MOST_PROGRAM_NAME} of the characters A-Z a-z 0-9 _, the first of them a letter")
    if name.upper() in KRL_WORDS:
        raise ValueError("is a word of the language; another name is needed")
    return name


def _lines(value: object) -> object:
    return [line for line in value.splitlines() if line.strip()] if isinstance(value, str) else value


def _hook_line(text: str) -> str:
    if not text.isascii() or not text.isprintable():
        raise ValueError("has ASCII characters only")
    done = re.search(r"\bDO\b(.*)", text.partition(";")[0], re.IGNORECASE)  # by a TRIGGER
    if _MOVES.match(text) or (done and _MOVES.match(done.group(1))):
        raise ValueError("may not move the arm, change a frame or a speed, or branch: a hook calls a sub-program")
    if not text.strip():
        raise ValueError("is a line that is not empty")
    try:
        pieces = list(string.Formatter().parse(text))
    except ValueError as error:
        raise ValueError(f"is no template ({error}); braces of the program itself are doubled: {{{{ }}}}") from None
    for _, name, spec, conversion in pieces:
        if name is None:
            continue
        if name not in HOOK_FIELDS:
            raise ValueError(f"has no field {{{name}}}; fields are {', '.join(HOOK_FIELDS)}")
        if conversion is not None or not _FORMAT.fullmatch(spec or "") or (spec and name in TEXT_FIELDS):
            raise ValueError(f"field {{{name}}}: a format is like 03d, .2f or g, of numbers only")
    return text


def _pattern(text: str) -> str:
    try:
        re.compile(text)
    except (re.error, RecursionError, OverflowError) as error:
        raise ValueError(f"is no regular expression ({error})") from None
    return text


HookLine = Annotated[str, Field(max_length=MOST_HOOK_LINE), AfterValidator(_hook_line)]
HookLines = Annotated[list[HookLine], BeforeValidator(_lines), Field(max_length=50)]
ArcLines = Annotated[HookLines, Field(min_length=1)]  # or the arc could not be read back
Pattern = Annotated[str, Field(min_length=1, max_length=200), AfterValidator(_pattern)]
Patterns = Annotated[list[Pattern], Field(max_length=50)]
ProgramName = Annotated[str, AfterValidator(_program_name)]
Number = Annotated[int, within(0, 1000)]
Percent = Annotated[float, within(0.1, 100)]


class FrameSection(Section):
    """A frame as KUKA gives it."""

    position_mm: Vec3 = Field((0.0, 0.0, 0.0), description="X, Y, Z")
    abc_deg: Angles3 = Field((0.0, 0.0, 0.0), description="A, B, C: about z, then the new y, then the new x")


class BaseSection(FrameSection):
    """A base frame of the controller's list."""

    machine: Annotated[int, within(1, 32)] | None = Field(
        None, description="MACHINE_DEF that moves it: the frame is given in its flange; none: it stands in the world"
    )


class Thinning(Section):
    """Points of a bead that the program may leave out."""

    chord_mm: Distance = Field(0.02, description="largest distance of what is left from what was checked; 0: none")
    angle_deg: Annotated[float, within(0, 180)] = Field(0.05, description="largest turn of the tool, likewise")


class Hooks(Section):
    """Lines written where something happens, with {field}s: program, sub_volume, layer, bead, target, speed_mm_s."""

    arc_on: ArcLines = Field(
        ["ARC_ON ( ) ;bead {bead} layer {layer} target {target} of {sub_volume}"],
        description="by default the call of a sub-program of the user's",
    )
    arc_off: ArcLines = Field(
        ["ARC_OFF ( ) ;bead {bead} layer {layer} target {target} of {sub_volume}"],
        description="the same for the end of the arc",
    )
    layer_start: HookLines = Field([";layer {layer} of {sub_volume} starts"], description="a comment")
    layer_end: HookLines = Field([";layer {layer} of {sub_volume} ends"], description="a comment")

    @model_validator(mode="after")
    def _told_apart(self) -> Hooks:
        first: dict[str, str] = {}
        for name in Hooks.model_fields:
            lines = getattr(self, name)
            skeleton = re.sub(r"\{\w+(:[^}]*)?\}", "{}", lines[0]).strip().upper() if lines else name
            if skeleton in first:
                raise ValueError(f"{name} begins as {first[skeleton]} does; read back, they could not be told apart")
            first[skeleton] = name
        return self


class ReadSection(Section):
    """How programs of others are read: regular expressions, searched in every line, case ignored; and tables."""

    arc_on: Patterns = Field(
        [r"^ARC_?ON\s*\(", r"^;\s*process_on\b", r"#ArcOn(After)?MoveStd\b", r"^A[12]0\s*\(\s*ARC_STRT"],
        description="the arc burns from here on; named groups become fields",
    )
    arc_off: Patterns = Field(
        [r"^ARC_?OFF\s*\(", r"^;\s*process_off\b", r"#ArcOff(After)?MoveStd\b", r"^A[12]0\s*\(\s*ARC_OFF"],
        description="the arc is off from here on",
    )
    layer_start: Patterns = Field([r"^;\s*layer[ :_]*(start[ :_]*)?(?P<layer>\d+)\s*$"], description="a layer begins")
    layer_end: Patterns = Field([r"^;\s*layer[ :_]*end[ :_]*(?P<layer>\d+)\s*$"], description="a layer ends")
    harmless: Patterns = Field(
        [r"^ArcMainNG\s*\("], description="statements that move nothing, though nobody else can know"
    )
    tool_data: dict[Number, FrameSection] = Field(default_factory=dict, description="TOOL_DATA[n], in the flange")
    base_data: dict[Number, BaseSection] = Field(default_factory=dict, description="BASE_DATA[n]")
    machines: dict[Number, FrameSection] = Field(
        default_factory=dict, description="MACHINE_DEF[n].ROOT, in the controller's world"
    )


class ControllerSection(Section):
    """The robot's controller: what programs are written with (KUKA KRC, KRL) and read with."""

    program: ProgramName | None = Field(
        None, description="name of the main module, at most 24 characters; made of the case's name where left out"
    )
    tool: Number | FrameSection | None = Field(
        None, description="number of the torch in TOOL_DATA, or its frame; none: the case's torch, as a literal frame"
    )
    base: Number | FrameSection | None = Field(
        None,
        description="number in BASE_DATA, or a frame in the table's flange (in the arm's base where no axis moves the "
        "table); none: where the part stands",
    )
    machine: Annotated[int, within(1, 32)] = Field(2, description="index of the table in MACHINE_DEF")
    blend_mm: Annotated[float, within(0, 1000)] | None = Field(
        None, description="C_DIS within beads; process.blend_mm where left out"
    )
    advance: Annotated[int, within(0, 5)] = Field(3, description="$ADVANCE: points computed ahead; 0 stops in each")
    points_a_module: Annotated[int, within(10, 100_000)] = Field(
        1000, description="moves of one file; longer layers are split. Known programs have 500 to 2500"
    )
    axis_speed_percent: Percent = Field(30.0, description="$VEL_AXIS of moves of axes")
    axis_acceleration_percent: Percent = Field(50.0, description="$ACC_AXIS")
    external_speed_percent: Percent = Field(100.0, description="$VEL_EXTAX: the table's axes")
    acceleration_mm_s2: Annotated[float, within(1, 1e5)] = Field(2300.0, description="$ACC.CP")
    turn_speed_deg_s: Annotated[float, within(0.1, 1e4)] = Field(200.0, description="$VEL.ORI1 and $VEL.ORI2")
    memory_mb: Annotated[float, within(0.1, 1000)] = Field(
        4.0, description="of the controller for programs; a larger program is warned of"
    )
    points_a_second: Annotated[float, within(0.1, 1000)] = Field(
        4.0, description="of a bead, above which the advance run is known to stall; warned of"
    )
    thinning: Thinning = Thinning()
    hooks: Hooks = Hooks()
    read: ReadSection = ReadSection()

    @model_validator(mode="after")
    def _program_is_no_hook(self) -> ControllerSection:
        called = {re.split(r"\W", line.strip(), maxsplit=1)[0].upper() for line in self.all_hooks()}
        if self.program is not None and self.program.upper() in called:
            raise ValueError(f"program: {self.program} is the name of what a hook calls; another name is needed")
        return self

    def all_hooks(self) -> list[str]:
        """Every line of the hooks."""
        hooks = self.hooks
        return [*hooks.arc_on, *hooks.arc_off, *hooks.layer_start, *hooks.layer_end]
