"""A motion called feasible, looked at by a second engine on the shapes as their files have them.

lines = Witness(result).problems()      # one a pair that comes nearer than the clearance asked for

Nothing of the composed cell is used: each model is compiled from its own file and put where the case says, its shapes
are coal's, and the way of the joints is straight from row to row. What has been welded is there as the targets'
points; a torch may not come nearer to those of earlier beads than the clearance either. The wire keeps the clearance
from all but what is welded, what it is welded onto and its own torch.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass

import coal
import mujoco
import numpy as np

from cell.case.sections import Case
from cell.verdict.result import Result

from .second_engine import placed, shape_of, signed_distance

STEP = np.deg2rad(1.0)  # of any axis between two samples at most
SLACK = 1e-4  # m below the clearance: of rounding and of boxes' corners
MOST = 1200  # samples of a motion


def rotation(degrees) -> np.ndarray:
    quat, R = np.zeros(4), np.zeros(9)
    mujoco.mju_euler2Quat(quat, np.deg2rad(degrees), "XYZ")
    mujoco.mju_quat2Mat(R, quat)
    return R.reshape(3, 3)


def frame(position_mm, rotation_deg) -> np.ndarray:
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = rotation(rotation_deg), np.array(position_mm) * 1e-3
    return T


def frame_of(pos, mat) -> np.ndarray:
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = np.reshape(mat, (3, 3)), pos
    return T


def held(section) -> dict[str, float]:
    """Where a section of a case says that joints stand, rad and m."""
    return {name: float(np.deg2rad(v)) for name, v in section.held_deg.items()} | {
        name: v * 1e-3 for name, v in section.held_mm.items()
    }


@dataclass(eq=False)
class Solid:
    """One shape: what it is of, what moves it, where it is in its model."""

    name: str
    of: str  # robot, tool, table, fixed, part
    level: int  # joints of its model that move it
    body: str
    shape: object
    radius: float
    geom: int = -1
    T: np.ndarray | None = None
    half: np.ndarray | None = None
    centre: np.ndarray | None = None


class Model:
    """A model from its file, by itself."""

    def __init__(self, path, joints, of: str, wires=(), held=None) -> None:
        self.model = mujoco.MjModel.from_xml_path(str(path))
        self.data = mujoco.MjData(self.model)
        m = self.model
        for name, value in (held or {}).items():
            self.data.joint(name).qpos[0] = value
        named = {int(g) for g in (*m.pair_geom1, *m.pair_geom2)}
        self.qpos = [int(m.joint(name).qposadr[0]) for name in joints]
        moved = np.zeros(m.nbody, dtype=int)
        for body in range(1, m.nbody):
            own = sum(int(m.joint(name).bodyid[0]) == body for name in joints)
            moved[body] = moved[m.body_parentid[body]] + own
        self.excluded = {
            frozenset((m.body(int(s) >> 16).name, m.body(int(s) & 0xFFFF).name)) for s in m.exclude_signature
        }
        weld = m.body_weldid  # while all of its joints move, planned or not
        self.neighbours = {
            frozenset((m.body(a).name, m.body(b).name))
            for a in range(1, m.nbody)
            for b in range(1, m.nbody)
            if weld[a] == weld[b] or weld[m.body_parentid[weld[a]]] == weld[b] != 0
        }
        self.wire = [g for g in range(m.ngeom) if m.geom(g).name in wires]
        shapes = [
            Solid(
                m.geom(g).name or f"{of}:{m.body(m.geom_bodyid[g]).name}:{g}",
                of,
                int(moved[m.geom_bodyid[g]]),
                m.body(m.geom_bodyid[g]).name,
                shape_of(m, g),
                float(m.geom_rbound[g]) or np.inf,
                g,
                half=m.geom_aabb[g, 3:].copy(),
                centre=m.geom_aabb[g, :3].copy(),
            )
            for g in range(m.ngeom)
            if m.geom_contype[g] or m.geom_conaffinity[g] or g in named
        ]
        self.solids = [solid for solid in shapes if solid.geom not in self.wire]
        self.wires = [solid for solid in shapes if solid.geom in self.wire]

    def pose(self, q) -> None:
        self.data.qpos[self.qpos] = q
        mujoco.mj_kinematics(self.model, self.data)

    def site(self, name: str) -> np.ndarray:
        s = self.model.site(name).id
        return frame_of(self.data.site_xpos[s], self.data.site_xmat[s])

    def place(self, T: np.ndarray) -> None:
        for solid in (*self.solids, *self.wires):
            g = solid.geom
            solid.T = T @ frame_of(self.data.geom_xpos[g], self.data.geom_xmat[g])


class Witness:
    """A second engine, looking at one motion."""

    def __init__(self, result: Result) -> None:
        job, case = result.job, result.job.case
        self.motion, self.targets, self.case = result.motion, job.targets, case
        self.arm = Model(case.path_of(case.robot.model), case.robot.joints, "robot", held=held(case.robot))
        self.torch = Model(case.path_of(case.tool.model), (), "tool", case.tool.wire, held(case.tool))
        table = case.positioner
        self.table = Model(case.path_of(table.model), table.joints, "table", held=held(table))
        self.T_robot = frame(case.robot.position_mm, case.robot.rotation_deg)
        self.T_table = frame(case.positioner.position_mm, case.positioner.rotation_deg)
        self.fixed, self.on_table = [], []
        if case.floor:
            self.fixed.append(
                Solid("floor", "fixed", 0, "", coal.Halfspace(np.array([0.0, 0, 1]), 0.0), np.inf, T=np.eye(4))
            )
        for fixture in case.fixtures:
            (self.on_table if fixture.on == "table" else self.fixed).append(self._fixture(fixture))
        self._workpiece(case)
        self.at_site = [s.T for s in self.on_table]
        self.least_mm = case.checks.clearance_mm
        self.built = self._built()

    def _fixture(self, fixture) -> Solid:
        if fixture.box is not None:
            size = np.array(fixture.box.size_mm) * 1e-3
            shape, radius = coal.Box(*size), float(np.linalg.norm(size) / 2)
        elif fixture.cylinder is not None:
            r, h = fixture.cylinder.radius_mm * 1e-3, fixture.cylinder.height_mm * 1e-3
            shape, radius = coal.Cylinder(r, h), float(np.hypot(r, h / 2))
        else:
            import trimesh

            mesh = trimesh.load(self.case.path_of(fixture.mesh), force="mesh")
            points = coal.StdVec_Vec3s()
            for p in np.asarray(mesh.convex_hull.vertices) * 1e-3:
                points.append(p)
            shape = coal.Convex.convexHull(points, True, "Qt")
            radius = float(np.linalg.norm(mesh.vertices, axis=1).max() * 1e-3)
        T = frame(fixture.position_mm, fixture.rotation_deg)
        return Solid(fixture.name, "fixed", 0, "", shape, radius, T=T)

    def _built(self) -> np.ndarray:
        """Points of what is there from the start, part frame, m, (k, 3)."""
        import trimesh

        number = {f"SV{k}": name for k, name in enumerate(self.case.part.sub_volumes, start=1)}
        some = [trimesh.load(self.case.path_of(number[name])) for name in self.case.part.built]
        points = [np.concatenate([m.vertices, m.triangles_center, m.sample(300, seed=1)]) for m in some]
        return np.concatenate([np.zeros((0, 3)), *points]) * 1e-3

    def _workpiece(self, case: Case) -> None:
        lift = 0.0
        if case.support is not None:
            r, lift = case.support.radius_mm * 1e-3, case.support.height_mm * 1e-3
            T = frame((0, 0, lift * 500), (0, 0, 0))
            self.on_table.append(Solid("support", "part", 0, "", coal.Cylinder(r, lift), np.hypot(r, lift), T=T))
        x, y, z = case.part.position_mm
        self.T_site_part = frame((x, y, z + lift * 1e3), (0, 0, case.part.rotation_deg))
        body = case.part.body
        low, high = np.array(body.z_mm) * 1e-3
        T = self.T_site_part @ frame((*body.axis_xy_mm, (low + high) * 500), (0, 0, 0))
        r = body.radius_mm * 1e-3
        self.on_table.append(Solid("body", "part", 0, "", coal.Cylinder(r, high - low), np.hypot(r, high), T=T))

    def _pose(self, q, E) -> None:
        self.arm.pose(q)
        self.arm.place(self.T_robot)
        self.torch.pose(())
        self.torch.place(self.T_robot @ self.arm.site(self.case.robot.flange))
        self.table.pose([E[("E1", "E2").index(name)] for name in self.case.positioner.joints])
        self.table.place(self.T_table)
        self.T_site = self.T_table @ self.table.site(self.case.positioner.table)
        for solid, T in zip(self.on_table, self.at_site, strict=True):
            solid.T = self.T_site @ T

    def pairs(self, moving: bool):
        """Pairs of solids to keep apart, and by how much, m."""
        clear = self.least_mm * 1e-3
        arm = [s for s in self.arm.solids if s.level]
        still = [*self.fixed, *self.on_table, *self.table.solids]
        yield from ((a, b, clear) for a in [*arm, *self.torch.solids] for b in still)
        yield from ((w, b, clear) for w in self.torch.wires for b in still if b.of != "part")
        torch = [*self.torch.solids, *self.torch.wires]
        yield from ((t, a, clear) for t in torch for a in self.arm.solids if a.level <= 5)
        yield from (
            (a, b, clear)
            for a in arm
            for b in self.arm.solids
            if a.level > b.level and frozenset((a.body, b.body)) not in self.arm.excluded
            if a.level - b.level >= 2 or frozenset((a.body, b.body)) not in self.arm.neighbours
        )
        if moving:
            tables = [s for s in self.table.solids if s.level]
            yield from ((a, b, 0.0) for a in [*tables, *self.on_table] for b in self.fixed)
            yield from ((a, b, 0.0) for a in self.on_table for b in self.table.solids if not b.level)

    def samples(self):
        """Rows before samples, and all axes at them."""
        m = self.motion
        axes = np.concatenate([m.q, m.table], axis=1)
        count = np.maximum(np.ceil(np.abs(np.diff(axes, axis=0)).max(axis=1) / STEP), 1).astype(int)
        row = np.repeat(np.arange(len(count)), count)
        f = np.concatenate([np.arange(n) / n for n in count])[:, None]
        q = (1 - f) * axes[row] + f * axes[row + 1]
        every = max(1, len(row) // MOST)
        return row[::every], q[::every]

    def problems(self) -> list[str]:
        """What is nearer than asked for."""
        m, n = self.motion, self.motion.q.shape[1]
        row, q = self.samples()
        moving = bool(np.ptp(m.table, axis=0).max() > 1e-9)
        pairs = list(self.pairs(moving))
        near: dict[tuple[str, str], list[float]] = defaultdict(list)
        asked = {}
        welded = np.maximum.accumulate(np.where(m.arc == 1, m.bead, -1))
        points = self.targets.position * 1e-3
        metal = []
        for k in range(len(row)):
            self._pose(q[k, :n], q[k, n:])
            for a, b, least in pairs:
                apart = np.linalg.norm(a.T[:3, 3] - b.T[:3, 3]) if np.isfinite(b.radius + a.radius) else 0.0
                if apart - a.radius - b.radius > least:
                    continue
                d = signed_distance(a.shape, _coal(a.T), b.shape, _coal(b.T))
                asked[a.name, b.name] = least
                near[a.name, b.name].append(float(d) - least)
            on = m.arc[row[k]] == 1 and m.arc[min(row[k] + 1, len(m.arc) - 1)] == 1
            laid = points[self.targets.bead < (m.bead[row[k]] if on else welded[row[k]] + 1)]
            metal += self._metal(np.concatenate([self.built, laid]), int(row[k]))
        found = []
        for pair, values in near.items():
            worst = min(values)
            if worst < -SLACK and not (len(values) == len(row) and max(values) < 0 and "tool" in _kinds(pairs, pair)):
                found.append(f"{pair[0]} - {pair[1]}: {1e3 * (worst + asked[pair]):.3f} mm, asked {self.least_mm:g}")
        return found + metal

    def _metal(self, laid: np.ndarray, row: int) -> list[str]:
        """Shapes of the torch that are too near to what has been welded."""
        if not len(laid):
            return []
        world = laid @ (self.T_site @ self.T_site_part)[:3, :3].T + (self.T_site @ self.T_site_part)[:3, 3]
        clear, found = self.least_mm * 1e-3, []
        for solid in self.torch.solids:
            local = (world - solid.T[:3, 3]) @ solid.T[:3, :3]
            box = np.maximum(np.abs(local - solid.centre) - solid.half, 0.0)
            for p in world[np.linalg.norm(box, axis=1) < clear - SLACK]:
                T = np.eye(4)
                T[:3, 3] = p
                d = signed_distance(solid.shape, _coal(solid.T), coal.Sphere(1e-6), _coal(T))
                if d < clear - SLACK:
                    found.append(f"row {row}: {solid.name} is {d * 1e3:.2f} mm from metal, asked {self.least_mm:g}")
                    break
        return found


def _kinds(pairs, names) -> set[str]:
    return {s.of for a, b, _ in pairs if (a.name, b.name) == names for s in (a, b)}


def _coal(T: np.ndarray):
    return coal.Transform3s(np.ascontiguousarray(T[:3, :3]), np.ascontiguousarray(T[:3, 3]))


__all__ = ["Witness", "placed"]
