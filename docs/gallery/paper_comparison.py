"""The propeller of Lettori et al. (2024) is sliced by the paper's three strategies.

`compare_paper` slices a part of the paper and puts its indices beside the paper's own: layers NL, adhesion area A,
targets NV and top angle R, with the total score F. The page below the code shows all figures.
"""

from pathlib import Path

import cell
import slicing

found = cell.compare_paper(["propeller"])
document = cell.compare_document("propeller", found)
for sub_volume in document["sub_volumes"]:
    print(sub_volume["name"], "best:", sub_volume["best"])
Path("comparison.html").write_text(cell.html_compare(document), encoding="utf-8")

# what the three look like
parts = cell.MODELS_DIR / "parts"
blade, hub = slicing.load(parts / "propeller_blade.stl"), slicing.load(parts / "propeller_hub.stl")
for strategy in ("planar", "cylindrical", "nonuniform"):
    sliced = slicing.slice(blade, slicing.CylindricalBody(radius_mm=9.7), strategy)
    Path(f"{strategy}.png").write_bytes(cell.slice_picture([sliced], hub, title=strategy, width=900, height=650))
