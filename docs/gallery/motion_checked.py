"""A motion is written, read back and checked; then one axis is moved by half a degree and the check finds it.

`check_motion` knows nothing of the planner. It takes a motion from any source and checks joint limits, speeds,
singularities, collisions with the growing part, and the beads.
"""

import csv
from pathlib import Path

import trimesh

import cell

trimesh.creation.box(bounds=((15, -10, 30), (29, 10, 45))).export("boss.stl")
case = cell.parse_case(
    {
        "name": "boss",
        "part": {"sub_volumes": ["boss.stl"], "body": {"radius_mm": 20, "z_mm": [0, 80]}, "rotation_deg": 180},
        "support": {"radius_mm": 15, "height_mm": 120},
        "positioner": {"position_mm": [1550, 0, 0], "rotation_deg": [0, 0, -90]},
    }
)
job = cell.prepare(case)
result = cell.check(job, E1_deg=90, E2_deg=180)
cell.write_motion("ours.csv", result.motion)

with open("ours.csv") as file:
    rows = list(csv.DictReader(file))
for row in rows:
    row["A1_deg"] = f"{float(row['A1_deg']) + 0.5:.6f}"
with open("shifted.csv", "w", newline="") as file:
    writer = csv.DictWriter(file, list(rows[0]))
    writer.writeheader()
    writer.writerows(rows)

for name in ("ours.csv", "shifted.csv"):
    found = cell.check_motion(job, cell.read_motion(name, job))
    distance, row = found.bead_distance
    print(f"{name}: feasible {found.feasible}, TCP at most {1000 * distance:.3f} mm off the bead (row {row})")
    for finding in found.findings[:3]:
        print("  ", finding.reason, finding.detail)

Path("torch.png").write_bytes(cell.picture(result, view="torch", width=1200, height=800))
