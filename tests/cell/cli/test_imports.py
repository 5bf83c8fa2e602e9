"""What a command imports: what is heavy and not needed for it stays out."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from support.paths import ROOT

from cell.cli.main import DRAWS

TOLD = """
import json, sys
from cell.cli.main import main
try:
    code = main({argv!r})
except SystemExit as ended:
    code = ended.code
sys.stderr.write("\\n" + json.dumps([code, sorted(sys.modules)]))
"""
ARRAYS = {"numpy", "mujoco", "pydantic", "yaml", "shapely", "manifold3d", "slicing.strategies", "cell.job"}
HEAVY = {"scipy", "trimesh", "networkx", "PIL", "lxml", "rich"}
# of rooms, what only some cases or options need
ROOMS = {
    "cell.coordination",
    "cell.html",
    "cell.pose_sweep",
    "cell.programs",
    "cell.remedy_search",
    "cell.verdict.all_reasons",
    "cell.verdict.best_pose",
    "cell.verdict.coordinated",
    "cell.verdict.indexed",
    "cell.view",
    "slicing.decomposition",
    "slicing.mesh.files.three_mf",
}


def imported(*argv: str) -> tuple[int, set[str]]:
    """The exit code of a command in a process of its own, and the modules it ends with."""
    command = [sys.executable, "-c", TOLD.format(argv=list(argv))]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    code, modules = json.loads(done.stderr.splitlines()[-1])
    return code, set(modules)


@pytest.mark.parametrize("argv", [["--help"], ["check", "--help"], ["--version"], ["check", "--frobnicate"]])
def test_help_and_usage_need_no_arrays(argv: list[str]) -> None:
    code, modules = imported(*argv)
    assert code == (2 if "--frobnicate" in argv else 0)
    assert not modules & (ARRAYS | HEAVY)
    assert ("importlib.metadata" in modules) == ("--version" in argv)


def test_a_case_that_cannot_be_read_needs_no_cell(tmp_path: Path) -> None:
    wrong = tmp_path / "wrong.case.yaml"
    wrong.write_text("slicing: {h_layer: 2}\n", encoding="utf-8")
    code, modules = imported("check", str(wrong))
    assert code == 2
    assert not modules & (HEAVY | ROOMS | {"numpy", "mujoco", "shapely", "cell.job"})


@pytest.mark.slow
def test_a_check_imports_what_it_runs(make_case: Callable[..., Path]) -> None:
    code, modules = imported("check", str(make_case()))
    assert code == 0
    assert not modules & (HEAVY - {"rich"} | ROOMS)
    assert {"mujoco", "cell.verdict.check"} <= modules  # what the test would see


@pytest.mark.parametrize("command", ["check", "replay"])
def test_only_what_draws_looks_for_a_window_system(command: str) -> None:
    """MuJoCo looks for one as it is imported, in processes of their own; without it, it cannot draw."""
    code = (
        "import os, sys; os.environ.pop('MUJOCO_GL', None); import cell.cli.main as m\n"
        f"m.COMMANDS[{command!r}] = lambda args: 0\n"
        f"sys.argv = ['rbam', {command!r}]; assert m.main() == 0\n"
        "import mujoco; from mujoco.rendering.classic import gl_context\n"
        "print('glfw' in sys.modules, hasattr(gl_context, 'GLContext'))"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    draws = command in DRAWS
    assert done.stdout.split() == [str(draws), str(draws)]


def test_commands_that_draw_are_known() -> None:
    views = re.compile(r"view\.(picture|film|window|browser)\b")
    users = {path.stem for path in (ROOT / "cell" / "cli").glob("*.py") if views.search(path.read_text("utf-8"))}
    assert users == {f"{command}_command" for command in DRAWS}
