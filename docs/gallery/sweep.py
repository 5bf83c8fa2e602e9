"""Every table pose of a grid gets the verdict of a check, and the best pose is named.

A pose at which some target is proved out of reach is settled in a few milliseconds, without a search. The others get a
whole check. `processes` is the number of processes.
"""

from pathlib import Path

import cell

case = cell.load_case(cell.DEFAULT_CASE)
poses = cell.grid(case, e1="0:90:90", e2="-180:90:90")
rows = cell.sweep(case, poses, processes=1)
document = cell.sweep_document(case, rows)

best = document["best"]
print(f"{sum(row['verdict'] == 'feasible' for row in rows)} of {len(rows)} poses are feasible")
print(f"best: E1 = {best['E1_deg']:g}, E2 = {best['E2_deg']:g}; clearance {best['least_clearance_mm']:.1f} mm")
Path("map.png").write_bytes(cell.sweep_picture(document))
