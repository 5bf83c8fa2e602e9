#!/usr/bin/env python3
"""Build the visual meshes of the KR 70 R2100 model from outer dimensions.

The castings are lofts: superellipse sections, given as [min, max] across the part at a few stations, joined by
monotone cubics and closed with rounded ends. Covers and motors are lofts as well, hoses are round tubes along a
spline. All numbers are millimetres in the robot's base frame at A = (0, -90, 90, 0, 0, 0), the pose in which the
outer shape was measured; the meshes are written in metres in the link frames of kr70_r2100.xml.

Example:
    python build_visuals.py            # writes assets/*.obj
"""

from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline, PchipInterpolator

ASSETS = Path(__file__).parent / "assets"
X, Y, Z = 0, 1, 2
RING = 34  # points around a section

# Origin (mm) and orientation of each link frame in the base frame at A = (0, -90, 90, 0, 0, 0).
UPRIGHT = np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])
FRAMES = {
    "base_link": ((0, 0, 0), np.eye(3)),
    "link_1": ((0, 0, 0), np.eye(3)),
    "link_2": ((175, 0, 575), UPRIGHT),
    "link_3": ((175, 0, 1465), np.eye(3)),
    "link_4": ((175, 0, 1515), np.eye(3)),
    "link_5": ((1210, 0, 1515), np.eye(3)),
    "link_6": ((1210, 0, 1515), np.eye(3)),
}


def loft(axis, stations, power=3.0, ends=(20.0, 20.0), ring=RING, as_given=False):
    """Close a smooth body through rounded sections.

    Args:
        axis: 0, 1 or 2, the direction the body runs along.
        stations: rows (s, u_min, u_max, v_min, v_max), mm; u and v are the two other axes in order.
        power: exponent of the superellipse, 2 for an ellipse, larger for squarer sections; one for all stations or
            one each.
        ends: radius (mm) of the rounding at the first and at the last station.
        ring: points around a section.
        as_given: True where the stations are dense enough to be joined as they stand.

    Returns:
        Vertices (n, 3) in mm, base frame, and faces (m, 3), outward.
    """
    rows = np.asarray(stations, float)
    s_all = rows[:, 0]
    lo, hi = s_all[0], s_all[-1]
    spline = PchipInterpolator(s_all, np.column_stack([rows[:, 1:], np.broadcast_to(power, len(rows))]))
    arc = 1 - np.cos(np.linspace(0, np.pi / 2, 6))
    inner = np.linspace(lo + ends[0], hi - ends[1], min(18, 3 * len(rows) - 2))
    if as_given:
        inner = s_all[(s_all > lo + ends[0]) & (s_all < hi - ends[1])]
    s = np.unique(np.round(np.concatenate([lo + ends[0] * arc, inner, hi - ends[1] * arc]), 3))
    u0, u1, v0, v1, n = spline(s).T
    inset = np.zeros_like(s)
    for depth, radius in ((s - lo, ends[0]), (hi - s, ends[1])):
        if radius > 0:
            x = np.clip(1 - depth / radius, 0, 1)
            inset = np.maximum(inset, radius * (1 - np.sqrt(1 - x**2)))
    t = 2 * np.pi * (np.arange(ring) + 0.5) / ring
    c, d = np.cos(t), np.sin(t)
    half_u, half_v = (u1 - u0) / 2 - inset, (v1 - v0) / 2 - inset
    half_u, half_v = np.maximum(half_u, 0.5), np.maximum(half_v, 0.5)
    e = (2 / n)[:, None]
    u = ((u0 + u1) / 2)[:, None] + half_u[:, None] * np.sign(c) * np.abs(c) ** e
    v = ((v0 + v1) / 2)[:, None] + half_v[:, None] * np.sign(d) * np.abs(d) ** e
    points = np.zeros((len(s), ring, 3))
    points[..., axis] = s[:, None]
    points[..., (Y, X, X)[axis]] = u
    points[..., (Z, Z, Y)[axis]] = v
    return stitch(points, flip=axis == Y)


def disc(axis, centre, radius, lo, hi, fillet=8.0, ring=RING):
    """Make a round cover or motor: a cylinder along an axis with rounded edges.

    Args:
        axis: 0, 1 or 2.
        centre: the two other coordinates in order, mm.
        radius: mm.
        lo: first station along the axis, mm.
        hi: last station, mm.
        fillet: radius of the edges, mm.
        ring: points around.

    Returns:
        Vertices (n, 3) in mm and faces (m, 3).
    """
    a, b = centre
    row = (a - radius, a + radius, b - radius, b + radius)
    return loft(axis, [(lo, *row), (hi, *row)], 2.0, (fillet, fillet), ring)


def tube(points, radius, ring=14, steps=28):
    """Run a hose of round section along a spline through points.

    Args:
        points: (k, 3) mm, base frame.
        radius: mm.
        ring: points around.
        steps: sections along.

    Returns:
        Vertices (n, 3) in mm and faces (m, 3).
    """
    p = np.asarray(points, float)
    knots = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(p, axis=0), axis=1))])
    curve = CubicSpline(knots, p)
    at = np.linspace(0, knots[-1], steps)
    centre, tangent = curve(at), curve(at, 1)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    normal = np.cross(tangent[0], np.eye(3)[np.argmin(np.abs(tangent[0]))])
    t = 2 * np.pi * np.arange(ring) / ring
    rows = []
    for c, d in zip(centre, tangent, strict=True):
        normal = normal - d * (normal @ d)
        normal /= np.linalg.norm(normal)
        other = np.cross(d, normal)
        rows.append(c + radius * (np.cos(t)[:, None] * normal + np.sin(t)[:, None] * other))
    return stitch(np.array(rows))


def stitch(points, flip=False):
    """Join rings of points to a closed mesh.

    Args:
        points: (sections, ring, 3) mm, counter-clockwise seen against the running direction.
        flip: True where the rings run clockwise.

    Returns:
        Vertices (n, 3) in mm and faces (m, 3), outward.
    """
    k, r, _ = points.shape
    i, j = np.meshgrid(np.arange(k - 1), np.arange(r), indexing="ij")
    a, b = i * r + j, i * r + (j + 1) % r
    sides = np.concatenate([np.stack([a, b, b + r], -1), np.stack([a, b + r, a + r], -1)]).reshape(-1, 3)
    first, last = k * r, k * r + 1
    near, far = np.arange(r), (k - 1) * r + np.arange(r)
    caps = [np.column_stack([np.full(r, first), np.roll(near, -1), near])]
    caps.append(np.column_stack([np.full(r, last), far, np.roll(far, -1)]))
    vertices = np.vstack([points.reshape(-1, 3), points[0].mean(0), points[-1].mean(0)])
    faces = np.vstack([sides, *caps])
    return vertices, faces[:, ::-1] if flip else faces


def bar(ends, radii, waist, breadth, power, samples=11):
    """Loft an upright bar with round ends (a bone): circles at both ends and a smooth waist between them.

    Args:
        ends: centres ((x, z), (x, z)) of the lower and the upper circle, mm.
        radii: their radii, mm.
        waist: rows (z, x_min, x_max) between the circles, mm.
        breadth: rows (z, y_min, y_max), mm.
        power: exponent of the superellipse of a section.
        samples: stations on each round end.

    Returns:
        Vertices (n, 3) in mm and faces (m, 3).
    """
    (x0, z0), (x1, z1) = ends
    r0, r1 = radii
    turn = np.linspace(0.06, 1.0, samples) * np.pi / 2
    low = [(z0 - r0 * np.cos(a), x0 - r0 * np.sin(a), x0 + r0 * np.sin(a)) for a in turn]
    high = [(z1 + r1 * np.cos(a), x1 - r1 * np.sin(a), x1 + r1 * np.sin(a)) for a in turn[::-1]]
    table = np.asarray(breadth, float)
    side = PchipInterpolator(table[:, 0], table[:, 1:])
    return loft(Z, [(z, a, b, *side(z)) for z, a, b in [*low, *waist, *high]], power, (4.0, 4.0), as_given=True)


def parts():
    """List the visual parts.

    Returns:
        Dict from mesh name (link_material) to a list of (vertices, faces), mm, base frame.
    """
    return {
        "base_link_dark": [
            loft(
                Z,
                [(0, -186, 244, -244, 244), (30, -186, 244, -244, 244), (185, -180, 226, -166, 166)],
                4.0,
                (4, 12),
            ),
            loft(
                Z,
                [(0, -378, -130, -216, 212), (140, -376, -130, -190, 186), (256, -334, -180, -160, 160)],
                5.0,
                (4, 18),
            ),
            tube([(-360, 60, 110), (-440, 66, 108), (-540, 66, 82), (-610, 64, 40), (-640, 64, 22)], 22),
            tube([(-360, 118, 112), (-440, 116, 108), (-540, 100, 80), (-610, 92, 40), (-640, 90, 22)], 20),
        ],
        "base_link_metal": [disc(Z, (0, 0), 168, 120, 196, 4)],
        "link_1_orange": [
            loft(
                Z,
                [
                    (182, -196, 232, -196, 196),
                    (215, -208, 254, -206, 206),
                    (300, -240, 248, -220, 220),
                    (370, -244, 236, -172, 186),
                    (440, -272, 285, -148, 150),
                    (535, -270, 345, -134, 148),
                ],
                [3, 2.8, 2.8, 3, 4, 4.5],
                (22, 10),
            ),
            loft(
                Y,
                [
                    (-134, 12, 338, 412, 738),
                    (-95, -2, 352, 398, 752),
                    (0, -6, 356, 394, 756),
                    (95, -2, 352, 398, 752),
                    (142, 6, 344, 406, 744),
                ],
                2.0,
                (22, 20),
                56,
            ),
            loft(
                Y,
                [(-96, -72, 190, 470, 724), (0, -90, 200, 470, 742), (100, -74, 200, 470, 732)],
                3.2,
                (40, 30),
            ),
            loft(
                Z,
                [
                    (380, -104, 124, 100, 230),
                    (440, -142, 134, 100, 256),
                    (490, -158, 134, 100, 240),
                    (531, -80, 105, 100, 214),
                ],
                4.5,
                (20, 18),
            ),
        ],
        "link_1_dark": [
            loft(
                Z,
                [(500, -270, -92, -82, 120), (610, -270, -102, -80, 118), (669, -266, -112, -78, 104)],
                5.0,
                (2, 26),
            ),
            loft(
                Y,
                [
                    (120, -40, 154, 533, 736),
                    (200, -50, 150, 535, 736),
                    (300, -58, 146, 555, 736),
                    (398, -54, 142, 570, 735),
                ],
                4.5,
                (4, 26),
            ),
            disc(Y, (175, 575), 128, -150, -100, 5),
            tube(
                [
                    (60, -120, 424),
                    (62, -175, 424),
                    (98, -236, 430),
                    (126, -272, 458),
                    (154, -288, 515),
                    (172, -284, 575),
                ],
                24,
            ),
        ],
        "link_2_orange": [
            bar(
                ((165, 575), (176, 1465)),
                (148, 111),
                [
                    (625, 19, 311),
                    (680, 33, 308),
                    (740, 47, 306),
                    (800, 60, 304),
                    (870, 66, 301),
                    (960, 68, 299),
                    (1080, 67, 296),
                    (1220, 66, 293),
                    (1360, 65, 289),
                ],
                [
                    (420, -172, -112),
                    (455, -205, -102),
                    (500, -250, -94),
                    (560, -300, -92),
                    (640, -314, -90),
                    (760, -314, -96),
                    (860, -328, -148),
                    (1050, -334, -148),
                    (1250, -328, -146),
                    (1380, -312, -152),
                    (1470, -286, -166),
                    (1540, -256, -178),
                    (1580, -232, -196),
                ],
                3.6,
            ),
        ],
        "link_2_dark": [disc(Y, (176, 1465), 62, -303, -270, 6), disc(Y, (172, 575), 88, -316, -270, 6)],
        "link_3_orange": [
            loft(
                X,
                [
                    (-4, -60, 222, 1336, 1592),
                    (60, -98, 246, 1332, 1616),
                    (130, -98, 243, 1332, 1630),
                    (250, -98, 219, 1346, 1630),
                    (350, -98, 190, 1374, 1628),
                    (450, -96, 142, 1406, 1616),
                    (512, -84, 90, 1424, 1604),
                ],
                [3.4, 3.6, 3.6, 3.4, 3.2, 2.8, 2.4],
                (34, 12),
            ),
            loft(
                Y,
                [(-186, 62, 300, 1350, 1580), (-140, 46, 330, 1334, 1592), (-60, 40, 380, 1334, 1600)],
                [2.0, 2.2, 3.0],
                (14, 10),
            ),
        ],
        "link_3_dark": [
            disc(X, (10, 1442), 56, -26, 40, 12),
            disc(X, (134, 1440), 56, -26, 40, 12),
            disc(X, (76, 1540), 50, -30, 40, 12),
            disc(X, (0, 1515), 82, 480, 516, 3),
            tube(
                [
                    (372, -80, 1530),
                    (356, -190, 1533),
                    (340, -262, 1531),
                    (308, -300, 1524),
                    (250, -296, 1502),
                    (185, -268, 1470),
                ],
                26,
            ),
        ],
        "link_4_orange": [
            loft(
                X,
                [
                    (508, -78, 78, 1437, 1603),
                    (600, -81, 90, 1434, 1606),
                    (800, -87, 114, 1428, 1609),
                    (960, -88, 136, 1424, 1610),
                    (1020, -78, 143, 1422, 1610),
                    (1120, -38, 146, 1420, 1610),
                    (1210, 0, 146, 1419, 1611),
                    (1250, 14, 145, 1426, 1604),
                    (1280, 24, 142, 1446, 1584),
                    (1298, 30, 138, 1476, 1554),
                    (1306, 36, 132, 1500, 1530),
                ],
                [2.2, 2.4, 2.6, 2.8, 3, 3.2, 3.4, 3.4, 3.2, 3, 2.6],
                (6, 4),
            ),
        ],
        "link_4_dark": [disc(Y, (1210, 1515), 66, 120, 151, 6)],
        "link_5_orange": [
            loft(
                X,
                [
                    (1118, -104, 30, 1470, 1560),
                    (1130, -118, 33, 1446, 1580),
                    (1155, -123, 34, 1430, 1598),
                    (1210, -125, 35, 1422, 1608),
                    (1260, -123, 38, 1428, 1602),
                    (1300, -119, 52, 1437, 1593),
                    (1335, -98, 72, 1438, 1592),
                    (1352, -84, 78, 1438, 1592),
                ],
                [3.2, 3.4, 3.6, 3.8, 3.6, 3, 2.4, 2.1],
                (8, 6),
            ),
        ],
        "link_5_dark": [disc(X, (0, 1515), 77, 1330, 1386, 10), disc(Y, (1205, 1515), 60, -130, -100, 6)],
        "link_6_metal": [disc(X, (0, 1515), 65, 1354, 1395, 3)],
    }


def write_obj(path, vertices, faces):
    """Write one mesh.

    Args:
        path: the .obj file.
        vertices: (n, 3) m.
        faces: (m, 3), from 0.
    """
    lines = [f"v {x:.4f} {y:.4f} {z:.4f}" for x, y, z in vertices]
    lines += [f"f {a} {b} {c}" for a, b, c in faces + 1]
    path.write_text("\n".join(lines) + "\n", encoding="ascii")


def main():
    """Write every mesh of `parts` into assets/ in its link's frame, in metres."""
    ASSETS.mkdir(exist_ok=True)
    for name, bodies in parts().items():
        origin, rotation = FRAMES[name.rsplit("_", 1)[0]]
        vertices, faces, count = [], [], 0
        for v, f in bodies:
            vertices.append(v)
            faces.append(f + count)
            count += len(v)
        local = (np.vstack(vertices) - origin) @ rotation / 1e3
        write_obj(ASSETS / f"{name}.obj", local, np.vstack(faces))
        print(f"{name}.obj  {len(local)} vertices")


if __name__ == "__main__":
    main()
