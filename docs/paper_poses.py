"""Write docs/paper_poses.md: the verdicts at the paper's two table poses under different assumptions.

``python docs/paper_poses.py`` takes some minutes. Every figure is a whole check of the shipped propeller's blade
(motion, limits, singularities, collisions), at each placement of the positioner and each roll about the wire.
"""

from __future__ import annotations

from pathlib import Path

from cell import DEFAULT_CASE, Case, Result, check, load_case, prepare, with_changes
from cell.case.sections import Roll

POSES = ((-45.0, 0.0), (90.0, 180.0))
DISTANCES = (1400.0, 1475.0, 1550.0)
YAWS = (90.0, -90.0)
ROLLS = (60.0, 75.0, 90.0, 105.0, 120.0)

TEXT = """# The paper's two table poses

Lettori et al. (2024) tried the propeller's blade with the table at E1 = -45, E2 = 0 and found that the arm
could not reach all targets, because of singularities; at E1 = 90, E2 = 180 the whole path was free. The paper
does not give the position of the positioner, the direction of the blade on the table, or the roll about the wire
that its imported planes fixed. The shipped case assumes:

- the blade points along -x of the table (azimuth 180 degrees), so that it is deposited 45 degrees off upright
  at -45/0 and straight up at 90/180, which is the purpose of a tilting table;
- the positioner stands {x:g} mm in front of the arm, its frame turned by {yaw:g} degrees about z, so that it
  tilts across the arm's plane;
- the roll is fixed at {roll:g} degrees: the torch's neck lies across the part's axis.

The table below changes these assumptions one by one. It gives the number of feasible targets, of {n}, and
for each pose the reason of most others. `python docs/paper_poses.py` makes it from whole checks
(motion, joint limits, singularity margins, collisions with {clearance:g} mm of clearance). For a positioner
turned by -90 degrees the cell is the mirror image, and the rolls have the opposite sign.

"""

READING = """
**Result.** With the roll of the shipped case the computation gives the paper's two verdicts. They do not
follow from the table poses alone, though:

- with a free roll {free}:
  the paper's set-up did not use the freedom about the wire, because its planes fixed the roll;
- fixed between 75 and 120 degrees, the roll makes 90/180 infeasible as well, although hardly any target by itself is
  out of reach there: the wire swings by 59 degrees to either side over the blade's root and takes the arm through
  its wrist singularity. A check of single points does not find this.
"""


def main() -> None:
    """Check every combination and write the page."""
    base = load_case(DEFAULT_CASE)
    lines = ["| positioner | roll, deg | E1 = -45, E2 = 0 | E1 = 90, E2 = 180 |\n| --- | --- | --- | --- |\n"]
    free_ok: list[bool] = []
    for yaw in YAWS:
        for x in DISTANCES:
            place = {"position_mm": (x, 0.0, 0.0), "rotation_deg": (0.0, 0.0, yaw)}
            cell = with_changes(base, positioner=base.positioner.model_copy(update=place))
            where = f"{x:g} mm, turned {yaw:g}"
            for roll in (*ROLLS, None):
                signed = None if roll is None else roll * (1 if yaw > 0 else -1)
                results = results_of(cell, signed)
                if roll is None:
                    free_ok += [r.feasible for r in results]
                cells = " | ".join(in_short(r) for r in results)
                lines.append(f"| {where} | {'free' if signed is None else f'{signed:g}'} | {cells} |\n")
    n = len(prepare(base).targets)
    roll_deg = base.roll.fixed_deg if isinstance(base.roll, Roll) else None
    head = TEXT.format(
        x=base.positioner.position_mm[0],
        yaw=base.positioner.rotation_deg[2],
        roll=roll_deg if roll_deg is not None else float("nan"),
        n=n,
        clearance=base.checks.clearance_mm,
    )
    share = f"{sum(free_ok)} of the {len(free_ok)} combinations of placement and pose above are feasible"
    page = head + "".join(lines) + READING.format(free=share)
    Path(__file__).with_name("paper_poses.md").write_text(page, encoding="utf-8")


def results_of(cell: Case, roll: float | None) -> list[Result]:
    """The verdicts at the paper's two poses."""
    job = prepare(with_changes(cell, roll="free" if roll is None else Roll(fixed_deg=roll)))
    return [check(job, *pose) for pose in POSES]


def in_short(result: Result) -> str:
    """Targets reached, and what stops most of the others."""
    n = len(result.rows)
    if result.feasible:
        return f"all {n}"
    reason = max(result.reasons, key=lambda name: result.reasons[name])
    return f"{n - result.infeasible} ({reason.replace('_', ' ')} {result.reasons[reason]})"


if __name__ == "__main__":
    main()
