"""What ``rbam compare`` does."""

from __future__ import annotations

import argparse
import sys

from ..atomic_files import STDOUT, write_text
from ..errors import InputError
from .case_options import load, refuse_outputs
from .console import put_json, say
from .exit_codes import FEASIBLE


def run(args: argparse.Namespace) -> int:
    """Compare the strategies on a case or on the paper's parts.

    Returns:
        The exit code.

    Raises:
        InputError: one line.
    """
    from ..compare.compare import compare_case, compare_document, compare_paper
    from ..report.comparison_lines import compare_lines

    if args.paper and args.case:
        raise InputError("--paper: compares the paper's own parts; leave the case out")
    if args.paper:
        refuse_outputs(args, None, "json", "html")
        title, found = "the paper's parts", compare_paper()
    else:
        case = load(args)
        refuse_outputs(args, case, "json", "html")
        title, found = case.title, compare_case(case)
    if args.json:
        put_json(args.json, compare_document(title, found))
    if args.html:
        from ..html.comparison_page import html_compare

        write_text(args.html, html_compare(compare_document(title, found)))
    say(compare_lines(title, found), sys.stderr if args.json == STDOUT else sys.stdout)
    return FEASIBLE
