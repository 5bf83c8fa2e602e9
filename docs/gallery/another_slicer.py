"""A toolpath of another slicer is welded: a thread that climbs round a quarter of a shaft.

The file has a row for each target, in order, with the deposition direction. `prepare` takes the toolpath instead of
meshes to slice. Verdict, motion and pictures then work as for any other part.
"""

from pathlib import Path

import numpy as np

import cell
import slicing

angle = np.radians(np.linspace(-45, 45, 40))
rows = ["bead,layer,x_mm,y_mm,z_mm,nx,ny,nz,thickness_mm"]
for layer in range(4):
    for a in angle:
        c, s, z = np.cos(a), np.sin(a), 50 + 10 * np.degrees(a) / 45
        rows.append(
            f"{layer},{layer},{(25 + 2 * layer) * c:.4f},{(25 + 2 * layer) * s:.4f},{z:.4f},{c:.6f},{s:.6f},0,2"
        )
Path("thread.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")

case = cell.parse_case(
    {
        "name": "thread",
        "part": {"toolpath": "thread.csv", "body": {"radius_mm": 25, "z_mm": [0, 100]}, "rotation_deg": 180},
        "support": {"radius_mm": 20, "height_mm": 120},
        "positioner": {"position_mm": [1550, 0, 0], "rotation_deg": [0, 0, -90]},
    }
)
path = slicing.read_toolpath("thread.csv", width_mm=5)
result = cell.check(cell.prepare(case, toolpath=path), E1_deg=90, E2_deg=180)

print("feasible" if result.feasible else f"infeasible: {result.reasons}")
print(f"{len(path.targets)} targets, {result.motion.t_s[-1]:.0f} s")
for warning in result.warnings:
    print("warning:", warning)
Path("torch.png").write_bytes(cell.picture(result, view="torch", width=1200, height=800))
