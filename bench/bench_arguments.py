"""Arguments that all benches have: ``--smoke`` runs one on tiny sizes, to see that it still runs.

args = parsed(parser, targets=40, repeat=1)      # what --smoke sets
left_out("the vendor's meshes are not here")      # ends a smoke run that lacks what it measures against
"""

from __future__ import annotations

import argparse
import sys
from typing import Any, NoReturn


def parsed(parser: argparse.ArgumentParser, **tiny: Any) -> argparse.Namespace:
    """Arguments of the command line; with ``--smoke`` these instead."""
    parser.add_argument("--smoke", action="store_true", help="tiny sizes, to see that it runs")
    args = parser.parse_args()
    unknown = set(tiny) - set(vars(args))
    if unknown:
        raise TypeError(f"no such arguments: {', '.join(sorted(unknown))}")
    if args.smoke:
        vars(args).update(tiny)
    return args


def left_out(why: str) -> NoReturn:
    """End a smoke run of a bench that lacks what it measures against."""
    print(f"left out: {why}")
    sys.exit(0)
