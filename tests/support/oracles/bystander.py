"""Plain MuJoCo, looking again at a motion called feasible.

Nothing of the checker is used: joints on straight lines from row to row in steps of 0.2 mm and 0.2 degrees, the wire
against the chords between the targets, contacts among what is there at that moment, the sign of MuJoCo's own Jacobian.
"""

from __future__ import annotations

import os

import mujoco
import numpy as np

from cell.scene.standalone import standalone_xml
from cell.verdict.result import Result

STEP_MM, STEP_DEG = 0.2, 0.2
OFF_MM, OFF_DEG = 0.05, 0.05
MOST = np.inf if os.environ.get("RBAM_EVERY_SAMPLE") else 5_000  # samples of a motion


class Bystander:
    """Plain MuJoCo, looking at one motion."""

    def __init__(self, result: Result) -> None:
        motion, targets = result.motion, result.job.targets
        assert motion is not None
        self.motion, self.targets = motion, targets
        self.model = mujoco.MjModel.from_xml_string(standalone_xml(result.job.scene))
        self.data = mujoco.MjData(self.model)
        there = [self.model.joint(k).name for k in range(self.model.njnt)]
        axes = [name if name in there else f"unused/{name}" for name in ("E1", "E2")]
        self.joints = [self.model.joint(name) for name in (*motion.names, *axes)]
        self.qpos = [joint.qposadr[0] for joint in self.joints]
        self.dofs = [joint.dofadr[0] for joint in self.joints[:-2]]
        self.J = np.zeros((6, self.model.nv))
        # the same cell in which the wire is solid for the part
        self.rigid = mujoco.MjModel.from_xml_string(standalone_xml(result.job.scene))
        for name in result.job.case.tool.wire:
            geom = self.rigid.geom(name).id
            self.rigid.geom_contype[geom] |= 1
            self.rigid.body_contype[self.rigid.geom_bodyid[geom]] |= 1
        self.out_mm = result.job.case.process.retract_mm
        own = result.job.case.positioner.max_speed_deg_s
        self.turns_deg_s = self.model.numeric("positioner_max_speed_deg_s").data if own is None else np.array(own)
        if len(self.turns_deg_s) < 2:  # of the one axis that there is
            self.turns_deg_s = np.where([name in there for name in axes], self.turns_deg_s[0], np.inf)
        # where no acceleration is known, full speed is taken to be reached in half a second
        named = [self.model.numeric(k).name for k in range(self.model.nnumeric)]
        known = "positioner_max_accel_deg_s2"
        self.starts_deg_s2 = self.model.numeric(known).data if known in named else 2 * self.turns_deg_s
        self.tcp, self.part = self.model.site("tcp").id, self.model.site("part").id
        names = [self.model.geom(g).name for g in range(self.model.ngeom)]
        self.born = np.array([int(n.split("/")[1]) if n.startswith("deposit/") else -1 for n in names])
        # layers are numbered as they are laid
        layers = list(zip(targets.sub_volume_index.tolist(), targets.layer.tolist(), strict=True))
        number = {layer: k for k, layer in enumerate(dict.fromkeys(layers))}
        self.layer = np.array([number[layer] for layer in layers])
        first = {k: int(targets.bead[self.layer == k][0]) for k in number.values()}
        self.again = np.array(
            [b > first[k] for k, b in zip(self.layer.tolist(), targets.bead.tolist(), strict=True)]
        )  # another bead of the same layer lies there already

    def problems(self) -> list[str]:
        m = self.motion
        row, f = self._some(*self._steps())
        axes = np.concatenate([m.q, m.table], axis=1)
        # what was laid is known from all rows before
        begun = np.maximum.accumulate(np.where(m.arc == 1, self.layer[m.target], -1))
        q = (1 - f) * axes[row] + f * axes[row + 1]
        endless = np.array([not self.model.jnt_limited[joint.id] for joint in self.joints])
        low, high = np.array([joint.range for joint in self.joints]).T
        low, high = np.where(endless, -np.inf, low), np.where(endless, np.inf, high)
        found = [
            f"row {row[k]}: outside its range" for k in np.flatnonzero(((q < low - 1e-7) | (q > high + 1e-7)).any(1))
        ]
        welding = (m.arc[row] & m.arc[row + 1]).astype(bool)
        k = m.target[row]
        below = np.where(welding, self.layer[k] + self.again[k], begun[row] + 1)
        seen = [self._look(q[i], int(below[i]), bool(welding[i])) for i in range(len(q))]
        found += [f"row {row[i]}: {what}" for i, (_, _, touching, _) in enumerate(seen) for what in touching]
        speed = np.diff(axes, axis=0) / np.diff(m.t_s)[:, None]
        most = np.concatenate([self.model.numeric("max_speed_deg_s").data, self.turns_deg_s])
        fast = np.abs(speed) > np.deg2rad(most) * 1.001
        found += [f"row {k}: too fast" for k in np.flatnonzero(fast.any(axis=1))]
        # the table's second differences; it turns in travels of its own, with rows at which everything stands. Where it
        # moves along the beads corners are rounded, of which the rows by themselves say nothing
        spent = (m.t_s[2:] - m.t_s[:-2])[:, None] / 2
        jerked = np.abs(np.diff(speed[:, -2:], axis=0)) / spent
        if np.diff(m.table, axis=0)[m.welding].any():
            jerked[:] = 0.0
        limit = np.deg2rad(self.starts_deg_s2) * 1.02
        found += [f"row {k + 1}: the table too suddenly" for k in np.flatnonzero((jerked > limit).any(axis=1))]
        place, wire, side = (np.array([x[j] for x in seen]) for j in (0, 1, 3))
        found += self._dragged(row, q, place, below, welding)
        on = np.flatnonzero(welding)
        found += [
            f"row {row[i]}: {what}" for i, what in zip(on, self._off(k[on], place[on], wire[on]), strict=True) if what
        ]
        for bead in np.unique(m.bead[row]):
            mine = welding & (m.bead[row] == bead)
            if len(np.unique(side[mine])) != 1:
                found.append(f"bead {bead}: more than one configuration")
        return found

    def _steps(self) -> tuple[np.ndarray, np.ndarray]:
        """The row before every sample, and how far it is to the next, (m, 1)."""
        axes = np.concatenate([self.motion.q, self.motion.table], axis=1)
        places = np.array([self._place(q)[0] for q in axes])
        away = np.linalg.norm(np.diff(places, axis=0), axis=1) / STEP_MM
        turn = np.rad2deg(np.abs(np.diff(axes, axis=0)).max(axis=1)) / STEP_DEG
        count = np.maximum(np.ceil(np.maximum(away, turn)), 1).astype(int)
        f = np.concatenate([np.arange(n) / n for n in count] + [[1.0]])
        return np.append(np.repeat(np.arange(len(count)), count), len(count) - 1), f[:, None]

    def _some(self, row: np.ndarray, f: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Samples of whole beads and the ways to them, spread evenly over the motion, not many more than MOST."""
        beads = np.unique(self.motion.bead)
        every = int(np.ceil(len(row) / MOST)) if len(row) > MOST else 1
        keep = np.isin(self.motion.bead[row], [*beads[::every], beads[-1]])
        return row[keep], f[keep]

    def _place(self, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """TCP and wire seen from the part, mm."""
        self.data.qpos[self.qpos] = q
        mujoco.mj_kinematics(self.model, self.data)
        R = self.data.site_xmat[self.part].reshape(3, 3)
        place = R.T @ (self.data.site_xpos[self.tcp] - self.data.site_xpos[self.part]) * 1e3
        return place, R.T @ self.data.site_xmat[self.tcp].reshape(3, 3)[:, 2]

    def _look(self, q: np.ndarray, below: int, welding: bool) -> tuple[np.ndarray, np.ndarray, list[str], float]:
        """TCP and wire seen from the part, mm; what touches; and the sign of the Jacobian's determinant.

        That sign changes at every singularity that is crossed.
        """
        model, data = self.model, self.data
        place, wire = self._place(q)
        mujoco.mj_collision(model, data)
        touching = []
        if data.ncon:
            contact = data.contact
            there = (self.born[contact.geom] < below).all(axis=1) & (contact.dist < 0)
            touching = [str([model.geom(g).name for g in contact.geom[k]]) for k in np.flatnonzero(there)]
        side = 0.0
        if welding:
            mujoco.mj_comPos(model, data)
            mujoco.mj_jacSite(model, data, self.J[:3], self.J[3:], self.tcp)
            side = float(np.sign(np.linalg.det(self.J[:, self.dofs])))
        return place, wire, touching, side

    def _dragged(
        self, row: np.ndarray, q: np.ndarray, place: np.ndarray, below: np.ndarray, welding: np.ndarray
    ) -> list[str]:
        """What the wire is drawn through on the way across, further than the retraction off both its ends."""
        model, data = self.rigid, mujoco.MjData(self.rigid)
        found = []
        # of a bead that is not among the samples nothing is known: the way after it begins where its rows go on
        jumps = np.diff(row, prepend=-2) > 1
        starts = np.flatnonzero(~welding & (np.append(True, welding[:-1]) | jumps))
        for start in starts:
            stop = start + 1 + int(np.argmax(np.append((welding | jumps)[start + 1 :], True)))
            ends = place[[start, min(stop, len(q) - 1)]]
            off = np.linalg.norm(place[start:stop, None] - ends, axis=2).min(axis=1)
            for i in start + np.flatnonzero(off > self.out_mm + 0.01):
                data.qpos[self.qpos] = q[i]
                mujoco.mj_kinematics(model, data)
                mujoco.mj_collision(model, data)
                contact = data.contact
                if data.ncon and ((self.born[contact.geom] < below[i]).all(axis=1) & (contact.dist < 0)).any():
                    found.append(f"row {row[i]}: the wire is drawn through the part")
        return found

    def _off(self, k: np.ndarray, place: np.ndarray, wire: np.ndarray) -> list[str]:
        """What is wrong with samples against the chords next to the targets they passed last."""
        t = self.targets
        good = np.zeros(len(k), dtype=bool)
        least = np.full(len(k), np.inf)
        for shift in (-1, 0, 1):
            a = np.clip(k + shift, 0, len(t) - 2)
            mine = (t.bead[a] == t.bead[k]) & (t.bead[a + 1] == t.bead[k])
            chord = t.position[a + 1] - t.position[a]
            s = np.clip(((place - t.position[a]) * chord).sum(1) / np.maximum((chord**2).sum(1), 1e-30), 0, 1)[:, None]
            off = np.linalg.norm(place - t.position[a] - s * chord, axis=1)
            swing = np.arccos(np.clip((t.normal[a] * t.normal[a + 1]).sum(1), -1, 1))[:, None]
            across = t.normal[a + 1] - np.cos(swing) * t.normal[a]
            across /= np.maximum(np.linalg.norm(across, axis=1), 1e-300)[:, None]
            normal = np.cos(s * swing) * t.normal[a] + np.sin(s * swing) * across
            wire_angle = np.rad2deg(np.arctan2(np.linalg.norm(np.cross(wire, normal), axis=1), -(wire * normal).sum(1)))
            good |= mine & (off <= OFF_MM) & (wire_angle <= OFF_DEG)
            least = np.where(mine, np.minimum(least, np.maximum(off / OFF_MM, wire_angle / OFF_DEG)), least)
        return [
            "" if ok else f"off its bead by {x:.1f} times what is allowed" for ok, x in zip(good, least, strict=True)
        ]
