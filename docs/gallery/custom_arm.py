"""An arm of your own takes the place of the shipped one: an MJCF file with six hinges and a site at the flange.

Its wrist axes meet in a point and its second axis is parallel to the third. rbam-cell recognises this from the file and
solves the arm in closed form; any other arm is solved by damped least squares. The case gives the names of the joints,
the flange and the base.
"""

from pathlib import Path

import trimesh

import cell

ARM = """<mujoco model="my_arm">
<compiler angle="degree" autolimits="true"/>
<custom>
  <numeric name="max_speed_deg_s" data="180 160 160 240 240 360"/>
</custom>
<worldbody>
  <body name="foot">
    <geom type="cylinder" size="0.16 0.1" pos="0 0 0.1"/>
    <body name="column" pos="0 0 0.55">
      <joint name="J1" axis="0 0 1" range="-170 170"/>
      <geom type="capsule" size="0.13" fromto="0 0 -0.15 0.1 0 0"/>
      <body name="upper_arm" pos="0.15 0 0">
        <joint name="J2" axis="0 1 0" range="-60 130"/>
        <geom type="capsule" size="0.08" fromto="0 0.2 0 0 0.2 0.9"/>
        <body name="elbow" pos="0 0 0.9">
          <joint name="J3" axis="0 1 0" range="-170 80"/>
          <geom type="capsule" size="0.1" fromto="0 0 0 0 0 0.15"/>
          <body name="forearm" pos="0 0 0.15">
            <joint name="J4" axis="1 0 0" range="-185 185"/>
            <geom type="capsule" size="0.07" fromto="0.2 0 0 0.75 0 0"/>
            <body name="wrist" pos="0.95 0 0">
              <joint name="J5" axis="0 1 0" range="-125 125"/>
              <geom type="capsule" size="0.05" fromto="-0.02 0 0 0.02 0 0"/>
              <body name="hand">
                <joint name="J6" axis="1 0 0" range="-350 350"/>
                <geom type="cylinder" size="0.05 0.015" pos="0.135 0 0" euler="0 90 0"/>
                <site name="plate" pos="0.15 0 0" euler="0 90 0"/>
              </body>
            </body>
          </body>
        </body>
      </body>
    </body>
  </body>
</worldbody>
<contact>
  <exclude body1="foot" body2="column"/>
  <exclude body1="forearm" body2="hand"/>
</contact>
</mujoco>"""
Path("my_arm.xml").write_text(ARM, encoding="utf-8")

boss = trimesh.creation.box(bounds=((15, -12, 30), (40, 12, 50)))
boss.export("boss.stl")
case = cell.parse_case(
    {
        "name": "my arm",
        "part": {"sub_volumes": ["boss.stl"], "body": {"radius_mm": 20, "z_mm": [0, 80]}, "rotation_deg": 180},
        "slicing": {"h_layer_mm": 3.0, "h_min_mm": 2.0, "h_max_mm": 4.0},
        "support": {"radius_mm": 15, "height_mm": 120},
        "robot": {
            "model": "my_arm.xml",
            "joints": ["J1", "J2", "J3", "J4", "J5", "J6"],
            "flange": "plate",
            "base": "foot",
            "home_deg": [0, 0, 0, 0, 30, 0],
        },
        "positioner": {"position_mm": [1300, 0, 0], "rotation_deg": [0, 0, -90]},
    }
)
job = cell.prepare(case)
result = cell.check(job, E1_deg=90, E2_deg=180)

print("feasible" if result.feasible else f"infeasible: {result.reasons}")
print("joints:", ", ".join(job.chain.names))
for warning in result.warnings:
    print("warning:", warning)
Path("cell.png").write_bytes(cell.picture(result, width=1200, height=900))
