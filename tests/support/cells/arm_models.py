"""Arms and tables as MJCF text, for cells of the tests."""

from __future__ import annotations

NUMERICS = (
    '<custom><numeric name="max_speed_deg_s" data="180 158 160 230 230 320"/>'
    '<numeric name="max_accel_deg_s2" data="350 69 80 1000 850 960"/></custom>'
)
RANGES = ((-185, 185), (-175, 60), (-120, 165), (-180, 180), (-125, 125), (-350, 350))
HOME = (0, -90, 90, 0, 0, 0)


def arm(
    *,
    under: str = "",
    extra: str = "",
    home: tuple[float, ...] | None = HOME,
    key: str = "home",
    before: tuple[float, ...] = (),
    ranges: tuple[tuple[float, float], ...] = RANGES,
    right: str = "90",
) -> str:
    """A six-axis arm like the shipped one.

    Args:
        under: joints of the body that carries the base.
        extra: more of the MJCF, after the worldbody.
        home: the joints' places in the key, deg; None for no key.
        key: the key's name.
        before: places of the joints under it in the key, as MuJoCo counts them.
        ranges: of the joints, deg.
        right: the right angle that frames are turned by, as it was written.
    """
    deg = [f"{low} {high}" for low, high in ranges]
    at = [*before, *(v * 3.141592653589793 / 180 for v in home or ())]
    keys = f'<keyframe><key name="{key}" qpos="{" ".join(f"{v:.12g}" for v in at)}"/></keyframe>' if home else ""
    heavy = '<inertial pos="0 0 0" mass="5" diaginertia="0.1 0.1 0.1"/>'
    return f"""<mujoco model="arm"><compiler angle="degree" autolimits="true"/>{NUMERICS}<worldbody>
<body name="carriage">{heavy}{under}<body name="base_link"><geom type="cylinder" size="0.12 0.04" pos="0 0 0.04"/>
<body name="link_1" euler="180 0 0">{heavy}<joint name="A1" axis="0 0 1" range="{deg[0]}"/>
<geom type="capsule" size="0.12" fromto="0 0 -0.2 0.12 0 -0.5"/>
<body name="link_2" pos="0.175 0 -0.575" euler="{right} 0 0">{heavy}<joint name="A2" axis="0 0 1" range="{deg[1]}"/>
<geom type="capsule" size="0.09" fromto="0.025 0 0.17 0.825 0 0.17"/>
<body name="link_3" pos="0.89 0 0">{heavy}<joint name="A3" axis="0 0 1" range="{deg[2]}"/>
<geom type="capsule" size="0.12" fromto="0 0 0 0.135 -0.035 0"/>
<body name="link_4" pos="0 -0.05 0" euler="0 -{right} 0">{heavy}<joint name="A4" axis="0 0 1" range="{deg[3]}"/>
<geom type="capsule" size="0.09" fromto="0 0 -0.285 0 0 -0.885"/>
<body name="link_5" pos="0 0 -1.035" euler="0 {right} 0">{heavy}<joint name="A5" axis="0 0 1" range="{deg[4]}"/>
<geom type="capsule" size="0.06" fromto="0 0 0 0.06 0 0"/>
<body name="link_6" euler="0 -{right} 0">{heavy}<joint name="A6" axis="0 0 1" range="{deg[5]}"/>
<geom type="capsule" size="0.05" fromto="0 0 -0.1 0 0 -0.125"/>
<site name="flange" pos="0 0 -0.185" euler="180 0 0"/>
</body></body></body></body></body></body></body></body></worldbody>
<contact><exclude body1="base_link" body2="link_1"/><exclude body1="link_4" body2="link_6"/></contact>
{extra}{keys}</mujoco>"""


def table(tilt: str | None = 'range="-135 135"', turn: str | None = 'range="-180 180"', more: str = "") -> str:
    """A table that tilts and turns; None leaves an axis out.

    Args:
        tilt: what E1's joint is written with.
        turn: what E2's joint is written with.
        more: joints between them.
    """
    e1 = "" if tilt is None else f'<joint name="E1" axis="0 -1 0" {tilt}/>'
    e2 = "" if turn is None else f'<joint name="E2" axis="0 0 1" {turn}/>'
    return f"""<mujoco model="table"><compiler angle="degree" autolimits="true"/><worldbody><body name="pedestal">
<geom type="box" size="0.15 0.1 0.15" pos="0 0.6 0.15"/><body name="tilt" pos="0 0 0.35">{e1}
<geom type="box" size="0.08 0.2 0.04" pos="0 0.25 0"/><body name="turn">{more}{e2}
<geom name="plate" type="cylinder" size="0.2 0.01" pos="0 0 0.14"/><site name="table" pos="0 0 0.15" euler="0 0 30"/>
</body></body></body></worldbody>
<contact><exclude body1="pedestal" body2="tilt"/><exclude body1="tilt" body2="turn"/></contact></mujoco>"""
