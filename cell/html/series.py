"""What the page plots along the path: angles, speeds, clearance, margins, and where on the path they stand.

    path_json(pack, result)        # {"x": seconds or target numbers, "q": .., "charts": [..]}

A feasible result is plotted over time. Where its samples are too many to be sent they are gathered into steps, each
with the worst of what it stands for, so that no peak of a speed or a margin is lost; clearance is that of the samples
sent. An infeasible one has no motion and is plotted over its targets, at the configuration of each or at the best
attempt. Units are those of the charts' titles.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ik.chain import Floats
from ik.singularity import KINDS, margins

from ..arrays import Ints
from ..collision.checker import Checker
from ..collision.clearances import CLEARANCE_REACH, Clearances
from ..collision.table import with_table_axes
from ..job.table_winding import upright_of
from ..motion.motion import Motion
from ..planning.context import settings_of
from ..units import METRES_PER_MM
from ..verdict.check import Result
from ..view.shown_motion import Played
from .pack import Pack
from .words import in_plain_words

MOST = 12_000  # samples sent, besides one a target
HELD = 0.01  # share of the deposition speed that it may be off and still counts as held
COLOURS = 8  # of lines in one chart; web/report.css has as many


@dataclass(frozen=True, eq=False)
class DrawnPath:
    """Where the arm is along the report's path.

    Attributes:
        x: seconds, or target numbers where there is no motion, (m,).
        q: arm and table, (m, j + 2), rad; NaN where a target has no configuration.
        arc: 1 while welding, (m,).
        target: target last passed, of a travel the one it leads to, (m,).
        starts: first sample of each step sent, (k,).
        timed: whether x is time.
    """

    x: Floats
    q: Floats
    arc: Ints
    target: Ints
    starts: Ints
    timed: bool


def path_of(result: Result) -> DrawnPath:
    """The samples of a result."""
    n = len(result.rows)
    if result.motion is not None:
        m = result.motion
        return DrawnPath(m.t_s, np.concatenate([m.q, m.table], axis=1), m.arc, m.target, _starts(m), True)
    nothing = np.full(result.job.scene.chain.n, np.nan)
    q = np.stack([next((x for x in (r.q, r.attempt) if x is not None), nothing) for r in result.rows])
    i = np.arange(n)
    return DrawnPath(i.astype(np.float64), np.column_stack([q, result.tables]), np.ones_like(i), i, i, False)


def _starts(motion: Motion) -> Ints:
    """Samples to keep: every one, or each target's first, where the arc changes, and some evenly between."""
    m = len(motion.t_s)
    if m <= MOST:
        return np.arange(m)
    change = np.flatnonzero((np.diff(motion.target) != 0) | (np.diff(motion.arc) != 0)) + 1
    even = np.linspace(0, m - 1, MOST).astype(np.int64)
    return np.unique(np.concatenate([even, change, change - 1]))


def path_json(pack: Pack, result: Result) -> dict[str, Any]:
    """The path and its charts as a document.

    Args:
        pack: where arrays go.
        result: the verdict.

    Returns:
        See ``web/charts.js`` for the charts; ``pairs`` are the nearest geoms' names, ``pair`` the number of each
        step's among them (-1: none within reach).
    """
    path = path_of(result)
    clear = _clearances(result, path)
    names, index = _pairs(result, clear)
    charts = [*_angles(result, path), *_speeds(result, path), _clearance(result, path, clear)]
    charts += [*_margins(result, path), _gravity(result, path)]
    for chart in charts:
        for line in chart["lines"]:
            line["y"] = pack.put(np.round(line["y"], 4), "f4")
    q = path.q[path.starts]
    return {
        "timed": path.timed,
        "samples": len(path.x),
        "x": pack.put(path.x[path.starts], "f4"),
        "q": pack.put(np.where(np.isfinite(q), np.round(q, 6), np.nan), "f4"),
        "arc": pack.put(path.arc[path.starts], "u1"),
        "target": pack.put(path.target[path.starts], "i4"),
        "pair": pack.put(index, "i2"),
        "pairs": names,
        "charts": charts,
        **_lines(pack, result, path),
    }


def _lines(pack: Pack, result: Result, path: DrawnPath) -> dict[str, Any]:
    """Where a program's text is in every step: the number of its file, and the line."""
    if not isinstance(result, Played) or result.program is None:
        return {}
    program, move = result.program.program, result.program.run.move
    move = move[np.minimum(path.starts + 1, len(move) - 1)]  # of the way that follows
    return {
        "files": list(program.files),
        "file": pack.put(program.moves.file[move], "i2"),
        "line": pack.put(program.moves.line[move], "u4"),
    }


def _worst(path: DrawnPath, values: Floats, of: Callable[..., Floats] = np.fmin.reduceat) -> Floats:
    """The worst of every step; NaN only where all of it is."""
    return np.asarray(of(values, path.starts), dtype=np.float64)


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
            low, high = float(np.min(path.q[:, k])), float(np.max(path.q[:, k]))
            low, high = np.rad2deg(low) - 1.0, np.rad2deg(high) + 1.0
        bounds = [{"y": round(float(v), 3), "label": f"{v:.5g}°"} for v in (low, high) if not endless]
        line = (name, np.rad2deg(path.q[path.starts, k]))
        margin = 0.06 * (high - low)
        charts.append(
            _chart(
                "Joint angles against their limits",
                name,
                "deg",
                [line],
                limits=bounds,
                range=[round(float(low - margin), 3), round(float(high + margin), 3)],
                small=True,
            )
        )
    return charts


def _speeds(result: Result, path: DrawnPath) -> list[dict[str, Any]]:
    """Joint speeds and the TCP's; there are none without a motion."""
    if not path.timed or len(path.x) < 2:
        return []
    scene, case = result.job.scene, result.job.case
    n = scene.chain.n
    dt = np.diff(path.x)
    dt = np.where(dt > 0, dt, np.nan)[:, None]
    share = np.abs(np.diff(path.q[:, :n], axis=0)) / dt / scene.chain.max_speed * 100
    share = np.concatenate([share, share[-1:]])
    lines = [(name, _worst(path, share[:, k], np.fmax.reduceat)) for k, name in enumerate(scene.chain.names)]
    top = float(np.nanmax(share))
    tcp = _tcp_speed(result, path, dt[:, 0])
    tcp[(path.arc[:-1] & path.arc[1:]) == 0] = np.nan
    held = _held(path, tcp, case.process.deposition_speed_mm_s)
    tcp = np.append(tcp, tcp[-1])
    wanted = case.process.deposition_speed_mm_s
    least, most = _worst(path, tcp), _worst(path, tcp, np.fmax.reduceat)
    return [
        _chart(
            "Speed",
            "Joint speed, share of each joint's limit",
            "%",
            lines,
            limits=[{"y": 100, "label": "limit 100 %"}],
            range=[0, round(max(105.0, 1.05 * top), 2)],
        ),
        _chart(
            "Speed",
            "TCP speed while welding",
            "mm/s",
            [("TCP", least)]
            if np.allclose(least, most, atol=1e-3, equal_nan=True)
            else [("least", least), ("most", most)],
            limits=[{"y": wanted, "label": f"asked {wanted:g} mm/s", "good": True}],
            range=[0, round(1.25 * max(wanted, float(np.nanmax(most))), 3)],
            note=held,
        ),
    ]


def _tcp_speed(result: Result, path: DrawnPath, dt: Floats) -> Floats:
    """Speed of the TCP between samples, (m - 1,), mm/s."""
    chain = result.job.scene.chain
    step = 20_000  # samples at once: poses of all would be large
    p = np.concatenate([chain.forward(path.q[i : i + step, : chain.n])[:, :3, 3] for i in range(0, len(path.q), step)])
    return np.asarray(np.linalg.norm(np.diff(p, axis=0), axis=1) / dt / METRES_PER_MM, dtype=np.float64)


def _held(path: DrawnPath, speed: Floats, wanted: float) -> str:
    """For how much of the welding the speed is held, in words."""
    dt, known = np.diff(path.x), np.isfinite(speed)
    total = float(dt[known].sum())
    if total <= 0:
        return ""
    off = known & (np.abs(speed / wanted - 1) > HELD)
    lost = float(dt[off].sum())
    if lost <= 0:
        return f"held within {HELD:.0%} all the {total:.0f} s of welding"
    return f"off by more than {HELD:.0%} for {lost:.1f} s of the {total:.0f} s of welding"


def _clearances(result: Result, path: DrawnPath) -> Clearances:
    """The nearest pair at every sample sent."""
    job, target = result.job, path.target
    before = np.where(target > 0, job.laid[np.maximum(target - 1, 0)], 0)
    if path.timed and path.arc.any():
        home = len(target) - int(np.argmax(path.arc[::-1]))  # after the last weld all of it is laid
        before[home:] = job.laid[target[home:]]
    # on the way to a bead all of the one before is laid; the ends of a way are samples of the beads
    way = path.arc == 0
    stage = np.where(way, before, job.stage[target])
    leaves, arrives = ~way & np.append(way[1:], False), ~way & np.insert(way[:-1], 0, False)
    stage = np.where(leaves, np.maximum(stage, job.laid[target]), stage)
    stage = np.where(arrives, np.maximum(stage, before), stage)[path.starts]
    q = path.q[path.starts]
    known = np.flatnonzero(np.isfinite(q).all(axis=1))
    scene, reach = with_table_axes(job.scene), max(CLEARANCE_REACH, 2 * settings_of(job).clearance)
    checker = Checker(scene, result.table, reach)
    found = checker.clearances(q[known], stage[known])
    out = Clearances.none(len(q))
    out.distance[:] = np.nan
    out.distance[known], out.pair[known], out.position[known] = found.distance, found.pair, found.position
    return out


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
        "Nearest two things that must not touch",
        "mm",
        [("clearance", mm)],
        limits=[{"y": limit, "label": f"needed {limit:g} mm", "low": True}],
        range=[round(float(np.clip(least, -reach / 2, 0.0)), 2), reach * 1.04],
        note=f"{reach:g} mm stands for {reach:g} mm and more" + ("" if path.timed else "; at the best attempts"),
        pairs=True,
    )


def _margins(result: Result, path: DrawnPath) -> list[dict[str, Any]]:
    job = result.job
    limits = job.singularity_limits.values(job.solver.geometry is not None)
    found = margins(job.solver.chain, job.solver.geometry, path.q[:, : job.scene.chain.n])
    charts = []
    for k, kind in enumerate(KINDS):
        if not np.isfinite(limits[k]):
            continue
        factor, unit = {"shoulder": (1e3, "mm"), "sigma": (1.0, "1")}.get(kind, (180 / np.pi, "deg"))
        values = _worst(path, found[:, k]) * factor
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
        chain, up = result.job.scene.chain, result.job.scene.T_world_base()[2, :3]
        out = -chain.forward(path.q[path.starts, : chain.n])[:, :3, 2] @ up
        values = np.rad2deg(np.arccos(np.clip(out, -1, 1)))
        values[path.arc[path.starts] == 0] = np.nan
    else:
        values = np.rad2deg(result.gravity)
    top = max(float(np.nanmax(values)), limit or 0.0, 2 * upright if along else 90.0)
    return _chart(
        "Gravity",
        "Deposition direction off straight up",
        "deg",
        [("gravity angle", values)],
        limits=limits,
        range=[0, round(min(180.0, 1.04 * top), 2)],
    )
