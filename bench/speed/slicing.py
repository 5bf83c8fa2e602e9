"""Slicing measured against trimesh's `section_multiplane` and manifold3d's `slice`, in one run on one thread.

    python -m bench.speed.slicing                   # about two minutes
    python -m bench.speed.slicing --repeat 7 --no-memory

Every row gives closed, ordered loops of points and the area inside of them for every layer; what is in and out of a
row is said in its name and in bench/figures/slicing.json. Each row is the fastest of its repeats, and the rows take
turns, so that a busy machine slows all of them alike.

Four parts: a sphere of 328,000 faces in 98 planar layers; a boss of about as many faces in some 50 cylindrical,
non-uniform and planar layers, each way by the whole of what `rbam slice` does for a sub-volume; peak memory of
`rbam slice` on a boss of a million faces, each strategy in a process of its own; and how time grows with faces and
layers.
"""

from __future__ import annotations

import os

os.environ["OMP_NUM_THREADS"] = "1"  # before numpy is loaded
os.environ["OPENBLAS_NUM_THREADS"] = "1"
os.environ["MKL_NUM_THREADS"] = "1"

import argparse
import dataclasses
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from importlib.util import find_spec
from pathlib import Path

import manifold3d
import numpy as np
import trimesh

from slicing import CylindricalBody, Mesh, SlicingParameters, slice_sub_volume
from slicing.curves.intersect import intersect_offsets
from slicing.mesh.solid import Floats, Ints, mesh_from_arrays
from slicing.surfaces.surfaces import Plane

from ..bench_arguments import parsed

ROOT = Path(__file__).resolve().parents[2]
UP = (0.0, 0.0, 1.0)
BODY_MM, BOSS_MM, STEP_MM = 60.0, 20.0, 1.6


@dataclass
class Row:
    """One line of a table: a way to slice, and its best time."""

    name: str
    run: Callable[[], int]  # -> layers that came out
    best: float = np.inf
    layers: int = 0

    def measure(self) -> None:
        start = time.perf_counter()
        self.layers = self.run()
        self.best = min(self.best, time.perf_counter() - start)


def sphere(subdivisions: int) -> tuple[Floats, Ints]:
    solid = trimesh.creation.icosphere(subdivisions=subdivisions, radius=50.0)
    return np.asarray(solid.vertices), np.asarray(solid.faces, dtype=np.int64)


def boss(edge_mm: float) -> tuple[Floats, Ints]:
    """A conical pin standing on a body of radius BODY_MM along x, its triangles' sides at most edge_mm long."""
    pin = manifold3d.Manifold.cylinder(140.0, 16.0, BOSS_MM, 256).rotate([0, 90, 0])
    pin -= manifold3d.Manifold.cylinder(200.0, BODY_MM, BODY_MM, 2048, True)
    fine = pin.refine_to_length(edge_mm).to_mesh()
    return np.array(fine.vert_properties)[:, :3].astype(np.float64), np.array(fine.tri_verts).astype(np.int64)


def trimesh_sections(
    solid: trimesh.Trimesh, origin: Floats, normal: Floats, heights: np.ndarray, *, areas: bool
) -> int:
    sections = solid.section_multiplane(origin, normal, heights)
    if areas:
        for section in sections:
            if section is not None:
                _ = section.discrete, section.area  # made when asked for
    return len(sections)


def peers(vertices: Floats, faces: Ints, origin: Floats, normal: Floats, heights: np.ndarray) -> list[Row]:
    def fresh(*, areas: bool) -> int:
        return trimesh_sections(trimesh.Trimesh(vertices, faces, process=False), origin, normal, heights, areas=areas)

    turn = trimesh.geometry.align_vectors(normal, UP)
    placed = ((vertices - origin) @ turn[:3, :3].T).astype(np.float32)

    def build() -> manifold3d.Manifold:
        built = manifold3d.Manifold(manifold3d.Mesh(placed, faces.astype(np.uint32)))
        built.num_tri()  # it is lazy
        return built

    made = build()

    def cut(solid: manifold3d.Manifold) -> int:
        found = [solid.slice(float(h)) for h in heights]
        return len([(section.to_polygons(), section.area()) for section in found])

    rows = [Row("trimesh section_multiplane, bare", lambda: fresh(areas=False))]
    missing = [name for name in ("networkx", "rtree") if find_spec(name) is None]
    if missing:
        print(f"{' and '.join(missing)} not installed: trimesh's loops and areas are left out", file=sys.stderr)
    else:
        rows.append(Row("trimesh section_multiplane, loops and areas", lambda: fresh(areas=True)))
    return [
        *rows,
        Row("manifold3d slice, loops and areas, built (C++, single precision)", lambda: cut(made)),
        Row("manifold3d slice, loops and areas, with building", lambda: cut(build())),
    ]


def prepared(vertices: Floats, faces: Ints) -> Mesh:
    """From arrays to a checked mesh with its edges."""
    mesh = mesh_from_arrays("bench", vertices, faces)
    _ = mesh.edges_and_sides
    return mesh


def untouched(mesh: Mesh) -> Mesh:
    """The same with its edges alone, as it comes from loading: what a run finds out is not left to the next."""
    copy = dataclasses.replace(mesh)
    copy.__dict__["edges_and_sides"] = mesh.edges_and_sides
    return copy


def take_turns(rows: list[Row], repeat: int) -> None:
    for _ in range(repeat):
        for row in rows:
            row.measure()


def planar_table(repeat: int, *, coarse: bool) -> str:
    vertices, faces = sphere(3 if coarse else 7)
    mesh, heights = prepared(vertices, faces), np.linspace(0.0, 100.0, 100)[1:-1]
    rows = [
        Row("rbam, prepared", lambda: layers_of(mesh, 98)),
        Row("rbam, with preparation", lambda: layers_of(prepared(vertices, faces), 98)),
        *peers(vertices, faces, np.array([0.0, 0.0, -50.0]), np.array(UP), heights),
    ]
    take_turns(rows, repeat)
    lines = [f"planar: a sphere of {len(faces):,} faces in {len(heights)} layers", ""]
    lines += ["| way | ms | trimesh bare / this |", "|---|--:|--:|"]
    bare = next(row.best for row in rows if row.name.startswith("trimesh"))
    return "\n".join(lines + [f"| {r.name} | {r.best * 1e3:.0f} | {bare / r.best:.1f} |" for r in rows])


def boss_table(repeat: int, *, coarse: bool) -> str:
    vertices, faces = boss(8.0 if coarse else 0.575)
    mesh, body = prepared(vertices, faces), CylindricalBody(BODY_MM)
    heights = BODY_MM + 0.5 + STEP_MM * np.arange(50)

    def ours(strategy: str) -> Row:
        parameters = SlicingParameters(strategy, STEP_MM, 0.8 * STEP_MM, 1.4 * STEP_MM)
        return Row(f"rbam, {strategy}", lambda: len(slice_sub_volume(untouched(mesh), body, parameters).layers))

    rows = [ours("planar"), ours("cylindrical"), ours("nonuniform")]
    rows += peers(vertices, faces, np.zeros(3), np.array([1.0, 0.0, 0.0]), heights)
    take_turns(rows, repeat)
    bare = next(row.best / row.layers for row in rows if row.name.startswith("trimesh"))
    lines = [f"a boss of {len(faces):,} faces, layer by layer; trimesh and manifold3d cut it by planes", ""]
    lines += ["| way | layers | ms a layer | trimesh bare / this |", "|---|--:|--:|--:|"]
    return "\n".join(
        lines
        + [
            f"| {r.name} | {r.layers} | {r.best / r.layers * 1e3:.2f} | {bare / (r.best / r.layers):.1f} |"
            for r in rows
        ]
    )


def memory_table() -> str:
    vertices, faces = boss(0.235)
    lines = [f"`rbam slice` on an STL file of {len(faces):,} faces, a process each", ""]
    lines += ["| strategy | s | peak MB |", "|---|--:|--:|"]
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "boss.stl"
        file.write_bytes(trimesh.exchange.stl.export_stl(trimesh.Trimesh(vertices, faces, process=False)))
        command = [sys.executable, "-m", "cell", "slice", str(file), "--body-radius", f"{BODY_MM:g}"]
        for strategy in ("planar", "cylindrical", "nonuniform"):
            start = time.perf_counter()
            process = subprocess.Popen(
                [*command, "--h-layer", f"{STEP_MM:g}", "--strategy", strategy],
                cwd=ROOT,
                stdout=subprocess.DEVNULL,
                env={**os.environ, "PYTHONPATH": str(ROOT)},
            )
            _, status, usage = os.wait4(process.pid, 0)
            if status:
                raise SystemExit(f"rbam slice --strategy {strategy} ended with {os.waitstatus_to_exitcode(status)}")
            lines.append(f"| {strategy} | {time.perf_counter() - start:.1f} | {usage.ru_maxrss / 1024:.0f} |")
    return "\n".join(lines)


def layers_of(mesh: Mesh, count: int) -> int:
    """Cut a sphere of `sphere` into so many planar layers."""
    base, heights = Plane((0.0, 0.0, -50.0), UP), np.linspace(0.0, 100.0, count + 2)[1:-1]
    return len(intersect_offsets(mesh, base, heights))


def growth_table(repeat: int, *, coarse: bool) -> str:
    counts = (5, 10) if coarse else (50, 100, 200, 400)
    rows: dict[tuple[int, int], Row] = {}
    for subdivisions in (2, 3) if coarse else (5, 6, 7, 8):
        mesh = prepared(*sphere(subdivisions))
        for count in counts:
            rows[len(mesh.faces), count] = Row("", partial(layers_of, mesh, count))
    take_turns(list(rows.values()), repeat)
    lines = ["growth: planar layers of spheres, prepared; ms (us a face; ms a layer)", ""]
    lines += ["| faces | " + " | ".join(f"{count} layers" for count in counts) + " |", "|--:" * (len(counts) + 1) + "|"]
    for size in sorted({size for size, _ in rows}):
        cells = [rows[size, count] for count in counts]
        text = [f"{r.best * 1e3:.0f} ({r.best / size * 1e6:.2f}; {r.best / r.layers * 1e3:.2f})" for r in cells]
        lines.append(f"| {size:,} | " + " | ".join(text) + " |")
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--repeat", type=int, default=5, help="rounds; the fastest counts (default 5)")
    parser.add_argument("--no-memory", action="store_true", help="leave out the part of a million faces")
    args = parsed(parser, repeat=1, no_memory=True)
    for part in (planar_table, boss_table, growth_table):
        print(part(args.repeat, coarse=args.smoke), end="\n\n", flush=True)
    if not args.no_memory:
        print(memory_table())


if __name__ == "__main__":
    main()
