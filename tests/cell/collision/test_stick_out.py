"""How far the wire reaches beyond the torch is never told too small, and is the stick-out of a torch as drawn."""

from __future__ import annotations

from typing import cast

import mujoco
import numpy as np
import pytest

from cell.collision.stick_out import SLACK, stick_out_of
from cell.scene.composition import BodyOwner
from cell.scene.contacts import SOLID, WIRE
from cell.scene.scene import Scene

GEOM = mujoco.mjtGeom
KINDS = [int(kind) for kind in (GEOM.mjGEOM_MESH, GEOM.mjGEOM_CAPSULE, GEOM.mjGEOM_CYLINDER, GEOM.mjGEOM_SPHERE)]
PROBE = 1e-6  # m, radius


class Cell:
    """A torch with its wire, a part, and a probe: as much of a scene as is asked for."""

    def __init__(self, spec: mujoco.MjSpec) -> None:
        self.model = model = spec.compile()
        names = [model.geom(g).name for g in range(model.ngeom)]
        self.wire_geom = np.array([name.startswith("wire") for name in names])
        self.tool_geom = np.array([name.startswith(("torch", "wire")) for name in names])
        part = np.array([name == "part" for name in names])
        self.piece_of_geom = np.where(part, BodyOwner.PART, BodyOwner.TOOL)
        self.contact_bits = np.array([np.where(self.wire_geom, WIRE, SOLID), np.where(self.wire_geom, 0, SOLID)])
        self.contact_bits[:, [name == "probe" for name in names]] = 0

    @property
    def stick_out(self) -> float:
        return stick_out_of(cast(Scene, self))


def cell_spec(rng: np.random.Generator) -> mujoco.MjSpec:
    """A part, and a flange with nothing on it."""
    spec = mujoco.MjSpec()
    spec.compiler.balanceinertia = True
    spec.worldbody.add_body(name="table").add_geom(
        name="part", type=GEOM.mjGEOM_SPHERE, size=[0.1, 0, 0], pos=[1, 0, 0]
    )
    arm = spec.worldbody.add_body(name="arm")
    arm.add_joint(axis=[0, 0, 1])
    arm.add_geom(name="arm", type=GEOM.mjGEOM_SPHERE, size=[0.05, 0, 0])
    torch = arm.add_body(name="torch", pos=rng.normal(size=3), quat=rng.normal(size=4))
    torch.add_joint(axis=[1, 0, 0])
    probe = spec.worldbody.add_body(name="probe", mocap=True)
    probe.add_geom(name="probe", type=GEOM.mjGEOM_SPHERE, size=[PROBE, 0, 0])
    return spec


def add_shape(spec: mujoco.MjSpec, name: str, kind: int, rng: np.random.Generator) -> None:
    place = {"pos": 0.02 * rng.normal(size=3), "quat": rng.normal(size=4), "density": 1000}
    if kind == GEOM.mjGEOM_MESH:
        spec.add_mesh(name=name, uservert=(0.02 * rng.normal(size=(12, 3))).ravel())
        spec.body("torch").add_geom(name=name, type=kind, meshname=name, **place)
    else:
        spec.body("torch").add_geom(name=name, type=kind, size=[*rng.uniform(0.002, 0.03, 2), 0.01], **place)


def furthest(cell: Cell, rng: np.random.Generator) -> float:
    """Of points of the wire's surface the greatest distance to the torch, by MuJoCo's own distances, m."""
    model, data = cell.model, mujoco.MjData(cell.model)
    mujoco.mj_kinematics(model, data)
    wire, far = model.geom("wire").id, 0.0
    radius, half = model.geom_size[wire, :2]
    for _ in range(40):
        away = rng.normal(size=3)
        if model.geom_type[wire] == GEOM.mjGEOM_CAPSULE:
            x = rng.choice([-half, half]) * np.array([0, 0, 1]) + radius * away / np.linalg.norm(away)
        else:
            x = np.append(radius * away[:2] / np.linalg.norm(away[:2]), rng.choice([-half, half]))
        data.mocap_pos[0] = data.geom_xpos[wire] + data.geom_xmat[wire].reshape(3, 3) @ x
        mujoco.mj_kinematics(model, data)
        torch = [g for g in np.flatnonzero(cell.tool_geom & ~cell.wire_geom) if model.geom_type[g] in KINDS]
        some = [mujoco.mj_geomDistance(model, data, int(g), model.geom("probe").id, 1.0, None) for g in torch]
        far = max(far, min(some) + PROBE)
    return far


@pytest.mark.parametrize("seed", range(12))
def test_no_point_of_the_wire_is_further_from_the_torch(seed: int) -> None:
    rng = np.random.default_rng(seed)
    spec = cell_spec(rng)
    for k in range(1 + seed % 3):
        add_shape(spec, f"torch{k}", KINDS[(seed + k) % 4], rng)
    kind = GEOM.mjGEOM_CAPSULE if seed % 2 else GEOM.mjGEOM_CYLINDER
    place = {"pos": 0.02 * rng.normal(size=3), "quat": rng.normal(size=4)}
    spec.body("torch").add_geom(name="wire", type=kind, size=[0.0006, 0.01, 0], density=1000, **place)
    cell = Cell(spec)
    assert furthest(cell, rng) <= cell.stick_out + 1e-5
    if seed % 3 == 0:  # of one shape it is hardly more
        assert cell.stick_out <= furthest(cell, rng) + 2e-3


def drawn(*, kind: int = GEOM.mjGEOM_CYLINDER, excluded: bool = False) -> mujoco.MjSpec:
    """A nozzle of 16 mm out of which a wire of 1.2 mm stands by 15 mm."""
    spec = cell_spec(np.random.default_rng(0))
    torch = spec.body("torch")
    torch.add_geom(name="torch", type=kind, size=[0.008, 0.02, 0.02], pos=[0, 0, -0.02])
    torch.add_geom(name="wire", type=GEOM.mjGEOM_CAPSULE, size=[0.0006, 0.01, 0], pos=[0, 0, 0.0044])
    if excluded:
        spec.add_exclude(bodyname1="torch", bodyname2="table")
    return spec


def test_it_is_the_stick_out_of_a_torch_as_drawn() -> None:
    cell = Cell(drawn())
    assert cell.stick_out == pytest.approx(0.015 + SLACK, abs=1e-5)
    assert cell.stick_out == cell.stick_out


def test_of_two_wires_the_longer_one_counts() -> None:
    for longer in ("wire", "wire too"):
        spec = drawn()
        torch = spec.body("torch")
        torch.add_geom(name="wire too", type=GEOM.mjGEOM_CAPSULE, size=[0.0006, 0.01, 0], pos=[0.003, 0, 0.0044])
        spec.geom(longer).pos += [0, 0, 0.002]
        assert Cell(spec).stick_out == pytest.approx(0.017 + SLACK, abs=1e-5)


def test_a_torch_that_is_not_checked_against_the_part_tells_nothing() -> None:
    assert np.isinf(Cell(drawn(excluded=True)).stick_out)
    assert np.isinf(Cell(drawn(kind=GEOM.mjGEOM_BOX)).stick_out)  # known by a ball that is larger
    cell = Cell(drawn())
    cell.contact_bits[0, cell.model.geom("torch").id] = WIRE
    assert np.isinf(cell.stick_out)
    cell = Cell(drawn())
    cell.contact_bits[1, cell.model.geom("part").id] = WIRE
    assert np.isinf(cell.stick_out)


def test_a_wire_that_does_not_move_with_the_tcp_is_known_by_nothing() -> None:
    cell = Cell(drawn())
    cell.tool_geom[cell.model.geom("wire").id] = False
    assert np.isinf(cell.stick_out)


def test_no_wire_reaches_no_further() -> None:
    cell = Cell(drawn())
    cell.wire_geom[:] = False
    assert cell.stick_out == 0.0
