"""Mutated case files: whatever stands in one, the answer is an exit code of 0, 1 or 2, in bounded time and memory.

    python -m bench.soundness.case_fuzz --count 2000 --seed 1  # read and prepared; --check checks them as well

Cases are the shipped ones with a small part in place of theirs, mutated in their content or in their text. Each is
named by its seed: the same seed gives the same file, which --show prints. What was wrong is printed at once, and every
EVERY seconds how many were answered, and with which exit code: a run that is cut off has told as much.
"""

from __future__ import annotations

import argparse
import contextlib
import copy
import io
import math
import os
import random
import resource
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import trimesh
import yaml

from ..bench_arguments import parsed

ROOT = Path(__file__).resolve().parents[2]
CASES = sorted((ROOT / "models" / "cases").glob("*.case.yaml"))
PART = {"sub_volumes": ["block.stl"], "body": {"radius_mm": 20}, "rotation_deg": 180}
NUMBERS = (
    *(0, -1, 1, 2, 7, 0.5, -0.0, 1e-3, 1e-6, 1e-9, 1e-300, 1e3, 1e5, 1e6, 1e9, 1e300, -1e300, 1.7e308),
    *(float("nan"), float("inf"), float("-inf"), 2**31, 2**63, 2**70, 10**310, 360, -360, 90, 89.999999, 45),
)
TEXTS = (
    *("", " ", "x", "SV1", "BODY", "free", "planar", "zigzag", "..", "/", ".", "/dev/zero", "/dev/null", "block.stl"),
    *("block.stl/", "gone.stl", "fuzz.case.yaml", "kr70_r2100", "a\0b", "a\nb", "\x1b[2J", "[bold]", "Ω叶😀"),
    *("a" * 300, "a/" * 3000, "-90:90:45", "0:1e9:1e-9", "1:2", "::", "1e400", "nan", "2024-13-01", "true", "~"),
    *("<<", "{{data}}"),
)
OTHERS = (None, True, False, [], {}, [[]], [None], {"a": 1}, {1: 2}, [[[[[[1]]]]]], [1, 2], [1, 2, 3], list(range(50)))
PIECES = (
    *("{", "}", "[", "]", "&a ", "*a", "!", "!!int ", "!!binary ", "!!python/object:os.system ", "|", ">", "'", '"'),
    *("%", "@", "`", ":", ": ", ",", "#", "?", "- ", "\t", "\n", "\n\n", "\0", "\x85", "\ufeff", "\u2028", "---\n"),
    *("...\n", "<<: *a\n", "&a [*a]", "!!timestamp 2024-99-99", "0x", "1_000", "[" * 60, "{a: " * 60, "é"),
    *("extends: x\n",),
)


Key = tuple[tuple[str, ...], list[tuple[float, float]]]


def known_keys() -> list[Key]:
    """All keys that a case may hold, as paths, with the ranges of their numbers."""
    from cell.case.fields import keys_of
    from cell.case.problems import _ranges, section_of
    from cell.case.sections import Case

    def below(section: Any) -> Iterator[Key]:
        for name, field in keys_of(section).items():
            inner = section_of(field.annotation)
            yield (name,), [] if inner is not None else _ranges([field.metadata, field.annotation])
            if inner is not None:
                yield from (((name, *path), ranges) for path, ranges in below(inner))

    return list(below(Case))


def bases() -> list[dict[str, Any]]:
    """The shipped cases' contents, each with a small part that is quickly sliced."""
    from cell.case.read import load_case

    found = []
    for path in CASES:
        content = load_case(path).model_dump(mode="json", exclude_unset=True)
        for key in ("extends", "description", "expect"):
            content.pop(key, None)
        content["part"] = copy.deepcopy(PART)
        content["beads"] = {key: value for key, value in content.get("beads", {}).items() if key != "seams"}
        content["slicing"] = {"h_layer_mm": 3, "h_min_mm": 2, "h_max_mm": 4}
        content["fixtures"] = [{"name": "clamp", "box": {"size_mm": [20, 20, 20]}, "position_mm": [300, 300, 20]}]
        content["process"] = {**content.get("process", {}), "travel_attempts": 50}
        found.append(content)
    return found


class Mutator:
    """Makes a case file of a seed."""

    def __init__(self) -> None:
        self.bases, self.keys = bases(), known_keys()
        self.numbers = [key for key in self.keys if len(key[1]) == 1]

    def text(self, seed: int) -> str:
        """The mutated case file, as text."""
        rng = random.Random(seed)
        content = copy.deepcopy(rng.choice(self.bases))
        for _ in range(rng.choice((0, 1, 1, 2, 3))):
            path, ((low, high),) = rng.choice(self.numbers)
            _put(content, path, _between(low, high, rng))
        for _ in range(rng.choice((0, 0, 1, 1, 2))):
            self._change(content, rng)
        text = _dumped(content, rng)
        for _ in range(rng.choice((0, 0, 0, 0, 1, 3))):
            text = _changed_text(text, rng)
        return text

    def _change(self, content: dict[str, Any], rng: random.Random) -> None:
        places = list(_places(content))
        holder, key = rng.choice(places)
        what = rng.randrange(9)
        if what == 0:
            del holder[key]
        elif what == 1 and isinstance(holder, dict):
            holder[_misspelt(str(key), rng)] = holder.pop(key)
        elif what == 2:
            other, its = rng.choice(places)
            holder[key] = copy.deepcopy(other[its])
        elif what == 3:
            holder[key] = rng.choice(([holder[key]], {"x": holder[key]}, [holder[key]] * 3))
        elif what == 4 and isinstance(holder[key], (int, float)) and not isinstance(holder[key], bool):
            holder[key] = _scaled(holder[key], rng.choice((-1, 10, 100, 1e3, 1e6, 0.1, 1e-3, 1e-6)))
        elif what <= 6:
            _put(content, rng.choice(self.keys)[0], _value(rng))
        else:
            holder[key] = _value(rng)


def _places(of: Any) -> Iterator[tuple[Any, Any]]:
    for key in list(of) if isinstance(of, dict) else range(len(of)):
        yield of, key
        if isinstance(of[key], (dict, list)):
            yield from _places(of[key])


def _put(content: dict[str, Any], path: tuple[str, ...], value: Any) -> None:
    here: Any = content
    for name in path[:-1]:
        if isinstance(here.get(name), list) and here[name] and isinstance(here[name][0], dict):
            here = here[name][0]
            continue
        if not isinstance(here.get(name), dict):
            here[name] = {}
        here = here[name]
    here[path[-1]] = value


def _value(rng: random.Random) -> Any:
    return copy.deepcopy(rng.choice(rng.choice((NUMBERS, NUMBERS, TEXTS, OTHERS))))


def _scaled(value: float, factor: float) -> float:
    """A number times a factor; as it is if it is a whole number beyond all floats."""
    try:
        return value * factor
    except OverflowError:
        return value


def _between(low: float, high: float, rng: random.Random) -> float:
    """A number that is allowed: an end, or one of any order of magnitude between them."""
    if rng.random() < 0.3:
        return rng.choice((low, high))
    size = math.exp(rng.uniform(math.log(max(low, 1e-3)), math.log(high)))
    value = size if low >= 0 else rng.choice((-1, 1)) * min(size, -low)
    return float(f"{value:.3g}") if rng.random() < 0.5 else float(round(value))


def _misspelt(key: str, rng: random.Random) -> str:
    k = rng.randrange(len(key)) if key else 0
    return key[:k] + rng.choice(("", "x", "_", key[k : k + 1] * 2)) + key[k + 1 :]


def _dumped(content: dict[str, Any], rng: random.Random) -> str:
    flow = rng.choice((None, False, True))
    return yaml.safe_dump(
        content, sort_keys=False, allow_unicode=rng.random() < 0.5, default_flow_style=flow, width=100
    )


def _changed_text(text: str, rng: random.Random) -> str:
    a = rng.randrange(len(text) + 1)
    b = min(len(text), a + rng.choice((1, 1, 2, 5, 20, 200)))
    lines = text.split("\n")
    i, j = rng.randrange(len(lines)), rng.randrange(len(lines))
    what = rng.randrange(8)
    if what == 0:
        return text[:a] + text[b:]
    if what == 1:
        return text[:a] + text[a:b] * rng.choice((2, 3, 50)) + text[b:]
    if what == 2:
        return text[:a]
    if what == 3:
        lines[i], lines[j] = lines[j], lines[i]
        return "\n".join(lines)
    if what == 4:
        lines.insert(i, lines[j])
        return "\n".join(lines)
    if what == 5:
        lines[i] = " " * rng.randrange(5) + lines[i].lstrip()
        return "\n".join(lines)
    return text[:a] + rng.choice(PIECES) + text[a if what == 6 else b :]


def write_part(folder: Path) -> None:
    """The small part that the cases name."""
    box = trimesh.creation.box((8.0, 6.0, 8.0))
    box.apply_translation((22.0, 0.0, 20.0))
    box.export(folder / "block.stl")


def outcome(path: Path, stop: str) -> tuple[int, str]:
    """Run a case in this process.

    Args:
        path: the case file.
        stop: "read", "prepare" or "check": how far it is taken.

    Returns:
        The exit code, 0 where it was taken so far, and what was said on stderr.

    Raises:
        Exception: whatever is no answer.
    """
    from cell.case.read import load_case
    from cell.cli.main import main
    from cell.errors import InputError
    from cell.job.job import prepare

    if stop == "check":
        said, out = io.StringIO(), io.StringIO()
        with contextlib.redirect_stderr(said), contextlib.redirect_stdout(out):
            return main(["check", str(path), "--no-remedies"]), said.getvalue()
    try:
        case = load_case(path)
        if stop == "prepare":
            prepare(case)
    except InputError as error:
        return 2, str(error) + "\n"
    return 0, ""


def answer(path: Path, stop: str) -> tuple[int | None, str | None]:
    """The exit code of a case, and what is wrong with the answer; None where it is one."""
    from cell.termination import Terminated

    try:
        code, said = outcome(path, stop)
    except BaseException as error:
        if isinstance(error, (KeyboardInterrupt, Terminated)):
            raise
        where = error.__traceback__
        while where is not None and where.tb_next is not None:
            where = where.tb_next
        at = "" if where is None else f" at {Path(where.tb_frame.f_code.co_filename).name}:{where.tb_lineno}"
        return None, f"{type(error).__name__}: {str(error)[:120]}{at}"
    if code not in (0, 1, 2):
        return code, f"exit code {code}: {said.strip()[:300]}"
    if code == 2 and said.count("\n") != 1:
        return code, f"{said.count(chr(10))} lines: {said[:200]!r}"
    return code, None


class TooLong(BaseException):
    """The time of a case is over."""


def _too_long(*_: object) -> None:
    raise TooLong(f"more than {SECONDS} s")


SECONDS, MIB = 60, 3000  # processor time of a case
PATIENCE = 10  # times as long may it take on a busy machine
EVERY = 20.0  # s between two counts that are printed


def work(seeds: range, stop: str) -> None:
    """Run seeds in this process with limits; a line each that is wrong, and the count of codes at the end."""
    resource.setrlimit(resource.RLIMIT_AS, (MIB * 2**20, MIB * 2**20))
    signal.signal(signal.SIGALRM, _too_long)
    signal.signal(signal.SIGPROF, _too_long)
    mutator, worst = Mutator(), (0.0, -1)
    count: Counter[str] = Counter()
    told = time.perf_counter()

    def tell() -> None:
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024
        by = ", ".join(f"{value} {name}" for name, value in sorted(count.items()))
        print(f"{count.total()} cases: {by}; slowest {worst[0]:.1f} s (seed {worst[1]}), peak {peak} MiB", flush=True)

    with tempfile.TemporaryDirectory() as folder:
        write_part(Path(folder))
        path = Path(folder) / "fuzz.case.yaml"
        for seed in seeds:
            path.write_text(mutator.text(seed), encoding="utf-8", errors="replace")
            start = time.process_time()
            signal.setitimer(signal.ITIMER_PROF, SECONDS)
            signal.alarm(PATIENCE * SECONDS)
            code, wrong = answer(path, stop)
            signal.alarm(0)
            signal.setitimer(signal.ITIMER_PROF, 0)
            worst = max(worst, (time.process_time() - start, seed))
            count["wrong" if wrong else f"ended with {code}"] += 1
            if wrong:
                print(f"seed {seed}: {wrong}", flush=True)
            if time.perf_counter() - told > EVERY:
                told = time.perf_counter()
                tell()
    tell()


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--check", action="store_true", help="check what can be prepared")
    parser.add_argument("--read", action="store_true", help="read alone")
    parser.add_argument("--show", type=int, metavar="SEED", help="print a case")
    args = parsed(parser, count=5)
    if args.show is not None:
        sys.stdout.write(Mutator().text(args.show))
        return 0
    # a process of its own, so that a crash of a library is seen as well
    stop = "check" if args.check else "read" if args.read else "prepare"
    code = "from bench.soundness import case_fuzz; "
    code += f"case_fuzz.work(range({args.seed}, {args.seed + args.count}), {stop!r})"
    env = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
    wrong = False
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True, env=env, cwd=ROOT) as child:
        assert child.stdout is not None
        for line in child.stdout:
            wrong |= line.startswith("seed ")
            print(line, end="", flush=True)
    return 1 if child.returncode or wrong else 0


if __name__ == "__main__":
    sys.exit(main())
