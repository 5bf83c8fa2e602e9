"""Random cases that a motion may be found for, and that motion held against its own case.

path = random_job(rng, folder);  held = own_motion(path)     # None: infeasible;  else what is not as it should be
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import trimesh
import yaml
from scipy.spatial.transform import Rotation

from cell.case.read import load_case
from cell.collision.proofs.between_samples import NEAREST_SHARE
from cell.errors import InputError
from cell.job.job import prepare
from cell.motion.motion_file import read_motion, write_motion
from cell.verdict.by_table_mode import check
from cell.verdict.result import Result
from cell.verification.motion_check import check_motion

from ..cells.odd_models import odd_models
from ..cells.odder_models import odder_fixtures, odder_models

SAME = 1e-4  # m: least clearances of one way, sampled otherwise
PATTERNS = ("contour_parallel", "zigzag", "raster", "contour")


def random_job(rng, folder: Path) -> Path:
    """A boss or two on a cylinder, laid and placed at random."""
    radius = float(rng.uniform(9, 50))
    size = rng.uniform((4, 6, 8), (10, 20, 24))
    box = trimesh.creation.box((size[0] + 4.0, size[1], size[2]))
    box.apply_translation([-(radius - 4.0 + (size[0] + 4.0) / 2), 0.0, 30.0])
    box.export(folder / "boss.stl")
    beads = {"pattern": str(rng.choice(PATTERNS[:2])), "width_mm": float(rng.uniform(3.5, 6))}
    if rng.random() < 0.5:
        beads |= {"lead_in_mm": float(rng.uniform(0, 3)), "lead_out_mm": float(rng.uniform(0, 3))}
    content = {
        "part": {
            "sub_volumes": ["boss.stl"],
            "body": {"radius_mm": radius, "z_mm": [0, 60]},
            "rotation_deg": float(rng.choice([0, 30, -120])),
        },
        "slicing": {"strategy": str(rng.choice(["cylindrical", "nonuniform", "planar"]))},
        "support": {"radius_mm": float(rng.uniform(8, 30)), "height_mm": float(rng.uniform(80, 200))},
        "positioner": {
            "position_mm": rng.uniform((1350, -300, 0), (1800, 300, 300)).tolist(),
            "rotation_deg": [0, 0, float(rng.uniform(-130, -50))],
        },
        "table": {"E1_deg": float(rng.uniform(40, 100)), "E2_deg": float(rng.uniform(-180, 130))},
        "beads": beads,
        "process": {
            "deposition_speed_mm_s": float(rng.uniform(5, 15)),
            "retract_mm": float(rng.uniform(10, 40)),
            "least_speed_share": 0.0,
            "dwell_s": float(rng.choice([0, 2])),
            "blend_mm": float(rng.choice([0.5, 1, 2])),
        },
        "checks": {"clearance_mm": float(rng.choice([0, 2, 5, 8]))},
    }
    if rng.random() < 0.4:
        low = float(rng.uniform(-180, 60))
        content["roll"] = {"range_deg": [low, low + float(rng.uniform(60, 180))]}
    if rng.random() < 0.6:
        place = rng.uniform((-150, -150, 0), (150, 150, 80)).tolist()
        shape = {"cylinder": {"radius_mm": 15.0, "height_mm": 60.0}}
        if rng.random() < 0.5:
            shape = {"box": {"size_mm": [30.0, 50.0, 80.0]}}
        content["fixtures"] = [{"name": "clamp", "on": "table", "position_mm": place, **shape}]
    path = folder / "job.case.yaml"
    path.write_text(yaml.safe_dump(content), encoding="utf-8")
    return path


def odd_job(rng, folder: Path, *, odder: bool = False) -> Path:
    """The same in a cell of models as other people write them, of which the table may index or move along."""
    path = random_job(rng, folder)
    content = yaml.safe_load(path.read_text(encoding="utf-8"))
    for key, told in (odder_models if odder else odd_models)(rng, folder).items():
        content[key] = {**content.get(key, {}), **told}
    if odder:
        content["fixtures"] = [*content.get("fixtures", []), *odder_fixtures(rng)]
    if content["positioner"]["joints"] == ["E2"]:
        content["table"].pop("E1_deg")
    mode = rng.choice(["fixed", "fixed", "indexed", "coordinated"])
    if mode != "fixed":
        content["table"] = {"mode": str(mode)}
    if mode == "coordinated":
        content["table"]["upright_deg"] = float(rng.choice([10, 30, 90]))
    if rng.random() < 0.4:  # a sheet, thin and wide
        place = rng.uniform((600, -900, 300), (1400, 900, 1500)).tolist()
        turn = rng.uniform(-180, 180, 3).tolist()
        sheet = {"name": "sheet", "position_mm": place, "rotation_deg": turn, "box": {"size_mm": [600.0, 400.0, 1.0]}}
        content["fixtures"] = [*content.get("fixtures", []), sheet]
    if rng.random() < 0.3:
        ball = trimesh.creation.icosphere(3, 1.0)
        ball.apply_scale(rng.uniform(20, 250, 3))
        ball.export(folder / "ball.stl")
        place = rng.uniform((300, -900, 0), (1600, 900, 1600)).tolist()
        content["fixtures"] = [*content.get("fixtures", []), {"name": "ball", "mesh": "ball.stl", "position_mm": place}]
    if rng.random() < 0.5:
        far = 100.0 if odder and rng.random() < 0.3 else 1.0
        _elsewhere(content, far * rng.uniform((-500, -500, 0), (500, 500, 100)), float(rng.uniform(-180, 180)))
    if rng.random() < 0.5:  # another boss beside it, laid before or after it, or there from the start
        own = trimesh.load(folder / "boss.stl")
        turn = np.deg2rad(rng.choice([-1, 1]) * rng.uniform(35, 180))
        own.apply_transform(trimesh.transformations.rotation_matrix(turn, (0, 0, 1)))
        own.apply_translation((0, 0, rng.uniform(-5, 5)))
        own.export(folder / "other.stl")
        part = content["part"]
        part["sub_volumes"] = ["boss.stl", "other.stl"]
        what = rng.integers(3)
        if what == 1:
            part["take"] = ["SV2", "SV1"]
        elif what == 2:
            part |= {"take": ["SV1"], "built": ["SV2"]}
    path.write_text(yaml.safe_dump(content), encoding="utf-8")
    return path


def _elsewhere(content, shift, turn_deg: float) -> None:
    """Move and turn a whole cell about the world's z axis."""
    turn = Rotation.from_euler("z", turn_deg, degrees=True)
    content["robot"] = content.get("robot", {})
    floor = [f for f in content.get("fixtures", []) if f.get("on") != "table"]
    for one in (content["robot"], content["positioner"], *floor):
        here = Rotation.from_euler("xyz", one.get("rotation_deg", (0, 0, 0)), degrees=True)
        one["position_mm"] = (turn.apply(one.get("position_mm", (0, 0, 0))) + shift).tolist()
        one["rotation_deg"] = (turn * here).as_euler("xyz", degrees=True).tolist()


def own_motion(path: Path, suffix: str = "csv") -> list[str] | None:
    """What the check of a motion from outside says against the very motion that a check wrote; None: there is none."""
    result, wrong = own_result(path, suffix)
    return None if result.motion is None else wrong


def own_result(path: Path, suffix: str = "csv") -> tuple[Result, list[str]]:
    """A case's verdict, and what the check of motions says against its own motion."""
    job = prepare(load_case(path))
    result = check(job)
    if result.motion is None:
        return result, []
    job = result.job
    file = path.with_name(f"m.{suffix}")
    write_motion(file, result.motion)
    wrong = [] if (np.diff(result.motion.t_s) > 0).all() else ["its times do not rise"]
    try:
        again = check_motion(job, read_motion(file, job))
    except InputError as error:
        return result, [*wrong, str(error)]
    wrong += [f"{f.reason} {f.detail}" for f in again.findings]
    least = np.inf if result.clearance is None else result.clearance.value
    held = np.inf if again.clearance is None else again.clearance[0]
    if not (least == held or abs(least - held) <= max(SAME, NEAREST_SHARE * min(least, held))):
        wrong.append(f"least clearance {least * 1e3:.3f} mm, held against itself {held * 1e3:.3f} mm")
    if min(least, held) < job.case.checks.clearance_mm * 1e-3:
        wrong.append(f"least clearance {min(least, held) * 1e3:.3f} mm of {job.case.checks.clearance_mm:g}")
    return result, wrong
