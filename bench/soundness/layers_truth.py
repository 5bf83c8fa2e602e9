"""Layers of random solids against sections that are made without slicing: area, loops, nesting.

    python -m bench.soundness.layers_truth                  # 300 solids: a few minutes
    python -m bench.soundness.layers_truth --count 40 --seed 7
    python -m bench.soundness.layers_truth --parts --count 500 --log layers.jsonl   # parts as CAD programs make them
    python -m bench.soundness.layers_truth --sum layers.jsonl

Each solid (holes, islands within holes, cavities with islands, several shells; `tests/random_solids.py`) stands on a
cylinder and is sliced with every strategy. Planes are cut by manifold3d; cylinders about the body's axis by bending the
solid straight and cutting that. What differs is printed with the seed; the exit code is 1 if anything does that the
layers' own check did not tell of.

With `--parts` two sub-volumes of each part of `tests/support/parts/cad_parts.py` are sliced, with any of the strategies
and any thickness, and three layers of each held against sections of `tests/support/parts/independent_sections.py`:
area, border, loops and holes.
"""

from __future__ import annotations

import argparse
import json
import time
from collections import Counter
from pathlib import Path
from typing import Any

import manifold3d
import numpy as np
import shapely

from slicing import WRONG_LAYER, CylindricalBody, Mesh, PartError, SlicedSubVolume, SlicingParameters, slice_sub_volume
from slicing.curves.intersect import intersect
from slicing.decomposition.decompose import Decomposition, decompose
from slicing.layers.body_ends import body_ends
from slicing.layers.layer import Layer
from slicing.layers.outside_body import region_of
from slicing.mesh.solid import mesh_from_arrays
from slicing.surfaces.surfaces import Cylinder, Plane
from slicing.volume.layer_areas import hold_volume
from slicing.warning import Warning
from tests.support.parts.cad_parts import cad_part
from tests.support.parts.independent_sections import section, solid_of_mesh
from tests.support.parts.random_solids import random_solid, unrolled_section

from ..bench_arguments import parsed

RADIUS, OUT = 40.0, 56.0  # of the body; how far out the solid's middle is
AREA_MM2, AREA_SHARE = 0.2, 0.01  # bent sections are polygons of 0.8 mm
TOLERANCE_MM, STEP_MM = 0.01, 0.02  # of curves; how far to either side of its surface a layer may fit
LEAST_MM2, BORDER_SHARE = 0.05, 0.01  # loops that count; what a border may be longer or shorter
ROOT_SHARE = 3e-6  # of the radius: half the height of a side of 1024, and some


def flat_differs(mesh: Mesh, solid: manifold3d.Manifold, z: float) -> str:
    """What differs in a section by a plane; empty if nothing does."""
    plane, theirs = Plane((0.0, 0.0, z), (0.0, 0.0, 1.0)), solid.slice(z)
    curves = intersect(mesh, plane)
    area = sum(curve.area_mm2 for curve in curves)
    region = region_of([plane.unrolled(curve.points) for curve in curves])
    parts = [part for part in shapely.get_parts(region) if part.area > 1e-6]
    if abs(area - theirs.area()) > 1e-6 * max(area, 1.0) or abs(region.area - area) > 1e-6 * max(area, 1.0):
        return f"area {area:.6f}, region {region.area:.6f}, theirs {theirs.area():.6f}"
    if len(curves) != theirs.num_contour() or len(parts) != len(theirs.decompose()):
        return f"{len(curves)} loops in {len(parts)} parts, theirs {theirs.num_contour()} in {len(theirs.decompose())}"
    return ""


def round_differs(layer: Layer, solid: manifold3d.Manifold) -> str:
    """What differs in a layer on a cylinder about the axis; empty if nothing does."""
    assert isinstance(layer.surface, Cylinder)
    by = [unrolled_section(solid, layer.surface.radius + step) for step in (0.0, 1e-3, -0.02, 0.02)]
    areas = [section.area() for section in by]
    slack = AREA_MM2 + AREA_SHARE * max(areas)
    if not min(areas) - slack <= layer.area_mm2 <= max(areas) + slack:
        return f"layer {layer.index}: area {layer.area_mm2:.3f}, theirs {areas[0]:.3f}"
    count = sum(abs(curve.area_mm2) > AREA_MM2 for curve in layer.curves)
    counts = [_loops(section, share) for section in by for share in (0.5, 2.0)]
    if not min(counts) <= count <= max(counts):
        return f"layer {layer.index}: {count} loops, theirs {counts}"
    return ""


def _loops(section: manifold3d.CrossSection, share: float) -> int:
    return sum(shapely.Polygon(loop).area > share * AREA_MM2 for loop in section.to_polygons())


def strategies(mesh: Mesh, solid: manifold3d.Manifold) -> dict[str, list[str]]:
    """What differs, by strategy; "told" where the layers' own check says so."""
    found: dict[str, list[str]] = {}
    for strategy in ("planar", "cylindrical", "nonuniform"):
        try:
            sliced = slice_sub_volume(mesh, CylindricalBody(RADIUS), SlicingParameters(strategy))
        except PartError as error:
            found[strategy] = [f"refused: {error}"]
            continue
        told = {line.layer for line in hold_volume(sliced).lines if line.code in WRONG_LAYER}
        found[strategy] = [f"told of layer {k}" for k in sorted(told, key=str)]
        if strategy == "cylindrical":
            layers = [layer for layer in sliced.layers[1::4] if layer.index not in told]
            found[strategy] += [text for layer in layers if (text := round_differs(layer, solid))]
        if strategy == "planar":
            found[strategy] += _planes_differ(sliced, solid, told)
    return found


def _planes_differ(sliced: SlicedSubVolume, solid: manifold3d.Manifold, told: set[int | None]) -> list[str]:
    """Planar layers that pass the body by, against manifold3d."""
    texts = []
    for layer in sliced.layers[::4]:
        assert isinstance(layer.surface, Plane)
        normal, point = np.array(layer.surface.normal), np.array(layer.surface.point)
        if layer.index in told or normal @ point <= RADIUS:
            continue
        turn = float(np.degrees(np.arctan2(normal[1], normal[0])))
        theirs = solid.rotate((0.0, 0.0, -turn)).rotate((0.0, -90.0, 0.0)).slice(float(normal @ point) + 1e-5)
        if abs(theirs.area() - layer.area_mm2) > 1e-3 * max(theirs.area(), 1.0):
            texts.append(f"layer {layer.index}: area {layer.area_mm2:.4f}, theirs {theirs.area():.4f}")
        elif theirs.num_contour() != len(layer.curves):
            texts.append(f"layer {layer.index}: {len(layer.curves)} loops, theirs {theirs.num_contour()}")
    return texts


def cad_strategy(parts: Decomposition, k: int, rng: np.random.Generator) -> str:
    """A strategy that fits what a sub-volume stands on."""
    fitting = ("cylindrical", "nonuniform", "planar", "revolved")
    return str(rng.choice(fitting if parts.cones[k] is None else ("conical", "planar", "revolved")))


def cad_layers(seed: int) -> dict[str, Any]:
    """Layers of a seed's part against sections: how many agree, what is refused, told of or differs."""
    start, rng = time.process_time(), np.random.default_rng([seed, 500])
    part, texts, layers = cad_part(seed), [], 0
    try:
        parts = decompose(mesh_from_arrays("part", part.vertices, part.faces))
    except PartError as error:
        return {"seed": seed, "layers": 0, "texts": [f"refused: {error}"], "words": part.words}
    for k in rng.permutation(len(parts.sub_volumes))[:2].tolist():
        mesh = parts.sub_volumes[k]
        solid = solid_of_mesh(mesh)
        xy = mesh.vertices[:, :2] - parts.body.axis_xy_mm
        high = max(float(np.hypot(*xy.T).max()) - parts.bodies[k].radius_mm, 0.05 * parts.bodies[k].radius_mm)
        strategy, h = cad_strategy(parts, k, rng), high / float(rng.uniform(4.0, 14.0))
        body = parts.bodies_for(strategy)[k]
        parameters = SlicingParameters(strategy, h, 0.8 * h, 1.3 * h, TOLERANCE_MM)
        try:
            sliced = slice_sub_volume(mesh, body, parameters, body_ends(parts.outline.points, body))
        except PartError as error:
            texts.append(f"refused: {mesh.name}, {strategy}: {error}")
            continue
        lines = [line for line in sliced.warnings if isinstance(line, Warning)]
        told = {line.layer for line in lines if line.code in WRONG_LAYER}
        texts += [f"told: {mesh.name}, {strategy}, layer {n}" for n in sorted(told, key=str)]
        chosen = rng.permutation(len(sliced.layers))[:3].tolist()
        layers += len(chosen)
        for layer in (sliced.layers[n] for n in chosen if n not in told):
            if differs := layer_differs(layer, solid):
                texts.append(f"{mesh.name}, {strategy}, h {h:.4g}, layer {layer.index}: {differs}")
    seconds = round(time.process_time() - start, 3)
    return {"seed": seed, "layers": layers, "texts": texts, "words": part.words, "process_s": seconds}


def layer_differs(layer: Layer, solid: manifold3d.Manifold) -> str:
    """What differs between a layer and the solid's sections by its surface and beside it; empty if nothing does."""
    # a first layer is where the solid begins: outside what the sections' polygon is off the circle
    off_axis = [layer.curves[0].points[:, :2] - axis for axis in layer.surface.axis_points]
    begins = 1e-4 + ROOT_SHARE * max((float(np.hypot(*off.T).max()) for off in off_axis), default=0.0)
    steps = (0.0 if layer.index else begins, STEP_MM, *((-STEP_MM,) if layer.index else ()))
    by = [section(solid, layer.surface, step, LEAST_MM2) for step in steps]
    border = sum(curve.length_mm for curve in layer.curves)
    areas, lengths = [one.area_mm2 for one in by], [one.length_mm for one in by]
    slack = LEAST_MM2 + TOLERANCE_MM * max(border, *lengths)
    if not min(areas) - slack <= layer.area_mm2 <= max(areas) + slack:
        return f"area {layer.area_mm2:.4f}, theirs {areas[0]:.4f}"
    if not min(lengths) * (1 - BORDER_SHARE) - 0.5 <= border <= max(lengths) * (1 + BORDER_SHARE) + 0.5:
        return f"border {border:.3f}, theirs {lengths[0]:.3f}"
    both = [(one.loops, one.holes) for one in by]
    counted = [curve for curve in layer.curves if abs(curve.area_mm2) > LEAST_MM2]
    loops, holes = len(counted), sum(curve.area_mm2 < 0 for curve in counted)
    if not min(n for n, _ in both) <= loops <= max(n for n, _ in both):
        return f"{loops} loops, theirs {both}"
    if min(n for _, n in both) >= 0 and not min(n for _, n in both) <= holes <= max(n for _, n in both):
        return f"{holes} holes, theirs {both}"
    return ""


def cad_main(args: argparse.Namespace) -> int:
    """Run the comparison of CAD-like parts; a log's seeds are not run again."""
    log = args.sum or args.log
    rows = [json.loads(line) for line in log.read_text("utf-8").splitlines()] if log and log.is_file() else []
    known = {row["seed"] for row in rows}
    for seed in () if args.sum else range(args.seed, args.seed + args.count):
        if seed in known:
            continue
        rows.append(cad_layers(seed))
        if log:
            with log.open("a", encoding="utf-8") as file:
                file.write(json.dumps(rows[-1]) + "\n")
        for text in rows[-1]["texts"]:
            print(f"{seed}: {text} [{rows[-1]['words']}]", flush=True)
    texts = [text for row in rows for text in row["texts"]]
    kinds = Counter(text.split(":")[0] if text.startswith(("refused", "told")) else "differs" for text in texts)
    print({"parts": len(rows), "layers": sum(row["layers"] for row in rows), **kinds})
    return int(kinds["differs"] > 0)


def main() -> int:
    """Run the comparison."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--count", type=int, default=300)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--parts", action="store_true", help="parts as CAD programs make them instead of random solids")
    parser.add_argument("--log", type=Path, help="with --parts: takes a line a part; what it holds is not run again")
    parser.add_argument("--sum", type=Path, metavar="LOG", help="run nothing: what a log holds")
    args = parsed(parser, count=3)
    if args.parts or args.sum:
        return cad_main(args)
    tally: Counter[str] = Counter()
    start = time.perf_counter()
    for seed in range(args.seed, args.seed + args.count):
        rng = np.random.default_rng(seed)
        solid = random_solid(rng).translate((OUT, 0.0, 0.0))
        data = solid.to_mesh64()
        mesh = mesh_from_arrays("SV1", np.asarray(data.vert_properties)[:, :3], np.asarray(data.tri_verts))
        flat = [text for z in rng.uniform(*mesh.bounds[:, 2], 4).tolist() if (text := flat_differs(mesh, solid, z))]
        for kind, texts in {"planes": flat, **strategies(mesh, solid)}.items():
            wrong = [text for text in texts if not text.startswith(("told", "refused"))]
            tally[f"{kind}: {'differs' if wrong else 'told' if texts else 'agrees'}"] += 1
            for text in texts:
                print(f"seed {seed}, {kind}: {text}", flush=True)
    for key, count in sorted(tally.items()):
        print(f"{count:5d}  {key}")
    print(f"{time.perf_counter() - start:.0f} s")
    return int(any("differs" in key for key in tally))


if __name__ == "__main__":
    raise SystemExit(main())
