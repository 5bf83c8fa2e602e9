"""Collision verdicts of the model's shapes against the real arm's meshes: is a true hit missed?

    python -m bench.soundness.collision MESHES  # a folder with base_link.stl, link_1.stl .. link_6.stl, metres
    python -m bench.soundness.collision MESHES --count 1000 --seed 7

The meshes are the vendor's (package kuka_iontec_support of kroshu/kuka_robot_descriptions, with the arm at home; this
project does not contain them). Random configurations of arm and table: half of them anywhere in the ranges, half with
the torch about the table. A true hit is a point of a link's surface that lies more than --depth inside a shape of the
torch, or of the table and what stands on it. Each must be seen by the model: its own shapes touch. Pairs that touch by
construction (torch and flange, mount and wrist) are left out. Shapes of torch and table are the model's on both sides.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np
import trimesh
from scipy.spatial import ConvexHull

from cell import load_case, prepare
from cell.scene.scene import Scene

from ..bench_arguments import left_out, parsed

ROOT = Path(__file__).resolve().parents[2]

LINKS = tuple(f"link_{i}" for i in range(1, 7))
POINTS = 6000  # a link, over its surface: about 10 mm apart
HOME = (0, -90, 90, 0, 0, 0)  # deg: how the arm stands in the meshes
NEAR = 0.7  # m of the TCP from the table for the configurations about it
TOUCHING = {("link_5", "torch_mount")}  # turn about the flange's own axis
GEOM = mujoco.mjtGeom


@dataclass(frozen=True, eq=False)
class Solid:
    """A collision shape as something that points can be inside of."""

    geom: int
    kind: int
    size: np.ndarray
    planes: np.ndarray | None

    @classmethod
    def of(cls, model: mujoco.MjModel, geom: int) -> Solid:
        kind, planes = int(model.geom_type[geom]), None
        if kind == int(GEOM.mjGEOM_MESH):
            mesh = int(model.geom_dataid[geom])
            first = model.mesh_vertadr[mesh]
            planes = ConvexHull(model.mesh_vert[first : first + model.mesh_vertnum[mesh]]).equations
        return cls(geom, kind, model.geom_size[geom].copy(), planes)

    def depth(self, p: np.ndarray) -> float:
        """How deep the deepest of some points (m, 3) in the shape's frame is inside; negative where none is."""
        if self.planes is not None:
            return float(-(p @ self.planes[:, :3].T + self.planes[:, 3]).max(axis=1).min())
        if self.kind == int(GEOM.mjGEOM_BOX):
            return float((self.size - np.abs(p)).min(axis=1).max())
        across, along = np.hypot(p[:, 0], p[:, 1]), np.abs(p[:, 2])
        if self.kind == int(GEOM.mjGEOM_CYLINDER):
            return float(np.minimum(self.size[0] - across, self.size[1] - along).max())
        if self.kind == int(GEOM.mjGEOM_CAPSULE):
            return float((self.size[0] - np.hypot(across, np.maximum(along - self.size[1], 0.0))).max())
        if self.kind == int(GEOM.mjGEOM_SPHERE):
            return float((self.size[0] - np.linalg.norm(p, axis=1)).max())
        raise SystemExit(f"no inside for a geom of type {self.kind}")


class Truth:
    """The links' real surfaces against the shapes of torch and table."""

    def __init__(self, scene: Scene, meshes: Path, seed: int) -> None:
        self.model = scene.model
        self.points, self.ball = {}, {}
        home = mujoco.MjData(scene.model)
        home.qpos[scene.arm_qpos] = np.deg2rad(HOME)
        mujoco.mj_kinematics(scene.model, home)
        for i, link in enumerate(LINKS):
            mesh = trimesh.load_mesh(meshes / f"{link}.stl")
            points = np.vstack([mesh.vertices, trimesh.sample.sample_surface_even(mesh, POINTS, seed=seed + i)[0]])
            body = home.body(link)
            points = (points - body.xpos) @ body.xmat.reshape(3, 3)
            centre = (points.min(axis=0) + points.max(axis=0)) / 2
            self.points[link] = points
            self.ball[link] = centre, float(np.linalg.norm(points - centre, axis=1).max())
        solid = [g for g in range(self.model.ngeom) if scene.contact_bits[:, g].any()]
        solid = [g for g in solid if self.model.geom_type[g] != GEOM.mjGEOM_PLANE]
        torch = [g for g in solid if scene.geom_name(g).startswith("torch_") and "wire" not in scene.geom_name(g)]
        table = [g for g in solid if not scene.arm_geom[g]]
        base = {g for g in solid if self.model.body(self.model.geom_bodyid[g]).name in ("base_link", *LINKS)}
        self.solids = {
            "torch": [Solid.of(self.model, g) for g in torch],
            "table": [Solid.of(self.model, g) for g in table if g not in base],
        }

    def hits(self, data: mujoco.MjData, depth: float) -> dict[str, tuple[float, str, str]]:
        """The deepest true hit with torch and with table: depth (m), link, geom."""
        found: dict[str, tuple[float, str, str]] = {}
        for what, solids in self.solids.items():
            for link in LINKS[: 5 if what == "torch" else 6]:
                body = data.body(link)
                R, t = body.xmat.reshape(3, 3), body.xpos
                centre, radius = self.ball[link]
                for solid in solids:
                    name = self.model.geom(solid.geom).name
                    gap = np.linalg.norm(R @ centre + t - data.geom_xpos[solid.geom])
                    if gap > radius + self.model.geom_rbound[solid.geom] or (link, name) in TOUCHING:
                        continue
                    to = data.geom_xmat[solid.geom].reshape(3, 3)
                    deep = solid.depth(self.points[link] @ (to.T @ R).T + (t - data.geom_xpos[solid.geom]) @ to)
                    if deep > max(depth, found.get(what, (0.0, "", ""))[0]):
                        found[what] = deep, link, name
        return found


def seen(scene: Scene, data: mujoco.MjData, what: str) -> float:
    """The least distance (m) of the model's own shapes of the arm from torch or table."""
    model, least = scene.model, np.inf
    for contact in data.contact:
        names = [model.geom(g).name for g in contact.geom]
        links = [model.body(model.geom_bodyid[g]).name in LINKS for g in contact.geom]
        if sum(links) != 1:
            continue
        other = contact.geom[int(links[0])]
        is_torch = names[int(links[0])].startswith("torch_")
        if (what == "torch" and is_torch) or (what == "table" and not scene.arm_geom[other]):
            least = min(least, float(contact.dist))
    return least


def configurations(scene: Scene, count: int, seed: int):
    """Random qpos: half anywhere in the ranges, half with the TCP about the table."""
    rng, model = np.random.default_rng(seed), scene.model
    data = mujoco.MjData(model)
    low, high = model.jnt_range.T
    made = 0
    while made < count:
        data.qpos[:] = rng.uniform(low, high)
        if made % 2:
            mujoco.mj_kinematics(model, data)
            if np.linalg.norm(data.site("tcp").xpos - data.site("table").xpos) > NEAR:
                continue
        made += 1
        yield data.qpos.copy()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("meshes", type=Path, nargs="?", help="folder of the vendor's collision meshes")
    parser.add_argument("--count", type=int, default=5000, help="configurations (default 5000)")
    parser.add_argument("--depth", type=float, default=10.0, help="mm from which a hit counts (default 10)")
    parser.add_argument("--seed", type=int, default=0)
    args = parsed(parser, count=50)
    if args.meshes is None:
        if args.smoke:
            left_out("the vendor's meshes are no part of this project")
        parser.error("MESHES: a folder is needed")
    missing = [link for link in LINKS if not (args.meshes / f"{link}.stl").is_file()]
    if missing:
        raise SystemExit(f"{args.meshes}: has no {missing[0]}.stl")
    scene = prepare(load_case(ROOT / "models" / "cases" / "propeller.case.yaml")).scene
    model = scene.model
    model.geom_gap[:], model.pair_gap[:] = 0.0, 0.0
    truth, data = Truth(scene, args.meshes, args.seed), mujoco.MjData(model)
    total, missed = {"torch": 0, "table": 0}, []
    for k, q in enumerate(configurations(scene, args.count, args.seed)):
        data.qpos[:] = q
        mujoco.mj_kinematics(model, data)
        mujoco.mj_collision(model, data)
        for what, (deep, link, geom) in truth.hits(data, args.depth * 1e-3).items():
            total[what] += 1
            if not seen(scene, data, what) < 0:
                missed.append((what, deep, link, geom, k, np.rad2deg(q).round(2).tolist()))
    for what in total:
        lost = [m for m in missed if m[0] == what]
        print(f"arm and {what}: {total[what]} of {args.count} configurations truly hit, {len(lost)} of them missed")
        for _, deep, link, geom, k, q in sorted(lost, reverse=True)[:20]:
            print(f"  missed: {link} {deep * 1e3:.1f} mm deep in {geom}, configuration {k}: {q}")
    sys.exit(1 if missed else 0)


if __name__ == "__main__":
    main()
