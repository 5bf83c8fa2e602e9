"""The sweep: same verdicts as single checks, independent of workers, resumable."""

import io
import json

import pytest

from cell.check import check
from cell.config import load_case
from cell.errors import InputError
from cell.job import prepare
from cell.sweep import parse_grid, sweep, sweep_document

POSES = [(90.0, 180.0), (0.0, 0.0), (-120.0, 45.0)]


def test_every_pose_has_the_verdict_of_a_single_check(make_case):
    case = load_case(make_case())
    job = prepare(case)
    for pose, row in zip(POSES, sweep(case, POSES, workers=1), strict=True):
        result = check(job, *pose)
        assert (row["verdict"] == "feasible") == result.feasible
        if row["searched"]:
            assert row["infeasible"] == result.infeasible
            assert row["reasons"] == result.reasons
        else:
            assert 0 < row["infeasible"] <= result.infeasible


@pytest.mark.slow
def test_the_number_of_workers_changes_nothing(make_case):
    case = load_case(make_case())
    assert sweep(case, POSES, workers=1) == sweep(case, POSES, workers=2)


def test_an_interrupted_sweep_goes_on_where_it_stopped(make_case, tmp_path, monkeypatch):
    case = load_case(make_case())
    log = tmp_path / "sweep.jsonl"
    whole = sweep(case, POSES, workers=1, log=str(log))
    lines = log.read_text().splitlines()
    log.write_text("\n".join(lines[:2]) + "\n" + lines[2][:20])  # cut off while writing
    seen = []
    import cell.sweep as module

    real = module.pose_outcome
    monkeypatch.setattr(module, "pose_outcome", lambda job, pose: seen.append(pose) or real(job, pose))
    assert sweep(case, POSES, workers=1, log=str(log)) == whole
    assert len(seen) == len(POSES) - 1
    assert len(log.read_text().splitlines()) == 1 + len(POSES)


def test_a_log_of_another_case_is_refused(make_case, tmp_path):
    log = tmp_path / "sweep.jsonl"
    sweep(load_case(make_case()), POSES[:1], workers=1, log=str(log))
    other = load_case(make_case("other", checks={"clearance_mm": 7}))
    with pytest.raises(InputError, match="another case"):
        sweep(other, POSES[:1], workers=1, log=str(log))
    log.write_text("something else")
    with pytest.raises(InputError, match="not the log of a sweep"):
        sweep(other, POSES[:1], workers=1, log=str(log))


def test_nothing_is_printed_in_a_pipe(make_case):
    out = io.StringIO()
    sweep(load_case(make_case()), POSES[:1], workers=1, progress=out)
    assert out.getvalue() == ""


def test_the_best_pose_is_feasible_and_closest_to_upright(make_case):
    case = load_case(make_case())
    rows = [
        {"E1_deg": 0, "E2_deg": 0, "verdict": "feasible", "gravity_max_deg": 50, "least_clearance_mm": 9},
        {"E1_deg": 1, "E2_deg": 0, "verdict": "feasible", "gravity_max_deg": 20, "least_clearance_mm": 6},
        {"E1_deg": 2, "E2_deg": 0, "verdict": "feasible", "gravity_max_deg": 20, "least_clearance_mm": 8},
        {"E1_deg": 3, "E2_deg": 0, "verdict": "infeasible", "infeasible": 3},
    ]
    document = sweep_document(case, rows)
    assert document["best"]["E1_deg"] == 2
    assert sweep_document(case, rows[3:])["best"] is None
    json.dumps(document)


def test_grids(make_case):
    case = load_case(make_case())
    assert parse_grid(case, "-10:10:10", "5") == [(-10.0, 5.0), (0.0, 5.0), (10.0, 5.0)]
    default = parse_grid(case, None, None)
    assert (90.0, -180.0) in default
    assert (135.0, 135.0) in default
    assert len(default) == 7 * 8
    for bad in ("1:0:1", "0:1:0", "a", "0:1", "nan:1:1"):
        with pytest.raises(InputError):
            parse_grid(case, bad, "0")
