"""The strategies side by side, by the paper's indices and scores: the data behind ``rbam compare``.

    found = compare_case(load_case("blade.case.yaml"))       # one Comparison a sub-volume
    found = compare_paper()                                  # the shipped parts, with the paper's own figures
    document = compare_document("blade", found)              # "rbam-compare/1"
    for line in compare_lines("blade", found): ...           # rich renderables

The paper's three strategies are compared, and conical and revolved layers where a sub-volume stands on a cone or on
a given profile. A strategy that cannot slice a sub-volume (planes, where it runs right round the body) is left out of
its scores and says why; only where none can is that an error.

Source: Lettori et al. 2024, section 5.1 and tables 2 to 9.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, cast

import numpy as np
import yaml

from slicing import (
    ALLOWED,
    NO_ENDS,
    ZERO_RAD,
    BeadParameters,
    Body,
    CylindricalBody,
    Indices,
    Mesh,
    PartError,
    Scores,
    SlicingParameters,
    Strategy,
    fits,
    indices,
    lay_beads,
    layer_metal,
    load_mesh,
    overhangs,
    sample_beads,
    scores_of,
    share_of,
    slice_sub_volume,
    worst_angle,
)

from ..case.part_sections import Sampling
from ..case.sections import Case
from ..errors import InputError
from ..job.job import heights_of_body_ends
from ..job.part_input import read_part
from ..progress import phase
from ..shipped import MODELS_DIR

PAPER_TABLES = MODELS_DIR / "parts" / "paper_tables.yaml"
STRATEGIES: tuple[Strategy, ...] = ("planar", "cylindrical", "nonuniform")  # those of the paper, in its order
PAPERS_BEADS = BeadParameters(thin_walls="border")  # the borders of every layer, however thin a wall is
SAME_AREA = 1e-3  # relative: cylinders a nudge apart have areas this close


def title_of(strategy: str) -> str:
    """A strategy as it is read."""
    return "non-uniform" if strategy == "nonuniform" else strategy


@dataclass(frozen=True)
class ComparisonRow:
    """What one strategy gives, or why it gives nothing.

    Attributes:
        strategy: planar, cylindrical, nonuniform, conical or revolved.
        indices: None where it cannot slice the sub-volume.
        problem: why not; None where it can.
        thin_layers: layers with beads thinner than h_min somewhere.
        overhang_deg: greatest overhang angle of its layers; None where it was not found.
        metal_share: metal laid as a share of what its layers take; None where it cannot slice the sub-volume.
    """

    strategy: str
    indices: Indices | None
    problem: str | None = None
    thin_layers: int = 0
    overhang_deg: float | None = None
    metal_share: float | None = None


@dataclass(frozen=True)
class Comparison:
    """One sub-volume under all strategies.

    Attributes:
        name: of the sub-volume.
        rows: one a strategy, those of :data:`STRATEGIES` first.
        parameters: thicknesses it was sliced with; the strategy in them says nothing.
        sampling: how curves became targets.
        paper: the paper's own figures; None where there are none.
        printed_F: the total scores as the paper prints them; None where there are none.
    """

    name: str
    rows: tuple[ComparisonRow, ...]
    parameters: SlicingParameters
    sampling: Sampling
    paper: tuple[ComparisonRow, ...] | None = None
    printed_F: tuple[float, ...] | None = None


def compare_mesh(
    mesh: Mesh,
    bodies: Mapping[str, Body],
    parameters: SlicingParameters,
    sampling: Sampling | None = None,
    beads: BeadParameters | None = None,
    ends: Mapping[str, tuple[float, float]] | None = None,
) -> Comparison:
    """Slice a sub-volume by several strategies.

    Args:
        mesh: the sub-volume, part frame, mm.
        bodies: by strategy, what it stands on.
        parameters: thicknesses; the strategy is replaced by each in turn.
        sampling: how curves become targets.
        beads: which beads a layer is laid in; the paper's where left out.
        ends: by strategy, where the body ends along its axis, mm; nowhere where left out.

    Returns:
        The comparison.

    Raises:
        InputError: no strategy can slice the sub-volume; one line.
    """
    chosen = sampling or Sampling()
    rows = tuple(
        _row(
            mesh,
            body,
            replace(parameters, strategy=cast(Strategy, s)),
            chosen,
            beads or PAPERS_BEADS,
            (ends or {}).get(s, NO_ENDS),
        )
        for s, body in bodies.items()
    )
    if all(row.indices is None for row in rows):
        raise InputError(str(rows[0].problem))
    return Comparison(mesh.name, rows, parameters, chosen)


def _row(
    mesh: Mesh,
    body: Body,
    parameters: SlicingParameters,
    sampling: Sampling,
    beads: BeadParameters,
    body_z_mm: tuple[float, float],
) -> ComparisonRow:
    try:
        sliced = slice_sub_volume(mesh, body, parameters, body_z_mm)
    except PartError as error:
        return ComparisonRow(parameters.strategy, None, str(error))
    laid = lay_beads([sliced], beads, locate=False)
    targets = sample_beads(laid, sampling.chord_tolerance_mm, sampling.min_segment_mm)
    thin = sum(layer.thickness_mm[0] < parameters.h_min_mm - 1e-6 for layer in sliced.layers)
    found = indices(sliced, targets)
    angle = worst_angle(overhangs(sliced, ALLOWED * beads.width_mm))
    share = share_of(layer_metal(sliced, laid[0].beads, beads.pitch_mm))
    return ComparisonRow(parameters.strategy, found, None, thin, angle, share)


@phase("comparing")
def compare_case(case: Case) -> list[Comparison]:
    """Slice the sub-volumes of a case with every strategy that suits their body.

    Args:
        case: the case; its thicknesses and sampling are used.

    Returns:
        One comparison a sub-volume.

    Raises:
        InputError: a mesh is missing or cannot be used; one line.
    """
    part = read_part(case)
    parameters = replace(case.slicing, strategy=STRATEGIES[0], thickness="report")
    found = []
    for k, mesh in enumerate(part.meshes):
        bodies = {strategy: of[k] for strategy, of in part.others.items() if fits(strategy, of[k])}
        if bodies["planar"].kind == "cylinder":
            bodies.pop("revolved", None)  # offsets of a cylinder are what "cylindrical" gives
        ends = {strategy: heights_of_body_ends(part, body) for strategy, body in bodies.items()}
        found.append(compare_mesh(mesh, bodies, parameters, case.sampling, case.beads, ends))
    return found


@phase("comparing")
def compare_paper(parts: Sequence[str] | None = None, tables: Path = PAPER_TABLES) -> list[Comparison]:
    """Compare the strategies on the shipped models of the paper's parts, beside the paper's figures.

    Args:
        parts: which of propeller, support, boiler, valve; all of them where left out.
        tables: the paper's figures and the names of the meshes, which lie beside that file.

    Returns:
        One comparison a row of the paper's tables, named ``support/SV1``.

    Raises:
        InputError: a part that is not one of them, or a file that is missing or cannot be used; one line.
    """
    data = _paper_data(tables)
    asked = data["parameters"]
    parameters = SlicingParameters("planar", asked["h_layer_mm"], asked["h_min_mm"])
    sampling = Sampling(chord_tolerance_mm=asked["chord_tolerance_mm"], min_segment_mm=asked["min_segment_mm"])
    found = []
    for part in data["parts"] if parts is None else parts:
        if part not in data["parts"]:
            raise InputError(f"{part}: is not a part of the paper; allowed: {', '.join(data['parts'])}")
        shipped = data["parts"][part]
        try:
            meshes = [load_mesh(tables.parent / f, "mm", f"{part}/{sv}") for sv, f in shipped["meshes"].items()]
        except PartError as error:
            raise InputError(str(error)) from None
        bodies: dict[str, Body] = dict.fromkeys(STRATEGIES, CylindricalBody(shipped["body_radius_mm"]))
        for ours in (compare_mesh(mesh, bodies, parameters, sampling) for mesh in meshes):
            row = data["rows"][ours.name]
            printed = None if row["F"] is None else tuple(float(v) for v in row["F"])
            found.append(replace(ours, paper=_paper_rows(row), printed_F=printed))
    return found


def _paper_data(tables: Path) -> dict[str, Any]:
    try:
        data: dict[str, Any] = yaml.safe_load(tables.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise InputError(f"{tables}: cannot be read ({' '.join(str(error).split())})") from None
    return data


def _paper_rows(row: dict[str, list[float]]) -> tuple[ComparisonRow, ...]:
    columns = zip(row["NL"], row["A"], row["NV"], row["R"], strict=True)
    return tuple(
        ComparisonRow(strategy, Indices(int(nl), float(a), int(nv), float(r)))
        for strategy, (nl, a, nv, r) in zip(STRATEGIES, columns, strict=True)
    )


def scores_by_strategy(rows: Sequence[ComparisonRow]) -> dict[str, dict[str, float]]:
    """I1 to I4 and F of every strategy that could slice the sub-volume, see `slicing.paper.scores`."""
    able, scored = _scored(rows)
    return {row.strategy: scored.to_dict(k) for k, row in enumerate(able)}


def best_strategy(rows: Sequence[ComparisonRow]) -> str:
    """The strategy with the greatest F; the first of equals."""
    able, scored = _scored(rows)
    return able[int(scored.best)].strategy


def _scored(rows: Sequence[ComparisonRow]) -> tuple[list[ComparisonRow], Scores]:
    able = [row for row in rows if row.indices is not None]
    return able, scores_of([row.indices for row in able if row.indices is not None])


def orders(rows: Sequence[ComparisonRow]) -> dict[str, bool] | None:
    """What the paper finds of its strategies, asked of a sub-volume.

    Args:
        rows: one a strategy.

    Returns:
        Answers by question; None where a strategy is missing:

        A_kept: the proposed strategy adheres as well as cylinders do.
        A_above_planar: and better than planes.
        NV_at_most_cylindrical: it needs no more targets than cylinders.
        R_zero_where_planar_is: it meets a top exactly where planes do.
    """
    by_name = {row.strategy: row.indices for row in rows}
    planar, cylindrical, nonuniform = (by_name.get(s) for s in STRATEGIES)
    if planar is None or cylindrical is None or nonuniform is None:
        return None
    return {
        "A_kept": bool(np.isclose(nonuniform.A_mm2, cylindrical.A_mm2, rtol=SAME_AREA, atol=0.0)),
        "A_above_planar": nonuniform.A_mm2 > planar.A_mm2,
        "NV_at_most_cylindrical": nonuniform.NV <= cylindrical.NV,
        "R_zero_where_planar_is": planar.R_rad > ZERO_RAD or nonuniform.R_rad <= ZERO_RAD,
    }


def compare_document(title: str, found: Sequence[Comparison]) -> dict[str, Any]:
    """The document of schema "rbam-compare/1".

    Args:
        title: of the case, or what else was compared.
        found: the comparisons.

    Returns:
        Plain lists, dicts, strings and numbers; mm2 and rad as the keys say.
    """
    return {
        "schema": "rbam-compare/1",
        "case": title,
        "strategies": list(dict.fromkeys(row.strategy for one in found for row in one.rows)),
        "sub_volumes": [_sub_volume(one) for one in found],
    }


def _sub_volume(one: Comparison) -> dict[str, Any]:
    document: dict[str, Any] = {
        "name": one.name,
        "parameters": {
            **{key: getattr(one.parameters, key) for key in ("h_layer_mm", "h_min_mm", "h_max_mm")},
            **one.sampling.model_dump(),
        },
        **_figures(one.rows),
        "thin_layers": {row.strategy: row.thin_layers for row in one.rows if row.indices is not None},
        "overhang_deg": {row.strategy: row.overhang_deg for row in one.rows if row.indices is not None},
        "metal_share": {row.strategy: row.metal_share for row in one.rows if row.indices is not None},
        "problems": {row.strategy: row.problem for row in one.rows if row.problem is not None},
    }
    if one.paper is not None:
        printed = None if one.printed_F is None else dict(zip(STRATEGIES, one.printed_F, strict=True))
        document["paper"] = {**_figures(one.paper), "printed_F": printed}
    return document


def _figures(rows: Sequence[ComparisonRow]) -> dict[str, Any]:
    return {
        "indices": {row.strategy: row.indices.to_dict() if row.indices else None for row in rows},
        "scores": scores_by_strategy(rows),
        "best": best_strategy(rows),
        "orders": orders(rows),
    }


CRITERIA = (
    ("layers NL", "NL", 0),
    ("adhesion A mm2", "A_mm2", 2),
    ("targets NV", "NV", 0),
    ("top R rad", "R_rad", 2),
    *((f"score {key}", key, 2) for key in ("I1", "I2", "I3", "I4", "F")),
)
FIGURES = (("overhang deg", "overhang_deg", "{:.0f}"), ("metal of the layers'", "metal_share", "{:.0%}"))


def criteria_of(rows: Sequence[ComparisonRow]) -> dict[str, dict[str, float]]:
    """Indices and scores by strategy; empty for one that could not slice."""
    scored = scores_by_strategy(rows)
    return {
        row.strategy: {} if row.indices is None else {**row.indices.to_dict(), **scored[row.strategy]} for row in rows
    }
