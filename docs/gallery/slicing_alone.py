"""Slicing by itself: a mesh becomes layers, beads and targets, without a robot.

`slicing` works in the part's frame in millimetres: z is the axis of the round body. `slicing.decompose` divides the
mesh of a whole part into its body and sub-volumes; here the boss is a mesh of its own on a shaft of 20 mm radius.
"""

from pathlib import Path

import trimesh

import cell
import slicing

boss = trimesh.creation.cylinder(radius=12, height=40, sections=96)
boss.apply_transform(trimesh.transformations.rotation_matrix(3.14159265 / 2, (0, 1, 0)))
boss.apply_translation((30, 0, 40))  # from inside the shaft outward
boss.export("boss.stl")

mesh = slicing.load("boss.stl", units="mm")
sliced = slicing.slice(mesh, slicing.CylindricalBody(radius_mm=20), strategy="nonuniform", h_layer_mm=2)
path = slicing.lay([sliced], pattern="contour_parallel", width_mm=5)

targets = path.targets
print(f"{len(sliced.layers)} layers, {targets.bead.max() + 1} beads, {len(targets)} targets")
print("first target, mm:", targets.position[0].round(2), "laid along", targets.normal[0].round(2))
Path("layers.png").write_bytes(cell.slice_picture([sliced], None, title="boss", colour="layer", width=1000, height=750))
