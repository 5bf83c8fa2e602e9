"""Every command on every shipped case, with every document it writes: a verdict for exit code, and whole files."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
import trimesh
from support.paths import ROOT

from cell.case.read import load_case
from cell.cli import main as cli
from cell.cli.main import main
from cell.verdict.check import check_fixed

CASES = sorted((ROOT / "models" / "cases").glob("*.case.yaml"))
SCHEMAS = {
    "check": "rbam-report/1",
    "motion": "rbam-motion-report/1",
    "slice": "rbam-slices/1",
    "compare": "rbam-compare/1",
    "sweep": "rbam-sweep/1",
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    found = tmp_path_factory.mktemp("every")
    box = trimesh.creation.box((8.0, 8.0, 8.0))
    box.apply_translation((23.5, 0.0, 20.0))
    box.export(found / "block.stl")
    return found


def small(case: Path, folder: Path) -> Path:
    """A shipped case with a small part in place of its own, and little to search."""
    lines = [
        f"extends: {case}",
        "part: {sub_volumes: [block.stl], body: {radius_mm: 20}, take: [], rotation_deg: 180}",
        "slicing: {h_layer_mm: 4, h_min_mm: 2, h_max_mm: 6}",
        "sampling: {chord_tolerance_mm: 1, min_segment_mm: 20}",
    ]
    if load_case(case).part.mesh is not None:
        lines[1] = "part: {mesh: null, " + lines[1].removeprefix("part: {")
    path = folder / case.name
    path.write_text("\n".join(lines) + "\n")
    return path


def document(path: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(path.read_text(), parse_constant=lambda name: pytest.fail(f"{name} in {path}"))
    return found


@pytest.mark.slow
@pytest.mark.parametrize("shipped", CASES, ids=lambda path: path.name.split(".")[0])
def test_every_document_of_every_command(
    shipped: Path, folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    case, out = str(small(shipped, folder)), folder / shipped.stem
    out.mkdir()
    known: dict[Any, Any] = {}

    def once(job: Any, e1: float, e2: float, progress: Any = None) -> Any:
        key = job.case.model_dump_json(), e1, e2
        if key not in known:
            known[key] = check_fixed(job, e1, e2, progress)
        return known[key]

    monkeypatch.setattr("cell.verdict.by_table_mode.check_fixed", once)
    monkeypatch.setattr("cell.pose_sweep.sweep.check_fixed", once)

    def run(command: str, *argv: str, json_: str | None = None) -> int:
        name = out / f"{json_ or command}.json"
        args = [command, *argv, *(["--json", str(name)] if (json_ or command) in SCHEMAS else [])]
        code = main(args)
        said = capsys.readouterr()
        assert code in (0, 1), said.err
        assert "Traceback" not in said.err
        if name.exists():
            assert document(name)["schema"] == SCHEMAS[json_ or command]
        return code

    motion = str(out / "m.csv")
    code = run("check", case, "--no-remedies", "--all-reasons", "--html", str(out / "c.html"), "--motion", motion)
    report = document(out / "check.json")
    assert code == (0 if report["verdict"] == "feasible" else 1)
    if code == 0:
        assert run("check", case, "--motion-in", motion, json_="motion") == 0
    files = ["--targets", str(out / "t.csv"), "--picture", str(out / "s.png")]
    assert run("slice", case, *files) == 0
    assert run("scene", case, "--xml", str(out / "cell.xml")) == 0
    assert all(path.stat().st_size > 100 for path in out.iterdir())
    if shipped != CASES[0]:
        return  # what follows says nothing of the cell, or what the check said already
    assert run("compare", case, "--html", str(out / "k.html")) == 0
    table = ["--e1", "90", "--e2", "180"]
    files = ["--out", "l.jsonl", "--csv", "p.csv", "--picture", "p.png", "--html", "p.html"]
    files = [name if name.startswith("-") else str(out / name) for name in files]
    run("sweep", case, *table, "--jobs", "1", *files)
    assert all(path.stat().st_size > 100 for path in out.iterdir())
    program = [str(out / "krl"), "--csv", str(out / "points.csv"), "--robodk", str(out / "station.py")]
    assert run("export", case, "--krl", *program) == 0
    assert set(cli.COMMANDS) == {"check", "slice", "compare", "sweep", "scene", "replay", "export"}
