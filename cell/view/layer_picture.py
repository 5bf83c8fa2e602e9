"""The layers of a part as a picture to print: light background, beads in colour, a bar that says what colours mean.

    png = slice_picture(sliced, body_mesh, title="support", colour="thickness", laid=laid)
    Path("support.png").write_bytes(png)

Drawn by ``cell.view.print_raster``, parallel projection, so that lengths can be compared; needs neither OpenGL nor a
display. Part frame, mm. Drawn are the beads that are laid, as thick as they are; where they are not given, the layers'
borders. What overhangs has a colour of its own.
"""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np

from ik.chain import Floats
from slicing import Bools, LaidSubVolume, Mesh, Overhang, SlicedSubVolume

from ..errors import InputError
from ..progress import phase
from .colours import DEPTH, HEAT, ramp
from .print_raster import Raster

if TYPE_CHECKING:
    from PIL import Image, ImageDraw, ImageFont

    from ..job.part_input import PartInput

By = Literal["thickness", "layer"]
BODY = (0.93, 0.94, 0.95)
THIN, THICK = (0.80, 0.10, 0.32), (0.98, 0.50, 0.10)  # outside of what the process allows
IN_THE_AIR = (0.05, 0.35, 0.95)  # overhanging
FINE_MM = 1.0  # spacing of points of beads that overhang
SAME_THICKNESS = 5e-3  # mm
INK, PALE = (40, 42, 46), (120, 124, 130)
DRAWN_LARGER = 2  # drawn that much larger and scaled down, against jagged edges
TURN, ELEVATION = 52.0, 30.0  # deg: the eye stands aside of where the sub-volumes point, and above
HEAD, FOOT, SIDE = 0.11, 0.10, 0.17  # of the picture's height, height and width: title, captions and bar
TICKS = 6
LEAST, MOST = 200, 8192


@dataclass(frozen=True, eq=False)
class _Scale:
    """Colours along a range of numbers, and one each for what is below and above it."""

    low: float
    high: float
    stops: Floats
    label: str
    below: bool = False  # whether there are such numbers
    above: bool = False
    hanging: bool = False  # whether some of it overhangs

    def colours(self, values: Floats) -> Floats:
        rgb = ramp(np.clip((values - self.low) / (self.high - self.low), 0.0, 1.0), self.stops)
        rgb[values < self.low - SAME_THICKNESS] = THIN
        rgb[values > self.high + SAME_THICKNESS] = THICK
        return rgb

    def ticks(self) -> list[float]:
        """Round numbers inside the range."""
        rough = (self.high - self.low) / TICKS
        power = 10.0 ** np.floor(np.log10(rough))
        step = float(next(m * power for m in (1, 2, 2.5, 5, 10) if m * power >= rough * 0.999))
        if self.label == "layer":
            step = max(1.0, float(np.ceil(step)))
        first = np.ceil(self.low / step - 1e-9)
        return [float(k * step) + 0.0 for k in np.arange(first, np.floor(self.high / step + 1e-9) + 1)]


@phase("drawing")
def slice_picture(
    sliced: Sequence[SlicedSubVolume],
    body_mesh: Mesh | None,
    *,
    title: str,
    colour: By = "thickness",
    width: int = 1400,
    height: int = 1000,
    laid: Sequence[LaidSubVolume] = (),
) -> bytes:
    """Draw the layers of a part.

    Args:
        sliced: its sub-volumes.
        body_mesh: what they stand on, light grey; None draws none.
        title: on top.
        colour: what colours mean: the thickness along every bead, or the number of the layer.
        width: pixels.
        height: pixels.
        laid: the sub-volumes' beads, in the same order; their layers' borders are drawn where left out.

    Returns:
        A PNG.

    Raises:
        InputError: no such colouring or size.
    """
    if colour not in get_args(By):
        raise InputError(f"colour {colour!r}: thickness or layer is needed")
    for name, value in (("width", width), ("height", height)):
        if not LEAST <= value <= MOST:
            raise InputError(f"{name} {value}: {LEAST} .. {MOST} pixels are allowed")
    beads = [_laid_beads(one) for one in laid] if laid else [_beads(s) for s in sliced]
    scale = _scale(sliced, beads, colour)
    picture = Raster(DRAWN_LARGER * width, DRAWN_LARGER * height)
    zoom = _draw(picture, sliced, beads, body_mesh, scale, colour)
    return _composed(picture, sliced, title, scale, zoom / DRAWN_LARGER, width, height)


def body_of(part: PartInput) -> Mesh | None:
    """The shape of a part's body: its own mesh, or its profile turned about its axis, or nothing.

    Args:
        part: from ``cell.job.part_input.read_part``.

    Returns:
        A mesh, mm.
    """
    if part.body_mesh is not None or part.profile is None:
        return part.body_mesh
    from slicing import solid_of_revolution

    body = part.round_body or part.bodies[0]
    return solid_of_revolution(body.axis_xy_mm, part.profile)


@dataclass(frozen=True, eq=False)
class _DrawnBead:
    """A bead to be drawn: layer, middles (k, 3) and thicknesses (k,), mm, and where it overhangs (k,)."""

    layer: int
    points: Floats
    thickness: Floats
    hanging: Bools


def _beads(s: SlicedSubVolume) -> list[_DrawnBead]:
    """The borders of a sub-volume's layers as beads."""
    return [
        _line(s, layer.index, np.concatenate([curve.points, curve.points[:1]]) if curve.closed else curve.points)
        for layer in s.layers
        for curve in layer.curves
    ]


def _laid_beads(laid: LaidSubVolume) -> list[_DrawnBead]:
    """The beads of a sub-volume."""
    found = []
    for bead in laid.beads:
        rows = [*range(len(bead.points)), 0] if bead.closed else list(range(len(bead.points)))
        points, gained = bead.points[rows], bead.gained_mm[rows]
        over = laid.overhangs[bead.layer] if laid.overhangs else None
        if over is not None and over.area_mm2 > 0.0:  # so fine that it is seen where it begins
            points, gained = _finer(points, gained)
        found.append(_line(laid.sliced, bead.layer, points, gained, over))
    return found


def _finer(points: Floats, gained: Floats) -> tuple[Floats, Floats]:
    """A line with points at most FINE_MM apart."""
    length = np.append(0.0, np.cumsum(np.sqrt((np.diff(points, axis=0) ** 2).sum(axis=1))))
    at = np.unique(np.concatenate([length, np.arange(0.0, length[-1], FINE_MM)]))
    return np.stack([np.interp(at, length, p) for p in points.T], axis=1), np.interp(at, length, gained)


def _line(
    s: SlicedSubVolume, layer: int, points: Floats, gained: Floats | float = 0.0, over: Overhang | None = None
) -> _DrawnBead:
    thickness = np.maximum(s.thickness_at(layer, points) + gained, 0.0)
    hanging = np.zeros(len(points), dtype=bool) if over is None else over.holds(points)
    middles = points + s.layers[layer].surface.normals(points) * thickness[:, None] / 2
    return _DrawnBead(layer, middles, thickness, hanging)


def _scale(sliced: Sequence[SlicedSubVolume], beads: Sequence[list[_DrawnBead]], colour: By) -> _Scale:
    hanging = any(bool(line.hanging.any()) for some in beads for line in some)
    if colour == "layer":
        last = float(max(1, *(len(s.layers) - 1 for s in sliced)))
        return _Scale(0.0, last, HEAT, "layer", hanging=hanging)
    values = np.concatenate([line.thickness for some in beads for line in some])
    # the bar is what the process allows: pictures of several strategies can be held side by side
    low, high = (f(getattr(s.parameters, key) for s in sliced) for f, key in ((min, "h_min_mm"), (max, "h_max_mm")))
    below, above = bool((values < low - SAME_THICKNESS).any()), bool((values > high + SAME_THICKNESS).any())
    return _Scale(low, high if high > low else low + 0.1, DEPTH, "thickness, mm", below, above, hanging)


def _draw(
    picture: Raster,
    sliced: Sequence[SlicedSubVolume],
    beads: Sequence[list[_DrawnBead]],
    body_mesh: Mesh | None,
    scale: _Scale,
    colour: By,
) -> float:
    """Draw body and beads; gives pixels a mm."""
    looks = _looks(sliced)
    every = np.concatenate(
        [line.points for some in beads for line in some] + ([] if body_mesh is None else [body_mesh.vertices])
    )
    seen = every @ looks[:2].T
    low, high = seen.min(axis=0), seen.max(axis=0)
    room = np.array([picture.width * (1 - SIDE - 0.04), picture.height * (1 - HEAD - FOOT)])
    zoom = float((room * 0.96 / np.maximum(high - low, 1e-6)).min())
    centre = np.array([picture.width * 0.02, picture.height * HEAD]) + room / 2

    def pixels(points: Floats) -> Floats:
        out = points @ looks.T * zoom
        out[..., :2] += centre - (low + high) / 2 * zoom
        return out

    if body_mesh is not None:
        picture.triangles(pixels(body_mesh.vertices[body_mesh.faces]), BODY)
    for some in beads:
        for line in some:
            value = line.thickness if colour == "thickness" else np.full(len(line.points), float(line.layer))
            rgb = scale.colours(value)
            rgb[line.hanging] = IN_THE_AIR
            picture.tube(pixels(line.points), line.thickness / 2 * zoom, rgb)
    return zoom


def _looks(sliced: Sequence[SlicedSubVolume]) -> Floats:
    """Rows: right, down, towards the eye; aside of where the sub-volumes point."""
    x, y = sliced[0].body.axis_xy_mm
    middles = np.array([s.mesh.vertices.mean(axis=0)[:2] - (x, y) for s in sliced])
    together = middles.mean(axis=0)
    # sub-volumes all round point nowhere
    somewhere = np.linalg.norm(together) > 0.2 * np.linalg.norm(middles, axis=1).max()
    points_to = np.degrees(np.arctan2(together[1], together[0])) if somewhere else -90.0
    a, e = np.deg2rad([points_to + TURN, ELEVATION])
    eye = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    right = np.array([-np.sin(a), np.cos(a), 0.0])
    return np.stack([right, -np.cross(eye, right), eye])


def _composed(
    picture: Raster, sliced: Sequence[SlicedSubVolume], title: str, scale: _Scale, zoom: float, width: int, height: int
) -> bytes:
    """Scale down, add the words."""
    from PIL import Image, ImageDraw

    pixels = np.rint(picture.image * 255).astype(np.uint8)
    image = Image.fromarray(pixels).resize((width, height), Image.Resampling.BOX)
    draw = ImageDraw.Draw(image)
    size = height / 1000
    draw.text((0.03 * width, 0.025 * height), title, INK, _font(34 * size))
    parts = [f"{s.name}: {len(s.layers)} layers, {_range(s)}" for s in sliced]
    said = f"{sliced[0].strategy}    " + "    ".join(parts[:4]) + ("    ..." if len(parts) > 4 else "")
    draw.text((0.03 * width, 0.07 * height), said, PALE, _font(22 * size))
    _ruler(draw, zoom, width, height, size)
    _bar(image, draw, scale, width, height, size)
    out = io.BytesIO()
    image.save(out, format="PNG", optimize=True)
    return out.getvalue()


def _range(s: SlicedSubVolume) -> str:
    low, high = min(x.thickness_mm[0] for x in s.layers), max(x.thickness_mm[1] for x in s.layers)
    return f"{low:.2f} mm thick" if high - low < 5e-3 else f"{low:.2f} .. {high:.2f} mm thick"


def _ruler(draw: ImageDraw.ImageDraw, zoom: float, width: int, height: int, size: float) -> None:
    """A length to compare with, bottom left."""
    mm = next(v for v in (100.0, 50.0, 20.0, 10.0, 5.0, 2.0, 1.0, 0.5, 0.0) if v * zoom <= 0.25 * width)
    x, y = 0.03 * width, 0.95 * height
    draw.line([(x, y), (x + mm * zoom, y)], INK, max(2, round(4 * size)))
    draw.text((x, y - 34 * size), f"{mm:g} mm", INK, _font(22 * size))


def _bar(image: Image.Image, draw: ImageDraw.ImageDraw, scale: _Scale, width: int, height: int, size: float) -> None:
    from PIL import Image

    x, top, bottom = round(0.875 * width), round(0.2 * height), round(0.85 * height)
    wide = max(8, round(26 * size))
    values = np.linspace(scale.high, scale.low, bottom - top)
    strip = np.rint(scale.colours(values) * 255).astype(np.uint8)
    image.paste(Image.fromarray(np.repeat(strip[:, None], wide, axis=1)), (x, top))
    draw.rectangle([x, top, x + wide, bottom], outline=PALE)
    draw.text((x, top - 84 * size), scale.label, INK, _font(22 * size))
    for value in scale.ticks():
        y = bottom - (value - scale.low) / (scale.high - scale.low) * (bottom - top)
        draw.line([(x + wide, y), (x + wide + 8 * size, y)], PALE, max(1, round(2 * size)))
        said = f"{value:g}" if scale.label == "layer" else f"{value:.2f}"
        draw.text((x + wide + 14 * size, y), said, INK, _font(22 * size), anchor="lm")
    for there, y, colour, said in (
        (scale.below, bottom + 14 * size, THIN, f"< {scale.low:.2f}"),
        (scale.above, top - 14 * size - wide, THICK, f"> {scale.high:.2f}"),
        (scale.hanging, bottom + 54 * size, IN_THE_AIR, "overhanging"),
    ):
        if there:
            draw.rectangle([x, y, x + wide, y + wide], fill=tuple(round(255 * v) for v in colour), outline=PALE)
            draw.text((x + wide + 14 * size, y + wide / 2), said, INK, _font(22 * size), anchor="lm")


def _font(size: float) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    from PIL import ImageFont

    return ImageFont.load_default(max(8.0, size))
