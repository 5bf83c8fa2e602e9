"""Make the pictures of the documents: the shipped case at two table poses, seen whole and at the torch.

    python docs/make_pictures.py                 # writes docs/pictures/*.png
    python docs/make_pictures.py my.case.yaml --out somewhere

Needs no display (Debian: libegl1, libgl1-mesa-dri). Colours are reduced to 256, so that a picture stays small.
"""

from __future__ import annotations

import argparse
import io
from pathlib import Path

from PIL import Image

from cell.check import check
from cell.config import DEFAULT_CASE, load_case
from cell.job import prepare
from cell.picture import picture

POSES = ((90, 180), (-45, 0))  # E1, E2, deg
VIEWS = ("cell", "torch")
WIDTH, HEIGHT = 1400, 900
LARGEST = 400_000  # bytes


def small(png: bytes) -> bytes:
    """The picture with 256 colours.

    Args:
        png: a PNG.

    Returns:
        A smaller one.
    """
    few = Image.open(io.BytesIO(png)).convert("RGB").quantize(256, dither=Image.Dither.FLOYDSTEINBERG)
    out = io.BytesIO()
    few.save(out, format="PNG", optimize=True)
    return out.getvalue()


def main() -> None:
    """Write them all."""
    parser = argparse.ArgumentParser(description="Make the pictures of the documents.")
    parser.add_argument("case", nargs="?", type=Path, default=DEFAULT_CASE)
    parser.add_argument("--out", type=Path, default=Path(__file__).resolve().parent / "pictures")
    args = parser.parse_args()
    case = load_case(args.case)
    job = prepare(case)
    args.out.mkdir(parents=True, exist_ok=True)
    for e1, e2 in POSES:
        result = check(job, e1, e2)
        for view in VIEWS:
            png = small(picture(result, width=WIDTH, height=HEIGHT, view=view))
            if len(png) > LARGEST:
                raise SystemExit(f"{view} at {e1}/{e2}: {len(png)} bytes are too many to commit")
            path = args.out / f"{case.title}_{e1}_{e2}_{view}.png"
            path.write_bytes(png)
            print(f"{path.name}: {'feasible' if result.feasible else 'infeasible'}, {len(png) // 1000} kB")


if __name__ == "__main__":
    main()
