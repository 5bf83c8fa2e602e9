"""Make the pictures of the documents: parts in the cell, a collision, and the layers of the parts by strategy.

    python docs/make_pictures.py                     # writes docs/pictures/*.png
    python docs/make_pictures.py propeller layers    # some: propeller, collision, support, boiler, valve, layers

Needs no display (Debian: libegl1, libgl1-mesa-dri). Colours are reduced where a picture would be large. A part is
shown by its case in models/cases; where it has none, by the one below.
"""

from __future__ import annotations

import argparse
import io
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from PIL import Image

from cell import MODELS_DIR, Case, Result, check, load_case, parse_case, picture, prepare, slice_picture, with_changes
from cell.case.part_sections import Support
from cell.job.job import slice_part
from cell.job.part_input import read_part
from cell.view.camera import View
from cell.view.film import film
from cell.view.layer_picture import body_of

PICTURES = Path(__file__).resolve().parent / "pictures"
CASES = MODELS_DIR / "cases"
PARTS = ("propeller", "support", "boiler", "valve")
STRATEGIES = ("planar", "cylindrical", "nonuniform")
PROPELLER_POSES = ((90, 180), (-45, 0))  # E1, E2, deg
WIDE_SUPPORT_MM = 30.0  # the propeller's nozzle has no room beside it
WIDTH, HEIGHT = 1400, 900
FRAMES, FRAME = 6, 400  # of a strip, and their size in pixels
FILM, FILM_FPS, FILM_S = (480, 320), 8, 14  # of a film: pixels, frames a second, seconds
LAYERS_WIDTH, LAYERS_HEIGHT = 1000, 720
SMALL, LARGEST = 120_000, 250_000  # bytes: up to here nothing is done, beyond here nothing is taken
COLOURS = (256, 128, 64)
STANDING = {
    "positioner": {"position_mm": [1550, 0, 0], "rotation_deg": [0, 0, -90]},
    "table": {"E1_deg": 90, "E2_deg": 180},
    "sampling": {"chord_tolerance_mm": 2.5, "min_segment_mm": 20.0},
}
OTHERWISE = {
    "support": {"part": {"mesh": "../parts/support.stl", "rotation_deg": 90}, "support": {"radius_mm": 25}},
    "boiler": {"part": {"mesh": "../parts/boiler.stl", "rotation_deg": 90}, "support": {"radius_mm": 30}},
    "valve": {
        "part": {"mesh": "../parts/valve.stl", "rotation_deg": 180, "take": ["SV2"]},
        "support": {"radius_mm": 60},
    },
}


def small(png: bytes) -> bytes:
    """The picture with as many colours as fit into its size.

    Args:
        png: a PNG.

    Returns:
        A smaller one.
    """
    if len(png) <= SMALL:
        return png
    full = Image.open(io.BytesIO(png)).convert("RGB")
    for colours in COLOURS:
        out = io.BytesIO()
        # dithering would make noise of the even surfaces, and noise does not compress
        full.quantize(colours, dither=Image.Dither.NONE).save(out, format="PNG", optimize=True)
        if len(out.getvalue()) <= LARGEST:
            return out.getvalue()
    raise SystemExit(f"a picture of {len(out.getvalue())} bytes is too large to commit")


def case_of(part: str) -> Case:
    """The shipped case of a part, or one that shows it.

    Args:
        part: its name.

    Returns:
        The case.
    """
    path = CASES / f"{part}.case.yaml"
    if path.exists():
        return load_case(path)
    content = {"name": part, **STANDING, **OTHERWISE[part]}
    content["support"] = {**OTHERWISE[part]["support"], "height_mm": 120}
    return parse_case(content, path)


def seen(result: Result, name: str, views: tuple[View, ...] = ("cell", "torch")) -> Iterator[tuple[str, bytes]]:
    """Pictures of a result."""
    for view in views:
        yield f"{name}_{view}", picture(result, width=WIDTH, height=HEIGHT, view=view)


def pictures(what: str) -> Iterator[tuple[str, bytes]]:
    """The pictures of a part, of the collision, or of the layers.

    Args:
        what: propeller, propeller_indexed, support, boiler, boiler_coordinated, valve, collision or layers.

    Yields:
        Names and PNGs; of films names that end in .webp, and these.
    """
    if what == "layers":
        for part in PARTS:
            yield from layers(part)
    elif what == "collision":
        case = case_of("propeller")
        case = with_changes(case, support=Support(radius_mm=WIDE_SUPPORT_MM, height_mm=case.support.height_mm))
        yield from seen(check(prepare(case), 90, 180), "collision", ("torch",))
    elif what == "propeller_indexed":
        result = check(prepare(case_of(what)))
        yield f"{what}_torch", picture(result, width=WIDTH, height=HEIGHT, view="torch", target=600)
        yield f"{what}_strip", strip(result, range(len(result.poses)))
        yield f"{what}.webp", moving(result)
    elif what == "boiler_coordinated":
        # one round of the duct, halfway up
        result = check(prepare(case_of(what)))
        t = result.job.targets
        duct = np.flatnonzero(t.bead == t.bead[len(t) // 2])
        yield f"{what}_strip", strip(result, duct[np.linspace(0, len(duct) - 1, FRAMES).astype(int)].tolist())
        yield f"{what}.webp", moving(result)
    elif what == "propeller":
        job = prepare(case_of(what))
        for e1, e2 in PROPELLER_POSES:
            yield from seen(check(job, e1, e2), f"{what}_{e1}_{e2}")
    else:
        case = case_of(what)
        yield from seen(check(prepare(case), case.table.E1_deg, case.table.E2_deg), what)


def strip(result: Result, frames: Sequence[int]) -> bytes:
    """Stills of a run side by side, as a film shows them: at some targets, or in the middle of some groups of poses.

    Args:
        result: a feasible result.
        frames: targets; of an indexed run the numbers of groups, of which some are taken, evenly.

    Returns:
        A PNG.
    """
    targets = list(frames)
    if result.mode == "indexed":
        some = np.unique(np.linspace(0, len(targets) - 1, FRAMES).astype(int))
        targets = [(result.poses[k].first + result.poses[k].stop) // 2 for k in some.tolist()]
    shots = [
        Image.open(io.BytesIO(picture(result, width=FRAME, height=FRAME, view="torch", target=i))) for i in targets
    ]
    across = -(-len(shots) // 2)
    whole = Image.new("RGB", (across * FRAME, 2 * FRAME), "white")
    for k, shot in enumerate(shots):
        whole.paste(shot, (k % across * FRAME, k // across * FRAME))
    out = io.BytesIO()
    whole.save(out, format="PNG")
    return out.getvalue()


def moving(result: Result) -> bytes:
    """A film of a feasible result, in ``FILM_S``.

    Returns:
        An animated WebP, which browsers show like a picture.
    """
    assert result.motion is not None
    with TemporaryDirectory() as folder:
        path = Path(folder) / "film.gif"
        film(result, path, size=FILM, fps=FILM_FPS, speed=float(result.motion.t_s[-1]) / FILM_S, view="torch")
        with Image.open(path) as frames:
            out = io.BytesIO()
            frames.save(out, format="WEBP", save_all=True, quality=60, method=6)
    return out.getvalue()


def layers(part: str) -> Iterator[tuple[str, bytes]]:
    """The layers of a part under every strategy."""
    case = case_of(part)
    read = read_part(case)
    for strategy in STRATEGIES:
        changed = with_changes(case, slicing=replace(case.slicing, strategy=strategy))
        png = slice_picture(
            slice_part(changed, read),
            body_of(read),
            title=part,
            width=LAYERS_WIDTH,
            height=LAYERS_HEIGHT,
        )
        yield f"{part}_layers_{strategy}", png


def main() -> None:
    """Write them."""
    everything = ("layers", "propeller", "propeller_indexed", "boiler_coordinated", "collision", *PARTS[1:])
    parser = argparse.ArgumentParser(description="Make the pictures of the documents.")
    parser.add_argument("what", nargs="*", metavar="WHAT", help=f"which: {', '.join(everything)} (default: all)")
    parser.add_argument("--out", type=Path, default=PICTURES)
    args = parser.parse_args()
    unknown = set(args.what) - set(everything)
    if unknown:
        parser.error(f"{', '.join(sorted(unknown))}: is none of {', '.join(everything)}")
    args.out.mkdir(parents=True, exist_ok=True)
    for what in args.what or everything:
        for name, found in pictures(what):
            still = not name.endswith(".webp")
            path, few = args.out / (f"{name}.png" if still else name), small(found) if still else found
            path.write_bytes(few)
            print(f"{path.name}: {len(few) // 1000} kB", flush=True)


if __name__ == "__main__":
    main()
