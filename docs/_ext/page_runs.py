"""What the pages show is run: the commands of the tutorial and how-tos, and the scripts of the gallery.

    runs = run_all(source=Path("docs"), folder=Path("build/docs_runs"))
    runs["tutorial/1_first_check"].outputs["rbam check"].text

A page has a folder of its own, in which its files are written and its commands run one after another. Pages of a folder
whose names begin with a number, as the tutorial's, go on from one another: they share one. Two folders run at a time.
What ran before and would run the same (pages and packages unchanged) is not run again. With RBAM_DOCS_KEEP=1 unchanged
pages are enough: for writing, never for CI.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass, field
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("cell", "ik", "slicing", "models")
WORKERS = 2
LONGEST_S = 300
BLOCK = re.compile(r"^```\{(file|run|example)\} *([^\n]*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
OPTION = re.compile(r":[a-z]+:.*")


@dataclass(frozen=True)
class Step:
    """One thing a page does: a file that it writes, a command or a script.

    Attributes:
        kind: file, run or example.
        name: of the file, or of the script; the command as it is shown.
        text: what the file holds; empty of others.
    """

    kind: str
    name: str
    text: str


@dataclass(frozen=True)
class Output:
    """What a command said.

    Attributes:
        text: standard output and error as they came.
        code: its exit code.
        seconds: how long it took.
    """

    text: str
    code: int
    seconds: float


@dataclass(frozen=True)
class PageRun:
    """A page's commands, run.

    Attributes:
        folder: where it ran, and where the files are that it wrote.
        outputs: by command, or by the script's name; of pages that share a folder all of theirs.
    """

    folder: Path
    outputs: dict[str, Output] = field(default_factory=dict)


def body_of(content: str) -> str:
    """A block without the options on its first lines."""
    lines = content.splitlines()
    while lines and OPTION.fullmatch(lines[0]):
        del lines[0]
    return "\n".join(lines).strip("\n")


def steps_of(page: str) -> list[Step]:
    """What a page does, in order."""
    found = []
    for kind, argument, content in BLOCK.findall(page):
        body = body_of(content)
        if kind == "file":
            found.append(Step(kind, argument.strip(), body + "\n"))
        elif kind == "run":
            found.append(Step(kind, body, ""))
        else:
            found.append(Step(kind, argument.strip(), ""))
    return found


def run_all(source: Path, folder: Path) -> dict[str, PageRun]:
    """Run every page that has something to run.

    Args:
        source: of the pages.
        folder: under which pages get theirs.

    Returns:
        By the page's name without its ending.
    """
    groups: dict[str, dict[str, list[Step]]] = {}
    for path in sorted(source.rglob("*.md")):
        steps = steps_of(path.read_text(encoding="utf-8"))
        if steps:
            name = path.relative_to(source).with_suffix("")
            group = name.parent if name.name[0].isdigit() else name
            groups.setdefault(group.as_posix(), {})[name.as_posix()] = steps
    packages = _state_of_packages()
    todo = sorted(groups.items(), key=lambda group: -sum(map(len, group[1].values())))  # the longest first
    with ThreadPoolExecutor(WORKERS) as pool:
        runs = list(pool.map(lambda one: _run_group(*one, source, folder, packages), todo))
    return {name: run for (_, pages), run in zip(todo, runs, strict=True) for name in pages}


def _state_of_packages() -> str:
    state = hashlib.sha256()
    for package in PACKAGES:
        for path in sorted((ROOT / package).rglob("*")):
            if path.is_file() and "__pycache__" not in path.parts:
                state.update(str(path.relative_to(ROOT)).encode())
                state.update(path.read_bytes())
    return state.hexdigest()


def _run_group(group: str, pages: dict[str, list[Step]], source: Path, folder: Path, packages: str) -> PageRun:
    todo = [(step, (source / name).parent) for name, steps in pages.items() for step in steps]
    scripts = [(beside / step.name).read_text(encoding="utf-8") for step, beside in todo if step.kind == "example"]
    if os.environ.get("RBAM_DOCS_KEEP") == "1":
        packages = ""
    key = hashlib.sha256(repr(([step for step, _ in todo], scripts)).encode()).hexdigest()
    here, kept = folder / group, folder / f"{group}.json"
    if kept.is_file():
        before = json.loads(kept.read_text(encoding="utf-8"))
        if before["key"] == key and packages in (before["packages"], "") and here.is_dir():
            return PageRun(here, {name: Output(**out) for name, out in before["outputs"].items()})
    shutil.rmtree(here, ignore_errors=True)
    here.mkdir(parents=True)
    outputs = dict(_outputs(todo, here))
    if any(step.kind == "example" and outputs[step.name].code for step, _ in todo):
        return PageRun(here, outputs)  # a script that failed runs again
    said = {name: asdict(output) for name, output in outputs.items()}
    kept.write_text(json.dumps({"key": key, "packages": packages, "outputs": said}), encoding="utf-8")
    return PageRun(here, outputs)


def _outputs(todo: list[tuple[Step, Path]], folder: Path) -> Iterator[tuple[str, Output]]:
    for step, beside in todo:
        if step.kind == "file":
            path = folder / step.name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(step.text, encoding="utf-8")
        else:
            argv = [str(beside / step.name)] if step.kind == "example" else arguments(step.name)
            yield step.name, _run(argv, folder)


def arguments(command: str) -> list[str]:
    """What Python is given to run a command that a page shows.

    Raises:
        ValueError: it is neither of rbam nor of Python.
    """
    program, *rest = shlex.split(command)
    if program == "rbam":
        return ["-m", "cell", *rest]
    if program == "python":
        return rest
    raise ValueError(f"{command!r}: pages run rbam and python alone")


def _run(argv: list[str], folder: Path) -> Output:
    paths = [str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])]
    variables = {**os.environ, "PYTHONPATH": os.pathsep.join(paths), "OPENBLAS_NUM_THREADS": "1", "NO_COLOR": "1"}
    start = time.perf_counter()
    done = subprocess.run(
        [sys.executable, *argv],
        cwd=folder,
        env=variables,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        timeout=LONGEST_S,
        text=True,
        encoding="utf-8",
        check=False,
    )
    text = "\n".join(line.rstrip() for line in done.stdout.splitlines())
    return Output(text, done.returncode, time.perf_counter() - start)
