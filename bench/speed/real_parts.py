"""Parts as they are built, of any number of targets, with twins that cannot be built: what the benches measure on.

    job = job_of("pad", 1000)                                              # zigzag, free roll, feasible
    job = job_of("flange", 10_000, fill="contour", roll="held", feasible=False)
    job = job_of("blade", 1000, twin="layer")                              # one layer asks for what no arm can do

Parts: a ``pad`` on a drum (300 mm square from 5,000 targets on), a ``flange`` right round an upright shaft, a twisted
``blade`` of an impeller, the ``branch`` of a valve. A part of more targets has more layers and is wider; its sampling
stays the same, but for borders alone (contour), which are sampled more finely where only that gives so many. Parts of
1,000 targets are known to be feasible, and so is the flange of 50,000 with a free roll: the table stands lower there.
The pad's contour of 50,000 is too tall for the arm.

Twins: ``share`` has a box over some of the part (what is lost depends on the part: its verdict says how much),
``layer`` has its middle layer deposited from below (it fails, and no other), ``all`` has a box over all of it (every
target can be reached, none is free), ``far`` stands out of reach. ``split`` has a wall hanging over the middle, along
the arm's way to it: with a free roll, targets can be welded from one side of it or from the other, but beads that lead
below it cannot. A held roll loses targets there.
"""

from __future__ import annotations

import atexit
import shutil
import sys
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import manifold3d
import numpy as np
import trimesh
import yaml

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "models" / "parts"))
from propeller import Propeller  # noqa: E402
from propeller import blade as propeller_blade  # noqa: E402
from solids import mesh_of, tube  # noqa: E402

from cell import Job, load_case, prepare, with_changes  # noqa: E402
from cell.scene.compose import compose  # noqa: E402
from cell.scene.scene import table_angles  # noqa: E402

PARTS = ("pad", "flange", "blade", "branch")
FILLS, ROLLS = ("zigzag", "contour"), ("free", "held")
TWINS = ("share", "layer", "all", "far", "split")
ABOVE_MM = 25.0  # from the part to the box over it: more than the wire, less than the nozzle
OVER_SHARE = 0.15  # of the targets right below the box of the twin `share`
FAR_MM = 3500.0
WALL_MM = 200.0  # from the part to the wall of the twin `split`: more than the torch's neck needs, less than the arm
WALL = (1000.0, 10.0, 800.0)  # its size, mm


@dataclass(frozen=True)
class Size:
    """How large a part is.

    Attributes:
        wide: across, mm; what it measures depends on the part.
        layers: how many.
        chord_mm: sampling.chord_tolerance_mm.
        segment_mm: sampling.min_segment_mm.
        lower_mm: how much lower than usual the table stands, so that the arm reaches over all of a tall part.
    """

    wide: float
    layers: int
    chord_mm: float = 0.1
    segment_mm: float = 3.0
    lower_mm: float = 0.0


# by part and fill: targets up to which it counts, size but for the layers, and targets of a layer, about
SIZES: dict[tuple[str, str], tuple[tuple[int, Size, float], ...]] = {
    ("pad", "zigzag"): ((5000, Size(150, 0), 350), (10**9, Size(300, 0), 1290)),
    ("pad", "contour"): ((5000, Size(150, 0, 0.005), 89), (10**9, Size(300, 0, 0.003, 2.0), 240)),
    ("flange", "zigzag"): (
        (5000, Size(12, 0), 179),
        (25_000, Size(60, 0), 640),
        (10**9, Size(90, 0, lower_mm=150), 1000),
    ),
    ("flange", "contour"): (
        (5000, Size(12, 0), 111),
        (25_000, Size(12, 0, 0.003, 1.0), 600),
        (10**9, Size(12, 0, 0.003, 1.0, lower_mm=150), 600),
    ),
    ("blade", "zigzag"): (
        (5000, Size(80, 0, 0.05), 34),
        (25_000, Size(160, 0, 0.05), 139),
        (10**9, Size(300, 0, 0.03), 500),
    ),
    ("blade", "contour"): ((5000, Size(80, 0, 0.05), 33), (10**9, Size(160, 0, 0.003, 1.0), 200)),
    ("branch", "zigzag"): (
        (5000, Size(34, 0, 0.3), 200),
        (25_000, Size(50, 0, 0.1), 332),
        (10**9, Size(80, 0, 0.1), 600),
    ),
    ("branch", "contour"): ((5000, Size(34, 0, 0.05), 150), (10**9, Size(50, 0, 0.005, 1.0), 616)),
}
HELD_DEG = {"pad": 0.0, "flange": 0.0, "blade": -60.0, "branch": -60.0}
LAYER_MM = {"pad": 2.0, "flange": 2.0, "blade": 1.5, "branch": 1.5}


def job_of(
    part: str,
    targets: int,
    fill: str = "zigzag",
    roll: str = "free",
    feasible: bool = True,
    twin: str = "share",
) -> Job:
    """A part in its cell.

    Args:
        part: one of PARTS.
        targets: how many, about.
        fill: one of FILLS.
        roll: one of ROLLS.
        feasible: whether it can be built.
        twin: one of TWINS, why it cannot, where it is not to be feasible.

    Returns:
        What ``cell.check`` takes.
    """
    # what would help prepares changed cases again: the files stay as long as the process
    folder = tempfile.mkdtemp(prefix="rbam-parts-")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return job_in(Path(folder), part, targets, fill, roll, None if feasible else twin)


def job_in(folder: Path, part: str, targets: int, fill: str, roll: str, twin: str | None) -> Job:
    """The same with its files kept in a folder: ``NAME.stl`` and ``NAME.case.yaml``, of the feasible part."""
    for given, known in ((part, PARTS), (fill, FILLS), (roll, ROLLS), (twin or "share", TWINS)):
        if given not in known:
            raise ValueError(f"{given!r}: there are {', '.join(known)}")
    job = prepare(load_case(write_case(folder, part, size_of(part, targets, fill), fill, roll)))
    return job if twin is None else twin_of(job, twin)


def size_of(part: str, targets: int, fill: str) -> Size:
    """The size that gives about so many targets."""
    _, size, a_layer = next(row for row in SIZES[part, fill] if targets < row[0])
    return replace(size, layers=max(round(targets / a_layer), 1))


def write_case(folder: Path, part: str, size: Size, fill: str, roll: str) -> Path:
    """Write a part's mesh and case; the case's path."""
    mesh, own = BUILDERS[part](size)
    mesh.export(folder / f"{part}.stl")
    h = LAYER_MM[part]
    content: dict[str, Any] = {
        "slicing": {"strategy": "cylindrical", "h_layer_mm": h, "h_min_mm": 0.6 * h, "h_max_mm": 1.4 * h},
        "beads": {"pattern": fill, "width_mm": 5, "thin_walls": "border"},
        "sampling": {"chord_tolerance_mm": size.chord_mm, "min_segment_mm": size.segment_mm},
        "positioner": {"position_mm": [1550, 0, 0], "rotation_deg": [0, 0, -90]},
        "table": {"E1_deg": 90, "E2_deg": 180},
        "roll": "free" if roll == "free" else {"fixed_deg": HELD_DEG[part]},
    }
    content |= own
    content["part"] = {"sub_volumes": [f"{part}.stl"], **own["part"]}
    path = folder / f"{part}.case.yaml"
    path.write_text(yaml.safe_dump(content), encoding="utf-8")
    return path


def pad(size: Size) -> tuple[trimesh.Trimesh, dict[str, Any]]:
    """A square pad on a drum of 500 mm, which points along -x of the table."""
    radius, half = 250.0, size.wide / 2 / 250.0
    angle = np.pi + np.linspace(-half, half, 121)
    around = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    outline = np.concatenate([(radius + size.layers * LAYER_MM["pad"]) * around, radius * around[::-1]])
    mesh = mesh_of(manifold3d.CrossSection([outline]).extrude(size.wide))
    return mesh, {
        "part": {"body": {"radius_mm": radius, "z_mm": [-20, size.wide + 20]}, "position_mm": [0, 0, 20]},
        "support": {"radius_mm": 100, "height_mm": 120},
    }


def flange(size: Size) -> tuple[trimesh.Trimesh, dict[str, Any]]:
    """A flange right round an upright shaft of 80 mm; the table stands level."""
    radius = 40.0
    mesh = trimesh.creation.annulus(radius, radius + size.layers * LAYER_MM["flange"], size.wide, sections=360)
    mesh.apply_translation([0, 0, 40 + size.wide / 2])
    return mesh, {
        "part": {"body": {"radius_mm": radius, "z_mm": [0, 80 + size.wide]}},
        "support": {"radius_mm": 30, "height_mm": 300},
        "positioner": {"position_mm": [1150, 0, -size.lower_mm], "rotation_deg": [0, 0, -90]},
        "table": {"E1_deg": 0, "E2_deg": 0},
    }


def blade(size: Size) -> tuple[trimesh.Trimesh, dict[str, Any]]:
    """A twisted blade on a hub, which points along -x of the table."""
    hub, thick = size.wide / 2, 0.15 * size.wide
    p = Propeller(
        hub_radius=hub,
        tip_radius=hub + size.layers * LAYER_MM["blade"],
        height=1.5 * size.wide,
        azimuth=180.0,
        pitch=3.75 * size.wide,
        root_chord=size.wide,
        tip_chord=0.9 * size.wide,
        footprint=np.pi / 4 * size.wide * thick,
        tip_thickness=0.7 * thick,
        crown=0.5,
    )
    return propeller_blade(p, around=96, outward=48), {
        "part": {"body": {"radius_mm": hub, "z_mm": [0, p.height]}},
        "slicing": _graded("blade"),
        "support": {"radius_mm": 30, "height_mm": 120},
    }


def branch(size: Size) -> tuple[trimesh.Trimesh, dict[str, Any]]:
    """A thick-walled branch on a valve's body, which points along -x of the table."""
    radius = max(74.0, 1.4 * size.wide)
    mesh = tube(radius, size.wide, size.wide - 14, radius + size.layers * LAYER_MM["branch"], 240)
    mesh.apply_transform(trimesh.transformations.rotation_matrix(np.pi, [0, 0, 1]))
    mesh.apply_translation([0, 0, 100])
    return mesh, {
        "part": {"body": {"radius_mm": radius, "z_mm": [0, 200]}},
        "slicing": _graded("branch"),
        "support": {"radius_mm": 60, "height_mm": 120},
    }


def _graded(part: str) -> dict[str, Any]:
    h = LAYER_MM[part]
    return {"strategy": "nonuniform", "h_layer_mm": h, "h_min_mm": 0.6 * h, "h_max_mm": 1.4 * h}


def twin_of(job: Job, twin: str) -> Job:
    """The same part, which cannot be built; see the module."""
    if twin == "layer":
        t = job.targets
        wrong = t.layer == int(t.layer.max()) // 2
        return replace(job, targets=replace(t, normal=np.where(wrong[:, None], -t.normal, t.normal)))
    if twin == "far":
        place = job.case.positioner.model_copy(update={"position_mm": (FAR_MM, 0.0, 0.0)})
        return _recomposed(job, positioner=place)
    if twin == "split":
        return _walled(job, WALL_MM)
    points = _world_mm(job)
    low, high = points.min(axis=0), points.max(axis=0)
    if twin == "share":
        low[0] = np.quantile(points[:, 0], 1.0 - OVER_SHARE)
        high[0] += 100.0
        low[1], high[1] = low[1] - 100.0, high[1] + 100.0
    else:
        low[:2], high[:2] = low[:2] - 150.0, high[:2] + 150.0
    box = {"size_mm": [high[0] - low[0], high[1] - low[1], 10.0]}
    position = [*(0.5 * (low + high)[:2]).tolist(), float(high[2]) + ABOVE_MM + 5.0]
    kind = type(job.case).model_fields["fixtures"]
    return _recomposed(job, fixtures=_fixtures(kind, {"name": "in_the_way", "box": box, "position_mm": position}))


def _walled(job: Job, above_mm: float) -> Job:
    """The job with a wall hanging over the middle of the part, along the arm's way to it."""
    points = _world_mm(job)
    middle, top = (points.min(axis=0) + points.max(axis=0)) / 2, float(points[:, 2].max())
    position = [*middle[:2].tolist(), top + above_mm + WALL[2] / 2]
    kind = type(job.case).model_fields["fixtures"]
    return _recomposed(
        job, fixtures=_fixtures(kind, {"name": "wall", "box": {"size_mm": WALL}, "position_mm": position})
    )


def _world_mm(job: Job) -> np.ndarray:
    """The targets in the world at the case's table pose, (n, 3), mm."""
    scene, table = job.scene, job.case.table
    T = scene.T_world_base() @ scene.T_base_part(*table_angles(scene, table.E1_deg, table.E2_deg))
    return job.targets.position @ T[:3, :3].T + 1e3 * T[:3, 3]


def _fixtures(field: Any, given: dict[str, Any]) -> Any:
    from pydantic import TypeAdapter

    return TypeAdapter(field.annotation).validate_python([given])


def _recomposed(job: Job, **changes: Any) -> Job:
    """The job with something of its case changed that only the cell depends on."""
    case = with_changes(job.case, **changes)
    return replace(job, case=case, scene=compose(case, job.shape))


BUILDERS = {"pad": pad, "flange": flange, "blade": blade, "branch": branch}
