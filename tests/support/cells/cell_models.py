"""Small models of an arm, a torch and a table as text, and changes that leave what they are."""

from __future__ import annotations

import copy
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as Tree

import numpy as np
import trimesh
import yaml

ARM = """
<mujoco model="arm">
<compiler angle="radian" autolimits="true"/>
<custom><numeric name="max_speed_deg_s" data="180 158 160 230 230 320"/></custom>
<worldbody>
<body name="base_link">
<geom name="foot" type="cylinder" size="0.12 0.04" pos="0 0 0.04"/>
<body name="link_1"><joint name="A1" axis="0 0 -1" range="-3.2 3.2"/>
<geom name="waist" type="capsule" size="0.12" fromto="0 0 0.25 0.12 0 0.5"/>
<body name="link_2" pos="0.175 0 0.575"><joint name="A2" axis="0 1 0" range="-3.05 1.05"/>
<geom name="upper" type="capsule" size="0.09" fromto="0.025 -0.17 0 0.825 -0.17 0"/>
<body name="link_3" pos="0.89 0 0"><joint name="A3" axis="0 1 0" range="-2.09 2.88"/>
<geom name="elbow" type="capsule" size="0.12" fromto="0 0 0 0.135 0 0.035"/>
<body name="link_4" pos="0 0 0.05"><joint name="A4" axis="-1 0 0" range="-3.14 3.14"/>
<geom name="fore" type="capsule" size="0.09" fromto="0.285 0 0 0.885 0 0"/>
<body name="link_5" pos="1.035 0 0"><joint name="A5" axis="0 1 0" range="-2.18 2.18"/>
<geom name="wrist" type="capsule" size="0.06" fromto="0 0 0 0.06 0 0"/>
<geom name="guide" type="capsule" size="0.008" fromto="0 0 0.09 0.3 0 0.09"/>
<body name="link_6"><joint name="A6" axis="-1 0 0" range="-6.1 6.1"/>
<geom name="hand" type="capsule" size="0.05" fromto="0.1 0 0 0.125 0 0"/>
<site name="flange" pos="0.185 0 0" quat="0.7071067811865476 0 0.7071067811865475 0"/>
</body></body></body></body></body></body></body>
</worldbody>
<contact><exclude body1="base_link" body2="link_1"/><exclude body1="link_4" body2="link_6"/></contact>
<keyframe><key name="home" qpos="0 -1.57079633 1.57079633 0 0 1.57079633"/></keyframe>
</mujoco>
"""

TORCH = """
<mujoco model="torch"><compiler angle="degree"/><worldbody><body name="torch">
<geom name="barrel" type="cylinder" size="0.042 0.1" pos="0 0 0.14"/>
<geom name="hose" type="capsule" size="0.015" fromto="-0.03 0 0.1 -0.08 0 0.06"/>
<geom name="neck" type="capsule" size="0.012" fromto="0 0 0.24 0 0 0.33"/>
<geom name="wire" type="cylinder" size="0.0006 0.0065" pos="0 0 0.3505"/>
<site name="tcp" pos="0 0 0.357"/></body></worldbody></mujoco>
"""

TABLE = """
<mujoco model="table"><compiler angle="degree" autolimits="true"/><worldbody><body name="pedestal">
<geom name="column" type="box" size="0.15 0.1 0.15" pos="0 0.6 0.15"/>
<body name="tilt" pos="0 0 0.35"><joint name="E1" axis="0 -1 0" range="-135 135"/>
<geom name="beam" type="box" size="0.08 0.2 0.04" pos="0 0.25 0"/>
<body name="turn"><joint name="E2" axis="0 0 1" range="-185 185"/>
<geom name="plate" type="cylinder" size="0.2 0.01" pos="0 0 0.14"/>
<site name="table" pos="0 0 0.15"/>
</body></body></body></worldbody>
<contact><exclude body1="pedestal" body2="tilt"/></contact></mujoco>
"""

BEAD = {"h_layer_mm": 4.9, "h_min_mm": 4, "h_max_mm": 5}


def write_case(
    folder: Path, name: str, arm: str = ARM, torch: str = TORCH, table: str = TABLE, **sections: Any
) -> Path:
    """A low box on a cylinder in one short bead, on a cell of these models."""
    for what, text in (("arm", arm), ("torch", torch), ("table", table)):
        (folder / f"{name}_{what}.xml").write_text(text, encoding="utf-8")
    if not (folder / "boss.stl").exists():
        box = trimesh.creation.box((8.0, 8.0, 12.0))
        box.apply_translation((-9.0, 0.0, 20.0))
        box.export(folder / "boss.stl")
    content: dict[str, Any] = {
        "part": {"sub_volumes": ["boss.stl"], "body": {"radius_mm": 9, "z_mm": [0, 40]}},
        "slicing": dict(BEAD),
        "sampling": {"min_segment_mm": 2},
        "support": {"radius_mm": 8, "height_mm": 100},
        "robot": {"model": f"{name}_arm.xml"},
        "tool": {"model": f"{name}_torch.xml", "wire": ["wire"]},
        "positioner": {"model": f"{name}_table.xml", "position_mm": [1500, 0, 0], "rotation_deg": [0, 0, -90]},
        "table": {"E1_deg": 90, "E2_deg": 180},
    }
    for key, value in sections.items():
        content[key] = {**content[key], **value} if isinstance(content.get(key), dict) else value
    path = folder / f"{name}.case.yaml"
    path.write_text(yaml.safe_dump(content), encoding="utf-8")
    return path


def renamed(text: str, keep: tuple[str, ...] = ()) -> str:
    """Bodies and geoms under other names, some of them the cell's own."""
    ours = [
        "support",
        "part",
        "workpiece",
        "floor",
        "deposit/0/SV1/0",
        "body/0",
        "support_visual",
        "robot/x",
        "pieces_0",
    ]
    tree, names = Tree.fromstring(text), {}
    for kind in ("body", "geom"):
        for k, element in enumerate(tree.iter(kind)):
            own = element.get("name", "")
            if own and own not in keep:
                names[kind, own] = f"{ours[k]}" if k < len(ours) else f"{kind} {k}"
                element.set("name", names[kind, own])
    for exclude in tree.iter("exclude"):
        for end in ("body1", "body2"):
            exclude.set(end, names.get(("body", exclude.get(end)), exclude.get(end)))
    return Tree.tostring(tree, encoding="unicode")


def unnamed(text: str, keep: tuple[str, ...] = ()) -> str:
    """Geoms without names, and bodies that no exclude names."""
    tree = Tree.fromstring(text)
    held = {e.get(end) for e in tree.iter("exclude") for end in ("body1", "body2")}
    for element in (*tree.iter("geom"), *tree.iter("body")):
        if element.get("name") not in {*keep, *held}:
            element.attrib.pop("name", None)
    return Tree.tostring(tree, encoding="unicode")


def with_visuals(text: str) -> str:
    """Every shape once more, larger, to look at only."""
    tree = Tree.fromstring(text)
    for body in [*tree.iter("body"), *tree.iter("worldbody")]:
        for geom in body.findall("geom"):
            look = copy.deepcopy(geom)
            look.attrib.pop("name", None)
            look.attrib |= {"contype": "0", "conaffinity": "0", "group": "2"}
            look.set("size", " ".join(str(1.3 * float(v)) for v in geom.get("size", "").split()))
            body.append(look)
    return Tree.tostring(tree, encoding="unicode")


def with_bodies_between(text: str) -> str:
    """A body without a joint between every two."""
    tree = Tree.fromstring(text)
    for parent in [*tree.iter("body"), *tree.iter("worldbody")]:
        for child in parent.findall("body"):
            parent.remove(child)
            between = Tree.SubElement(parent, "body", pos=child.attrib.pop("pos", "0 0 0"))
            between.append(child)
    return Tree.tostring(tree, encoding="unicode")


def with_shapes_in_bodies(text: str) -> str:
    """Every shape in a body of its own, but for those of bodies that excludes name."""
    tree = Tree.fromstring(text)
    held = {e.get(end) for e in tree.iter("exclude") for end in ("body1", "body2")}
    for body in [b for b in tree.iter("body") if b.get("name") not in held]:
        for geom in body.findall("geom"):
            body.remove(geom)
            holder = Tree.SubElement(body, "body")
            holder.append(geom)
    return Tree.tostring(tree, encoding="unicode")


def fused(text: str) -> str:
    """What the first body holds is held by the worldbody, as after a reader that fuses what no joint parts."""
    tree = Tree.fromstring(text)
    world = tree.find("worldbody")
    first = world.find("body")
    world.remove(first)
    for element in list(first):
        world.append(element)
    for exclude in tree.iter("exclude"):
        for end in ("body1", "body2"):
            if exclude.get(end) == first.get("name"):
                exclude.set(end, "world")
    return Tree.tostring(tree, encoding="unicode")


def driven(text: str) -> str:
    """Actuators, sensors, tendons, cameras that follow, and keyframes, as public models have them."""
    tree = Tree.fromstring(text)
    joints = [joint.get("name") for joint in tree.iter("joint")]
    body = next(tree.iter("body")).get("name")
    actuator, sensor = Tree.SubElement(tree, "actuator"), Tree.SubElement(tree, "sensor")
    tendon = Tree.SubElement(tree, "tendon")
    for name in joints:
        Tree.SubElement(actuator, "position", name=f"drive_{name}", joint=name, kp="1000")
        Tree.SubElement(sensor, "jointpos", joint=name)
    fixed = Tree.SubElement(tendon, "fixed", name="coupled")
    Tree.SubElement(fixed, "joint", joint=joints[0], coef="1")
    Tree.SubElement(actuator, "motor", tendon="coupled")
    Tree.SubElement(tree.find("worldbody"), "camera", mode="targetbody", target=body)
    Tree.SubElement(tree.find("worldbody"), "light", mode="targetbody", target=body)
    custom = tree.find("custom")
    custom = Tree.SubElement(tree, "custom") if custom is None else custom
    held = Tree.SubElement(custom, "tuple", name="held")
    Tree.SubElement(held, "element", objtype="body", objname=body)
    Tree.SubElement(custom, "text", name="note", data="of the maker")
    return Tree.tostring(tree, encoding="unicode")


def mirrored(text: str) -> str:
    """The model in a mirror across its xz plane; the same joint angles are mirror images."""
    tree = Tree.fromstring(text)
    flip = {
        "pos": (1, -1, 1),
        "fromto": (1, -1, 1, 1, -1, 1),
        "axis": (-1, 1, -1),
        "quat": (1, -1, 1, -1),
    }
    for element in tree.iter():
        for key, signs in flip.items():
            if key in element.attrib:
                values = np.array([float(v) for v in element.get(key).split()]) * signs
                element.set(key, " ".join(str(v) for v in values.tolist()))
    return Tree.tostring(tree, encoding="unicode")
