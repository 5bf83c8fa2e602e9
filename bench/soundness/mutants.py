"""Weakenings of what is proved or checked, one at a time in a copy of the tree: a test must fail for each.

    python -m bench.soundness.mutants                          # all of them, with the tests named beside each
    python -m bench.soundness.mutants --only cell/collision/proofs/between_samples.py   # those of one module
    python -m bench.soundness.mutants --list

A mutant (``weakenings.py``) is a module, the exact text that is replaced, and what takes its place. A text that stands
nowhere, or twice, is said: the list has to follow the code. One that changes no verdict says why beside it
(`equivalent`). Exit code 1 if another survives, or one does not apply.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from .weakenings import MUTANTS, Mutant

ROOT = Path(__file__).resolve().parents[2]
COPIED = ("cell", "ik", "slicing", "models", "tests", "bench", "docs", "pyproject.toml", "README.md")
LONGEST = 1800  # s a mutant


def copied_tree(folder: Path) -> Path:
    """The tree as it is now, apart, so that it can be edited while mutants run."""
    copy = folder / "tree"
    copy.mkdir()
    for name in COPIED:
        here = ROOT / name
        if here.is_dir():
            shutil.copytree(here, copy / name, ignore=shutil.ignore_patterns("__pycache__"))
        elif here.exists():
            shutil.copy2(here, copy / name)
    return copy


def tested(tree: Path, tests: Iterable[str]) -> tuple[int | None, str]:
    """Exit code of pytest over files of tests, up to the first that fails, and which; None where it does not end."""
    every = ["-x", "-q", "-p", "no:cacheprovider", "-m", "slow or not slow", "-r", "fE"]
    command = [sys.executable, "-m", "pytest", *every, *(f"tests/{name}" for name in tests)]
    environment = {**os.environ, "PYTHONPATH": str(tree)}
    try:
        done = subprocess.run(
            command, cwd=tree, env=environment, capture_output=True, text=True, timeout=LONGEST, check=False
        )
    except subprocess.TimeoutExpired:
        return None, ""
    failed = re.search(r"^(?:FAILED|ERROR) (\S+)", done.stdout, re.MULTILINE)
    return done.returncode, failed[1].removeprefix("tests/") if failed else ""


def outcome(tree: Path, mutant: Mutant) -> tuple[str, str]:
    """What became of a mutant ("killed", "survives" or why it does not apply), and the test that killed it."""
    module = tree / mutant.module
    source = module.read_text(encoding="utf-8")
    if source.count(mutant.text) != 1:
        return f"does not apply: its text stands {source.count(mutant.text)} times", ""
    try:
        _written(module, source.replace(mutant.text, mutant.by))
        code, by = tested(tree, mutant.tests)
    finally:
        _written(module, source)
    if code is None:
        return "killed (does not end)", ""
    survived = "survives, argued equivalent" if mutant.equivalent else "survives"
    return {0: survived, 1: "killed"}.get(code, f"pytest ended with {code}"), by


def _written(module: Path, source: str) -> None:
    """Write a module and forget its bytecode, which Python tells apart by whole seconds and sizes alone."""
    for old in (module.parent / "__pycache__").glob(f"{module.stem}.*"):
        old.unlink()
    module.write_text(source, encoding="utf-8")


def document(rows: list[list[str]], baseline: str) -> dict[str, Any]:
    """The outcome as bench/figures/mutants.json keeps it."""
    killed, argued = (sum(row[2].startswith(words) for row in rows) for words in ("killed", "survives, argued"))
    left = len(rows) - killed - argued
    return {
        "bench": "mutants",
        "question": "proofs and checks, weakened",
        "against": "the tests of what is weakened",
        "result": f"{len(rows)} weakenings: {killed} killed, {argued} argued equivalent, {left} survive",
        "command": "python -m bench.soundness.mutants --figures bench/figures/mutants.json",
        "date": time.strftime("%Y-%m-%d"),
        "machine": "shared, 2 cores, Linux x86-64; other programs beside it",
        "about": "weakenings of what is proved or checked, one at a time: a test must fail for each",
        "tables": [
            {"caption": "", "columns": ["module", "what is replaced", "outcome", "first test that fails"], "rows": rows}
        ],
        "notes": [f"Without a weakening the same tests pass: {baseline}."],
    }


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default="", help="mutants of modules whose path begins so")
    parser.add_argument("--list", "--smoke", action="store_true", help="apply none")
    parser.add_argument("--figures", metavar="F", type=Path, help="keep the outcome in this file")
    args = parser.parse_args()
    mutants = [mutant for mutant in MUTANTS if mutant.module.startswith(args.only)]
    if not mutants:
        raise SystemExit(f"no weakening of {args.only}")
    if args.list:
        for mutant in mutants:
            print(f"listed       {mutant.module}: {_short(mutant)}")
        return 0
    from ..figures import text_of

    rows: list[list[str]] = []
    with tempfile.TemporaryDirectory() as folder:
        tree = copied_tree(Path(folder))
        files = sorted({name for mutant in mutants for name in mutant.tests})
        code, failed = tested(tree, files)
        if code != 0:
            print(f"the tests do not pass without a mutant: pytest ended with {code}, {failed}")
            return 1
        for mutant in mutants:
            words, by = outcome(tree, mutant)
            rows.append([mutant.module, _short(mutant), words, by])
            print(f"{words:12} {mutant.module}: {_short(mutant)}  [{by}]", flush=True)
            if args.figures:
                args.figures.write_text(text_of(document(rows, f"{len(files)} files")), encoding="utf-8")
    bad = sum(not row[2].startswith(("killed", "survives, argued")) for row in rows)
    print(f"{bad} mutants survive or do not apply")
    return int(bad > 0)


def _short(mutant: Mutant) -> str:
    return " ".join(mutant.text.split())[:90]


if __name__ == "__main__":
    sys.exit(main())
