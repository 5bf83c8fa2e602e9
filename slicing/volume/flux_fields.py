"""Fields without divergence that pass a surface and its offsets evenly, and such of divergence 1 that are zero on it.

    field = field_of(Cylinder((0.0, 0.0), 20.0))
    field.evenly(faces, slice(0, 1000))           # (1000,) flux of (x, y, 0) / rho² through the first faces
    field.volume_beyond(faces)                    # mm³ of the solid outside

For a plane the field is its normal, for surfaces of revolution (x, y, 0) / rho² about their axis, which passes a ring
of radius r evenly. A field of divergence 1 that is zero on the surface gives the volume: (rho² - r²) / (2 rho²)
(x, y, 0), or the height over a plane.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..mesh.solid import Floats, Ints
from ..surfaces.offset_families import ascending, mean_above
from ..surfaces.surfaces import Cone, Cylinder, Plane, Revolved, Round, Surface
from .solid_faces import SolidFaces


@dataclass(frozen=True)
class PlaneField:
    """The normal of a plane."""

    surface: Plane

    def evenly(self, faces: SolidFaces, part: slice) -> Floats:
        """Flux (c,) through some faces of the field that passes the plane evenly."""
        normals = faces.mesh.normals[part].T
        flux = 0.5 * self.surface.normal[0] * normals[0]
        for along, normal in zip(self.surface.normal[1:], normals[1:], strict=True):
            if along:
                flux += 0.5 * along * normal
        return flux

    def heights(self, faces: SolidFaces) -> Floats:
        """Heights (n,) of the vertices among the offsets of the plane (see `Plane.level`)."""
        x, y, z = (n * place for n, place in zip(self.surface.normal, faces.places, strict=True))
        x += y
        x += z
        return x

    def volume_beyond(self, faces: SolidFaces) -> float:
        """Volume of the solid on the outer side, mm³."""
        height = self.heights(faces) - self.surface.level
        above = faces.touching(height > 0)
        mean = mean_above(faces.of_corners(height, above))
        return float(0.5 * mean @ (faces.mesh.normals[above] @ np.asarray(self.surface.normal)))


@dataclass(frozen=True)
class AxisField:
    """The field (x, y, 0) / rho² about an axis, for any surface of revolution."""

    surface: Round

    def evenly(self, faces: SolidFaces, part: slice) -> Floats:
        """Flux (c,) through some faces of the field that passes the surface evenly."""
        normals = faces.mesh.normals[part].T
        x, y = (faces.centres[k][part] - self.surface.axis_point[k] for k in (0, 1))
        square = x * x
        square += y * y
        np.maximum(square, faces.on_axis, out=square)
        x *= normals[0]
        y *= normals[1]
        x += y
        x *= 0.5
        x /= square
        return x

    def heights(self, faces: SolidFaces) -> Floats:
        """Heights (n,) of the vertices among the offsets of the surface."""
        return self.surface.distance(faces.mesh.vertices) + self.surface.level

    def volume_beyond(self, faces: SolidFaces) -> float:
        """Volume of the solid on the outer side, mm³."""
        beyond, radius = self.may_lie_beyond(faces)
        rho2, flux = faces.about(self.surface.axis_point, beyond)
        out = rho2 > radius**2
        return float((0.5 * (1.0 - radius[out] ** 2 / rho2[out]) * flux[out]).sum())

    def may_lie_beyond(self, faces: SolidFaces) -> tuple[Ints, Floats]:
        """Faces (k,) whose centroids may lie outside, and the surface's radius (k,) at their heights."""
        return np.arange(len(faces.mesh.faces)), self.surface.radius_at(faces.centre_z)

    def may_lie_deeper(self, faces: SolidFaces, height: Floats, than_mm: float) -> Ints:
        """Faces (k,) that may reach deeper than a height, from the heights (n,) of the vertices over the surface."""
        centres, radii = faces.mesh.bounding_spheres
        return np.flatnonzero(self.surface.distance(centres) - radii < than_mm)


@dataclass(frozen=True)
class CylinderField(AxisField):
    """The same for a cylinder, where squared distances do."""

    surface: Cylinder

    def heights(self, faces: SolidFaces) -> Floats:
        """Heights (n,) of the vertices among the offsets of the surface."""
        return np.sqrt(faces.squares(self.surface.axis_point))

    def may_lie_beyond(self, faces: SolidFaces) -> tuple[Ints, Floats]:
        """Faces (k,) whose centroids may lie outside, and its radius (k,): none lies farther out than all corners."""
        beyond = faces.touching(faces.squares(self.surface.axis_point) > self.surface.radius**2)
        return beyond, np.full(len(beyond), self.surface.radius)

    def may_lie_deeper(self, faces: SolidFaces, height: Floats, than_mm: float) -> Ints:
        """Faces (k,) that may reach deeper than a height, from the heights (n,) of the vertices over the surface."""
        _, radii = faces.mesh.bounding_spheres
        near = faces.touching(self.surface.may_reach(height, than_mm, float(radii.max(initial=0.0))))
        lowest = ascending(faces.of_corners(height, near))[0]
        return near[self.surface.may_reach(lowest, than_mm, radii.take(near))]


ROUND_FIELDS: dict[type, Callable[[Any], AxisField]] = {Cylinder: CylinderField, Cone: AxisField, Revolved: AxisField}
FIELDS: dict[type, Callable[[Any], PlaneField | AxisField]] = {Plane: PlaneField, **ROUND_FIELDS}


def round_field_of(surface: Round) -> AxisField:
    """The field that passes a surface of revolution evenly.

    Args:
        surface: the surface.
    """
    return ROUND_FIELDS[type(surface)](surface)


def field_of(surface: Surface) -> PlaneField | AxisField:
    """The field that passes a surface evenly.

    Args:
        surface: the surface.
    """
    return FIELDS[type(surface)](surface)
