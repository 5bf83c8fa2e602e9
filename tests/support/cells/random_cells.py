"""Random cells of all shape kinds that a model may hold: arms, torches, positioners and fixtures, as files of a case.

case = random_cell(rng, folder)           # folder must hold plate.stl of write_meshes(folder)
scenes = random_scenes(folder, seed=5, count=4)
a, b = random_pair(rng, "capsule", "mesh")    # a model of two free shapes
"""

from __future__ import annotations

from itertools import product

import mujoco
import numpy as np
import trimesh
from scipy.spatial import ConvexHull

from cell import compose, prepare
from cell.case.read import parse_case

KINDS = ("sphere", "capsule", "ellipsoid", "cylinder", "box", "mesh", "plane")
ARM = (  # joint axis, place in the link before, range in deg, where its shapes are about
    ("0 0 -1", (0, 0, 0), 185, (0.0, 0, 0.4)),
    ("0 1 0", (0.175, 0, 0.575), 120, (0.4, -0.17, 0)),
    ("0 1 0", (0.89, 0, 0), 140, (0.05, 0, 0)),
    ("-1 0 0", (0, 0, 0.05), 180, (0.5, 0, 0)),
    ("0 1 0", (1.035, 0, 0), 125, (0.03, 0, 0)),
    ("-1 0 0", (0, 0, 0), 350, (0.11, 0, 0)),
)


def rotation(rng):
    """A random quaternion; sometimes along the axes, where degenerate cases are."""
    q = rng.normal(size=4)
    if rng.random() < 0.3:
        q = np.zeros(4)
        q[[0, rng.integers(1, 4)]] = 1.0
    return q / np.linalg.norm(q)


def points(rng, size):
    """Vertices of a convex mesh: few, many, prisms as of CAD, boxes with many points in one plane."""
    form = rng.integers(4)
    if form == 0:
        v = rng.normal(size=(int(rng.integers(4, 40)), 3))
        v /= np.linalg.norm(v, axis=1)[:, None]
    elif form == 1:
        a = np.linspace(0, 2 * np.pi, int(rng.integers(5, 100)))[:-1]
        v = np.concatenate([np.stack([np.cos(a), np.sin(a), np.full(len(a), z)], axis=1) for z in (-1.0, 1.0)])
    elif form == 2:
        v = rng.normal(size=(300, 3))
        v /= np.linalg.norm(v, axis=1)[:, None]
    else:
        v = np.array(list(product(np.linspace(-1, 1, 4), repeat=3)))
    v = v * size
    return v[ConvexHull(v).vertices] if form != 3 else v


def sizes(rng, low=0.003, high=1.5):
    """Half sizes along three axes: anything between two lengths; thin sheets and long rods among them."""
    size = np.exp(rng.uniform(np.log(low), np.log(high), 3))
    if rng.random() < 0.3:
        size[rng.integers(3)] = low
    return size


def text(values):
    return " ".join(f"{v:.6f}" for v in np.ravel(values))


def shape_xml(rng, name, at, low, high, assets, kinds=KINDS[:-1]):
    """A geom of any kind near a place; its mesh goes into ``assets``."""
    kind = kinds[rng.integers(len(kinds))]
    size = sizes(rng, low, high)
    place = np.array(at) + rng.normal(size=3) * low
    given = f'size="{text(size)}"'
    if kind == "mesh":
        assets.append(f'<mesh name="{name}" vertex="{text(points(rng, size))}"/>')
        given = f'mesh="{name}"'
    elif kind == "box" and rng.random() < 0.3:
        given = f'fromto="{text(place - size)} {text(place + size)}" size="{size[0]:.6f}"'
        return f'<geom name="{name}" type="box" {given}/>'
    return f'<geom name="{name}" type="{kind}" {given} pos="{text(place)}" quat="{text(rotation(rng))}"/>'


def arm_xml(rng):
    assets, inner, close = [], "", ""
    for i, (axis, at, turn, about) in enumerate(ARM):
        shapes = "".join(
            shape_xml(rng, f"l{i + 1}_{k}", about, 0.03, 0.25, assets) for k in range(int(rng.integers(1, 3)))
        )
        inner += (
            f'<body name="link_{i + 1}" pos="{text(at)}"><inertial pos="0 0 0" mass="5" diaginertia=".1 .1 .1"/>'
            f'<joint name="A{i + 1}" axis="{axis}" range="-{turn} {turn}"/>{shapes}'
        )
        close += "</body>"
    flange = '<site name="flange" pos="0.185 0 0" quat="0.70710678 0 0.70710678 0"/>'
    base = shape_xml(rng, "base_shape", (0, 0, 0.05), 0.03, 0.2, assets)
    return (
        f'<mujoco><compiler angle="degree" autolimits="true"/><asset>{"".join(assets)}</asset><custom>'
        '<numeric name="max_speed_deg_s" data="180 158 160 230 230 320"/></custom><worldbody><body name="base_link">'
        f'{base}{inner}{flange}{close}</body></worldbody><contact><exclude body1="base_link" body2="link_1"/>'
        '<exclude body1="link_2" body2="link_4"/><exclude body1="link_4" body2="link_6"/></contact></mujoco>'
    )


def torch_xml(rng):
    assets = []
    shapes = "".join(shape_xml(rng, f"t{k}", (0, 0, 0.1 + 0.05 * k), 0.008, 0.08, assets) for k in range(3))
    return (
        f'<mujoco><asset>{"".join(assets)}</asset><worldbody><body name="torch">{shapes}'
        '<geom name="wire" type="cylinder" size="0.0006" fromto="0 0 0.28 0 0 0.3"/>'
        '<site name="tcp" pos="0 0 0.3"/></body></worldbody></mujoco>'
    )


def table_xml(rng):
    assets = []
    still = shape_xml(rng, "pedestal", (0, 0.6, 0.2), 0.05, 0.3, assets)
    tilts = shape_xml(rng, "cradle", (0, 0.3, 0), 0.03, 0.3, assets)
    turns = shape_xml(rng, "plate", (0, 0, 0.1), 0.01, 0.3, assets)
    return (
        f'<mujoco><compiler angle="degree" autolimits="true"/><asset>{"".join(assets)}</asset><worldbody>'
        f'<body name="column">{still}<body name="tilt" pos="0 0 0.35"><joint name="E1" axis="0 -1 0" range="-135 135"/>'
        f'{tilts}<body name="turn"><joint name="E2" axis="0 0 1" range="-185 185"/>{turns}'
        '<site name="table" pos="0 0 0.15"/></body></body></body></worldbody></mujoco>'
    )


def fixtures(rng):
    out = []
    for k in range(int(rng.integers(2, 6))):
        size = sizes(rng, 0.005, 0.6) * 2e3
        shape = [
            {"box": {"size_mm": size.tolist()}},
            {"cylinder": {"radius_mm": float(size[0] / 2), "height_mm": float(size[1])}},
            {"mesh": "plate.stl"},
        ][rng.integers(3)]
        place = {"position_mm": rng.uniform((-300, -1000, 0), (1800, 1000, 1600)).tolist(), "name": f"fixture{k}"}
        out.append({**shape, **place, "rotation_deg": rng.uniform(-180, 180, 3).tolist()})
    return out


def write_meshes(folder):
    """Files that cells refer to."""
    block = trimesh.creation.box((8.0, 8.0, 12.0))
    block.apply_translation((-9.0, 0.0, 20.0))
    block.export(folder / "boss.stl")
    trimesh.creation.icosphere(2, 1.0).apply_scale((300, 20, 200)).export(folder / "plate.stl")


def random_cell(rng, folder):
    """A case of random shapes; half of the arms and torches are the shipped ones."""
    content = {
        "part": {"sub_volumes": ["boss.stl"], "body": {"radius_mm": 9, "z_mm": [0, 40]}},
        "support": {"radius_mm": float(rng.uniform(8, 60)), "height_mm": float(rng.uniform(50, 300))},
        "positioner": {"position_mm": [1500, 0, 0], "rotation_deg": [0, 0, -90]},
        "table": {"E1_deg": 90, "E2_deg": 180},
        "fixtures": fixtures(rng),
    }
    for key, xml, chance in (("robot", arm_xml, 0.7), ("tool", torch_xml, 0.5), ("positioner", table_xml, 0.5)):
        if rng.random() < chance:
            (folder / f"{key}.xml").write_text(xml(rng), encoding="utf-8")
            content[key] = {**content.get(key, {}), "model": f"{key}.xml"}
            if key == "tool":
                content[key]["wire"] = ["wire"]
    return parse_case(content, folder / "cell.case.yaml")


def random_pair(rng, one, two, detectable, low=0.003):
    """A model of two shapes that move freely, (a plane stands), of random sizes from ``low`` on."""
    spec = mujoco.MjSpec()
    for i, kind in enumerate((one, two)):
        body = spec.worldbody.add_body(name=f"b{i}")
        size, what = sizes(rng, low), {}
        if kind == "mesh":
            spec.add_mesh(name=f"m{i}", uservert=points(rng, size).ravel())
            what = {"meshname": f"m{i}"}
        elif kind == "plane":
            what = {"size": (0, 0, 0.1)}
        else:
            what = {"size": size}
        if kind != "plane":
            body.add_freejoint()
            what["mass"] = 1.0
        body.add_geom(type=getattr(mujoco.mjtGeom, f"mjGEOM_{kind.upper()}"), **what)
    plain = spec.compile()
    detectable(spec)
    return plain, spec.compile()


def put(rng, datas):
    """Both shapes of :func:`random_pair` somewhere near one another, alike in every data given."""
    model = datas[0].model
    planes = model.geom_type == mujoco.mjtGeom.mjGEOM_PLANE
    far = float(model.geom_rbound.sum())
    off = rng.normal(size=3)
    off *= rng.uniform(0, 1.0) * (far + 0.03) / np.linalg.norm(off)
    if rng.random() < 0.3:
        off *= 0.3
    places = [np.concatenate([p, rotation(rng)]) for p in (np.zeros(3), off)]
    if planes.any():
        places = [places[1]]
    for data in datas:
        data.qpos[:] = np.concatenate(places)
        mujoco.mj_kinematics(data.model, data)


def random_scenes(folder, seed, count):
    """Composed random cells that share one part."""
    write_meshes(folder)
    rng = np.random.default_rng(seed)
    part = prepare(random_cell(rng, folder)).shape
    return [compose(random_cell(rng, folder), part) for _ in range(count)]
