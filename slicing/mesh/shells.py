"""One solid of the shells of a mesh: which is inside out, which is a cavity, which overlap, and what cannot be decided.

    mesh = one_solid(mesh)

A point belongs to the solid where the shells wind round it at least once, and no point may lie where they wind less
than not at all. From this follows, from the outermost shell inward:

- a shell that lies in no material must face outward; one that does not is turned, with all that lies within it;
- a shell within material is a *cavity* if it faces inward. If it faces outward it adds nothing and is dropped, which
  is reported: it may have been meant as a cavity;
- within a shell that had to be turned, a shell that then faces outward may be either: refused;
- shells that overlap are united (manifold3d), if the result agrees with the winding numbers of the shells it came from;
- faces of one shell that cross, or a cavity that breaks out of its shell, leave no definite solid: refused,
  with a place. Crossings no deeper than SHALLOW_MM move no curve by more than its tolerance: said
  and left.

Shells without volume (a sheet with two sides) are dropped. Shells that only touch are left as they are.

Source: winding numbers of points, Jacobson, Kavan, Sorkine-Hornung 2013, equation 5.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from .closing import repaired
from .components import components
from .folds import unfolded
from .manifold import manifold_of, triangles_of
from .mesh_edges import MeshEdges
from .self_crossings import Crossings, crossings
from .solid import Bools, Floats, Ints, Mesh, PartError, mesh_from_arrays

SHALLOW_MM = 0.01  # the tolerance of curves
FLAT_VOLUME = 1e-12  # of its extent cubed: a shell of less volume is a sheet
SAME_VOLUME = 1e-6  # shells whose union is as large as they are together do not overlap
MOST_ANGLES = 20_000_000  # solid angles in a check by winding numbers
SEED = 20240901


def one_solid(mesh: Mesh) -> Mesh:
    """A mesh whose shells bound one solid, none crossing another.

    Args:
        mesh: closed and oriented, shell by shell; a shell may be inside out.

    Returns:
        The same mesh where nothing was wrong, else the repaired one, what was done added to its warnings.

    Raises:
        PartError: crossing faces, no volume, or shells of which it is not clear what is solid; one line.
    """
    mesh = unfolded(mesh)
    reach = max(4.0 * mesh.noise_mm, 1e-9 * float(np.ptp(mesh.bounds, axis=0).max()))
    crossing = crossings(mesh.vertices, mesh.faces, reach)
    label, count = shell_labels(mesh)
    lines = _crossing_lines(mesh, crossing, label)
    shells = _Shells(mesh, label, count)
    if not shells.solid.any():
        raise PartError(f"{mesh.name}: the mesh encloses no volume; a solid is needed")
    if count == 1:
        return _alone(mesh, lines)
    sign, kept = shells.settled(crossing, lines)
    turned = sign != shells.sign
    faces = np.where(turned[label][:, None], mesh.faces[:, ::-1], mesh.faces)[kept[label]]
    if (kept & (sign > 0)).sum() > 1:
        apart = label[crossing.pairs]
        cross = bool((apart[:, 0] != apart[:, 1]).any())
        united = _united(mesh, faces, label[kept[label]], sign, cross, lines)
        if united is not None:
            return united
    if not lines:
        return mesh
    if turned.any() or not kept.all():
        used, faces = np.unique(faces, return_inverse=True)
        mesh = replace(mesh, vertices=mesh.vertices[used], faces=faces.reshape(-1, 3).astype(np.int64))
    return replace(mesh, warnings=(*mesh.warnings, *lines))


def _alone(mesh: Mesh, lines: list[str]) -> Mesh:
    """A mesh of one shell, facing outward."""
    if mesh.volume < 0:
        lines.append(repaired(f"{mesh.name}: turned the mesh, which was inside out ({-mesh.volume:.6g} mm³)"))
        mesh = replace(mesh, faces=np.ascontiguousarray(mesh.faces[:, ::-1]))
    return replace(mesh, warnings=(*mesh.warnings, *lines)) if lines else mesh


def shell_labels(mesh: Mesh) -> tuple[Ints, int]:
    """Which shell each face (m,) belongs to, and how many there are; shells that touch at a vertex are two."""
    one, other = MeshEdges.of(len(mesh.vertices), mesh.faces).pairs().T // 3
    count, label = components(len(mesh.faces), one, other)
    return label, count


def winding_numbers(points: Floats, triangles: Floats) -> Floats:
    """How often triangles wind round points.

    Args:
        points: (n, 3) mm.
        triangles: (m, 3, 3) corners of closed, oriented shells.

    Returns:
        (n,): 1 inside a shell that faces outward, 0 outside, -1 inside one that faces inward.
    """
    total = np.zeros(len(points))
    for k, point in enumerate(points):
        a, b, c = (triangles[:, i] - point for i in range(3))
        la, lb, lc = (np.sqrt((v * v).sum(axis=1)) for v in (a, b, c))
        volume = (a * np.cross(b, c)).sum(axis=1)
        below = la * lb * lc + (a * b).sum(axis=1) * lc + (b * c).sum(axis=1) * la + (c * a).sum(axis=1) * lb
        total[k] = np.arctan2(volume, below).sum() / (2.0 * np.pi)
    return total


def _place(point: Floats) -> str:
    return f"({', '.join(f'{v:.3f}' for v in point)}) mm"


def _crossing_lines(mesh: Mesh, found: Crossings, label: Ints) -> list[str]:
    """Refuse deep crossings within a shell; a line about shallow ones."""
    within = label[found.pairs[:, 0]] == label[found.pairs[:, 1]]
    depth, points = found.depth_mm[within], found.points[within]
    if len(depth) == 0:
        return []
    worst = int(np.argmax(depth))
    said = f"{len(depth)} pair{'s' if len(depth) > 1 else ''} of faces cross, up to {depth[worst]:.2g} mm deep"
    if depth[worst] > SHALLOW_MM:
        raise PartError(
            f"{mesh.name}: {said}, at {_place(points[worst])}; a solid whose faces do not cross each other is needed"
        )
    return [repaired(f"{mesh.name}: {said}, at {_place(points[worst])}; they were left as they are")]


class _Shells:
    """The shells of a mesh: volumes, boxes, and which lies within which."""

    def __init__(self, mesh: Mesh, label: Ints, count: int) -> None:
        self.mesh, self.label, self.count = mesh, label, count
        origin = mesh.vertices.mean(axis=0)
        a, b, c = (mesh.vertices[mesh.faces[:, k]] - origin for k in range(3))
        self.volume = np.bincount(label, weights=(a * np.cross(b, c)).sum(axis=1) / 6.0, minlength=count)
        self.sign = np.where(self.volume < 0, -1, 1)
        self._order = np.argsort(label, kind="stable")
        self._first = np.searchsorted(label[self._order], np.arange(count + 1))
        corners = mesh.vertices[mesh.faces[self._order]]
        self.low = np.minimum.reduceat(corners.min(axis=1), self._first[:-1])
        self.high = np.maximum.reduceat(corners.max(axis=1), self._first[:-1])
        self.solid = np.asarray(np.abs(self.volume) > FLAT_VOLUME * (self.high - self.low).max(axis=1) ** 3)

    def triangles(self, shell: int) -> Floats:
        """Corners (k, 3, 3) of a shell's faces."""
        rows = self._order[self._first[shell] : self._first[shell + 1]]
        return self.mesh.vertices[self.mesh.faces[rows]]

    def _around(self, shell: int, others: list[int]) -> list[int]:
        """Those of other shells that a shell lies in: most of three of its points do."""
        corners = self.triangles(shell)
        points = corners[[0, len(corners) // 3, 2 * len(corners) // 3]].mean(axis=1)
        inside = []
        for other in others:
            if (self.low[other] <= self.low[shell]).all() and (self.high[other] >= self.high[shell]).all():
                turns = np.abs(winding_numbers(points, self.triangles(other)))
                if np.median(turns) > 0.75:
                    inside.append(other)
        return inside

    def settled(self, crossing: Crossings, lines: list[str]) -> tuple[Ints, Bools]:
        """How each shell must face (1 outward, -1 inward), and which count; lines for what was done.

        Raises:
            PartError: it is not clear.
        """
        name, kept = self.mesh.name, self.solid
        if not kept.all():
            lost = float(np.abs(self.volume[~kept]).sum())
            dropped = int((~kept).sum())
            shells = f"{dropped} shell{'s' * (dropped != 1)}"
            lines.append(repaired(f"{name}: dropped {shells} without volume ({lost:.2g} mm³)"))
        sign = self.sign.copy()
        if (sign[kept] > 0).all():
            return sign, kept
        turned, inner, outer, sticks_out = (np.zeros(self.count, dtype=bool) for _ in range(4))
        apart = self.label[crossing.pairs]
        sticks_out[apart[apart[:, 0] != apart[:, 1]]] = True  # what crosses another is in it with a part only: united
        larger: list[int] = []
        for shell in np.argsort(-np.abs(self.volume), kind="stable").tolist():
            if not kept[shell]:
                continue
            around = self._around(shell, larger)
            larger.append(shell)
            if turned[around].sum() % 2:
                sign[shell] *= -1
            outside = int(sign[around].sum())
            outer[shell] = not around
            if outside == 0 and sign[shell] < 0:
                sign[shell], turned[shell] = 1, True
            elif turned[around].any() and outside > 0 and sign[shell] > 0:
                raise self._undecided("two shells, one within the other, both face inward", shell)
            inner[shell] = outside > 0 and outside + sign[shell] > 0 and not sticks_out[shell]
            self._refuse_torn(shell, around, sign, turned, crossing)
        if turned.any():
            was, now = float(self.volume[kept].sum()), float((np.abs(self.volume) * sign)[kept].sum())
            many = (
                "the mesh, which was" if (turned == outer).all() else f"{turned.sum()} of {kept.sum()} shells that were"
            )
            lines.append(repaired(f"{name}: turned {many} inside out ({was:.6g} mm³ before, {now:.6g} mm³ now)"))
        if inner.any():
            lines.append(_inner_line(name, int(inner.sum()), float(np.abs(self.volume[inner]).sum())))
        return sign, kept & ~inner

    def _undecided(self, what: str, shell: int) -> PartError:
        at = _place(self.triangles(shell)[0].mean(axis=0))
        return PartError(f"{self.mesh.name}: {what} (one of them at {at}); whether one is a cavity is not clear")

    def _refuse_torn(self, shell: int, around: list[int], sign: Ints, turned: Bools, crossing: Crossings) -> None:
        """Refuse a shell that crosses a larger one if one of them would be a cavity, or only one had to be turned."""
        label = self.label[crossing.pairs[crossing.depth_mm > SHALLOW_MM]]
        others = np.unique(label[(label == shell).any(axis=1)])
        for other in others[np.abs(self.volume[others]) > abs(self.volume[shell])].tolist():
            if (sign[shell] < 0 and other in around) or turned[shell] != turned[other]:
                raise self._undecided("two shells cross and one of them faces inward", shell)


def _inner_line(name: str, count: int, volume: float) -> str:
    return repaired(
        f"{name}: dropped {count} shell{'s' if count > 1 else ''} that face{'s' if count == 1 else ''} "
        "outward within the"
        f" material of others (a cavity must face inward); the others hold these {volume:.6g} mm³ already"
    )


def _united(mesh: Mesh, faces: Ints, label: Ints, sign: Ints, cross: bool, lines: list[str]) -> Mesh | None:
    """The union of shells that overlap.

    None if none do: none `cross`, none lies within another, and together they are as large as one by one.

    Raises:
        PartError: the union does not agree with the winding numbers.
    """
    import manifold3d

    solids = _solids(mesh, faces, label, sign)
    boxes = np.array([solid.bounding_box() for solid in solids])
    meet = [
        ((boxes[k + 1 :, :3] <= boxes[k, 3:]) & (boxes[k + 1 :, 3:] >= boxes[k, :3])).all(axis=1).any()
        for k in range(len(boxes))
    ]
    if not any(meet):
        return None
    union = manifold3d.Manifold.batch_boolean(solids, manifold3d.OpType.Add)
    apart, together = sum(solid.volume() for solid in solids), union.volume()
    area = sum(solid.surface_area() for solid in solids)
    data = union.to_mesh64()
    # a shell within another leaves no face, however small it is against the rounding of those that merely touch
    left = np.asarray(data.run_original_id)[np.diff(data.run_index) > 0]
    inner = [solid for solid in solids if solid.original_id() not in left]
    if not (cross or inner) and apart - together <= max(SAME_VOLUME * apart, 4.0 * mesh.noise_mm * area):
        return None
    vertices, triangles = triangles_of(union)
    _require_same_inside(mesh, faces, vertices[triangles])
    detail = f"{apart:.6g} mm³ with overlaps counted twice, {together:.6g} mm³ as one solid"
    lines.append(repaired(f"{mesh.name}: united {len(solids)} shells that overlap ({detail})"))
    if inner:
        lines.append(_inner_line(mesh.name, len(inner), float(sum(solid.volume() for solid in inner))))
    made = mesh_from_arrays(mesh.name, vertices, triangles, mesh.noise_mm)
    return replace(made, warnings=(*mesh.warnings, *lines))


def _solids(mesh: Mesh, faces: Ints, label: Ints, sign: Ints) -> list[Any]:
    """A manifold3d solid of each shell that faces outward, with the cavities in it."""
    shells = {int(s): faces[label == s] for s in np.unique(label)}
    owner = {s: [own] for s, own in shells.items() if sign[s] > 0}
    boxes = {s: (mesh.vertices[own].min(axis=(0, 1)), mesh.vertices[own].max(axis=(0, 1))) for s, own in shells.items()}
    for s, own in shells.items():
        if sign[s] > 0:
            continue
        point = mesh.vertices[own[:1]].mean(axis=1)
        around = [
            t
            for t in owner
            if (boxes[t][0] <= boxes[s][0]).all()
            and (boxes[t][1] >= boxes[s][1]).all()
            and winding_numbers(point, mesh.vertices[shells[t]])[0] > 0.75
        ]
        if not around:
            raise PartError(f"{mesh.name}: a cavity at {_place(point[0])} does not lie in a shell that faces outward")
        owner[min(around, key=lambda t: float(np.prod(boxes[t][1] - boxes[t][0])))].append(own)
    solids = []
    for parts in owner.values():
        used, triangles = np.unique(np.concatenate(parts), return_inverse=True)
        solids.append(manifold_of(mesh.vertices[used], triangles.reshape(-1, 3), mesh.name).as_original())
    return solids


def _require_same_inside(mesh: Mesh, faces: Ints, union: Floats) -> None:
    """Hold a union against the shells it was made of, by winding numbers at random points."""
    before = mesh.vertices[faces]
    count = int(np.clip(MOST_ANGLES // (len(before) + len(union)), 12, 400))
    points = np.random.default_rng(SEED).uniform(mesh.bounds[0], mesh.bounds[1], (count, 3))
    was, is_ = winding_numbers(points, before) > 0.5, winding_numbers(points, union) > 0.5
    if (was != is_).any():
        bad = points[int(np.argmax(was != is_))]
        raise PartError(f"{mesh.name}: shells overlap in a way that could not be united, at {_place(bad)}")
