"""How many processes a command works in.

prepare_and_check(case, bars, processes=process_count(args))
"""

from __future__ import annotations

import argparse

from ..errors import InputError
from ..processes.worker_pool import cores


def process_count(args: argparse.Namespace) -> int:
    """The processes asked for, or one a core: what is found does not depend on it, and small parts start none.

    Raises:
        InputError: it is no number of processes.
    """
    if args.jobs is None:
        return cores()
    if args.jobs < 1:
        raise InputError(f"--jobs: {args.jobs} is not a number of processes; 1 or more is needed")
    return int(args.jobs)
