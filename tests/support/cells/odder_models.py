"""More of what other people write in MJCF, put into the arms, torches and tables of ``support/cells/odd_models.py``.

sections = odder_models(rng, folder)     # as odd_models: what a case says of them, their files written

A track under the arm, cables of balls, fingers that follow one another, closed chains that nobody plans, tendons,
shapes fitted to meshes under either rule, mirrored meshes, attached models in other angles, shapes that only a contact
pair names, tilted axes, lifts, necks bent up to a right angle, long wires, sheets of a hundredth of a millimetre.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .odd_models import HOME, Writer, arm_text, table_text, text

HEAVY = '<inertial pos="0 0 0" mass="1" diaginertia=".1 .1 .1"/>'
KINDS = ("box", "capsule", "cylinder", "ellipsoid", "sphere")


class More:
    """A model's text, to which more is added."""

    def __init__(self, rng, folder: Path, model: str, name: str) -> None:
        self.rng, self.folder, self.model, self.name = rng, folder, model, name

    def chance(self, p: float) -> bool:
        return bool(self.rng.random() < p)

    def put(self, more: str, before: str) -> None:
        assert before in self.model, before
        self.model = self.model.replace(before, more + before, 1)

    def asset(self, more: str) -> None:
        self.put(more, "</asset>")

    def end(self, more: str) -> None:
        self.put(more, "</mujoco>")

    def fitted(self, at) -> str:
        """A shape fitted to a mesh, which may be mirrored."""
        corners = self.rng.normal(size=(10, 3)) * self.rng.uniform(0.008, 0.02, 3)
        sides = self.rng.choice([-1, 1], 3)
        mesh = f"{self.name}fit"
        self.asset(
            f'<mesh name="{mesh}" vertex="{text(corners)}" scale="{text(sides)}" '
            f'refpos="{text(self.rng.uniform(-0.1, 0.1, 3))}" refquat="{text(self.rng.normal(size=4))}"/>'
        )
        if self.chance(0.5):
            self.model = self.model.replace("<compiler ", '<compiler fitaabb="true" ', 1)
        kind = KINDS[self.rng.integers(len(KINDS))]
        return f'<geom type="{kind}" mesh="{mesh}" fitscale="{self.rng.uniform(0.8, 1.2):.3f}" pos="{text(at)}"/>'

    def mirrored(self, at) -> str:
        """A mesh in the mirror."""
        corners = self.rng.uniform(-0.02, 0.02, (9, 3))
        self.asset(
            f'<mesh name="{self.name}mirror" vertex="{text(corners)}" scale="-1 1 -1.5" refpos="0.2 -0.1 0.05"/>'
        )
        return f'<geom type="mesh" mesh="{self.name}mirror" pos="{text(at)}"/>'

    def attached(self, at) -> str:
        """A body of another file, of other angles."""
        self.asset(f'<model name="{self.name}other" file="{self.name}_other.xml"/>')
        (self.folder / f"{self.name}_other.xml").write_text(
            f'<mujoco><compiler angle="radian" eulerseq="{self.rng.choice(["xyz", "ZYX", "zxz"])}"/><worldbody>'
            f'<body name="other" euler="{text(self.rng.uniform(-1, 1, 3))}"><geom type="box" size="0.02 0.01 0.03"/>'
            "</body></worldbody></mujoco>",
            encoding="utf-8",
        )
        return f'<frame pos="{text(at)}"><attach model="{self.name}other" body="other" prefix="o_"/></frame>'

    def cable(self, at) -> str:
        """Balls and rods, one on the other."""
        link = f'<body pos="0 0 0.012">{HEAVY}<joint type="ball"/><geom type="capsule" size="0.004 0.005"/>'
        return f'<body pos="{text(at)}">{HEAVY}{link * 6}{"</body>" * 6}</body>'

    def any(self, at) -> str:
        """One of these, or none."""
        what = (self.fitted, self.mirrored, self.attached, self.cable)[self.rng.integers(4)]
        return what(at) if self.chance(0.7) else ""


def odder_arm(rng, folder: Path) -> tuple[str, dict]:
    """An arm with more of what people write; what a case says of it."""
    m = More(rng, folder, arm_text(rng, folder), "arm")
    told: dict = {}
    m.put(m.any((0.3, 0.1, 0.12)), '<body name="link_5"')
    if m.chance(0.4):
        track = '<joint name="RAIL" type="slide" axis="0 1 0" range="-3 3"/>'
        m.put(f'<body name="carriage">{HEAVY}{track}', '<body name="base_link">')
        m.put("</body>", "</worldbody>")
        told["held_mm"] = {"RAIL": float(rng.uniform(-100, 100))}
    if m.chance(0.4):  # two fingers beside the upper arm, one of which follows the other
        finger = '<body pos="0.4 -0.3 0.{}"><joint name="F{}" axis="0 1 0" range="0 30"/><geom size="0.01"/></body>'
        m.put(finger.format(1, 1) + finger.format(2, 2), '<body name="link_3"')
        m.end('<equality><joint joint1="F2" joint2="F1"/></equality>')
    if m.chance(0.3):
        m.end('<equality><connect body1="link_4" body2="link_1" anchor="0 0 0" active="false"/></equality>')
    if m.chance(0.3):
        m.end(
            '<tendon><fixed name="both" range="-300 300"><joint joint="A2" coef="1"/><joint joint="A3" coef="1"/>'
            "</fixed></tendon>"
        )
    if m.chance(0.3):  # of a shape without bits a contact pair says that it is hard
        m.put('<geom name="lug" size="0.02" pos="0.5 0 0.1" contype="0" conaffinity="0"/>', '<body name="link_3"')
        m.put('<geom name="foot_lug" size="0.02" pos="-0.2 0 0.03"/>', '<body name="link_1"')
        m.end('<contact><pair geom1="lug" geom2="foot_lug" margin="0.1" gap="0.05"/></contact>')
    return m.model, told


def odder_torch(rng, folder: Path) -> str:
    """A torch whose neck is bent by up to a right angle, with a wire of up to 60 mm."""
    w = Writer(rng, folder, "t")
    bend = float(rng.uniform(0, 90))
    out = np.array([np.sin(np.deg2rad(bend)), 0, np.cos(np.deg2rad(bend))])
    knee = np.array([0, 0, rng.uniform(0.22, 0.32)])
    end = knee + rng.uniform(0.06, 0.2) * out
    tip = end + rng.uniform(0.008, 0.06) * out
    shapes = w.rod((0, 0, 0.02), (0, 0, 0.2), 0.04) + w.rod((0, 0, 0.18), knee, 0.015) + w.rod(knee, end, 0.012)
    if w.chance(0.4):
        shapes += '<geom type="box" size="0.05 0.05 0.000005" pos="0 0 0.21"/>'
    wire = f'<geom name="wire" type="cylinder" size="0.0006" fromto="{text(end)} {text(tip)}"/>'
    site = f'<site name="tcp" pos="{text(tip)}" euler="0 {bend:.6f} 0"/>'
    m = More(
        rng,
        folder,
        f'<mujoco model="torch"><compiler angle="degree" autolimits="true"/>{w.defaults()}'
        f'<asset>{"".join(w.assets)}</asset><worldbody><body name="torch">{shapes}{wire}{site}</body></worldbody>'
        "</mujoco>",
        "torch",
    )
    m.put(m.any((0.05, 0.02, 0.12)), '<geom name="wire"')
    return m.model


def odder_table(rng, folder: Path) -> tuple[str, dict]:
    """A table with tilted axes or a lift; what a case says of it."""
    m = More(rng, folder, table_text(rng, folder), "table")
    told: dict = {}
    m.put(m.any((0.1, 0.5, 0.33)), '<body name="tilt"')
    if m.chance(0.4):
        for axis in ("0 -1 0", "0 0 1"):
            off = np.array(axis.split(), dtype=float) + rng.normal(size=3) * 0.08
            m.model = m.model.replace(f'axis="{axis}" range', f'axis="{text(off)}" range', 1)
    if m.chance(0.4):
        lift = '<joint name="LIFT" type="slide" axis="0 0 1" range="0 0.5"/>'
        m.model = m.model.replace('<body name="pedestal">', f'<body name="pedestal">{HEAVY}{lift}', 1)
        told["held_mm"] = {"LIFT": float(rng.uniform(0, 150))}
    return m.model, told


def odder_models(rng, folder: Path) -> dict[str, dict]:
    """Write an arm, a torch and a table; what a case says of them, by its sections."""
    arm, of_arm = odder_arm(rng, folder)
    table, of_table = odder_table(rng, folder)
    for key, written in (("robot", arm), ("tool", odder_torch(rng, folder)), ("positioner", table)):
        (folder / f"{key}.xml").write_text(written, encoding="utf-8")
    axes = [name for name in ("E1", "E2") if f'"{name}"' in table]
    speeds = [{"E1": 60, "E2": 120}[name] for name in axes]
    return {
        "robot": {"model": "robot.xml", "home_deg": list(HOME), **of_arm},
        "tool": {"model": "tool.xml", "wire": ["wire"]},
        "positioner": {"model": "positioner.xml", "joints": axes, "max_speed_deg_s": speeds, **of_table},
    }


def odder_fixtures(rng) -> list[dict]:
    """What stands in a cell, very thin or very large."""
    some: list[dict] = []
    if rng.random() < 0.3:  # a foil somewhere in the arm's way or out of it
        place = rng.uniform((500, -1200, 200), (1400, 1200, 1800)).tolist()
        turn = rng.uniform(-180, 180, 3).tolist()
        some.append(
            {"name": "foil", "position_mm": place, "rotation_deg": turn, "box": {"size_mm": [800.0, 500.0, 0.01]}}
        )
    if rng.random() < 0.3:  # a tank beside the cell
        side = float(rng.choice([-1, 1]))
        place = [float(rng.uniform(-500, 1500)), side * (20000.0 + float(rng.uniform(300, 1200))), -500.0]
        some.append({"name": "tank", "position_mm": place, "cylinder": {"radius_mm": 20000.0, "height_mm": 4000.0}})
    return some
