"""The packages' own names: the README's example runs as it stands there."""

from __future__ import annotations

import re
import subprocess
import sys

import pytest
from support.paths import ROOT


def example() -> str:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    found = re.search(r"<!-- python example -->\n```python\n(.*?)```", text, re.DOTALL)
    assert found
    return found.group(1)


def test_the_readmes_example_runs(make_case, tmp_path, monkeypatch, capsys):
    make_case("blade")
    monkeypatch.chdir(tmp_path)
    exec(compile(example(), "README.md", "exec"), {})
    assert re.fullmatch(r"True \d+ rows\n", capsys.readouterr().out)
    assert (tmp_path / "blade.csv").is_file()


def test_the_readmes_example_says_what_would_help(make_case, tmp_path, monkeypatch, capsys):
    make_case("blade", positioner={"position_mm": [4000, 0, 0]})
    monkeypatch.chdir(tmp_path)
    exec(compile(example(), "README.md", "exec"), {})
    assert "positioner" in capsys.readouterr().out


@pytest.mark.parametrize("package", ["cell", "slicing", "ik"])
def test_importing_a_package_loads_nothing_heavy(package):
    code = f"import sys, {package}; print([m for m in ('mujoco', 'numpy', 'scipy', 'shapely') if m in sys.modules])"
    run = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "[]"
