"""Solids and tubes drawn into an image with hidden parts hidden: an orthographic depth buffer in numpy, for print.

    canvas = Raster(1600, 1200)
    canvas.triangles(corners, colour)          # (n, 3, 3) in pixels, z towards the eye
    canvas.tube(points, radius, colours)       # (k, 3), (k,) pixels, (k, 3)
    canvas.image                               # (1200, 1600, 3), 0 .. 1

Needs no OpenGL. x goes right, y down, z towards the eye, all in pixels.
"""

from __future__ import annotations

import numpy as np

from ik.chain import Floats

from ..arrays import Ints, repeat_with_index

LIGHT = np.array([-0.45, -0.65, 0.61])  # over the left shoulder
AMBIENT, SOLID = 0.45, 0.74  # light from everywhere, on tubes and on solids
RIM = 0.5  # how dark the edge of a tube is: neighbouring beads are distinguished by it
STRIPS = 8  # that the half of a tube which is seen is drawn in
SHORTEST = 3.0  # px: nearer points of a tube are taken for one
CORNER = np.cos(np.deg2rad(15.0))  # from here on the outside of a bend is rounded off
PIXELS_AT_ONCE = 1_000_000  # pixels looked at together


class Raster:
    """An image with a depth for every pixel."""

    def __init__(self, width: int, height: int) -> None:
        """An empty white one.

        Args:
            width: pixels.
            height: pixels.
        """
        self.width, self.height = width, height
        self.image = np.ones((height, width, 3), dtype=np.float32)
        self.depth = np.full((height, width), -np.inf, dtype=np.float32)

    def triangles(self, corners: Floats, colour: tuple[float, float, float]) -> None:
        """Draw triangles, lit by their own normals; those that face away are left out.

        Args:
            corners: (n, 3, 3).
            colour: of all of them.
        """
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        # y points down, so that a solid's outward faces turn clockwise here
        facing = normal[:, 2] < -1e-9
        corners, normal = corners[facing], -normal[facing]
        if not len(corners):
            return
        normal = normal / np.linalg.norm(normal, axis=1)[:, None]
        shade = SOLID + (1 - SOLID) * np.clip(normal @ LIGHT, 0.0, 1.0)
        rgb = np.clip(shade[:, None] * np.array(colour), 0.0, 1.0)
        self._filled(corners, np.repeat(rgb[:, None], 3, axis=1))

    def _filled(self, corners: Floats, rgb: Floats) -> None:
        """Triangles (n, 3, 3) with a colour at every corner, (n, 3, 3)."""
        # what is looked at is what they cover, and a row each that they may touch
        extent = np.ptp(corners[:, :, :2], axis=1)
        ends = np.cumsum(
            np.abs(_cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])) / 2 + extent[:, 1] + 2
        )
        for some in np.split(
            np.arange(len(corners)), np.searchsorted(ends, np.arange(PIXELS_AT_ONCE, ends[-1], PIXELS_AT_ONCE))
        ):
            if len(some):
                self._together(corners[some], rgb[some])

    def _together(self, corners: Floats, rgb: Floats) -> None:
        triangle, x, y = _covered(corners)
        a, b, c = (corners[triangle, k] for k in range(3))
        p = np.stack([x + 0.5, y + 0.5], axis=1)
        area = _cross(b - a, c - a)
        area = np.where(np.abs(area) < 1e-9, np.inf, area)
        u, v = _cross(c - b, p - b[:, :2]) / area, _cross(a - c, p - c[:, :2]) / area
        weights = np.clip(np.stack([u, v, 1.0 - u - v], axis=1), 0.0, 1.0)
        z = np.einsum("nk,nk->n", weights, corners[triangle, :, 2])
        self._put(np.stack([x, y], axis=1), z, np.einsum("nk,nkc->nc", weights, rgb[triangle]))

    def tube(self, points: Floats, radius: Floats, colours: Floats) -> None:
        """Draw a polyline as a tube.

        Args:
            points: its middle, (k, 3).
            radius: (k,).
            colours: (k, 3).
        """
        kept = _thinned(points)
        points, radius, colours = points[kept], radius[kept], colours[kept]
        if len(points) < 2:
            return
        along, bend = _directions(points)
        # across the way as it is seen, and out of it towards the eye
        across = np.stack([-along[:, 1], along[:, 0], np.zeros(len(along))], axis=1)
        across /= np.maximum(np.linalg.norm(across, axis=1), 1e-9)[:, None]
        out = np.cross(along, across)
        out *= np.where(out[:, 2:] < 0, -1.0, 1.0)
        angle = np.linspace(-np.pi / 2, np.pi / 2, STRIPS + 1)
        normal = np.sin(angle)[:, None, None] * across + np.cos(angle)[:, None, None] * out
        skin = points + radius[:, None] * normal
        rgb = _lit(colours, normal)
        a, b, c, d = ((i, j) for i in (slice(None, -1), slice(1, None)) for j in (slice(None, -1), slice(1, None)))
        for corners in ((a, b, c), (b, d, c)):
            self._filled(
                np.stack([skin[k] for k in corners], axis=2).reshape(-1, 3, 3),
                np.stack([rgb[k] for k in corners], axis=2).reshape(-1, 3, 3),
            )
        round_ = np.flatnonzero(bend < CORNER)
        self._discs(points[round_], radius[round_], colours[round_], int(np.ceil(2 * radius.max())) + 2)

    def _discs(self, middle: Floats, radius: Floats, rgb: Floats, size: int) -> None:
        """Spheres as they are seen."""
        offset = np.stack(np.meshgrid(np.arange(size), np.arange(size), indexing="ij"), axis=-1).reshape(-1, 2)
        pixel = np.floor(middle[:, None, :2] - size / 2 + 0.5).astype(np.int64) + offset
        d = (pixel + 0.5 - middle[:, None, :2]) / np.maximum(radius, 0.6)[:, None, None]
        out = np.einsum("ijk,ijk->ij", d, d)
        which = np.nonzero(out <= 1.0)
        d, up = d[which], np.sqrt(1.0 - out[which])
        normal = np.column_stack([d, up])
        z = middle[which[0], 2] + up * radius[which[0]]
        self._put(pixel[which], z, _lit(rgb[which[0]], normal))

    def _put(self, pixel: Ints, z: Floats, rgb: Floats) -> None:
        x, y = pixel[:, 0], pixel[:, 1]
        kept = (x >= 0) & (x < self.width) & (y >= 0) & (y < self.height)
        index, z, rgb = (y * self.width + x)[kept], z[kept].astype(np.float32), rgb[kept]
        depth, image = self.depth.ravel(), self.image.reshape(-1, 3)
        nearer = z > depth[index]
        index, z, rgb = index[nearer], z[nearer], rgb[nearer]
        # of those that share a pixel the nearest is written last
        order = np.lexsort((z, index))
        index, z, rgb = index[order], z[order], rgb[order]
        last = np.append(index[1:] != index[:-1], True) if len(index) else np.zeros(0, dtype=bool)
        depth[index[last]], image[index[last]] = z[last], rgb[last]


def _cross(a: Floats, b: Floats) -> Floats:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def _lit(colours: Floats, normal: Floats) -> Floats:
    """Colours of a tube's skin by its normals; dark at its edges."""
    light = np.clip(normal @ LIGHT, 0.0, 1.0)
    shade = (AMBIENT + (1 - AMBIENT) * light) * (RIM + (1 - RIM) * np.clip(1.6 * normal[..., 2], 0.0, 1.0))
    return np.clip(colours * shade[..., None] * 1.15, 0.0, 1.0)


def _thinned(points: Floats) -> Ints:
    """Which points of a polyline are kept: both ends, and between them those that are far enough apart."""
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    steps = np.floor(length / SHORTEST).astype(np.int64)
    kept = np.append(np.flatnonzero(np.diff(steps, prepend=-1)), len(points) - 1)
    return np.unique(kept)


def _directions(points: Floats) -> tuple[Floats, Floats]:
    """Unit directions along a polyline at its points, and the cosine of its bend there (ends count as bends)."""
    step = np.diff(points, axis=0)
    step /= np.maximum(np.linalg.norm(step, axis=1), 1e-9)[:, None]
    before, after = np.concatenate([step[:1], step]), np.concatenate([step, step[-1:]])
    along = before + after
    along /= np.maximum(np.linalg.norm(along, axis=1), 1e-9)[:, None]
    bend = np.einsum("ij,ij->i", before, after)
    bend[[0, -1]] = -1.0
    return along, bend


def _covered(corners: Floats) -> tuple[Ints, Ints, Ints]:
    """The pixels whose middles triangles (n, 3, 3) cover, row by row: triangle, x and y of each."""
    y = corners[:, :, 1]
    first = np.ceil(y.min(axis=1) - 0.5).astype(np.int64)
    rows = np.maximum(np.ceil(y.max(axis=1) - 0.5).astype(np.int64) - first, 0)
    triangle, within = repeat_with_index(rows)
    row = first[triangle] + within
    start, end = corners[triangle], np.roll(corners, -1, axis=1)[triangle]
    rise = end[..., 1] - start[..., 1]
    level = row[:, None] + 0.5
    with np.errstate(divide="ignore", invalid="ignore"):
        share = (level - start[..., 1]) / rise
    met = (rise != 0.0) & (share >= 0.0) & (share <= 1.0)
    x = start[..., 0] + np.where(met, share, 0.0) * (end[..., 0] - start[..., 0])
    left = np.ceil(np.where(met, x, np.inf).min(axis=1) - 0.5)
    right = np.ceil(np.where(met, x, -np.inf).max(axis=1) - 0.5)
    wide = np.where(met.any(axis=1), np.maximum(right - left, 0.0), 0.0).astype(np.int64)
    span, along = repeat_with_index(wide)
    return triangle[span], left[span].astype(np.int64) + along, row[span]
