"""A wire that would run through metal between nozzle and bead is a collision, whatever the arm does."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import trimesh
import yaml
from scipy.spatial import ConvexHull

from cell.case.read import load_case
from cell.job.job import prepare
from cell.job.wire_in_metal import SKIN_LINES, Metal, Wires, wire_size
from cell.motion.motion_file import read_motion, write_motion
from cell.verdict.check import check_fixed
from cell.verification.motion_check import check_motion

RADIUS, STICK_OUT = 0.6, 40.0
LOWEST, ROOF = 18.0, (46.0, 50.0)  # mm from the axis: where the block begins, from where to where the roof is


def box(low, high):
    made = trimesh.creation.box(np.subtract(high, low))
    made.apply_translation(np.add(low, high) / 2)
    return made


def write(folder, name, roof=True, stick_out=STICK_OUT, reach=14.0):
    """A block on a hub under the roof of one that is built already: a post with a plate that juts out to z = reach."""
    post = [box((16, -12, 50), (50, 12, 56)), box((ROOF[0], -12, reach), (ROOF[1], 12, 56))]
    trimesh.boolean.union(post, engine="manifold").export(folder / f"{name}_roof.stl")
    box((16, -6, 20), (24, 6, 28)).export(folder / "low.stl")
    case = {
        "part": {"sub_volumes": [f"{name}_roof.stl", "low.stl"], "take": ["SV2"], "body": {"radius_mm": 20}},
        "slicing": {"strategy": "planar", "h_layer_mm": 2, "h_min_mm": 1, "h_max_mm": 3},
        "support": {"radius_mm": 20, "height_mm": 150},
        "table": {"E1_deg": 0, "E2_deg": 90},
        "tool": {"dimensions": {"stick_out_mm": stick_out}},
    }
    case["part"]["body"]["z_mm"] = [0, 80]
    if roof:
        case["part"]["built"] = ["SV1"]
    path = folder / f"{name}.case.yaml"
    path.write_text(yaml.safe_dump(case), encoding="utf-8")
    return prepare(load_case(path))


@pytest.fixture(scope="module")
def under_a_roof(tmp_path_factory):
    return write(tmp_path_factory.mktemp("roof"), "roof")


def test_a_wire_through_a_roof_is_a_collision_at_every_target(under_a_roof):
    found = under_a_roof.wires_in_metal
    assert sorted(found) == list(range(len(under_a_roof.targets)))
    for failure in found.values():
        assert failure.reason == "collision"
        assert failure.proved
        assert failure.pair[0] == "torch_wire"
        assert failure.pair[1].startswith("built/SV1/")
        assert -2.5 < failure.measure < -1.5  # from the plane to the one below it: layers are 2 mm thick


def test_the_check_and_the_check_of_a_motion_say_so(under_a_roof, tmp_path):
    job = under_a_roof
    result = check_fixed(job, 0.0, 90.0)
    assert not result.feasible
    assert result.reasons["collision"] == len(job.targets)
    # but for the wire all is well: the nozzle is beyond the roof
    blind = write(tmp_path, "blind")
    blind.__dict__["wires_in_metal"] = {}
    motion = check_fixed(blind, 0.0, 90.0).motion
    assert motion is not None
    write_motion(tmp_path / "m.csv", motion)
    read = read_motion(tmp_path / "m.csv", job)
    again = check_motion(job, read)
    assert {(f.reason, f.failure.pair[0]) for f in again.findings} == {("collision", "torch_wire")}
    # nor is it drawn through metal with the arc off, however near to a bead's end
    arc, on = motion.arc.copy(), np.flatnonzero((motion.arc == 1) & (motion.bead == 0))
    off = on[len(on) // 3 : 2 * len(on) // 3]
    arc[off] = 0
    again = check_motion(job, replace(read, motion=replace(read.motion, arc=arc)))
    wire = [f for f in again.findings if f.failure.pair[:1] == ("torch_wire",)]
    assert any(f.row <= off[len(off) // 2] <= f.to_row for f in wire)


@pytest.mark.parametrize(
    "change",
    [{"roof": False}, {"stick_out": 12.0}, {"reach": 34.0}],
    ids=["no roof", "a wire that ends below it", "a roof that ends beside it"],
)
def test_a_wire_that_meets_nothing_is_free(change, tmp_path):
    assert write(tmp_path, "free", **change).wires_in_metal == {}


def test_a_roof_over_some_of_the_targets_stops_those_alone(tmp_path):
    job = write(tmp_path, "half", reach=29.0)  # with half a bead it begins at 26.4 mm; the corners are at 20 and 28
    assert set(job.wires_in_metal) == set(np.flatnonzero(job.targets.position[:, 2] > 27.0).tolist())


def test_a_wire_is_as_long_and_thick_as_it_is_modelled(under_a_roof):
    length, radius = wire_size(under_a_roof.scene)
    assert length == pytest.approx(STICK_OUT + 4.0)  # it begins within the nozzle
    assert radius == pytest.approx(RADIUS)


def test_a_wire_that_cuts_the_rim_of_the_support_anywhere_about_it_runs_through_metal(under_a_roof):
    job = under_a_roof
    metal, support = Metal.of(job.case, job.shape, job.targets, job.layers_lie_below), job.case.support
    turn = np.linspace(0.0, 2 * np.pi, 720, endpoint=False)
    n, none = len(turn), np.zeros(720, dtype=np.int64)
    radius = 1e-3
    for inside_mm, through in ((0.01, True), (-0.02, False)):  # of the rim, 20 mm in radius, or beside it
        ring = (support.radius_mm - inside_mm) * np.column_stack([np.cos(turn), np.sin(turn)])
        tip = np.column_stack([ring, np.full(n, -support.height_mm - 10.0)]) - [*job.case.part.position_mm[:2], 0]
        wires = Wires(tip, np.tile([0, 0, 1.0], (n, 1)), np.zeros(n), 30.0, radius, none, none)
        found, length = metal.met(wires)
        assert ([metal.names[m] for m in found if m >= 0] == n * ["support"]) if through else (found < 0).all()
        assert length == pytest.approx(20.0 if through else 0.0)


def inside(points, planes):
    return (points @ planes[:, :3].T + planes[:, 3]).max(axis=-1) <= 0.0


def test_what_wires_run_through_is_what_dense_points_on_them_say():
    rng = np.random.default_rng(4)
    n, length, free = 60, 30.0, 2.0
    pieces = [rng.normal(size=(12, 3)) * rng.uniform(1, 8, 3) + rng.uniform(-30, 30, 3) for _ in range(40)]
    pieces += [rng.normal(size=(12, 3)) * (60, 60, 0.4) + (0, 0, 20)]  # a sheet across all of it
    deposit, owner = rng.integers(-1, 6, len(pieces)), rng.integers(-1, 3, len(pieces))
    metal = Metal(tuple(map(str, range(len(pieces)))), tuple(pieces), deposit, owner)
    out = rng.normal(size=(n, 3))
    out /= np.linalg.norm(out, axis=1)[:, None]
    tip = rng.uniform(-30, 30, (n, 3))
    wires = Wires(tip, out, np.full(n, free), length, RADIUS, rng.integers(0, 6, n), rng.integers(0, 3, n))
    found, over = metal.met(wires)
    planes = [ConvexHull(piece).equations for piece in pieces]
    along = np.arange(free, length, 0.1)
    through = np.zeros(n, dtype=bool)
    for k in range(n):
        there = [m for m in range(len(pieces)) if deposit[m] < wires.laid[k] and owner[m] != wires.sub_volume[k]]
        there += [m for m in range(len(pieces)) if owner[m] < 0 and deposit[m] < wires.laid[k]]
        first = np.cross(out[k], [0.3, 0.5, 0.8])
        first /= np.linalg.norm(first)
        second = np.cross(out[k], first)
        turn = np.linspace(0, 2 * np.pi, 2 * SKIN_LINES, endpoint=False)[:, None]
        skin = tip[k] + np.concatenate([[[0, 0, 0]], RADIUS * (np.cos(turn) * first + np.sin(turn) * second)])
        points = skin[:, None] + along[:, None] * out[k]
        hit = [inside(points, planes[m]) for m in there]
        through[k] = np.any(hit, axis=(0, 2)).all() if hit else False
        if found[k] >= 0:
            assert found[k] in there
            assert over[k] == pytest.approx(0.1 * inside(points[0], planes[found[k]]).sum(), abs=0.21)
    assert 3 <= through.sum() < n - 3
    assert (through == (found >= 0)).mean() > 0.97  # lines at other angles about the wire
    assert not (through & (found < 0)).any()


def test_no_wire_runs_through_anything_between_targets_that_are_left_out():
    """Directions of all kinds about a body and a block, on the body and off it, at targets and between them."""
    pieces = {
        "body": trimesh.creation.cylinder(radius=30, height=80, sections=40),
        "block": box((30, -8, -8), (50, 8, 8)),
    }
    points = tuple(np.asarray(mesh.vertices) for mesh in pieces.values())
    metal = Metal(tuple(pieces), points, np.full(2, -1), np.full(2, -1))
    left_out = met = 0
    for seed in range(30):
        rng = np.random.default_rng(seed)
        n, angle = 60, np.linspace(0.0, 2.0, 60) + rng.uniform(0, 6)
        out = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
        position = out * rng.uniform(30, 34) + [0, 0, rng.uniform(-30, 30)]
        normal = (
            out + rng.choice([0.0, 0.5, 2.0]) * rng.normal(size=3) + rng.choice([0.0, 0.3]) * rng.normal(size=(n, 3))
        )
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        path = np.arange(n) // 20
        thick, none = rng.uniform(1.0, 3.0, n), np.zeros(n, dtype=np.int64)
        targets = SimpleNamespace(
            bead=path, position=position, normal=normal, thickness_mm=thick, sub_volume_index=none
        )
        out_of_it = np.flatnonzero(~metal.may_be_met(targets))
        left_out += len(out_of_it)
        after = np.minimum(out_of_it + 1, n - 1)
        for f in (0.0, 0.3, 0.5, 0.8, 1.0):
            f_here = np.where(path[after] == path[out_of_it], f, 0.0)[:, None]
            tip = (1 - f_here) * position[out_of_it] + f_here * position[after]
            way = (1 - f_here) * normal[out_of_it] + f_here * normal[after]
            way /= np.linalg.norm(way, axis=1)[:, None]
            free = np.minimum(thick[out_of_it], thick[after]) + 0.5
            few = np.zeros(len(out_of_it), dtype=np.int64)
            found, _ = metal.met(Wires(tip, way, free, STICK_OUT, RADIUS, few, few))
            assert (found < 0).all()
        every = Wires(position, normal, thick + 0.5, STICK_OUT, RADIUS, none, none)
        met += int((metal.met(every)[0] >= 0).sum())
    assert left_out > 300
    assert met > 100


def roofed(folder, roof_layer, below_layer):
    """Two beads of another slicer: the second lies below the first, by 5 mm."""
    beads = [(0, 27, roof_layer), (1, 22, below_layer)]
    rows = [f"{x},{-10 + 3 * k},30,1,0,0,{path},{layer}" for path, x, layer in beads for k in range(8)]
    (folder / "theirs.csv").write_text("\n".join(["x,y,z,nx,ny,nz,path,layer", *rows]) + "\n", encoding="utf-8")
    case = {
        "part": {"toolpath": "theirs.csv", "body": {"radius_mm": 20, "z_mm": [0, 60]}},
        "support": {"radius_mm": 15, "height_mm": 120},
        "table": {"E1_deg": 90, "E2_deg": 0},
        "positioner": {"position_mm": [1500, 0, 0], "rotation_deg": [0, 0, -90]},
    }
    path = folder / "theirs.case.yaml"
    path.write_text(yaml.safe_dump(case), encoding="utf-8")
    return prepare(load_case(path))


@pytest.mark.parametrize("below_layer", [0, 1])
def test_a_bead_below_one_that_lies_there_is_met_though_of_one_layer(below_layer, tmp_path):
    job = roofed(tmp_path, 0, below_layer)
    met = job.wires_in_metal
    assert sorted(met) == list(range(8, 16))
    # of its own layer it is not known what lies there when
    assert {failure.proved for failure in met.values()} == {below_layer > 0}
    assert not check_fixed(job, 90.0, 0.0).feasible


@pytest.mark.parametrize("meshes", [["both"], ["upper", "lower"]])
def test_layers_of_one_sub_volume_face_one_another_in_a_groove(meshes, tmp_path):
    solids = {"upper": box((31, -7, 26), (39, 7, 30)), "lower": box((33, -7, 10), (39, 7, 18))}
    solids["both"] = trimesh.util.concatenate(list(solids.values()))
    for name in meshes:
        solids[name].export(tmp_path / f"{name}.stl")
    groove = [[15, 0], [50, 0], [50, 10], [15, 10], [15, 26], [32, 26], [32, 30], [15, 30], [15, 70]]
    case = {
        "part": {"sub_volumes": [f"{name}.stl" for name in meshes], "body": {"profile_mm": groove}},
        "slicing": {"strategy": "revolved", "h_layer_mm": 1.73},
        "beads": {"pattern": "contour_parallel"},
        "tool": {"dimensions": {"stick_out_mm": 35}},
        "support": {"radius_mm": 12, "height_mm": 120},
    }
    path = tmp_path / "groove.case.yaml"
    path.write_text(yaml.safe_dump(case), encoding="utf-8")
    job = prepare(load_case(path))
    met = job.wires_in_metal
    assert met
    assert all(failure.proved for failure in met.values())
    assert max(failure.measure for failure in met.values()) < -2.0
