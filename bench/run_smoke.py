"""Run every bench on tiny sizes: ``python bench/run_smoke.py [NAME ...]``. A bench without its peer is left out."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
HELPERS = {
    "bench_arguments",
    "figures",
    "real_parts",
    "run_smoke",
    "tesseract_cell",
    "tesseract_peer",
    "toolbox",
    "weakenings",
}
LONGEST_S = 300


def benches() -> list[Path]:
    """The scripts that are benches."""
    return [path for path in sorted(HERE.glob("*.py")) if path.stem not in HELPERS]


def main() -> int:
    names = sys.argv[1:] or [path.stem for path in benches()]
    env = {**os.environ, "PYTHONPATH": str(HERE.parent)}
    bad = 0
    for name in names:
        start = time.perf_counter()
        command = [sys.executable, str(HERE / f"{name}.py"), "--smoke"]
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
