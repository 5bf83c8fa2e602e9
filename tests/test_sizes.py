"""Functions fit a screen and take few parameters; what is larger has its reason here."""

from __future__ import annotations

import ast
from functools import cache
from pathlib import Path

from support.paths import ROOT
from support.source_trees import nodes_of

LINES, PARAMETERS = 60, 6  # of a function, its docstring aside
ROOTS = ("cell", "ik", "slicing", "models", "bench")

LONGER = {
    "models/kr70_r2100/build_visuals.py:parts": "one solid of the arm after the other",
}
MORE_PARAMETERS = {
    "cell/collision/proofs/between_samples.py:least_between_samples": "samples with what is known of them and the rest",
    "cell/collision/proofs/between_samples.py:unproven_steps": "samples with what is known, and what is to be proved",
    "cell/collision/blended_corners.py:cut_corners": "samples with what is known of them, and what is to be proved",
    "cell/planning/edges/blended_check.py:_met": "samples with what is known of them, and what is to be proved",
    "cell/coordination/table_schedule.py:_solved": "the terms of one least-squares problem",
    "cell/planning/edges/edge_tracking.py:track_edges": "edges as columns, and what they are held against",
    "cell/planning/blocking_layers.py:_blame": "a trial with all that it varies",
    "cell/view/film.py:film": "options of a film, all with defaults",
    "cell/view/layer_picture.py:_composed": "options of a picture",
    "cell/view/layer_picture.py:slice_picture": "options of a picture, all with defaults",
    "ik/bead_path.py:best_runs": "nodes as columns, and what a way through them may do; public",
    "ik/dls.py:_descend": "targets as columns, and how far is descended",
    "ik/dls.py:solve": "options of a search, all with defaults; public",
    "ik/reachability_proof.py:certify": "options of a proof, all with defaults; public",
    "models/kr70_r2100/build_visuals.py:disc": "the measures of one solid",
    "models/parts/solids.py:plate": "the measures of one solid",
    "slicing/curves/ellipse_arcs.py:_origins": "the terms of one formula, as columns",
    "slicing/curves/ellipse_arcs.py:_unwrap_slivers": "the terms of one formula, as columns",
    "slicing/curves/ellipse_arcs.py:sample_arcs": "arcs as columns",
    "slicing/curves/parallel_levels.py:level_curves": "options of a cut, all with defaults",
    "slicing/curves/revolved.py:_whole": "faces as columns",
    "slicing/curves/slabs.py:_chords": "faces as columns",
    "slicing/paper/adhesion.py:_integral": "the terms of one formula",
}


@cache
def functions() -> list[tuple[str, ast.FunctionDef | ast.AsyncFunctionDef]]:
    found = []
    for root in ROOTS:
        for path in sorted((ROOT / root).rglob("*.py")):
            for node in nodes_of(path):
                if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                    found.append((f"{Path(path).relative_to(ROOT).as_posix()}:{node.name}", node))
    return found


def length(node: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    assert node.end_lineno is not None
    doc = ast.get_docstring(node, clean=False)
    return node.end_lineno - node.lineno + 1 - (doc.count("\n") + 1 if doc else 0)


def parameters(node: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    given = node.args.posonlyargs + node.args.args + node.args.kwonlyargs
    return sum(one.arg not in ("self", "cls") for one in given)


def test_functions_fit_a_screen_or_say_why_not() -> None:
    assert {name for name, node in functions() if length(node) > LINES} == set(LONGER)


def test_functions_take_few_parameters_or_say_why_not() -> None:
    assert {name for name, node in functions() if parameters(node) > PARAMETERS} == set(MORE_PARAMETERS)
