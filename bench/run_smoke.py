"""Run every bench on tiny sizes: ``python -m bench.run_smoke [NAME ...]``. A bench without its peer is left out."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOMS = ("soundness", "speed")
SHARED = {"__init__", "real_parts", "tesseract_cell", "tesseract_peer", "weakenings"}  # are no benches
LONGEST_S = 300


def benches() -> list[Path]:
    """The scripts that are benches."""
    return [path for room in ROOMS for path in sorted((HERE / room).glob("*.py")) if path.stem not in SHARED]


def main() -> int:
    names = set(sys.argv[1:])
    unknown = names - {path.stem for path in benches()}
    if unknown:
        raise SystemExit(f"no bench: {', '.join(sorted(unknown))}")
    env = {**os.environ, "PYTHONPATH": str(HERE.parent)}
    bad = 0
    for path in benches():
        name = path.stem
        if names and name not in names:
            continue
        start = time.perf_counter()
        command = [sys.executable, "-m", f"bench.{path.parent.name}.{name}", "--smoke"]
        done = subprocess.run(
            command, env=env, cwd=HERE.parent, capture_output=True, text=True, check=False, timeout=LONGEST_S
        )
        lines = (done.stdout + done.stderr).strip().splitlines()
        said = next((line for line in lines if line.startswith("left out: ")), "")
        bad += done.returncode != 0
        words = said or ("ok" if done.returncode == 0 else f"exit code {done.returncode}")
        print(f"{name:18} {time.perf_counter() - start:5.1f} s  {words}", flush=True)
        if done.returncode:
            print("\n".join(lines[-20:]))
    return int(bad > 0)


if __name__ == "__main__":
    sys.exit(main())
