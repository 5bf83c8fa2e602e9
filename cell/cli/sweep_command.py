"""What ``rbam sweep`` does."""

from __future__ import annotations

import argparse
import sys
from typing import TYPE_CHECKING, Any

from ..atomic_files import STDOUT, write_bytes, write_csv, write_text
from ..errors import InputError
from .case_options import load, refuse_outputs, roll_argument
from .console import put_json, say
from .exit_codes import FEASIBLE, INFEASIBLE
from .progress_bar import Bars

if TYPE_CHECKING:
    from ..case.sections import Case


def run(args: argparse.Namespace) -> int:
    """Check all poses of a grid, and write their map.

    Returns:
        The exit code.

    Raises:
        InputError: one line.
    """
    from ..case.read import with_changes
    from ..pose_sweep.grid import grid
    from ..pose_sweep.ranking import sweep_document
    from ..pose_sweep.sweep import require_fixed_table, sweep
    from ..report.sweep_lines import sweep_lines

    case = load(args)
    require_fixed_table(case)
    refuse_outputs(args, case, "json", "out", "csv", "picture", "html")
    rolls = list(dict.fromkeys(args.rolls or ()))
    if len(rolls) == 1:  # nothing to tell poses apart by: the case's own roll is another one
        case = with_changes(case, roll=roll_argument(rolls.pop()))
        case = with_changes(case, sweep=case.sweep.model_copy(update={"roll": []}))
    poses = grid(case, args.e1, args.e2, rolls=rolls, placements=args.positioner or (), height=args.height)
    if args.jobs is not None and args.jobs < 1:
        raise InputError(f"--jobs: {args.jobs} is not a number of processes; 1 or more is needed")
    if args.dask is not None and args.jobs is not None:
        raise InputError("--jobs: the Dask cluster has workers of its own; give either --jobs or --dask")
    with _executor(args.dask) as executor:
        found = sweep(case, poses, processes=args.jobs, log=args.out, progress=Bars(sys.stderr), executor=executor)
    document = sweep_document(case, found)
    _put_sweep(args, case, document)
    say(sweep_lines(document), sys.stderr if args.json == STDOUT else sys.stdout)
    return FEASIBLE if document["best"] else INFEASIBLE


def _executor(dask: str | None) -> Any:
    from contextlib import nullcontext

    if dask is None:
        return nullcontext()
    from ..pose_sweep.workers import dask_cluster

    return dask_cluster(dask)


def _put_sweep(args: argparse.Namespace, case: Case, document: dict[str, Any]) -> None:
    if args.json:
        put_json(args.json, document)
    if args.csv:
        from ..pose_sweep.ranking import sweep_columns

        write_csv(args.csv, *sweep_columns(document))
    if args.picture:
        from ..view.sweep_map_picture import sweep_picture

        write_bytes(args.picture, sweep_picture(document))
    if args.html:
        from ..html.sweep_page import html_sweep

        write_text(args.html, html_sweep(case, document))
