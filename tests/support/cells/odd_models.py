"""Arms, torches and tables as other people write them in MJCF: whatever the format allows, at random.

sections = odd_models(rng, folder)     # {"robot": {..}, "tool": {..}, "positioner": {..}}, their files written

Arms have a reach near that of the shipped one, so that a motion may be found, and nearly all of them a spherical wrist;
tables have two axes, two of which one is endless, or one. What is drawn
at random is how shapes are given: defaults classes, frames, replicates, includes, attached models, meshes with a scale
and a reference frame, one-sided contact bits, margins and gaps, joints that nobody plans (ball, hinge, slide), bodies
that a user drags (mocap), couplings, excludes against the model's own world, planes.
"""

from __future__ import annotations

from itertools import product
from pathlib import Path

import numpy as np
import trimesh

CORNERS = np.array(list(product((-1.0, 1.0), repeat=3)))
BITS = ("", 'contype="1" conaffinity="1"', 'contype="0" conaffinity="1"', 'contype="4" conaffinity="0"')
HOME = (0, -90, 90, 0, 0, 90)


def text(values) -> str:
    return " ".join(f"{float(v):.6f}" for v in np.ravel(values))


class Writer:
    """Writes shapes in whatever way; what they need of assets is collected."""

    def __init__(self, rng, folder: Path, prefix: str) -> None:
        self.rng, self.folder, self.prefix = rng, folder, prefix
        self.assets: list[str] = []
        self.names = rng.random() < 0.6

    def chance(self, p: float) -> bool:
        return bool(self.rng.random() < p)

    def own(self) -> str:
        """A name, or none; bits, margin and gap."""
        name = f' name="{self.prefix}{len(self.assets)}_{int(self.rng.integers(1e9))}"' if self.names else ""
        near = f' margin="{self.rng.uniform(0, 0.02):.4f}"' if self.chance(0.2) else ""
        near += f' gap="{self.rng.uniform(0, 0.01):.4f}"' if self.chance(0.2) else ""
        return f"{name} {BITS[self.rng.integers(len(BITS))]}{near}"

    def rod(self, a, b, radius: float) -> str:
        """Something long between two places."""
        kind = ("capsule", "cylinder", "box", "ellipsoid", "mesh", "class")[self.rng.integers(6)]
        a, b = np.array(a, dtype=float), np.array(b, dtype=float)
        if kind == "mesh":
            return self.mesh(a, b, radius)
        if kind == "class":
            return f'<geom class="{self.prefix}tube" size="{radius:.4f}" fromto="{text(a)} {text(b)}"{self.own()}/>'
        return f'<geom type="{kind}" size="{radius:.4f}" fromto="{text(a)} {text(b)}"{self.own()}/>'

    def mesh(self, a, b, radius: float) -> str:
        """A prism as a mesh: from a file or by its corners, scaled, about a reference frame of its own."""
        n = int(self.rng.integers(3, 9))
        turn = 2 * np.pi * np.arange(n) / n
        ring = np.column_stack([np.cos(turn), np.sin(turn)]) * radius / np.cos(np.pi / n)
        half = np.linalg.norm(b - a) / 2
        corners = np.concatenate([np.column_stack([ring, np.full(n, z)]) for z in (-half, half)])
        name, scale = f"{self.prefix}m{len(self.assets)}", float(self.rng.choice([1, 1e-3, 0.5]))
        more = f' refpos="{text(self.rng.uniform(-0.3, 0.3, 3))}"' if self.chance(0.4) else ""
        more += f' refquat="{text(self.rng.normal(size=4))}"' if self.chance(0.4) else ""
        more += ' maxhullvert="8"' if self.chance(0.3) else ""
        if self.chance(0.5):
            hull = trimesh.PointCloud(corners / scale).convex_hull
            hull.export(self.folder / f"{name}.stl")
            self.assets.append(f'<mesh name="{name}" file="{name}.stl" scale="{scale} {scale} {scale}"{more}/>')
        else:
            self.assets.append(
                f'<mesh name="{name}" vertex="{text(corners / scale)}" scale="{scale} {scale} {scale}"{more}/>'
            )
        along = (b - a) / np.linalg.norm(b - a)
        return f'<geom type="mesh" mesh="{name}" pos="{text((a + b) / 2)}" zaxis="{text(along)}"{self.own()}/>'

    def knob(self, at, size: float) -> str:
        """Something small."""
        kind = ("sphere", "box", "ellipsoid", "bolts")[self.rng.integers(4)]
        if kind == "bolts":
            return (
                f'<replicate count="4" euler="0 0 90"><geom type="sphere" size="{size / 3:.4f}" '
                f'pos="{text(np.add(at, (size, 0, 0)))}"/></replicate>'
            )
        sizes = {"sphere": 1, "box": 3, "ellipsoid": 3}[kind]
        return (
            f'<geom type="{kind}" size="{text(self.rng.uniform(0.5, 1, sizes) * size)}" pos="{text(at)}"{self.own()}/>'
        )

    def framed(self, inner: str) -> str:
        """In a frame that undoes itself, or as it is."""
        if not self.chance(0.3):
            return inner
        at = self.rng.uniform(-0.2, 0.2, 3)
        return f'<frame pos="{text(at)}"><frame pos="{text(-at)}">{inner}</frame></frame>'

    def loose(self, at) -> str:
        """A body on a joint that nobody plans, or none."""
        if not self.chance(0.3):
            return ""
        joint = ('<joint type="ball"/>', '<joint axis="0 1 0" range="-30 30"/>', '<joint type="slide" range="0 0.02"/>')
        inertia = '<inertial pos="0 0 0" mass="1" diaginertia=".1 .1 .1"/>'
        return f'<body pos="{text(at)}">{inertia}{joint[self.rng.integers(3)]}{self.knob((0, 0, 0), 0.02)}</body>'

    def defaults(self) -> str:
        return (
            f'<default><default class="{self.prefix}tube"><geom type="capsule" margin="0.003"/>'
            f'<default class="{self.prefix}inner"><geom type="cylinder"/></default></default></default>'
        )


def arm_text(rng, folder: Path) -> str:
    w = Writer(rng, folder, "a")
    offset = 0.06 if w.chance(0.1) else 0.0  # of A6's axis from A5's: no spherical wrist then
    s, inertia = rng.uniform(0.9, 1.15), '<inertial pos="0 0 0" mass="5" diaginertia=".1 .1 .1"/>'
    held = w.chance(0.4)
    parts = [
        (("A1", "0 0 -1", -185, 185), (0, 0, 0), w.rod((0, 0, 0.25 * s), (0.12 * s, 0, 0.5 * s), 0.12)),
        (("A2", "0 1 0", -175, 60), (0.175 * s, 0, 0.575 * s), w.rod((0.025, -0.17, 0), (0.825 * s, -0.17, 0), 0.09)),
        (("A3", "0 1 0", -120, 165), (0.89 * s, 0, 0), w.rod((0, 0, 0), (0.135, 0, 0.035), 0.12)),
        (("A4", "-1 0 0", -180, 180), (0, 0, 0.05 * s), w.rod((0.285 * s, 0, 0), (0.885 * s, 0, 0), 0.09)),
        (("A5", "0 1 0", -125, 125), (1.035 * s, 0, 0), w.rod((0, 0, 0), (0.06, 0, 0), 0.06)),
        (("A6", "-1 0 0", -350, 350), (0, 0, offset), w.rod((0.1, 0, 0), (0.125, 0, 0), 0.05)),
    ]
    inner = '<site name="flange" pos="0.185 0 0" quat="0.70710678118 0 0.70710678118 0"/>'
    for k, ((name, axis, low, high), at, shape) in reversed(list(enumerate(parts, start=1))):
        more = w.knob((0, 0.1, 0.1), 0.03) if k in (2, 3) and w.chance(0.4) else ""
        more += w.loose((0, 0.12, 0.1)) if k in (2, 4) else ""
        pos = f'pos="{text(at)}"' if any(at) else ""
        inner = w.framed(
            f'<body name="link_{k}" {pos}>{inertia}<joint name="{name}" axis="{axis}" range="{low} {high}"/>'
            f"{w.framed(shape)}{more}{inner}</body>"
        )
    extra = '<equality><joint joint1="A3" joint2="A2" active="false"/></equality>' if w.chance(0.3) else ""
    drag = '<body name="goal" mocap="true"><geom type="sphere" size="0.05" contype="0" conaffinity="0"/></body>'
    excludes = '<exclude body1="world" body2="link_4"/><exclude body1="world" body2="link_6"/>' if held else ""
    world = f"{drag if w.chance(0.3) else ''}" + (
        '<geom type="plane" size="3 3 .1" pos="0 0 -0.01"/>' if w.chance(0.3) else ""
    )
    return (
        f'<mujoco model="arm"><compiler angle="degree" autolimits="true"/>{w.defaults()}'
        '<custom><numeric name="max_speed_deg_s" data="180 158 160 230 230 320"/></custom>'
        f"<asset>@ASSETS@</asset><worldbody>{world}"
        f'<body name="base_link">{w.rod((0, 0, 0), (0, 0, 0.08), 0.12)}{inner}</body></worldbody>'
        '<contact><exclude body1="base_link" body2="link_1"/><exclude body1="link_4" body2="link_6"/>'
        f'<exclude body1="link_3" body2="link_5"/><exclude body1="link_2" body2="link_4"/>{excludes}</contact>'
        f"{extra}</mujoco>"
    ).replace("@ASSETS@", "".join(w.assets))


def torch_text(rng, folder: Path) -> str:
    """A barrel, a neck that is straight or bent, a nozzle and a wire; knobs, rods across and hoses."""
    w = Writer(rng, folder, "t")
    bend = rng.choice([0.0, 0.0, 30.0, 45.0])
    end = np.array([0.12 * np.sin(np.deg2rad(bend)), 0, 0.30 + 0.12 * np.cos(np.deg2rad(bend))])
    along = np.array([np.sin(np.deg2rad(bend)), 0, np.cos(np.deg2rad(bend))])
    shapes = [
        w.rod((0, 0, 0.02), (0, 0, 0.2), 0.04),
        w.rod((0, 0, 0.18), (0, 0, 0.3), 0.015),
        w.rod((0, 0, 0.3), end, 0.012),
    ]
    if w.chance(0.6):
        across = rng.normal(size=3) * (1, 1, 0.3)
        across *= rng.uniform(0.04, 0.12) / np.linalg.norm(across)
        at = np.array([0, 0, rng.uniform(0.1, 0.26)])
        shapes.append(w.rod(at - across, at + across, rng.uniform(0.004, 0.015)))
    if w.chance(0.5):
        shapes.append(w.knob((0.05, 0, 0.1), 0.03))
    if w.chance(0.3):  # a thin sheet that keeps spatter off
        shapes.append('<geom type="box" size="0.05 0.05 0.0005" pos="0 0 0.22"/>')
    tip = end + 0.015 * along
    wire = f'<geom name="wire" type="cylinder" size="0.0006" fromto="{text(end)} {text(tip)}"/>'
    site = f'<site name="tcp" pos="{text(tip)}" euler="0 {bend:.6f} 0"/>'
    body = f'<body name="torch">{"".join(w.framed(s) for s in shapes)}{wire}{site}{w.loose((0, 0.05, 0.1))}</body>'
    if w.chance(0.3):
        (folder / "torch_body.xml").write_text(f"<mujoco>{body}</mujoco>", encoding="utf-8")
        body = '<include file="torch_body.xml"/>'
    return (
        f'<mujoco model="torch"><compiler angle="degree" autolimits="true"/>{w.defaults()}'
        f"<asset>{''.join(w.assets)}</asset><worldbody>{body}</worldbody></mujoco>"
    )


def table_text(rng, folder: Path) -> str:
    """A table that tilts and turns; of some the turn is endless, and some are tilted once for all."""
    w = Writer(rng, folder, "p")
    turns = '<joint name="E2" axis="0 0 1" range="-185 185"/>' if w.chance(0.8) else '<joint name="E2" axis="0 0 1"/>'
    tilts = '<joint name="E1" axis="0 -1 0" range="-135 135"/>'
    leans = ""
    if w.chance(0.15):
        tilts, leans = "", f'euler="0 {-rng.uniform(40, 100):.3f} 0"'
    back = rng.uniform(0.5, 0.7)
    heavy = '<inertial pos="0 0 0" mass="5" diaginertia=".1 .1 .1"/>'
    plate = f'<geom name="plate" type="cylinder" size="{rng.uniform(0.12, 0.25):.3f} 0.01" pos="0 0 0.14"/>'
    if w.chance(0.3):
        plate = '<geom type="box" size="0.15 0.15 0.01" pos="0 0 0.14"/>'
    return (
        f'<mujoco model="table"><compiler angle="degree" autolimits="true"/>{w.defaults()}'
        f'<asset>@ASSETS@</asset><worldbody><body name="pedestal">{w.rod((0, back, 0), (0, back, 0.3), 0.1)}'
        f'<body name="tilt" pos="0 0 0.35" {leans}>{heavy}{tilts}'
        f"{w.rod((0, 0.12, 0), (0, back - 0.2, 0), 0.05)}"
        f'<body name="turn">{heavy}{turns}{w.framed(plate)}'
        f'<site name="table" pos="0 0 0.15" euler="0 0 {rng.uniform(-90, 90):.3f}"/></body></body></body></worldbody>'
        '<contact><exclude body1="pedestal" body2="tilt"/><exclude body1="tilt" body2="turn"/></contact></mujoco>'
    ).replace("@ASSETS@", "".join(w.assets))


def odd_models(rng, folder: Path) -> dict[str, dict]:
    """Write an arm, a torch and a table; what a case says of them, by its sections."""
    made = {"robot": arm_text, "tool": torch_text, "positioner": table_text}
    texts = {key: make(rng, folder) for key, make in made.items()}
    for key, written in texts.items():
        (folder / f"{key}.xml").write_text(written, encoding="utf-8")
    axes = [name for name in ("E1", "E2") if f'"{name}"' in texts["positioner"]]
    speeds = [{"E1": 60, "E2": 120}[name] for name in axes]
    return {
        "robot": {"model": "robot.xml", "home_deg": list(HOME)},
        "tool": {"model": "tool.xml", "wire": ["wire"]},
        "positioner": {"model": "positioner.xml", "joints": axes, "max_speed_deg_s": speeds},
    }
