"""What the page plots along the path: angles, speeds, clearance, margins, and where on the path they stand.

    path_json(pack, result)        # {"x": seconds or target numbers, "q": .., "charts": [..]}

Of many samples (``cell.html.drawn_path``) clearance is that of the samples sent, and the least of the whole motion
where it occurs; speeds and margins are the worst of each step. Units are those of the charts' titles.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ik.chain import Chain, Floats
from ik.singularity import KINDS, margins

from ..arrays import Ints
from ..collision.checker import Checker
from ..collision.clearances import CLEARANCE_REACH, Clearances
from ..collision.table_clearances import with_table_axes
from ..job.table_winding import upright_of
from ..motion.deposition_speed import KEPT_SHARE
from ..planning.context import settings_of
from ..units import METRES_PER_MM
from ..verdict.result import Result
from ..view.shown_motion import ShownMotion
from .drawn_path import BUDGET, SAMPLES_AT_ONCE, DrawnPath, PageBudget, drawn_path, note_of, worst_of_steps
from .pack import Pack
from .page_words import in_plain_words

COLOURS = 8  # of lines in one chart; web/report.css has as many


def path_json(pack: Pack, result: Result, budget: PageBudget = BUDGET) -> dict[str, Any]:
    """The path and its charts as a document.

    Args:
        pack: where arrays go.
        result: the verdict.
        budget: how much of it.

    Returns:
        See ``web/charts.js`` for the charts; ``pairs`` are the nearest geoms' names, ``pair`` the number of each
        step's among them (-1: none within reach); ``note`` what the charts do not show, empty where that is nothing.
    """
    path = drawn_path(result, budget)
    clear = _clearances(result, path)
    names, index = _pairs(result, clear)
    charts = [*_angles(result, path), *_speeds(result, path), _clearance(result, path, clear)]
    charts += [*_margins(result, path), _gravity(result, path)]
    for chart in charts:
        for line in chart["lines"]:
            if "y" in line:
                line["y"] = pack.steps(line["y"], _steps_a_unit(path, chart["unit"]))
    return {
        "timed": path.timed,
        "samples": len(path.x),
        "note": note_of(result, path),
        "x": pack.steps(path.x[path.starts], 1e4),
        "q": pack.steps(path.q, 1e5 if path.gathered else 1e6),
        "arc": pack.put(path.arc[path.starts], "u1"),
        "target": pack.steps(path.target[path.starts]),
        "pair": pack.steps(index),
        "pairs": names,
        "charts": charts,
        **_lines(pack, result, path),
    }


def _steps_a_unit(path: DrawnPath, unit: str) -> float:
    """How finely a chart's values are sent: as they are read off, and finer where there are few."""
    return 1e2 if path.gathered and unit != "1" else 1e4


def _lines(pack: Pack, result: Result, path: DrawnPath) -> dict[str, Any]:
    """Where a program's text is in every step: the number of its file, and the line."""
    if not isinstance(result, ShownMotion) or result.program is None:
        return {}
    program, move = result.program.program, result.program.run.move
    move = move[np.minimum(path.starts + 1, len(move) - 1)]  # of the way that follows
    return {
        "files": list(program.files),
        "file": pack.steps(program.moves.file[move]),
        "line": pack.steps(program.moves.line[move]),
    }


def _chart(group: str, title: str, unit: str, lines: list[tuple[str, Floats]], **more: Any) -> dict[str, Any]:
    return {
        "group": group,
        "title": title,
        "unit": unit,
        "lines": [{"name": name, "y": np.where(np.isfinite(y), y, np.nan)} for name, y in lines],
        **more,
    }


def _angles(result: Result, path: DrawnPath) -> list[dict[str, Any]]:
    scene = result.job.scene
    limits = [*zip(scene.chain.lower, scene.chain.upper, strict=True), *scene.table_range]
    charts = []
    for k, (name, (low, high)) in enumerate(zip((*scene.chain.names, "E1", "E2"), limits, strict=True)):
        low, high = np.rad2deg([low, high])
        endless = not np.isfinite([low, high]).all()
        if endless:  # no limits to draw: the chart is as high as what is in it
            low, high = float(np.min(path.axis(k))), float(np.max(path.axis(k)))
            low, high = np.rad2deg(low) - 1.0, np.rad2deg(high) + 1.0
        bounds = [{"y": round(float(v), 3), "label": f"{v:.5g}°"} for v in (low, high) if not endless]
        margin = 0.06 * (high - low)
        ends = [round(float(low - margin), 3), round(float(high + margin), 3)]
        chart = _chart("Joint angles against their limits", name, "deg", [], limits=bounds, range=ends, small=True)
        charts.append({**chart, "lines": [{"name": name, "angle": k}]})  # the page has it from q
    return charts


def _speeds(result: Result, path: DrawnPath) -> list[dict[str, Any]]:
    """Joint speeds and the TCP's; there are none without a motion."""
    if not path.timed or len(path.x) < 2:
        return []
    scene, wanted = result.job.scene, result.job.case.process.deposition_speed_mm_s
    dt = np.diff(path.x)
    dt = np.where(dt > 0, dt, np.nan)

    def share(first: int, stop: int) -> Floats:
        i = np.minimum(np.arange(first, stop), len(dt) - 1)
        turned = np.abs(path.arm[i + 1] - path.arm[i]) / dt[i, None]
        return np.asarray(turned / scene.chain.max_speed * 100)

    most_share = worst_of_steps(path, share, np.fmax.reduceat)
    lines = [(name, most_share[:, k]) for k, name in enumerate(scene.chain.names)]
    tcp = np.linalg.norm(np.diff(_tcp(scene.chain, path.arm)[0], axis=0), axis=1) / dt / METRES_PER_MM
    tcp[(path.arc[:-1] & path.arc[1:]) == 0] = np.nan
    kept = _kept(path, tcp, wanted)
    tcp = np.append(tcp, tcp[-1])[:, None]
    least, most = (worst_of_steps(path, lambda i, j: tcp[i:j], of)[:, 0] for of in (np.fmin.reduceat, np.fmax.reduceat))
    return [
        _chart(
            "Speed",
            "Joint speed, share of each joint's limit",
            "%",
            lines,
            limits=[{"y": 100, "label": "limit 100 %"}],
            range=[0, round(max(105.0, 1.05 * float(np.nanmax(most_share))), 2)],
        ),
        _chart(
            "Speed",
            "TCP speed while welding",
            "mm/s",
            [("TCP", least)]
            if np.allclose(least, most, atol=1e-3, equal_nan=True)
            else [("least", least), ("most", most)],
            limits=[{"y": wanted, "label": f"set to {wanted:g} mm/s", "good": True}],
            range=[0, round(1.25 * max(wanted, float(np.nanmax(most))), 3)],
            note=kept,
        ),
    ]


def _tcp(chain: Chain, q: Floats) -> tuple[Floats, Floats]:
    """Place of the TCP, (n, 3), m, and direction of the wire, (n, 3), in the base frame."""
    Ts = [chain.forward(q[i : i + SAMPLES_AT_ONCE])[:, :3, 2:] for i in range(0, len(q), SAMPLES_AT_ONCE)]
    found = np.concatenate(Ts) if Ts else np.zeros((0, 3, 2))
    return found[:, :, 1], found[:, :, 0]


def _kept(path: DrawnPath, speed: Floats, wanted: float) -> str:
    """For how much of the welding the deposition speed is kept, in words."""
    dt, known = np.diff(path.x), np.isfinite(speed)
    total = float(dt[known].sum())
    if total <= 0:
        return ""
    off = known & (np.abs(speed / wanted - 1) > 1 - KEPT_SHARE)
    lost = float(dt[off].sum())
    if lost <= 0:
        return f"kept within {100 * (1 - KEPT_SHARE):.0f} % for all {total:.0f} s of welding"
    return (
        f"momentarily off by more than {100 * (1 - KEPT_SHARE):.0f} % for {lost:.1f} s of the {total:.0f} s of welding"
    )


def _clearances(result: Result, path: DrawnPath) -> Clearances:
    """The nearest pair at every sample sent, and the least of the whole motion where it occurs."""
    q = path.q
    known = np.flatnonzero(np.isfinite(q).all(axis=1))
    job = result.job
    scene, reach = with_table_axes(job.scene), max(CLEARANCE_REACH, 2 * settings_of(job).clearance)
    found = Checker(scene, result.table, reach).clearances(q[known], _laid(result, path)[known])
    out = Clearances.none(len(q))
    out.distance[:] = np.nan
    out.distance[known], out.pair[known], out.position[known] = found.distance, found.pair, found.position
    _keep_least(result, path, out)
    return out


def _laid(result: Result, path: DrawnPath) -> Ints:
    """Deposits that are there at every sample sent, (k,)."""
    job, at = result.job, path.starts
    laid, last = job.laid, len(path.x) - 1
    target = path.target[at]
    before = np.where(target > 0, laid[np.maximum(target - 1, 0)], 0)
    if path.timed and path.arc.any():
        home = at > last - int(np.argmax(path.arc[::-1]))  # after the last weld all of it is laid
        before[home] = laid[target[home]]
    # on the way to a bead all of the one before is laid; the ends of a way are samples of the beads
    way = path.arc[at] == 0
    deposits_laid = np.where(way, before, job.deposits_before[target])
    leaves = ~way & (at < last) & (path.arc[np.minimum(at + 1, last)] == 0)
    arrives = ~way & (at > 0) & (path.arc[np.maximum(at - 1, 0)] == 0)
    deposits_laid = np.where(leaves, np.maximum(deposits_laid, laid[target]), deposits_laid)
    return np.where(arrives, np.maximum(deposits_laid, before), deposits_laid)


def _keep_least(result: Result, path: DrawnPath, found: Clearances) -> None:
    """Put the least clearance of a motion, which may lie between the samples sent, where it occurs."""
    least = result.clearance
    if least is None or not path.timed or len(least.what) != 2:
        return
    scene = result.job.scene
    geoms = {scene.geom_name(g): g for g in range(scene.model.ngeom)}
    own = np.flatnonzero(path.target[path.starts] == least.target)
    if len(own) == 0 or not all(name in geoms for name in least.what):
        return
    at = int(own[np.argmin(found.distance[own])])
    if found.distance[at] > least.value:
        found.distance[at], found.pair[at] = least.value, [geoms[name] for name in least.what]


def _pairs(result: Result, clear: Clearances) -> tuple[list[list[str]], Ints]:
    """Names of the distinct pairs, and the number of each sample's."""
    unique, index = np.unique(clear.pair, axis=0, return_inverse=True)
    index = index.ravel()
    known = unique[:, 0] >= 0
    number = np.where(known, np.cumsum(known) - 1, -1)
    names = [[in_plain_words(result, result.job.scene.geom_name(int(g))) for g in pair] for pair in unique[known]]
    return names, number[index]


def _clearance(result: Result, path: DrawnPath, clear: Clearances) -> dict[str, Any]:
    limit = result.job.case.checks.clearance_mm
    reach = max(CLEARANCE_REACH / METRES_PER_MM, 2 * limit)
    # nothing within reach is drawn at the reach; NaN is no configuration
    mm = np.where(np.isinf(clear.distance), reach, clear.distance / METRES_PER_MM)
    least = float(np.nanmin(mm)) if np.isfinite(mm).any() else 0.0
    return _chart(
        "Clearance",
        "Least distance between shapes that must not touch",
        "mm",
        [("clearance", mm)],
        limits=[{"y": limit, "label": f"needed {limit:g} mm", "low": True}],
        range=[round(float(np.clip(least, -reach / 2, 0.0)), 2), reach * 1.04],
        note=f"{reach:g} mm means {reach:g} mm or more" + ("" if path.timed else "; at the best attempts"),
        pairs=True,
    )


def _margins(result: Result, path: DrawnPath) -> list[dict[str, Any]]:
    job = result.job
    limits = job.singularity_limits.values(job.solver.geometry is not None)
    chain, geometry = job.solver.chain, job.solver.geometry
    found = worst_of_steps(path, lambda i, j: margins(chain, geometry, path.arm[i:j]))
    charts = []
    for k, kind in enumerate(KINDS):
        if not np.isfinite(limits[k]):
            continue
        factor, unit = {"shoulder": (1e3, "mm"), "sigma": (1.0, "1")}.get(kind, (180 / np.pi, "deg"))
        values = found[:, k] * factor
        limit = float(limits[k]) * factor
        top = max(float(np.nanmax(values)) if np.isfinite(values).any() else 0.0, 2 * limit)
        charts.append(
            _chart(
                "Distance from singularities",
                kind if kind != "sigma" else "smallest singular value",
                unit,
                [(kind, values)],
                limits=[
                    {"y": round(limit, 4), "label": f"needed {limit:g}{'' if unit == '1' else ' ' + unit}", "low": True}
                ],
                range=[0, round(1.08 * top, 4)],
                small=True,
            )
        )
    return charts


def _gravity(result: Result, path: DrawnPath) -> dict[str, Any]:
    """Angle between the deposition direction and up: of the targets, and on the way of the wire itself."""
    limit, limits = result.job.case.checks.gravity_max_deg, []
    if limit is not None:
        limits.append({"y": limit, "label": f"limit {limit:g} deg"})
    along = result.job.case.table.mode == "coordinated"
    upright = float(np.rad2deg(upright_of(result.job.case)))
    if along:
        limits.append({"y": upright, "label": f"upright_deg {upright:g} deg"})
    if path.timed:
        up = result.job.scene.T_world_base()[2, :3]
        out = -_tcp(result.job.scene.chain, path.arm[path.starts])[1] @ up
        values = np.rad2deg(np.arccos(np.clip(out, -1, 1)))
        values[path.arc[path.starts] == 0] = np.nan
    else:
        values = np.rad2deg(result.gravity)
    top = max(float(np.nanmax(values)), limit or 0.0, 2 * upright if along else 90.0)
    return _chart(
        "Gravity",
        "Deposition direction off upright",
        "deg",
        [("off upright", values)],
        limits=limits,
        range=[0, round(min(180.0, 1.04 * top), 2)],
    )
