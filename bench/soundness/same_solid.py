"""The same solid as another mesh: the same body, sub-volumes and layers.

    python -m bench.soundness.same_solid                       # 100 parts of tests/support, each otherwise in two ways
    python -m bench.soundness.same_solid --count 20 --seed 500 --varied

Ways: turned and moved, a file in inches, other diagonals, refined, faces shuffled, another file. Of one sub-volume the
layers of a strategy are compared: how many, areas, lengths, loops. What differs is printed with the seed; the exit code
is 1 then.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from collections import Counter
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from slicing import Mesh, PartError, SlicingParameters, load_mesh, slice_sub_volume
from slicing.decomposition.decompose import decompose
from slicing.layers.body_ends import body_ends
from slicing.mesh.load import solid_from_arrays
from tests.support.parts.cad_parts import FORMATS, CadPart, cad_part
from tests.support.parts.machined_parts import machined_part
from tests.support.parts.same_solid import retriangulated, shuffled, split
from tests.support.parts.varied_parts import varied_part

from ..bench_arguments import parsed

INCH = 25.4
WAYS = ("turned", "inches", "diagonals", "refined", "shuffled", "file")
ALIKE = "refused alike"
MOST_FACES = 4000  # in whose triangles changes are made
RADIUS, VOLUME, AREA, AREA_MM2 = 2e-5, 5e-4, 2e-3, 0.05  # shares that may differ, and an area


@dataclass(frozen=True, eq=False)
class Found:
    """What is compared: radius, volumes, and (n, 3) area, length and loops of layers, in mm; or the refusal."""

    radius: float
    volumes: np.ndarray
    layers: np.ndarray
    refused: str = ""


def otherwise(part: CadPart, way: str, rng: np.random.Generator) -> Mesh:
    """The mesh of a part otherwise."""
    vertices, faces = part.vertices, part.faces
    if way == "turned":
        turn = Rotation.random(random_state=int(rng.integers(2**31))).as_matrix()
        vertices = vertices @ turn.T + rng.uniform(-500, 500, 3)
    elif way == "diagonals":
        vertices, faces = retriangulated(vertices, faces, rng, 2)
    elif way == "refined":
        vertices, faces = split(vertices, faces, rng, 40)
    elif way == "shuffled":
        vertices, faces = shuffled(vertices, faces, rng)
    elif way == "file":
        with tempfile.TemporaryDirectory() as folder:
            return load_mesh(part.save(Path(folder), str(rng.choice(FORMATS))))
    elif way == "inches":
        with tempfile.TemporaryDirectory() as folder:
            small = replace(part, vertices=vertices / INCH)
            return load_mesh(small.save(Path(folder), str(rng.choice(("obj", "ply", "stl")))), "inch")
    return solid_from_arrays("part", vertices, faces)


def found(mesh: Mesh, strategy: str, rank: float, share: float) -> Found:
    """Body, sub-volumes, and the layers of one of them (by its rank in volume), a share of its height thick."""
    try:
        parts = decompose(mesh)
        order = np.argsort([one.volume for one in parts.sub_volumes])
        volumes = np.sort([one.volume for one in parts.sub_volumes])
        k = int(order[int(rank * len(order))])
        body = parts.bodies_for(strategy)[k]
        xy = parts.sub_volumes[k].vertices[:, :2] - parts.body.axis_xy_mm
        high = max(float(np.hypot(*xy.T).max()) - parts.bodies[k].radius_mm, 0.05 * parts.bodies[k].radius_mm)
        h = float(f"{high * share:.2g}")
        parameters = SlicingParameters(strategy, h, 0.8 * h, 1.3 * h, 0.01)
        sliced = slice_sub_volume(parts.sub_volumes[k], body, parameters, body_ends(parts.outline.points, body))
    except PartError as error:
        return Found(0.0, np.zeros(0), np.zeros((0, 3)), str(error))
    rows = [(one.area_mm2, sum(c.length_mm for c in one.curves), len(one.curves)) for one in sliced.layers]
    return Found(parts.body.radius_mm, volumes, np.array(rows))


def differs(one: Found, other: Found) -> str:
    """What differs; empty if nothing does."""
    if bool(one.refused) != bool(other.refused):
        return f"refused: {one.refused or other.refused}"
    if one.refused:
        return ""
    if abs(one.radius / other.radius - 1) > RADIUS:
        return f"radius {one.radius:.6g}, {other.radius:.6g}"
    if len(one.volumes) != len(other.volumes) or (np.abs(one.volumes / other.volumes - 1) > VOLUME).any():
        return f"volumes {np.round(one.volumes, 2).tolist()}, {np.round(other.volumes, 2).tolist()}"
    if len(one.layers) != len(other.layers):
        return f"{len(one.layers)} layers, {len(other.layers)}"
    slack = AREA_MM2 + AREA * np.abs(one.layers)
    off = np.abs(one.layers - other.layers) - np.where([True, True, False], slack, 0.0)
    if off.max() > 0:
        k = int(off.max(axis=1).argmax())
        return f"layer {k}: {np.round(one.layers[k], 3).tolist()}, {np.round(other.layers[k], 3).tolist()}"
    return ""


def one(part: CadPart, seed: int) -> dict[str, Any]:
    """What differs of a part in two ways, by way: "" where nothing does."""
    start, rng = time.process_time(), np.random.default_rng([seed, 17])
    ways = WAYS if len(part.faces) <= MOST_FACES else ("turned", "inches", "shuffled", "file")
    strategy = str(rng.choice(("cylindrical", "nonuniform", "planar", "revolved")))
    how = strategy, float(rng.random()), float(1 / rng.uniform(4, 12))
    first = found(solid_from_arrays("part", part.vertices, part.faces), *how)
    texts = {}
    for way in rng.choice(ways, 2, replace=False).tolist():
        try:
            texts[way] = differs(first, found(otherwise(part, way, rng), *how))
        except PartError as error:
            texts[way] = f"not read: {error}"
        if first.refused and not texts[way]:
            texts[way] = ALIKE
    seconds = round(time.process_time() - start, 3)
    return {"seed": seed, "ways": texts, "words": f"{part.words}; {strategy}", "process_s": seconds}


def main() -> int:
    """Run the comparison."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--varied", action="store_true", help="parts of tests/support/parts/varied_parts.py")
    parser.add_argument("--machined", action="store_true", help="parts of tests/support/parts/machined_parts.py")
    parser.add_argument("--log", type=Path, help="takes a line a part; seeds that it holds are not run again")
    args = parsed(parser, count=2)
    rows = (
        [json.loads(line) for line in args.log.read_text("utf-8").splitlines()]
        if args.log and args.log.is_file()
        else []
    )
    known = {row["seed"] for row in rows}
    make = machined_part if args.machined else varied_part if args.varied else cad_part
    for seed in range(args.seed, args.seed + args.count):
        if seed in known:
            continue
        rows.append(one(make(seed), seed))
        if args.log:
            with args.log.open("a", encoding="utf-8") as file:
                file.write(json.dumps(rows[-1]) + "\n")
        for way, text in rows[-1]["ways"].items():
            if text not in ("", ALIKE):
                print(f"{seed}, {way}: {text} [{rows[-1]['words']}]", flush=True)
    kinds = {"": "the same", ALIKE: ALIKE}
    tally = Counter(f"{way}: {kinds.get(text, 'differs')}" for row in rows for way, text in row["ways"].items())
    for key, count in sorted(tally.items()):
        print(f"{count:5d}  {key}")
    return int(any("differs" in key for key in tally))


if __name__ == "__main__":
    raise SystemExit(main())
