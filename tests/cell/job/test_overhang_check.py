"""Which targets overhang, whether the case sets a limit or not."""

import numpy as np
import pytest
import trimesh
import yaml

from cell.case.read import load_case
from cell.job.job import prepare
from cell.job.overhang_check import targets_over_nothing, unsupported_targets
from cell.motion.motion_file import ReadMotion
from cell.verdict.check import check_fixed
from cell.verification.motion_check import check_motion


def box(low, high):
    made = trimesh.creation.box(np.subtract(high, low))
    made.apply_translation(np.add(low, high) / 2)
    return made


def lip_job(folder, limit, name="lip"):
    """An arm out of a cylinder of radius 20, whose end comes back along it: the lip from x = 30 on hangs."""
    arm = [box((15, -6, 10), (50, 6, 22)), box((44, -6, 20), (50, 6, 40)), box((30, -6, 34), (48, 6, 40))]
    trimesh.boolean.union(arm, engine="manifold").export(folder / "lip.stl")
    case = {
        "part": {"sub_volumes": ["lip.stl"], "body": {"radius_mm": 20, "z_mm": [0, 80]}},
        "slicing": {"strategy": "planar", "h_layer_mm": 2, "h_min_mm": 1, "h_max_mm": 3},
        "support": {"radius_mm": 20, "height_mm": 150},
        "table": {"E1_deg": 0, "E2_deg": 90},
        "checks": {} if limit is None else {"overhang_mm": limit},
    }
    (folder / f"{name}.case.yaml").write_text(yaml.safe_dump(case), encoding="utf-8")
    return prepare(load_case(folder / f"{name}.case.yaml"))


@pytest.mark.parametrize("limit", [None, 1.0])
def test_targets_of_a_lip_that_begins_in_the_air(tmp_path, limit):
    job = lip_job(tmp_path, limit)
    over = targets_over_nothing(job)
    place, layer = job.targets.position[sorted(over)], job.targets.layer[sorted(over)]
    begins = (place[:, 2] > 33.0) & (place[:, 0] < 33.0)
    assert begins.any()
    assert len(set(layer[begins].tolist())) == 1  # the layers above it lie on it
    # the rest is the bridge from the arm to the lip
    assert (place[~begins][:, 0] > 43.0).all()
    assert set(unsupported_targets(job)) == (set() if limit is None else set(over))


@pytest.mark.slow
def test_a_motion_that_welds_what_hangs_is_refused_where_the_case_limits_it(tmp_path):
    free, limited = lip_job(tmp_path, None), lip_job(tmp_path, 1.0, "limited")
    motion = check_fixed(free, 0.0, 90.0).motion
    assert motion is not None
    read = ReadMotion(motion, np.arange(len(motion.t_s)) + 1, ())
    assert check_motion(free, read).feasible
    found = check_motion(limited, read).findings
    assert {f.reason for f in found} == {"overhang"}
    hanging = set(unsupported_targets(limited))
    welds = {int(t) for f in found for t in motion.target[f.row - 1 : f.to_row][motion.arc[f.row - 1 : f.to_row] == 1]}
    assert welds == hanging
