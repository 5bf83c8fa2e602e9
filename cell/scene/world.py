"""The world around the cell: floor, light, and MuJoCo's options.

Use:

    world = surroundings(case)                # mujoco.MjSpec
"""

from __future__ import annotations

import mujoco

from ..case.sections import Case
from .contacts import SOLID, WIRE

MASSLESS = 1e-9  # kg, kg m2: what MuJoCo takes a moving body without mass for; kinematics needs none


def surroundings(case: Case) -> mujoco.MjSpec:
    """An empty world: light, sky, and the floor if the case has one; no gravity."""
    world = mujoco.MjSpec()
    world.modelname = "cell"
    world.compiler.degree = False
    world.compiler.boundmass = world.compiler.boundinertia = MASSLESS
    world.compiler.balanceinertia = True
    world.option.gravity = (0, 0, 0)  # kinematics and contacts alone: nothing is to fall
    world.stat.extent, world.stat.center = 3.4, (1.0, -0.1, 0.6)  # the same depth range whatever stands in the cell
    world.visual.headlight.ambient = (0.28, 0.28, 0.28)
    world.visual.headlight.diffuse = (0.30, 0.30, 0.30)
    world.visual.headlight.specular = (0.05, 0.05, 0.05)
    world.visual.map.znear = 0.005
    world.visual.quality.shadowsize = 8192
    world.visual.global_.offwidth, world.visual.global_.offheight = 2560, 1600
    _add_textures(world)
    _add_lights(world)
    if case.floor:
        world.worldbody.add_geom(
            name="floor",
            type=mujoco.mjtGeom.mjGEOM_PLANE,
            size=(20, 20, 0.1),
            material="floor",
            contype=SOLID,
            conaffinity=SOLID | WIRE,
        )
    return world


def _add_textures(world: mujoco.MjSpec) -> None:
    """Sky and floor."""
    world.add_texture(
        name="sky",
        type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT,
        rgb1=(0.97, 0.98, 0.99),
        rgb2=(0.80, 0.83, 0.86),
        width=256,
        height=1536,
    )
    world.add_texture(
        name="floor",
        type=mujoco.mjtTexture.mjTEXTURE_2D,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_CHECKER,
        mark=mujoco.mjtMark.mjMARK_EDGE,
        rgb1=(0.74, 0.75, 0.77),
        rgb2=(0.71, 0.72, 0.74),
        markrgb=(0.64, 0.65, 0.67),
        width=512,
        height=512,
    )
    textures = [""] * int(mujoco.mjtTextureRole.mjNTEXROLE)
    textures[int(mujoco.mjtTextureRole.mjTEXROLE_RGB)] = "floor"
    dull = {"reflectance": 0.0, "specular": 0.0, "shininess": 0.0}
    world.add_material(name="floor", textures=textures, texrepeat=(1, 1), texuniform=True, **dull)


def _add_lights(world: mujoco.MjSpec) -> None:
    """A sun that casts shadows, and a weaker one from the other side."""
    body = world.worldbody
    sun = mujoco.mjtLightType.mjLIGHT_DIRECTIONAL
    body.add_light(
        type=sun,
        pos=(0.5, -1.4, 4.5),
        dir=(0.1, 0.25, -0.96),
        diffuse=(0.5,) * 3,
        specular=(0.15,) * 3,
        castshadow=True,
    )
    body.add_light(
        type=sun,
        pos=(-2, 3, 4),
        dir=(0.45, -0.6, -0.65),
        diffuse=(0.22, 0.23, 0.25),
        specular=(0,) * 3,
        castshadow=False,
    )
