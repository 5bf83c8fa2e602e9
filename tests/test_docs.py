"""The documents, without building their site: every page is listed, links lead somewhere, commands exist."""

from __future__ import annotations

import ast
import re
import shlex
from collections.abc import Iterator
from fnmatch import fnmatch
from pathlib import Path
from types import ModuleType

import pytest
from support.paths import ROOT

import cell
import ik
import slicing
from cell.cli.arguments import build_parser
from cell.cli.main import _joined_negatives

DOCS = ROOT / "docs"
PUBLIC = {"cell": cell, "ik": ik, "slicing": slicing}
PAGES = sorted(DOCS.rglob("*.md"))
READ = [*PAGES, ROOT / "README.md", ROOT / "bench" / "README.md", *sorted((ROOT / "models").rglob("README.md"))]
FENCED = re.compile(r"^(```+)([^\n]*)\n(.*?)^\1$", re.MULTILINE | re.DOTALL)
TOCTREE = re.compile(r"^```\{toctree\}\n(.*?)^```$", re.MULTILINE | re.DOTALL)
LINK = re.compile(r"\]\((?!https?:|mailto:|#)([^)#\s]+)(?:#[^)]*)?\)")
INLINE = re.compile(r"`(rbam [^`]+)`")


def name_of(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


def entries(page: Path) -> Iterator[str]:
    """What the tables of contents of a page list, from the documents' folder; patterns as they are."""
    for block in TOCTREE.findall(page.read_text(encoding="utf-8")):
        for line in block.splitlines():
            if line and not line.startswith(":"):
                yield (page.parent / line).relative_to(DOCS).as_posix()


def shown(page: Path) -> Iterator[str]:
    """Command lines of rbam in the blocks of a page."""
    for _, kind, content in FENCED.findall(page.read_text(encoding="utf-8")):
        if kind.strip() not in ("sh", "console", "{run}"):
            continue
        for line in content.replace("\\\n", " ").splitlines():
            for part in line.split("&&"):
                words = part.split("#")[0].removeprefix("$ ").strip()
                if re.match(r"(\S*/)?rbam\s", words):
                    yield words


def ends_with(argv: list[str]) -> int:
    """What parsing arguments would end the program with; 0 where they are fine."""
    try:
        build_parser().parse_args(_joined_negatives(argv))
    except SystemExit as ended:
        return int(ended.code or 0)
    return 0


def test_every_page_is_in_a_table_of_contents() -> None:
    listed = [entry for page in PAGES for entry in entries(page)]
    names = {page.relative_to(DOCS).with_suffix("").as_posix() for page in PAGES}
    left = {name for name in names - {"index"} if not any(fnmatch(name, entry) for entry in listed)}
    assert left == set()
    assert {entry for entry in listed if "*" not in entry} <= names


def test_every_example_of_the_gallery_has_a_page_and_a_text() -> None:
    scripts = sorted((DOCS / "gallery").glob("*.py"))
    assert len(scripts) >= 7
    for script in scripts:
        assert f"{{example}} {script.name}\n" in script.with_suffix(".md").read_text(encoding="utf-8")
        assert ast.get_docstring(ast.parse(script.read_text(encoding="utf-8")))


def test_examples_import_public_names_alone() -> None:
    for script in sorted((DOCS / "gallery").glob("*.py")):
        tree = ast.parse(script.read_text(encoding="utf-8"))
        for node in ast.walk(tree):
            if isinstance(node, ast.ImportFrom):
                assert (node.module or "").split(".")[0] not in ("cell", "ik", "slicing"), script
            if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id in PUBLIC:
                assert node.attr in PUBLIC[node.value.id].__all__, f"{script}: {node.value.id}.{node.attr}"
            if isinstance(node, ast.Import):
                assert not any(a.name.startswith(("cell.", "ik.", "slicing.")) for a in node.names), script


@pytest.mark.parametrize("page", READ, ids=name_of)
def test_links_and_pictures_exist(page: Path) -> None:
    text = FENCED.sub("", page.read_text(encoding="utf-8"))
    lost = [link for link in LINK.findall(text) if not (page.parent / link).exists()]
    assert lost == []


@pytest.mark.parametrize("page", READ, ids=name_of)
def test_commands_that_are_shown_can_be_typed(page: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for command in shown(page):
        assert ends_with(shlex.split(command)[1:]) == 0, f"{command}: {capsys.readouterr().err}"


@pytest.mark.parametrize("page", READ, ids=name_of)
def test_options_that_are_named_exist(page: Path) -> None:
    commands = build_parser()._subparsers._group_actions[0].choices  # type: ignore[union-attr]
    for text in INLINE.findall(FENCED.sub("", page.read_text(encoding="utf-8"))):
        name, *words = text.split()[1:]
        assert name in commands, text
        known = commands[name]._option_string_actions  # type: ignore[index]
        unknown = [w for w in words if w.startswith("--") and w.split("=")[0] not in known]
        assert unknown == [], text


@pytest.fixture
def page_runs(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(str(DOCS / "_ext"))
    import page_runs

    return page_runs


def test_pages_run_what_they_show(page_runs: ModuleType, tmp_path: Path) -> None:
    source, folder = tmp_path / "docs", tmp_path / "runs"
    source.mkdir()
    text = "```{file} say.py\nprint(open('said.txt').read())\nraise SystemExit(3)\n```\n"
    text += "```{file} said.txt\nso\n```\n```{run}\n:exit: 3\npython say.py\n```\n"
    (source / "page.md").write_text(text, encoding="utf-8")
    first = page_runs.run_all(source, folder)["page"].outputs["python say.py"]
    assert (first.text.strip(), first.code) == ("so", 3)
    again = page_runs.run_all(source, folder)["page"].outputs["python say.py"]
    assert again.seconds == first.seconds  # not run again
    (source / "page.md").write_text(text.replace("\nso\n", "\nother\n"), encoding="utf-8")
    assert page_runs.run_all(source, folder)["page"].outputs["python say.py"].text.strip() == "other"


def test_pages_whose_names_begin_with_a_number_go_on_from_one_another(page_runs: ModuleType, tmp_path: Path) -> None:
    source = tmp_path / "docs"
    source.mkdir()
    (source / "1_first.md").write_text("```{file} say.py\nprint('here')\n```\n", encoding="utf-8")
    (source / "2_second.md").write_text("```{run}\npython say.py\n```\n", encoding="utf-8")
    runs = page_runs.run_all(source, tmp_path / "runs")
    assert runs["2_second"].outputs["python say.py"].text == "here"


def test_pages_run_rbam_and_python_alone(page_runs: ModuleType) -> None:
    assert page_runs.arguments("rbam check my.case.yaml") == ["-m", "cell", "check", "my.case.yaml"]
    with pytest.raises(ValueError, match="rbam and python alone"):
        page_runs.arguments("rm -r .")
