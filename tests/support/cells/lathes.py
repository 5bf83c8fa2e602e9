"""A positioner with one level axis, as a welding rotator: the part lies and turns about its own axis."""

from __future__ import annotations

from pathlib import Path

import trimesh

from cell.job.job import Job

from ..jobs.boss_motion import boss_case, job_of

LATHE = """<mujoco model="lathe"><compiler angle="degree" autolimits="true"/><worldbody><body name="headstock">
<geom type="box" size="0.1 0.1 0.45" pos="0 0.25 0.45"/><body name="spindle" pos="0 0.13 0.8">
<joint name="E1" axis="0 -1 0" {turn}/><geom type="cylinder" size="0.1 0.01" pos="0 -0.01 0" euler="90 0 0"/>
<site name="table" pos="0 -0.02 0" euler="90 0 0"/></body></body></worldbody>
<contact><exclude body1="headstock" body2="spindle"/></contact></mujoco>"""


def ring_part(folder: Path, radius_mm: float = 20.0, high_mm: float = 2.2, wide_mm: float = 5.0) -> dict[str, object]:
    """A flange of one layer and one bead right round a shaft: the section ``part`` of a case."""
    ring = trimesh.creation.annulus(radius_mm, radius_mm + high_mm, wide_mm, sections=96)
    ring.apply_translation([0, 0, 20])
    ring.export(folder / "ring.stl")
    return {"sub_volumes": ["ring.stl"], "body": {"radius_mm": radius_mm, "z_mm": [0, 40]}}


def lathe_job(folder: Path, turn: str = "", **sections: object) -> Job:
    """A part on a rotator, prepared; ``turn`` is what its joint is written with: without a range it is endless."""
    (folder / "lathe.xml").write_text(LATHE.format(turn=turn), encoding="utf-8")
    positioner = {"model": "lathe.xml", "joints": ["E1"], "position_mm": [1300, 0, 0], "max_speed_deg_s": [100]}
    content = {"positioner": positioner, "support": {"radius_mm": 15, "height_mm": 150}, **sections}
    return job_of(boss_case(folder, **content))
