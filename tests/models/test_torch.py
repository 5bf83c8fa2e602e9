"""The torch's model: dimensions in, geoms and tcp out; the shipped file is the default dimensions."""

import itertools
import warnings
from dataclasses import asdict, replace

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.paths import ROOT

from cell.mjcf.torch import ALLOWED, TorchDimensions, shape_torch, tcp_of_dimensions

XML = ROOT / "models" / "cmt_torch" / "cmt_torch.xml"
CHAIN = [
    "torch_mount",
    "torch_mount_block",
    "torch_body",
    "torch_barrel",
    *(f"torch_neck_{i}" for i in range(1, 6)),
    "torch_nozzle",
    "torch_nozzle_taper",
    "torch_wire",
]


def load() -> mujoco.MjSpec:
    return mujoco.MjSpec.from_file(str(XML))


def compiled(d: TorchDimensions | None) -> tuple[mujoco.MjModel, mujoco.MjData]:
    spec = load()
    if d is not None:
        shape_torch(spec, d)
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


def site_pose(data: mujoco.MjData) -> np.ndarray:
    T = np.eye(4)
    T[:3, :3] = data.site("tcp").xmat.reshape(3, 3)
    T[:3, 3] = data.site("tcp").xpos
    return T


def gap(model: mujoco.MjModel, data: mujoco.MjData, a: str, b: str) -> float:
    return mujoco.mj_geomDistance(model, data, model.geom(a).id, model.geom(b).id, 1.0, None)


torches = st.builds(
    TorchDimensions,
    mount_length_mm=st.floats(10, 200),
    body_length_mm=st.floats(100, 400),
    body_radius_mm=st.floats(30, 80),
    # MuJoCo takes a site turned by less than 1e-6 rad for one that is not turned
    neck_angle_deg=st.just(0.0) | st.floats(0.01, 90),
    neck_bend_radius_mm=st.floats(30, 150),
    neck_radius_mm=st.floats(8, 25),
    neck_straight_mm=st.floats(5, 120),
    nozzle_length_mm=st.floats(30, 120),
    nozzle_radius_mm=st.floats(10, 20),
    nozzle_tip_radius_mm=st.floats(5, 10),
    stick_out_mm=st.floats(5, 30),
    wire_diameter_mm=st.floats(0.6, 2.4),
)


def test_the_shipped_file_compiles_without_a_warning() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        model, data = compiled(None)
    assert not data.warning.number.any()
    assert data.ncon == 0
    assert model.body("torch").mass[0] == pytest.approx(4.0, abs=1.0)


def test_the_shipped_file_is_the_default_dimensions() -> None:
    (a, da), (b, db) = compiled(None), compiled(TorchDimensions())
    assert a.ngeom == b.ngeom
    np.testing.assert_allclose(da.geom_xpos, db.geom_xpos, atol=2e-9)
    np.testing.assert_allclose(da.geom_xmat, db.geom_xmat, atol=1e-6)
    np.testing.assert_allclose(a.geom_size, b.geom_size, atol=2e-9)
    np.testing.assert_allclose(a.mesh_vert, b.mesh_vert, atol=1e-8)
    np.testing.assert_allclose(site_pose(da), tcp_of_dimensions(TorchDimensions()), atol=1e-12)


@pytest.mark.slow
@settings(max_examples=25, deadline=None)
@given(d=torches)
def test_any_torch_has_its_tcp_where_the_closed_form_says_and_hangs_together(d: TorchDimensions) -> None:
    model, data = compiled(d)
    np.testing.assert_allclose(site_pose(data), tcp_of_dimensions(d), atol=1e-12)
    for a, b in itertools.pairwise(CHAIN):
        assert gap(model, data, a, b) <= 1e-6, (a, b)
    assert gap(model, data, "torch_body", "torch_hose") < 0
    # The bend's centre line, offset by the neck's radius to every side, stays inside the capsules.
    for angle in np.linspace(0, d.neck_angle_deg, 23):
        elbow = tcp_of_dimensions(replace(d, neck_angle_deg=float(angle)))
        straight = (d.neck_straight_mm + d.nozzle_length_mm + d.stick_out_mm) * 1e-3
        centre = elbow[:3, 3] - straight * elbow[:3, 2]
        to_axis = [np.linalg.norm(centre - p) for i in range(1, 5) for p in axis_points(model, data, f"torch_neck_{i}")]
        assert min(to_axis) <= model.geom("torch_neck_1").size[0] - d.neck_radius_mm * 1e-3 + 1e-4


def axis_points(model: mujoco.MjModel, data: mujoco.MjData, name: str) -> np.ndarray:
    """Points every 0.1 mm or so along a capsule's axis."""
    half, along = model.geom(name).size[1], data.geom(name).xmat.reshape(3, 3)[:, 2]
    steps = np.linspace(-half, half, 2 + int(2 * half / 1e-4))
    return data.geom(name).xpos + steps[:, None] * along


def test_the_wire_points_53_degrees_off_the_flange() -> None:
    T = tcp_of_dimensions(TorchDimensions())
    s, c = np.sin(np.radians(53)), np.cos(np.radians(53))
    np.testing.assert_allclose(T[:3, 2], [s, 0, c], atol=1e-15)
    np.testing.assert_allclose(T[:3, 0], [c, 0, -s], atol=1e-15)
    np.testing.assert_allclose(T[:3, :3] @ T[:3, :3].T, np.eye(3), atol=1e-15)


def test_the_wire_ends_at_the_tcp() -> None:
    model, data = compiled(None)
    wire = data.geom("torch_wire")
    end = wire.xpos + model.geom("torch_wire").size[1] * wire.xmat.reshape(3, 3)[:, 2]
    np.testing.assert_allclose(end, data.site("tcp").xpos, atol=1e-12)


def test_stick_out_moves_the_tcp_along_the_wire_alone() -> None:
    short, long = TorchDimensions(stick_out_mm=10), TorchDimensions(stick_out_mm=18.5)
    a, b = tcp_of_dimensions(short), tcp_of_dimensions(long)
    np.testing.assert_allclose(
        np.linalg.inv(a) @ b, [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 8.5e-3], [0, 0, 0, 1]], atol=1e-15
    )


def test_a_neck_without_an_angle_is_a_straight_torch() -> None:
    d = TorchDimensions(neck_angle_deg=0)
    _, data = compiled(d)
    length = d.mount_length_mm + d.body_length_mm + d.neck_straight_mm + d.nozzle_length_mm + d.stick_out_mm
    expected = np.eye(4)
    expected[2, 3] = length * 1e-3
    np.testing.assert_allclose(site_pose(data), expected, atol=1e-12)
    for name in CHAIN:
        assert np.hypot(*data.geom(name).xpos[:2]) < 1e-7, name


def test_visual_pieces_stay_within_collision_pieces() -> None:
    model, data = compiled(None)
    solid = [g for g in range(model.ngeom) if model.geom_group[g] == 3]
    seen = [g for g in range(model.ngeom) if model.geom_group[g] == 2]
    assert seen
    assert all(model.geom_contype[g] == 0 and model.geom_conaffinity[g] == 0 for g in seen)
    low = np.min([data.geom_xpos[g] - model.geom_rbound[g] for g in solid], axis=0)
    high = np.max([data.geom_xpos[g] + model.geom_rbound[g] for g in solid], axis=0)
    for g in seen:
        assert (data.geom_xpos[g] > low).all()
        assert (data.geom_xpos[g] < high).all()
        assert min(mujoco.mj_geomDistance(model, data, g, k, 1.0, None) for k in solid) < 0


def test_reshaping_a_compiled_spec_works_again_and_again() -> None:
    spec = load()
    spec.compile()
    for angle in (20.0, 75.0):
        d = TorchDimensions(neck_angle_deg=angle, nozzle_length_mm=80, nozzle_radius_mm=14)
        shape_torch(spec, d)
        model = spec.compile()
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        np.testing.assert_allclose(site_pose(data), tcp_of_dimensions(d), atol=1e-12)


@pytest.mark.parametrize("key", sorted(ALLOWED))
@pytest.mark.parametrize("bad", ["low", "high", float("nan"), "53", True, None])
def test_a_value_out_of_range_is_named(key: str, bad: object) -> None:
    low, high = ALLOWED[key]
    value = {"low": low - 0.2, "high": high + 1}.get(bad, bad) if isinstance(bad, str) else bad
    with pytest.raises(ValueError, match=rf"^torch: {key} is .*; allowed is a number from .* to .*$"):
        TorchDimensions(**{key: value})  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("key", "change"),
    [
        ("neck_bend_radius_mm", {"neck_bend_radius_mm": 10}),
        ("nozzle_tip_radius_mm", {"nozzle_tip_radius_mm": 13}),
        ("wire_diameter_mm", {"wire_diameter_mm": 4, "nozzle_tip_radius_mm": 2}),
        ("neck_radius_mm", {"neck_radius_mm": 50}),
    ],
)
def test_dimensions_that_contradict_each_other_are_refused(key: str, change: dict[str, float]) -> None:
    with pytest.raises(ValueError, match=rf"^torch: {key} is .*; allowed is"):
        TorchDimensions(**change)


def test_a_spec_without_the_names_is_refused() -> None:
    spec = load()
    spec.delete(spec.geom("torch_wire"))
    with pytest.raises(ValueError, match="no geom named 'torch_wire'"):
        shape_torch(spec, TorchDimensions())


def test_the_defaults_are_within_what_is_allowed() -> None:
    assert asdict(TorchDimensions()).keys() == ALLOWED.keys()
