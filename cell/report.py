"""What is said of a result: the documents of the contracts, and the terminal report.

document = report_document(result)                # "rbam-report/1"
for line in report_lines(result): ...             # rich renderables
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ik.chain import Floats
from slicing.deposition import metal_document, share_of
from slicing.overhang import worst_angle
from slicing.warning import typed

from .check import Result, Row
from .pace import pace_document
from .parts import found_document, found_lines
from .place import METRES_PER_MM
from .robot import inverse, pose
from .terminal import is_verbose
from .way_words import margin_in_words, way_in_words

if TYPE_CHECKING:
    from rich.console import RenderableType

    from slicing.indices import Indices
    from slicing.layers import SlicedSubVolume
    from slicing.laying import LaidSubVolume

    from .job import Job
    from .remedies import Remedy
    from .sections import Process

WORST = 8  # infeasible targets shown on the terminal
GRAVEST_FIRST = ("unreachable", "joint_limit", "collision", "singular", "no_path", "speed", "gravity", "overhang")


def tcp_in_flange(result: Result) -> Floats:
    """Pose of the TCP in the flange frame, (4, 4), m."""
    import mujoco

    scene = result.job.scene
    data = mujoco.MjData(scene.model)
    mujoco.mj_kinematics(scene.model, data)
    T = [pose(data.site_xpos[s], data.site_xmat[s]) for s in (scene.sites["flange"], scene.sites["tcp"])]
    return inverse(T[0]) @ T[1]


def report_document(
    result: Result,
    remedies: Sequence[Remedy] = (),
    all_reasons: Mapping[int, list[dict[str, Any]]] | None = None,
) -> dict[str, Any]:
    """The contract "rbam-report/1": see docs/formats.md.

    Args:
        result: the verdict.
        remedies: what would help, from ``cell.remedies``.
        all_reasons: by target what excludes its candidates, from ``cell.all_reasons``; None leaves the key out.

    Returns:
        The document.
    """
    job, t = result.job, result.job.targets
    T = tcp_in_flange(result)
    rows = [
        {
            "index": i,
            "sub_volume": t.sub_volume[t.sub_volume_index[i]],
            "layer": int(t.layer[i]),
            "base_xyz_mm": _list(result.placed.position[i] / METRES_PER_MM, 4),
            "base_normal": _list(result.placed.normal[i], 8),
            "verdict": "feasible" if row.reason is None else "infeasible",
            "reason": row.reason,
            "detail": row.detail,
            "proved": row.proved,
            "q_deg": None if row.q is None or row.reason else _list(np.rad2deg(row.q), 6),
            "attempt_deg": None if row.attempt is None else _list(np.rad2deg(row.attempt), 6),
            "gravity_deg": round(float(np.rad2deg(result.gravity[i])), 3),
            "bead": int(t.path[i]),
        }
        for i, row in enumerate(result.rows)
    ]
    if all_reasons is not None:
        for i, reasons in all_reasons.items():
            rows[i]["all_reasons"] = reasons
    return {
        "schema": "rbam-report/1",
        "case": job.case.title,
        "verdict": "feasible" if result.feasible else "infeasible",
        "table": table_document(result),
        "tcp_in_flange": {"xyz_mm": _list(T[:3, 3] / METRES_PER_MM, 4), "z_axis": _list(T[:3, 2], 9)},
        "targets": len(rows),
        "infeasible": result.infeasible,
        "reasons": result.reasons,
        "solver": job.solver.name,
        "roll": _roll_text(result),
        "least_clearance": _least(result, "clearance"),
        "least_singularity_margin": _least(result, "singularity"),
        "smallest_singular_value": None if result.sigma is None else round(result.sigma, 6),
        "gravity_deg": {
            "min": round(float(np.rad2deg(result.gravity.min())), 3),
            "max": round(float(np.rad2deg(result.gravity.max())), 3),
        },
        "motion": None
        if result.motion is None
        else {
            "time_s": round(float(result.motion.t_s[-1]), 3),
            "arc_on_s": round(result.motion.arc_time, 3),
            "samples": len(result.motion.t_s),
            "travel_s": round(result.motion.travel_time, 3),
            "dwell_s": round(result.motion.dwell_time, 3),
            "speed": None if result.motion.pace is None else pace_document(result.motion.pace, t.path),
            "home_s": None if result.motion.home_s is None else round(result.motion.home_s, 3),
        },
        "metal": metal_of(job) if job.beads else None,
        "warnings": [str(line) for line in result.warnings],
        "typed_warnings": [typed(line).document() for line in result.warnings],
        **found_document(job.T_part_input, job.evidence),
        "rows": rows,
        "help": [remedy.document() for remedy in remedies],
    }


def table_document(result: Result) -> dict[str, float]:
    """Table angles as the contracts write them."""
    return {"E1_deg": float(result.asked[0]), "E2_deg": float(result.asked[1])}


def _list(values: Floats, digits: int) -> list[float]:
    return [round(float(v), digits) + 0.0 for v in values]


def _roll_text(result: Result) -> str:
    window = result.job.window
    if window.is_full:
        return "free"
    low, high = np.rad2deg([window.low, window.high])
    return f"fixed:{low:g}" if window.is_fixed else f"range:{low:g}:{high:g}"


def _least(result: Result, what: str) -> dict[str, Any] | None:
    if what == "clearance":
        c = result.clearance
        if c is None:
            return None
        return {"distance_mm": round(c.value / METRES_PER_MM, 3), "target": c.target, "pair": list(c.what)}
    s = result.singularity
    if s is None:
        return None
    kind = s.what[0]
    factor, unit = {"shoulder": (1e3, "mm"), "sigma": (1.0, "1")}.get(kind, (180 / np.pi, "deg"))
    return {"kind": kind, "margin": round(s.value * factor, 3), "unit": unit, "target": s.target}


def in_words(row: Row) -> str:
    """An infeasible target's reason and measure in a few words."""
    d = row.detail
    if "in_words" in d:
        return str(d["in_words"])
    if row.reason == "unreachable":
        if "beyond_reach_mm" in d:
            return f"{d['beyond_reach_mm']:.1f} mm beyond the arm's reach"
        if "inside_reach_mm" in d:
            return f"{d['inside_reach_mm']:.1f} mm too close to fold up for"
        return str(d["search"])
    if row.reason == "joint_limit":
        return f"{d['axis']} {d['over_deg']:.1f} deg over its limit"
    if row.reason == "singular":
        return margin_in_words(d)
    if row.reason == "gravity":
        return f"{d['angle_deg']:.1f} deg off up, limit {d['limit_deg']:g}"
    if row.reason == "overhang":
        return overhang_in_words(d)
    if row.reason == "speed" and "share" in d:
        why = f"; {d['axis']}'s {d['by']}" if d["axis"] else ""
        held = f"{100 * d['share']:.0f} % of the speed held, needs {100 * d['limit']:.0f} %"
        return f"from target {d['from_target']}: {held}{why}"
    return way_in_words(d)


def overhang_in_words(d: dict[str, Any]) -> str:
    """How far a layer stands out over what lies below it."""
    out = "with nothing below anywhere" if d["out_mm"] is None else f"up to {d['out_mm']:.1f} mm"
    return f"{d['area_mm2']:.1f} mm2 stand out over what lies below, {out}, limit {d['limit_mm']:g}"


def metal_of(job: Job) -> dict[str, float]:
    """The metal of all beads of a job, see `slicing.deposition.metal_document`."""
    process = job.case.process
    metal = [m for one in job.beads for m in one.metal]
    return metal_document(metal, process.density_g_cm3, process.wire_diameter_mm)


def metal_in_words(d: dict[str, Any]) -> str:
    """Metal of `metal_document` in a few words."""
    return (
        f"{d['mass_g']:.0f} g, {d['wire_m']:.1f} m of wire; {d['laid_mm3']:.0f} mm3 laid, {d['share']:.0%} of the"
        f" {d['wanted_mm3']:.0f} mm3 that the layers take"
    )


def _unit(unit: str) -> str:
    return "" if unit == "1" else f" {unit}"


def report_lines(result: Result) -> Iterator[RenderableType]:
    """The terminal report.

    Yields:
        rich renderables, one a block.
    """
    from rich.table import Table
    from rich.text import Text

    job = result.job
    good = result.feasible
    head = Text.assemble(
        (job.case.title, "bold"),
        f"  E1 = {result.asked[0]:g}, E2 = {result.asked[1]:g} deg   ",
        ("feasible" if good else "infeasible", "bold green" if good else "bold red"),
    )
    yield head
    facts = Table.grid(padding=(0, 2))
    facts.add_column(style="dim")
    facts.add_column()
    for name, value in _facts(result):
        facts.add_row(name, value)
    yield facts
    if not good:
        yield _worst(result)


def _facts(result: Result) -> Iterator[tuple[str, str]]:
    job, n = result.job, len(result.rows)
    layers = sum(len(s.layers) for s in job.sliced)
    beads = int(job.targets.path.max()) + 1
    yield (
        "part",
        f"{len(job.sliced)} sub-volume(s), {job.case.slicing.strategy}: {layers} layers, {beads} beads, {n} targets",
    )
    for line in found_lines(job.T_part_input, job.evidence):
        name, text = line.split(": ", 1)
        yield name, text
    yield "reached", f"{n - result.infeasible} of {n} targets ({job.solver.name}, roll {_roll_text(result)})"
    counts = ", ".join(f"{reason} {k}" for reason, k in result.reasons.items() if k)
    if counts:
        yield "not reached", counts
    clearance, singular = _least(result, "clearance"), _least(result, "singularity")
    if clearance:
        yield (
            "least clearance",
            f"{clearance['distance_mm']:.1f} mm, {' - '.join(clearance['pair'])}, at target {clearance['target']}"
            f" (limit {job.case.checks.clearance_mm:g})",
        )
    if singular:
        sigma = "" if result.sigma is None else f"; smallest singular value {result.sigma:.3f}"
        yield (
            "singularity",
            f"{singular['kind']} at {singular['margin']:g}{_unit(singular['unit'])}, "
            f"at target {singular['target']}{sigma}",
        )
    gravity = np.rad2deg(result.gravity)
    yield "deposition", f"{gravity.min():.0f} to {gravity.max():.0f} deg off straight up"
    if result.motion is not None:
        motion = result.motion
        dwell = f", {motion.dwell_time:.0f} s waiting" if motion.dwell_time else ""
        home = "" if motion.home_s is None else f" ({motion.home_s:.0f} s from home and back)"
        yield (
            "motion",
            f"{motion.t_s[-1]:.0f} s, {motion.arc_time:.0f} s of them with the arc on, {motion.travel_time:.0f} s "
            f"travelling{home}{dwell}; {len(motion.t_s)} samples checked",
        )
        if motion.pace is not None:
            yield "speed", speed_in_words(pace_document(motion.pace, job.targets.path))
    if job.beads:
        yield "metal", metal_in_words(metal_of(job))
    for line in result.warnings:
        yield "warning", line


def speed_in_words(d: dict[str, Any]) -> str:
    """How far the deposition speed is held, of what ``cell.pace.pace_document`` says."""
    if not d["slowed"]:
        return "held all along"
    why = f" ({d['axis']}'s {d['by']})" if d["axis"] else ""
    return (
        f"held to {100 * d['least_share']:.0f} % or more over every 5 mm, least from target "
        f"{d['from_target']}{why}; {d['slowed_s']:.0f} s on ways below 98 %"
    )


def _worst(result: Result) -> RenderableType:
    from rich.table import Table

    t = result.job.targets
    bad = worst_first(result)
    table = Table(box=None, pad_edge=False, header_style="dim", title_justify="left")
    for name, justify in (
        ("target", "right"),
        ("layer", "left"),
        ("x, y, z mm (base)", "left"),
        ("reason", "left"),
    ):
        table.add_column(name, justify=justify)  # type: ignore[arg-type]
    table.add_column("what went wrong")
    table.add_column("")
    shown = len(bad) if is_verbose() else WORST
    for i in bad[:shown]:
        row = result.rows[i]
        xyz = ", ".join(f"{v:.0f}" for v in result.placed.position[i] / METRES_PER_MM)
        layer = f"{t.sub_volume[t.sub_volume_index[i]]}/{t.layer[i]}"
        table.add_row(str(i), layer, xyz, row.reason, in_words(row), "proved" if row.proved else "")
    if len(bad) > shown:
        table.caption = f"and {len(bad) - shown} more; all of them with --verbose or --json"
        table.caption_justify = "left"
    return table


def worst_first(result: Result) -> list[int]:
    """Infeasible targets, the gravest first."""
    bad = [i for i, row in enumerate(result.rows) if row.reason is not None]
    return sorted(bad, key=lambda i: -severity(result.rows[i]))


def severity(row: Row) -> float:
    """How bad an infeasible target is, so that what no lower margin mends comes first; whole reasons are 1e6 apart."""
    d = row.detail
    measure = d.get("beyond_reach_mm") or d.get("inside_reach_mm") or d.get("over_deg") or 0.0
    if "distance_mm" in d:
        measure = d.get("required_mm", 0.0) - d["distance_mm"]
    elif "margin" in d:
        measure = d.get("limit", 0.0) - d["margin"]
    elif "share" in d:
        measure = d.get("limit", 0.0) - d["share"]
    elif "angle_deg" in d:
        measure = d["angle_deg"] - d.get("limit_deg", 0.0)
    rank = len(GRAVEST_FIRST) - GRAVEST_FIRST.index(row.reason) if row.reason in GRAVEST_FIRST else 0
    return rank * 1e6 + float(np.clip(measure, -4e5, 4e5))


def slice_lines(
    sliced: Sequence[SlicedSubVolume],
    found: Sequence[Indices],
    warnings: Sequence[str],
    told: Sequence[str] = (),
    laid: Sequence[LaidSubVolume] = (),
    process: Process | None = None,
) -> Iterator[RenderableType]:
    """The terminal report of a slicing: the paper's indices by sub-volume.

    Args:
        sliced: the sub-volumes.
        found: their indices.
        warnings: of the part as a whole, one line each.
        told: of its beads, one line each.
        laid: its beads, for their metal and overhangs.
        process: density and wire, for mass and length.

    Yields:
        rich renderables.
    """
    from rich.table import Table

    table = Table(box=None, pad_edge=False, header_style="dim")
    for name in ("sub-volume", "strategy"):
        table.add_column(name)
    more = ("overhang deg", "metal") if laid else ()
    for name in ("layers NL", "adhesion A mm2", "targets NV", "top R rad", "thickness mm", "volume mm3", *more):
        table.add_column(name, justify="right")
    for k, (s, i) in enumerate(zip(sliced, found, strict=True)):
        low, high = min(x.thickness_mm[0] for x in s.layers), max(x.thickness_mm[1] for x in s.layers)
        thickness = f"{low:.2f} .. {high:.2f}"
        numbers = (
            str(i.NL),
            f"{i.A_mm2:.2f}",
            str(i.NV),
            f"{i.R_rad:.3f}",
            thickness,
            f"{s.mesh.volume:.1f}",
        )
        table.add_row(s.name, s.strategy, *numbers, *(_bead_figures(laid[k]) if laid else ()))
    yield table
    if laid and process is not None:
        metal = metal_document([m for one in laid for m in one.metal], process.density_g_cm3, process.wire_diameter_mm)
        yield f"metal: {metal_in_words(metal)}"
    for line in (*warnings, *(line for s in sliced for line in s.warnings), *told):
        yield f"warning: {line}"


def _bead_figures(laid: LaidSubVolume) -> tuple[str, str]:
    """Greatest overhang angle, and metal laid as a share of what the layers take."""
    angle = worst_angle(laid.overhangs)
    return "-" if angle is None else f"{angle:.0f}", f"{share_of(laid.metal):.0%}"
