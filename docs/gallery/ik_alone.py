"""Inverse kinematics by itself: where can the torch point straight down, and where is that proved impossible?

`ik` works on arrays in metres and radians and knows nothing of parts or cells. `certify` settles for each target
whether the arm reaches it at *any* roll about the wire, inside its joint limits and with its singularity margins.
What it calls unreachable is proved over the whole range of the roll; it is not a search that found nothing.

The map is a vertical section through the cell with one target in each field. Green is reached; the other colours show
the reason. Grey means undecided and does not occur here.
"""

import numpy as np
from PIL import Image

import cell
import ik

chain = cell.prepare(cell.load_case(cell.DEFAULT_CASE)).chain  # the shipped arm with its torch
x, z = np.meshgrid(np.linspace(0.2, 2.6, 121), np.linspace(2.4, -0.6, 151))
Ts = np.tile(np.eye(4), (x.size, 1, 1))
Ts[:, :3, :3] = np.diag([1.0, -1.0, -1.0])  # z of the TCP points down
Ts[:, 0, 3], Ts[:, 2, 3] = x.ravel(), z.ravel()

proof = ik.certify(chain, Ts, ik.RollWindow.free())
for name in ("reachable", "unreachable", "undecided"):
    print(f"{name}: {getattr(proof, name).sum()} of {x.size}")

COLOURS = {"unreachable": (196, 78, 82), "joint_limit": (221, 160, 60), "singular": (120, 100, 180)}
picture = np.full((x.size, 3), 150, dtype=np.uint8)
picture[proof.reachable] = 90, 170, 110
for cause, colour in COLOURS.items():
    picture[proof.unreachable & (proof.cause == cause)] = colour
    print(f"{cause}: {(proof.cause == cause).sum()}")
Image.fromarray(picture.reshape(*x.shape, 3)).resize((726, 906), Image.Resampling.NEAREST).save("reach.png")
