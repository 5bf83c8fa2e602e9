"""The welding torch's dimensions: where they put the wire's tip, and how they reshape the torch's MJCF.

`models/cmt_torch/cmt_torch.xml` is a CMT torch with assumed dimensions. A cell with another torch states its
own lengths, and the same named geoms take them: no other file changes.

    import mujoco
    from cell.mjcf.torch import TorchDimensions, shape_torch, tcp_in_flange

    spec = mujoco.MjSpec.from_file("models/cmt_torch/cmt_torch.xml")
    longer = TorchDimensions(neck_angle_deg=45, stick_out_mm=12)
    shape_torch(spec, longer)        # the geoms, the bend and the site `tcp` follow
    tcp_of_dimensions(longer)            # the same tcp in closed form, metres

The flange frame is KUKA's null tool frame (z away from the flange). The torch runs along z (mount, body),
bends by the neck angle towards +x, and ends with a straight neck, the gas nozzle and the wire. Dimensions are
millimetres and degrees, as in a case file; the MJCF and every array are metres.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from numbers import Real

import mujoco
import numpy as np

ALLOWED: dict[str, tuple[float, float]] = {
    "mount_length_mm": (5.0, 1000.0),
    "body_length_mm": (20.0, 2000.0),
    "body_radius_mm": (5.0, 300.0),
    "neck_angle_deg": (0.0, 90.0),
    "neck_bend_radius_mm": (5.0, 1000.0),
    "neck_radius_mm": (2.0, 200.0),
    "neck_straight_mm": (1.0, 1000.0),
    "nozzle_length_mm": (5.0, 500.0),
    "nozzle_radius_mm": (2.0, 100.0),
    "nozzle_tip_radius_mm": (1.0, 100.0),
    "stick_out_mm": (1.0, 100.0),
    "wire_diameter_mm": (0.3, 5.0),
}
"""Smallest and largest value of every dimension: wide enough for any arc torch, too narrow for metres."""

DRIVE_FRACTION = 0.64
"""Share of the body's length that the drive housing takes; the slimmer barrel takes the rest."""
BARREL_FRACTION = 0.72
"""The barrel's radius over the drive housing's."""
DISC_FRACTION = 0.25
"""Share of the mount's length that the disc on the flange takes; a square block takes the rest."""
TAPER_FRACTION = 0.4
"""Share of the nozzle's length, at its end, over which it tapers."""
BEND_PIECES = 4
BEND_PIECES_VISUAL = 10

_OVERLAP_M = 0.004  # each piece reaches this far into the one before it, so that no gap opens by rounding
_INSET_M = 0.0004  # visual pieces end this far inside the collision pieces, so that faces do not flicker
_HALF_MIN_M = 1e-4  # MuJoCo refuses a capsule without length: what a bend of 0° would ask for


@dataclass(frozen=True)
class TorchDimensions:
    """Lengths of a torch with a bent neck; the defaults are those of `models/cmt_torch/cmt_torch.xml`.

    Attributes:
        mount_length_mm: Flange face to the body's rear end.
        body_length_mm: Drive housing and barrel, along the flange's z.
        body_radius_mm: Radius of the drive housing.
        neck_angle_deg: Angle between the flange's z and the wire, 0 (straight) to 90.
        neck_bend_radius_mm: Radius of the bend's centre line.
        neck_radius_mm: Outer radius of the neck.
        neck_straight_mm: Straight neck between the bend and the nozzle.
        nozzle_length_mm: Gas nozzle, to its rim.
        nozzle_radius_mm: Outer radius of the nozzle where it does not taper.
        nozzle_tip_radius_mm: Outer radius at the rim.
        stick_out_mm: Free wire, from the rim to the wire's end (the contact tip is flush with the rim).
        wire_diameter_mm: Diameter of the wire.

    Raises:
        ValueError: A value is not a number in its range, or two of them contradict each other.
    """

    mount_length_mm: float = 60.0
    body_length_mm: float = 250.0
    body_radius_mm: float = 42.0
    neck_angle_deg: float = 53.0
    neck_bend_radius_mm: float = 60.0
    neck_radius_mm: float = 16.0
    neck_straight_mm: float = 40.0
    nozzle_length_mm: float = 65.0
    nozzle_radius_mm: float = 12.0
    nozzle_tip_radius_mm: float = 9.0
    stick_out_mm: float = 15.0
    wire_diameter_mm: float = 1.2

    def __post_init__(self) -> None:
        for field in fields(self):
            value, (low, high) = getattr(self, field.name), ALLOWED[field.name]
            number = isinstance(value, Real) and not isinstance(value, bool)
            if not (number and low <= value <= high):  # written so that NaN is refused as well
                raise ValueError(f"torch: {field.name} is {value!r}; allowed is a number from {low:g} to {high:g}")
        if self.neck_bend_radius_mm < self.neck_radius_mm:
            raise ValueError(
                f"torch: neck_bend_radius_mm is {self.neck_bend_radius_mm:g}; allowed is at least "
                f"neck_radius_mm ({self.neck_radius_mm:g}), or the neck would cut into itself"
            )
        if self.nozzle_tip_radius_mm > self.nozzle_radius_mm:
            raise ValueError(
                f"torch: nozzle_tip_radius_mm is {self.nozzle_tip_radius_mm:g}; allowed is at most "
                f"nozzle_radius_mm ({self.nozzle_radius_mm:g})"
            )
        if self.wire_diameter_mm >= 2 * self.nozzle_tip_radius_mm:
            raise ValueError(
                f"torch: wire_diameter_mm is {self.wire_diameter_mm:g}; allowed is less than the nozzle's "
                f"diameter at its rim ({2 * self.nozzle_tip_radius_mm:g})"
            )
        if self.neck_radius_mm > self.body_radius_mm:
            raise ValueError(
                f"torch: neck_radius_mm is {self.neck_radius_mm:g}; allowed is at most body_radius_mm "
                f"({self.body_radius_mm:g})"
            )


def tcp_of_dimensions(d: TorchDimensions) -> np.ndarray:
    """Place the wire's end in the flange frame.

    With the neck angle a, the bend's radius r, the bend's start at h = mount + body and the straight length
    s = neck + nozzle + stick-out, the tcp is at (r (1 - cos a) + s sin a, 0, h + r sin a + s cos a), turned
    by a about the flange's y: x_tcp = (cos a, 0, -sin a), z_tcp (along the wire) = (sin a, 0, cos a).

    Args:
        d: The torch's dimensions.

    Returns:
        T_flange_tcp, (4, 4), metres.
    """
    T_flange_tcp = _neck_end(d)
    straight = (d.neck_straight_mm + d.nozzle_length_mm + d.stick_out_mm) * 1e-3
    T_flange_tcp[:3, 3] += straight * T_flange_tcp[:3, 2]
    return T_flange_tcp


def shape_torch(spec: mujoco.MjSpec, d: TorchDimensions) -> None:
    """Give the torch of a loaded `cmt_torch.xml` other dimensions, in place.

    Args:
        spec: The torch's spec, its names without a prefix; reshape before attaching it.
        d: The dimensions to give it.

    Raises:
        ValueError: The spec has no geom, mesh, frame or site of a name that the torch must have.
    """
    _shape_mount_and_body(spec, d)
    for prefix, pieces in (("torch_neck_", BEND_PIECES), ("torch_neck_visual_", BEND_PIECES_VISUAL)):
        _shape_bend(spec, d, prefix, pieces)

    frame = _named(spec, "frame", "torch_neck_end")
    half = math.radians(d.neck_angle_deg) / 2
    frame.alt.type = mujoco.mjtOrientation.mjORIENTATION_QUAT  # the XML states the angle in degrees, as euler
    frame.quat = [math.cos(half), 0.0, math.sin(half), 0.0]
    frame.pos = _neck_end(d)[:3, 3]
    _shape_nozzle_and_wire(spec, d)


def _neck_end(d: TorchDimensions) -> np.ndarray:
    """T_flange_bend_end, (4, 4), metres: where the bend ends; z along the wire."""
    return _on_bend(d, math.radians(d.neck_angle_deg))


def _on_bend(d: TorchDimensions, angle: float) -> np.ndarray:
    """The frame on the bend's centre line after turning by `angle` (rad), (4, 4), metres."""
    c, s, r = math.cos(angle), math.sin(angle), d.neck_bend_radius_mm * 1e-3
    T = np.eye(4)
    T[:3, 0], T[:3, 2] = (c, 0.0, -s), (s, 0.0, c)
    T[:3, 3] = r * (1 - c), 0.0, (d.mount_length_mm + d.body_length_mm) * 1e-3 + r * s
    return T


def _shape_mount_and_body(spec: mujoco.MjSpec, d: TorchDimensions) -> None:
    """Stack the disc, the block, the drive housing and the barrel along the flange's z."""
    mount, body, radius = d.mount_length_mm * 1e-3, d.body_length_mm * 1e-3, d.body_radius_mm * 1e-3
    disc, drive = mount * DISC_FRACTION, mount + body * DRIVE_FRACTION
    barrel, block, neck = radius * BARREL_FRACTION, radius * 0.8, d.neck_radius_mm * 1e-3
    barrel = max(barrel, neck)
    end = mount + body
    for suffix, inset in (("", 0.0), ("_visual", _INSET_M)):
        _along_z(spec, "torch_mount" + suffix, 0.0, disc, radius * 1.4 - inset)
        _along_z(spec, "torch_mount_block" + suffix, disc - _OVERLAP_M / 2, mount, block - inset)
        _along_z(spec, "torch_body" + suffix, mount - inset, drive, radius - inset)
        _along_z(spec, "torch_barrel" + suffix, drive - _OVERLAP_M, end - inset, barrel - inset)
    for name, z in (("torch_ring_1_visual", 0.12), ("torch_ring_2_visual", 0.52)):
        centre = mount + z * body
        _along_z(spec, name, centre - 0.01 * body, centre + 0.01 * body, radius)
    _along_z(spec, "torch_union_visual", end - 0.06 * body, end - _INSET_M / 2, barrel)
    _shape_hose(spec, d)


def _shape_hose(spec: mujoco.MjSpec, d: TorchDimensions) -> None:
    """Let the rigid end of the hose pack leave the drive housing opposite the bend, 45° backwards."""
    mount, body, radius = d.mount_length_mm * 1e-3, d.body_length_mm * 1e-3, d.body_radius_mm * 1e-3
    side = 0.7 * radius
    height = mount + 0.3 * body
    reach = side + 0.35 * body * math.sqrt(0.5)
    for name, scale in (("torch_hose", 1.0), ("torch_hose_visual", 0.96)):
        hose = _named(spec, "geom", name)
        hose.fromto = [-side, 0.0, height, -reach, 0.0, height - (reach - side)]
        hose.size[0] = 0.4 * radius * scale


def _shape_bend(spec: mujoco.MjSpec, d: TorchDimensions, prefix: str, pieces: int) -> None:
    """Lay capsules along chords of the bend: the collision ones thick enough to hold the whole bent tube."""
    step = math.radians(d.neck_angle_deg) / pieces
    # A chord leaves its arc by at most this much; with it added, the pieces hold the whole bent tube.
    sagitta = d.neck_bend_radius_mm * 1e-3 * (1 - math.cos(step / 2)) if prefix == "torch_neck_" else 0.0
    for i in range(pieces):
        start, end = _on_bend(d, i * step)[:3, 3], _on_bend(d, (i + 1) * step)[:3, 3]
        half = max(float(np.linalg.norm(end - start)) / 2, _HALF_MIN_M)
        along = _on_bend(d, (i + 0.5) * step)[:3, 2]
        middle = (start + end) / 2
        geom = _named(spec, "geom", f"{prefix}{i + 1}")
        geom.fromto = [*(middle - half * along), *(middle + half * along)]
        geom.size[0] = d.neck_radius_mm * 1e-3 + sagitta


def _shape_nozzle_and_wire(spec: mujoco.MjSpec, d: TorchDimensions) -> None:
    """Stack the straight neck, the nozzle, the wire and the tcp along z of the frame at the bend's end."""
    neck, nozzle, wire = d.neck_straight_mm * 1e-3, d.nozzle_length_mm * 1e-3, d.stick_out_mm * 1e-3
    neck_r, wire_r = d.neck_radius_mm * 1e-3, d.wire_diameter_mm / 2 * 1e-3
    nozzle_r, rim_r = d.nozzle_radius_mm * 1e-3, d.nozzle_tip_radius_mm * 1e-3
    rim, taper = neck + nozzle, TAPER_FRACTION * nozzle
    overlap = min(_OVERLAP_M, neck / 2, nozzle / 4)
    _along_z(spec, f"torch_neck_{BEND_PIECES + 1}", 0.0, neck, neck_r)
    _along_z(spec, "torch_neck_visual_straight", 0.0, 0.55 * neck, neck_r)
    _along_z(spec, "torch_neck_visual_nut", 0.55 * neck, neck - _INSET_M / 2, neck_r)
    _along_z(spec, "torch_nozzle", neck - overlap, rim - taper, nozzle_r)
    _along_z(spec, "torch_nozzle_visual", neck - overlap, rim - taper, nozzle_r)
    _along_z(spec, "torch_wire", rim - overlap, rim + wire, wire_r)
    _along_z(spec, "torch_wire_visual", rim - overlap, rim + wire, wire_r)
    inner = min(rim_r, max(3 * wire_r, 0.4 * rim_r))
    _along_z(spec, "torch_gas_visual", rim - 3 * _INSET_M, rim - _INSET_M, 0.5 * (rim_r + inner))
    _along_z(spec, "torch_tip_visual", rim - 3 * _INSET_M, rim, inner)
    # (mesh, corners of its polygons, how far short of the rim it ends: the visual one shows the contact tip)
    tapers = (("torch_nozzle_taper", 16, 0.0), ("torch_nozzle_taper_visual", 32, 2 * _INSET_M))
    for name, nvert, inset in tapers:
        mesh = _named(spec, "mesh", name)
        mesh.uservert = _frustum(nvert, nozzle_r, rim_r, rim - taper, rim - inset).ravel()
    _named(spec, "site", "tcp").pos = [0.0, 0.0, rim + wire]


def _frustum(nvert: int, radius: float, tip_radius: float, z: float, z_tip: float) -> np.ndarray:
    """Corners of two rings that hold a truncated cone (polygons around its circles), (2 nvert, 3)."""
    angles = (np.arange(nvert) + 0.5) * (2 * math.pi / nvert)
    circle = np.column_stack([np.cos(angles), np.sin(angles)]) / math.cos(math.pi / nvert)
    return np.vstack(
        [np.column_stack([circle * r, np.full(nvert, at)]) for r, at in ((radius, z), (tip_radius, z_tip))]
    )


def _along_z(spec: mujoco.MjSpec, name: str, start: float, end: float, radius: float) -> None:
    """Set a cylinder (or a square box) along z of its frame, from `start` to `end`, metres."""
    geom = _named(spec, "geom", name)
    geom.pos = [0.0, 0.0, (start + end) / 2]
    half = (end - start) / 2
    geom.size = [radius, radius, half] if geom.type == mujoco.mjtGeom.mjGEOM_BOX else [radius, half, 0.0]


def _named(spec: mujoco.MjSpec, kind: str, name: str) -> mujoco.MjsElement:
    """Look an element up by name.

    Raises:
        ValueError: The spec has none of that name.
    """
    element = getattr(spec, kind)(name)
    if element is None:
        raise ValueError(f"torch: the MJCF has no {kind} named {name!r}; models/cmt_torch/cmt_torch.xml has")
    return element
