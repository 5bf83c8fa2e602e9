"""Tables whose axes are neither square nor crossing, composed into a cell with a small part."""

from __future__ import annotations

from pathlib import Path

from cell.job.job import Job

from ..jobs.boss_motion import boss_case, job_of

SKEW = """<mujoco model="skew"><compiler angle="degree" autolimits="true"/><worldbody><body name="pedestal">
<geom type="box" size="0.1 0.1 0.1" pos="0 0.6 0.1"/><body name="tilt" pos="0.02 0.01 0.4" euler="1 -2 3">
<joint name="E1" axis="0.05 -1 0.1" pos="0.01 0 0.03" range="-120 130"/>
<geom type="box" size="0.08 0.1 0.03" pos="0 0.25 0"/><body name="turn" pos="0.03 -0.02 0.01">
<joint name="E2" axis="0.1 -0.04 1" pos="0 0.02 0" {turn}/>
<geom name="plate" type="cylinder" size="0.15 0.01" pos="0 0 0.1"/><site name="table" pos="0 0 0.11" euler="0 2 30"/>
</body></body></body></worldbody>
<contact><exclude body1="pedestal" body2="tilt"/><exclude body1="tilt" body2="turn"/></contact></mujoco>"""


def skew_job(folder: Path, turn: str = 'range="-185 135"', **sections: object) -> Job:
    """A boss on such a table; ``turn`` is what E2's joint is written with."""
    (folder / "skew.xml").write_text(SKEW.format(turn=turn), encoding="utf-8")
    positioner = {"model": "skew.xml", "position_mm": [1500, 0, 0], "max_speed_deg_s": [100, 150]}
    content = {"positioner": positioner, "table": {}, "support": {"radius_mm": 15, "height_mm": 100}, **sections}
    return job_of(boss_case(folder, **content))
