"""A case's controller in its cell: what its numbers of tools and bases mean there, and where an arm's axes put its TCP.

Use:

    controller = cell_controller(job)         # for write_krl and read_krl
    frames = frames_of(job, controller)       # tool and base that a program of the case is written with
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ik.chain import Floats
from slicing import Code, Warning

from ..case.controller_section import FrameSection
from ..job.job import Job
from ..mjcf.chain_from_model import TABLE_AXES
from ..rigid import inverse
from ..scene.site_frames import T_flange_tcp, T_table_part
from .cell_frames import T_base_root, tables_seen_from_base
from .controller import Controller, controller_of, matrix_of
from .orientation import pose_of
from .program import BaseFrame, ToolFrame


@dataclass(frozen=True, eq=False)
class ProgramFrames:
    """What a program is written with.

    Attributes:
        program: its name.
        tool: the torch.
        base: on the table.
        warnings: what the controller is taken to hold, typed.
    """

    program: str
    tool: ToolFrame
    base: BaseFrame
    warnings: tuple[Warning, ...]


def frames_of(job: Job, controller: Controller) -> ProgramFrames:
    """The tool and base that a case's program is written with.

    Args:
        job: names the cell.
        controller: from :func:`cell_controller`.

    Returns:
        Numbers where the case gives numbers, with the frames that they are taken to hold; else literal frames. What the
        controller has to hold is told: those frames, and where the table's root is.
    """
    section, reported = job.case.controller, []
    own = T_flange_tcp(job.scene)
    if isinstance(section.tool, int):
        tool = ToolFrame(controller.tool_data[section.tool], section.tool)
        reported.append(_taken(f"TOOL_DATA[{section.tool}]", tool.T_flange_tcp))
    else:
        tool = ToolFrame(own if section.tool is None else matrix_of(section.tool))
    reported += _one_axis(job)
    on_table = base_on_part(job, controller.machine)
    if isinstance(section.base, int):
        base = controller.base_data[section.base]
        reported.append(_taken(f"BASE_DATA[{section.base}]", base.T))
    else:
        T = matrix_of(section.base) if isinstance(section.base, FrameSection) else on_table.T
        base = replace(on_table, T=T)
    if base.coupled:
        reported.append(_taken(f"MACHINE_DEF[{base.machine}].ROOT, seen from $ROBROOT,", T_base_root(job)))
    else:
        text = "program: the base is given in the arm's base: the controller must have $ROBROOT at $WORLD (all of it 0)"
        reported.append(Warning(Code.PROGRAM_FRAME, text))
    return ProgramFrames(controller.program, tool, base, tuple(reported))


def _one_axis(job: Job) -> tuple[Warning, ...]:
    """Say what the program calls a table's one axis where its joint has a name of its own."""
    joints, has_axis = job.case.positioner.joints, job.scene.has_axis
    if len(joints) != 1 or joints[0] in TABLE_AXES:
        return ()
    name = TABLE_AXES[int(np.argmax(has_axis))]
    text = (
        f"program: the table's axis {joints[0]} is {name} in the program: the controller must have the same "
        "(a joint named E1 or E2 is called so)"
    )
    return (Warning(Code.PROGRAM_TABLE, text),)


def base_on_part(job: Job, machine: int) -> BaseFrame:
    """Where the part stands: on the table that moves it, or in the arm's base where no axis does.

    Args:
        job: names the cell.
        machine: index of the table in MACHINE_DEF.
    """
    scene = job.scene
    if scene.has_axis.any():
        return BaseFrame(T_table_part(scene), coupled=True, machine=machine)
    table = tables_seen_from_base(scene, np.zeros((1, 2)))[0]
    return BaseFrame(table @ T_table_part(scene), coupled=False)


def _taken(name: str, T: Floats) -> Warning:
    row = pose_of(T)
    x = ", ".join(
        f"{axis} {round(float(v), 3) + 0.0:.3f}"
        for axis, v in zip("XYZABC", [*(row[:3] * 1e3), *np.rad2deg(row[3:])], strict=True)
    )
    return Warning(
        Code.PROGRAM_FRAME, f"program: {name} is taken to be {x} (mm, deg): the controller must have the same"
    )


def cell_controller(job: Job) -> Controller:
    """The controller of a case in its cell.

    Args:
        job: names the cell.

    Returns:
        The case's, whose own tool and base have frames where its tables do not say them.
    """
    section, scene = job.case.controller, job.scene

    def forward(joints: Floats, external: Floats, tool: ToolFrame, base: BaseFrame) -> Floats:
        T = scene.chain.forward(joints[None])[0] @ inverse(T_flange_tcp(scene)) @ tool.T_flange_tcp
        frame = tables_seen_from_base(scene, np.nan_to_num(external)[None])[0] @ base.T if base.coupled else base.T
        return pose_of(inverse(frame) @ T)

    made = controller_of(job.case, home=scene.home, axes=scene.chain.n, forward=forward)
    tools, bases = dict(made.tool_data), dict(made.base_data)
    if isinstance(section.tool, int):
        tools.setdefault(section.tool, T_flange_tcp(scene))
    if isinstance(section.base, int):
        bases.setdefault(section.base, replace(base_on_part(job, section.machine), number=section.base))
    return replace(made, tool_data=tools, base_data=bases)
