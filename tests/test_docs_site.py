"""A site is not built where a page shows what is not so: small sites of one page, with what must be refused."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from support.paths import ROOT

pytest.importorskip("sphinx")
pytest.importorskip("myst_parser")

HEAD = "# Page\n\n```{file} say.py\nprint('so it is')\nraise SystemExit(1)\n```\n\n"
RUN = "```{run}\n:exit: 1\n:shows: so it is\npython say.py\n```\n"


def built(folder: Path, text: str) -> tuple[int, str]:
    """Exit code and words of a build of one page."""
    (folder / "site").mkdir(exist_ok=True)
    conf = f'extensions = ["myst_parser", "live_pages"]\ndocs_runs_folder = {str(folder / "runs")!r}\n'
    (folder / "site" / "conf.py").write_text(conf, encoding="utf-8")
    (folder / "site" / "index.md").write_text(text, encoding="utf-8")
    command = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", str(folder / "site"), str(folder / "out")]
    env = {**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT / "docs" / "_ext"), str(ROOT)])}
    done = subprocess.run(command, env=env, capture_output=True, text=True, check=False)
    return done.returncode, done.stderr


@pytest.mark.slow
def test_a_page_that_shows_what_is_so_is_built(tmp_path: Path) -> None:
    code, words = built(tmp_path, HEAD + RUN)
    assert code == 0, words
    assert "so it is" in (tmp_path / "out" / "index.html").read_text(encoding="utf-8")


@pytest.mark.slow
def test_a_page_that_shows_what_is_not_so_is_refused(tmp_path: Path) -> None:
    page = HEAD + "```{run}\npython say.py\n```\n" + "```{run}\n:exit: 1\n:shows: so it was\npython say.py again\n```\n"
    page += "```{shot} cell.png\nA cell\n```\n" + "```{page} report.html\n```\n"
    code, said = built(tmp_path, page)
    assert code != 0
    assert "python say.py: exit code 1, the page says 0" in said
    assert "python say.py again: says nothing of 'so it was'" in said
    assert "cell.png: no command of this page made it" in said
    assert "report.html: no command of this page made it" in said
