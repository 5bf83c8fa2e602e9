"""The report on a result, for the terminal.

Use:

    for line in report_lines(result): ...             # rich renderables

The document of the same result is made by ``cell.report.check_document``.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from slicing import share_of, worst_angle

from ..job.part_input import found_lines
from ..motion.deposition_speed import speed_document
from ..units import METRES_PER_MM
from ..verdict.result import Result
from ..verdict.severity import worst_first
from ..verdict.table_use import table_use
from ..verdict.words import in_words, speed_in_words, unit_word
from .check_document import least_document, metal_of, roll_text_of
from .facts import facts_grid, headline

if TYPE_CHECKING:
    from rich.console import RenderableType

    from slicing import LaidSubVolume


WORST = 8  # infeasible targets shown on the terminal


def metal_in_words(d: dict[str, Any]) -> str:
    """Metal of `metal_document` in a few words."""
    return (
        f"{d['mass_g']:.0f} g, {d['wire_m']:.1f} m of wire; {d['laid_mm3']:.0f} mm3 laid, {100 * d['share']:.0f} % of"
        f" the {d['wanted_mm3']:.0f} mm3 that the layers need"
    )


def report_lines(result: Result, *, every: bool = False) -> Iterator[RenderableType]:
    """The terminal report.

    Args:
        result: the verdict.
        every: list every infeasible target, not the worst ones alone.

    Yields:
        rich renderables, one a block.
    """
    yield headline(result.job.case.title, table_in_words(result), feasible=result.feasible)
    yield facts_grid(_facts(result))
    if not result.feasible:
        yield _worst(result, every)


def table_in_words(result: Result) -> str:
    """Where the table stands, in a few words."""
    if result.mode == "coordinated":
        there = [name for name, has in zip(("E1", "E2"), result.job.scene.has_axis, strict=True) if has]
        axes = " and ".join(name for name in there if name in (result.job.case.table.axes or there))
        return f"table coordinated, {axes} along the beads"
    if not result.poses:
        return f"E1 = {result.asked[0]:g}, E2 = {result.asked[1]:g} deg"
    count = len({(pose.E1_deg, pose.E2_deg) for pose in result.poses})
    return f"table {result.mode}, {count} pose{'s' if count > 1 else ''}"


def pasted_poses(result: Result) -> list[str]:
    """The poses as lines of a case file's section ``table``."""
    lines = ["table: {mode: indexed, poses: ["]
    for pose in result.poses:
        low, high = pose.layers
        lines.append(
            f"  {{sub_volume: {pose.sub_volume}, layers: [{low}, {high}], E1_deg: {pose.E1_deg:g},"
            f" E2_deg: {pose.E2_deg:g}}},"
        )
    return [*lines[:-1], lines[-1][:-1] + "]}"]


def _facts(result: Result) -> Iterator[tuple[str, str]]:
    job, n = result.job, len(result.rows)
    layers = sum(job.layers)
    beads = int(job.targets.bead.max()) + 1
    made = job.case.slicing.strategy if job.sliced else "from a toolpath"
    volumes = f"{len(job.layers)} sub-volume{'s' * (len(job.layers) != 1)}"
    yield "part", f"{volumes}, {made}: {layers} layers, {beads} beads, {n} targets"
    for line in found_lines(job.T_part_input, job.evidence):
        name, text = line.split(": ", 1)
        yield name, text
    good, looked = result.looked_at - result.infeasible, result.looked_at
    of = f"{n} targets" if looked == n else f"the {looked} targets checked"
    yield "weldable", f"{good} of {of} ({job.solver.name}, roll {roll_text_of(result)})"
    counts = ", ".join(f"{reason} {k}" for reason, k in result.reasons.items() if k)
    if counts:
        yield "not weldable", counts
    if looked < n:
        left_out = f"{n - looked} of {n} targets"
        yield "not checked", f"{left_out}: the part is infeasible without them (--every-target checks them)"
    clearance, singular = least_document(result, "clearance"), least_document(result, "singularity")
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
            f"{singular['kind']} at {singular['margin']:g}{unit_word(singular['unit'])}, "
            f"at target {singular['target']}{sigma}",
        )
    if result.mode == "best":
        yield "table", f"{{mode: fixed, E1_deg: {result.asked[0]:g}, E2_deg: {result.asked[1]:g}}}"
    if result.poses:
        yield "table", "\n".join(pasted_poses(result)).removeprefix("table: ")
    gravity = np.rad2deg(result.gravity)
    yield "deposition", f"{gravity.min():.0f} to {gravity.max():.0f} deg off upright"
    if result.motion is not None:
        motion = result.motion
        dwell = f", {motion.dwell_time:.0f} s waiting" if round(motion.dwell_time) else ""
        home = "" if motion.home_s is None else f" ({motion.home_s:.0f} s from home and back)"
        yield (
            "motion",
            f"{motion.t_s[-1]:.0f} s, {motion.arc_time:.0f} s with the arc on, {motion.travel_time:.0f} s "
            f"travelling{home}{dwell}; {len(motion.t_s)} samples checked",
        )
        use = table_use(result)
        if use is not None and job.case.table.mode == "coordinated":
            yield "table", use.in_words()
        if motion.held_speed is not None:
            yield "speed", speed_in_words(speed_document(motion.held_speed, job.targets.bead))
    if job.beads:
        yield "metal", metal_in_words(metal_of(job))
    for line in result.warnings:
        yield "warning", line


def _worst(result: Result, every: bool) -> RenderableType:
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
    table.add_column("what is wrong")
    table.add_column("")
    shown = len(bad) if every else WORST
    for i in bad[:shown]:
        row = result.rows[i]
        xyz = ", ".join(f"{v:.0f}" for v in result.placed.position[i] / METRES_PER_MM)
        layer = f"{t.sub_volume[t.sub_volume_index[i]]}/{t.layer[i]}"
        table.add_row(str(i), layer, xyz, row.reason, in_words(row), "proved" if row.proved else "")
    if len(bad) > shown:  # of those checked
        table.caption = f"and {len(bad) - shown} more; all of them with --verbose or --json"
        table.caption_justify = "left"
    return table


def _bead_figures(laid: LaidSubVolume) -> tuple[str, str]:
    """Greatest overhang angle, and metal laid as a share of what the layers take."""
    angle = worst_angle(laid.overhangs)
    return "-" if angle is None else f"{angle:.0f}", f"{100 * share_of(laid.metal):.0f} %"
