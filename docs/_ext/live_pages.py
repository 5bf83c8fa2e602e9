"""Directives whose commands run when the site is built: file, run, shot, page, example, gallery.

- file NAME: a file that the page's commands read; shown as it is.
- run: a command and what it says; `:exit:` and `:shows:` are held, else the build fails.
- shot NAME: a picture that a command made; the content is its text for those who cannot see it.
- page NAME: a page, or a schema, that a command made: linked, and a page shown in a frame.
- example NAME: a script beside the page: its text, its code, what it says and its pictures.
- gallery: all examples with their first pictures.
"""

from __future__ import annotations

import ast
import os
import shutil
from pathlib import Path
from typing import Any, ClassVar

from docutils import nodes
from docutils.parsers.rst import directives
from docutils.statemachine import StringList
from page_runs import ROOT, Output, PageRun, body_of, run_all
from sphinx.application import Sphinx
from sphinx.environment import BuildEnvironment
from sphinx.util import logging
from sphinx.util.docutils import SphinxDirective

LOG = logging.getLogger(__name__)
LEXERS = {".yaml": "yaml", ".py": "python", ".csv": "text", ".xml": "xml"}
RUNS: dict[str, PageRun] = {}


class LiveDirective(SphinxDirective):
    """What the directives share."""

    @property
    def ran(self) -> PageRun:
        """What this page's commands did."""
        return RUNS[self.env.docname]

    def picture(self, path: Path, alt: str) -> nodes.image:
        """A picture that a command made."""
        uri = "/" + Path(os.path.relpath(path, self.env.srcdir)).as_posix()
        return nodes.image(uri=uri, alt=alt, candidates={})

    def code(self, text: str, language: str, title: str = "") -> nodes.Node:
        """A block of code, with a title above."""
        block = nodes.literal_block(text, text, language=language)
        if not title:
            return block
        holder = nodes.container("", literal_block=True, classes=["literal-block-wrapper"])
        holder += nodes.caption(title, title)
        holder += block
        return holder

    def held(self, name: str, output: Output, code: int, shows: str | None) -> None:
        """Warn, which ends the build, where a command did not do what the page says."""
        if output.code != code:
            words = f"{name}: exit code {output.code}, the page says {code}:\n{output.text}"
            LOG.warning(words, location=self.get_location())
        if shows and shows not in output.text:
            LOG.warning(f"{name}: says nothing of {shows!r}:\n{output.text}", location=self.get_location())


class FileBlock(LiveDirective):
    """A file that the page writes."""

    required_arguments = 1
    has_content = True

    def run(self) -> list[nodes.Node]:
        """The file's name and content."""
        name = self.arguments[0]
        return [self.code("\n".join(self.content), LEXERS.get(Path(name).suffix, "text"), name)]


class RunBlock(LiveDirective):
    """A command and what it says."""

    has_content = True
    option_spec: ClassVar[dict[str, Any]] = {
        "exit": directives.nonnegative_int,
        "shows": directives.unchanged_required,
        "silent": directives.flag,
    }

    def run(self) -> list[nodes.Node]:
        """The command above its output."""
        command = body_of("\n".join(self.content))
        output = self.ran.outputs[command]
        self.held(command, output, self.options.get("exit", 0), self.options.get("shows"))
        shown = nodes.container(classes=["run"])
        shown += self.code(f"$ {command}", "console")
        if output.text and "silent" not in self.options:
            said = self.code(output.text, "text")
            said["classes"].append("said")
            shown += said
        return [shown]


class Shot(LiveDirective):
    """A picture that a command made."""

    required_arguments = 1
    has_content = True

    def run(self) -> list[nodes.Node]:
        """The picture."""
        path = self.ran.folder / self.arguments[0]
        if not path.is_file():
            LOG.warning(f"{path.name}: no command of this page made it", location=self.get_location())
            return []
        return [self.picture(path, " ".join(self.content))]


class MadePage(LiveDirective):
    """A page of one file that a command made."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """A link and a frame."""
        name = self.arguments[0]
        if not (self.ran.folder / name).is_file():
            LOG.warning(f"{name}: no command of this page made it", location=self.get_location())
        return [_frame(self.env.docname, name)]


class Example(LiveDirective):
    """A script of the gallery."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """Its text, pictures, code, and what it says."""
        name = self.arguments[0]
        path = Path(self.env.doc2path(self.env.docname)).with_name(name)
        self.env.note_dependency(str(path))
        source = path.read_text(encoding="utf-8")
        output = self.ran.outputs[name]
        self.held(name, output, 0, None)
        first = ast.parse(source).body[0]
        text = nodes.container()
        words = (ast.get_docstring(ast.parse(source)) or "").splitlines()
        self.state.nested_parse(StringList(words, source=str(path)), 0, text)
        code = "\n".join(source.splitlines()[first.end_lineno or 0 :]).strip("\n")
        pictures = [self.picture(p, f"made by {name}") for p in sorted(self.ran.folder.glob("*.png"))]
        if not pictures:
            LOG.warning(f"{name}: made no picture", location=self.get_location())
        said = [self.code(output.text, "text", "it says")] if output.text else []
        pages = [_frame(self.env.docname, p.name) for p in sorted(self.ran.folder.glob("*.html"))]
        return [*text.children, *pictures, self.code(code, "python", f"docs/gallery/{name}"), *said, *pages]


class Gallery(LiveDirective):
    """All examples."""

    def run(self) -> list[nodes.Node]:
        """One card an example: its first picture and its title."""
        folder = Path(self.env.doc2path(self.env.docname)).parent
        cards = nodes.container(classes=["gallery"])
        for page in sorted(folder.glob("*.md")):
            name = page.relative_to(self.env.srcdir).with_suffix("").as_posix()
            pictures = sorted(RUNS[name].folder.glob("*.png")) if name in RUNS else []
            if pictures:
                title = page.read_text(encoding="utf-8").splitlines()[0].removeprefix("# ")
                link = nodes.reference("", "", refuri=f"{page.stem}.html", internal=True)
                link += self.picture(pictures[0], "")
                link += nodes.inline(title, title)
                cards += nodes.container("", nodes.paragraph("", "", link))
        return [cards]


def _frame(docname: str, name: str) -> nodes.Node:
    where = "../" * docname.count("/") + f"_runs/{docname}/{name}"
    html = f'<p><a href="{where}">{name}</a>, as it was made</p>\n'
    if name.endswith(".html"):
        html += f'<iframe class="made" src="{where}" title="{name}" loading="lazy"></iframe>\n'
    return nodes.raw("", html, format="html")


def _run_pages(app: Sphinx) -> None:
    RUNS.clear()
    folder = Path(app.config.docs_runs_folder)
    RUNS.update(run_all(Path(app.srcdir), folder))
    for run in {id(run): run for run in RUNS.values()}.values():
        for command, output in run.outputs.items():
            LOG.info(f"{output.seconds:6.1f} s  {run.folder.relative_to(folder)}: {command}")


def _with_runs(app: Sphinx, env: BuildEnvironment, *_: set[str]) -> list[str]:
    """Pages to read anew though their own text is as before: what they show may have changed."""
    return [name for name in (*RUNS, "gallery/index") if name in env.found_docs]


def _copy_pages(app: Sphinx, error: Exception | None) -> None:
    if error is not None or app.builder.format != "html":
        return
    for name, run in RUNS.items():
        for path in (*run.folder.glob("*.html"), *run.folder.glob("*.schema.json")):
            there = Path(app.outdir) / "_runs" / name / path.name
            there.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(path, there)


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the directives."""
    kinds = {"file": FileBlock, "run": RunBlock, "shot": Shot, "page": MadePage, "example": Example, "gallery": Gallery}
    for name, kind in kinds.items():
        app.add_directive(name, kind)
    app.add_config_value("docs_runs_folder", str(ROOT / "build" / "docs_runs"), "env", str)
    app.connect("builder-inited", _run_pages)
    app.connect("env-get-outdated", _with_runs)
    app.connect("build-finished", _copy_pages)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
