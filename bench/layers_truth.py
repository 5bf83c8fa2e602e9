"""Layers of random solids against sections that are made without slicing: area, loops, nesting.

    python bench/layers_truth.py                  # 300 solids: a few minutes
    python bench/layers_truth.py --count 40 --seed 7

Each solid (holes, islands within holes, cavities with islands, several shells; `tests/random_solids.py`) stands on a
cylinder and is sliced with every strategy. Planes are cut by manifold3d; cylinders about the body's axis by bending the
solid straight and cutting that. What differs is printed with the seed; the exit code is 1 if anything does that the
layers' own check did not tell of.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections import Counter
from pathlib import Path

import manifold3d
import numpy as np
import shapely

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from bench_arguments import parsed
from support.random_solids import random_solid, unrolled_section

from slicing import WRONG_LAYER, Body, Mesh, PartError, SlicedSubVolume, SlicingParameters, slice_sub_volume
from slicing.curves.intersect import intersect
from slicing.layers.layer import Layer
from slicing.layers.outside_body import region_of
from slicing.mesh.solid import mesh_from_arrays
from slicing.surfaces.surfaces import Cylinder, Plane
from slicing.volume.layer_areas import hold_volume

RADIUS, OUT = 40.0, 56.0  # of the body; how far out the solid's middle is
AREA_MM2, AREA_SHARE = 0.2, 0.01  # bent sections are polygons of 0.8 mm


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
            sliced = slice_sub_volume(mesh, Body(RADIUS), SlicingParameters(strategy))
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


def main() -> int:
    """Run the comparison."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--count", type=int, default=300)
    parser.add_argument("--seed", type=int, default=0)
    args = parsed(parser, count=3)
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
