"""What ``rbam slice`` does."""

from __future__ import annotations

import argparse
import sys
from typing import TYPE_CHECKING

from ..atomic_files import STDOUT, write_bytes, write_csv
from ..errors import InputError
from .case_options import refuse_outputs
from .console import put_json, say
from .exit_codes import FEASIBLE

if TYPE_CHECKING:
    from ..case.sections import Case


def run(args: argparse.Namespace) -> int:
    """Slice a mesh or a case, and write what is asked for.

    Returns:
        The exit code.

    Raises:
        InputError: one line.
    """
    from slicing import indices, slices_document, targets_rows, travels

    from ..job.job import sample_part, slice_part
    from ..job.part_input import found_document, found_lines, read_part
    from ..report.slice_lines import slice_lines

    case = _slice_input(args)
    refuse_outputs(args, case, "json", "targets", "picture", reads=[args.input])
    part = read_part(case)
    sliced = slice_part(case, part)
    laid, targets, reported = sample_part(case, sliced)
    found = [indices(s, targets) for s in sliced]
    metal = case.process.density_g_cm3, case.process.wire_diameter_mm
    if args.json:
        document = slices_document(sliced, found, part.warnings, laid, *metal)
        put_json(args.json, {**document, **found_document(part.T_part_input, part.evidence)})
    if args.targets:
        ways = travels(targets, case.process.retract_mm, sliced[0].body.surface.axis_point)
        write_csv(args.targets, *targets_rows(targets, ways, case.process.travel_speed_mm_s))
    if args.picture:
        from ..view.layer_picture import body_of, slice_picture

        png = slice_picture(sliced, body_of(part), title=case.title, colour=args.colour, laid=laid)
        write_bytes(args.picture, png)
    lines = [
        *slice_lines(sliced, found, part.warnings, reported, laid, case.process),
        *found_lines(part.T_part_input, part.evidence),
    ]
    say(lines, sys.stderr if args.json == STDOUT else sys.stdout)
    return FEASIBLE


def _slice_input(args: argparse.Namespace) -> Case:
    from pathlib import Path

    from ..case.read import load_case, parse_case, with_changes
    from ..shipped import case_path

    if args.input.endswith((".yaml", ".yml")) or case_path(args.input) != Path(args.input):
        for option, key in (("units", "part.units"), ("body_radius", "part.body.radius_mm")):
            if getattr(args, option) is not None:
                name = option.replace("_", "-")
                raise InputError(f"--{name}: goes with a mesh; a case says it itself ({key})")
        case = load_case(args.input)
    else:
        path = Path(args.input)
        part: dict[str, object] = {"mesh": path.name, "units": args.units or "mm"}
        if args.body_radius is not None:
            part = {"sub_volumes": [path.name], "body": {"radius_mm": args.body_radius}, "units": args.units or "mm"}
        case = parse_case({"part": part}, path.parent / "command line")
    changes = {"strategy": args.strategy, "h_layer_mm": args.h_layer}
    changes = {key: value for key, value in changes.items() if value is not None}
    beads = {"pattern": args.pattern, "width_mm": args.width}
    beads = {key: value for key, value in beads.items() if value is not None}
    if not changes and not beads:
        return case
    from dataclasses import asdict

    merged = {**asdict(case.slicing), **changes}
    if args.h_layer is not None:
        # the limits keep their share of the layer height, as when a process is scaled
        for key in ("h_min_mm", "h_max_mm"):
            merged[key] *= args.h_layer / case.slicing.h_layer_mm
    return with_changes(case, slicing=merged, beads={**asdict(case.beads), **beads})
