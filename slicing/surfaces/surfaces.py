"""The surfaces that layers lie on: planes, cylinders, cones and other surfaces of revolution about z.

All know their outward side; axes are parallel to z. The outward normal is the direction of deposition:
material is laid from the inside outward.

    body = Cylinder((0.0, 0.0), 20.0)
    body.distance(points)            # signed, mm, positive outside
    body.normals(points)             # unit, away from the axis

What a caller wants to know of a surface it asks the surface (`slicing.surfaces.offsets`): `is_flat`, `is_straight`,
`bends`, `ends`. Where another room does a thing in a way of its own on each kind, a table there names a function for
every kind; where most kinds do it alike, one function does it and those that differ are registered with it
(`functools.singledispatch`).
"""

from .cones import Cone
from .cylinders import Cylinder
from .planes import Plane
from .revolved_profiles import Revolved

__all__ = ["Cone", "Cylinder", "Plane", "Revolved", "Round", "Surface"]

Round = Cylinder | Cone | Revolved
Surface = Cylinder | Plane | Cone | Revolved
