"""What ``rbam scene`` does."""

from __future__ import annotations

import argparse
import sys

from ..atomic_files import write_text
from .case_options import load, refuse_outputs
from .console import say
from .exit_codes import FEASIBLE


def run(args: argparse.Namespace) -> int:
    """Describe the composed cell, or write it as one MJCF.

    Returns:
        The exit code.

    Raises:
        InputError: one line.
    """
    case = load(args)
    refuse_outputs(args, case, "xml")
    from ..job.job import prepare
    from ..report.scene_contents import look_into_scene, scene_lines
    from ..scene.scene import case_table
    from ..scene.standalone import standalone_xml

    scene = prepare(case).scene
    if args.xml:
        write_text(args.xml, standalone_xml(scene))
        return FEASIBLE
    say(scene_lines(look_into_scene(scene, case_table(case, scene))), sys.stdout)
    return FEASIBLE
