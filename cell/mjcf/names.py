"""Names in a composed cell: every model keeps its own, and none can be taken for one of the cell's.

    name_all(child, "robot")                       # shapes and bodies without a name get one
    names = attach(world, child, "robot/", frame)  # names.geoms["hose"] -> what it is called in the cell

A model's element keeps its own name unless the cell uses that name itself (``support``, ``part``, ``deposit/..``) or
another model has it already: then the model goes before it, as in ``positioner/support``. What an element is comes from
the body it belongs to, never from its name.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field

import mujoco

KINDS = ("bodies", "joints", "geoms", "sites", "cameras", "numerics", "excludes", "pairs")
MODELS = r"(robot|tool|positioner)(/.*)?"
RESERVED = {
    "bodies": re.compile(rf"world|part|workpiece|unused|fixed_table.*|pieces_\d+|fixture[_/].*|{MODELS}"),
    "geoms": re.compile(rf"floor|support|(support|body|BODY|SV\d+)_visual|(deposit|built|body|fixture)/.*|{MODELS}"),
    "joints": re.compile(rf"unused/.*|{MODELS}"),
    "sites": re.compile(rf"part|{MODELS}"),
}
ANY_KIND = re.compile(MODELS)


@dataclass(frozen=True)
class Names:
    """What a model's elements are called in the cell, by their own names.

    Attributes:
        bodies: of its bodies.
        joints: likewise.
        geoms: likewise.
        sites: likewise.
    """

    bodies: dict[str, str] = field(default_factory=dict)
    joints: dict[str, str] = field(default_factory=dict)
    geoms: dict[str, str] = field(default_factory=dict)
    sites: dict[str, str] = field(default_factory=dict)


def name_all(spec: mujoco.MjSpec, what: str) -> None:
    """Name bodies, joints and geoms that have no name, after the body that holds them.

    Args:
        spec: a model by itself; changed in place.
        what: what its worldbody is called.
    """
    name_bodies(spec, what)
    bodies = list(spec.bodies)
    for kind, word in (("joints", "joint"), ("geoms", "geom")):
        taken = {element.name for element in getattr(spec, kind)}
        for body in bodies:
            for number, element in enumerate(getattr(body, kind), start=1):
                if not element.name:
                    element.name = _free(f"{_label(body, what)} ({word} {number})", taken)
                    taken.add(element.name)


def name_bodies(spec: mujoco.MjSpec, what: str) -> None:
    """Name bodies that have no name, after the body that holds them.

    Args:
        spec: a model by itself; changed in place.
        what: what its worldbody is called.
    """
    bodies = list(spec.bodies)  # parents come first
    taken = {body.name for body in bodies}
    for body in bodies[1:]:
        if not body.name:
            number = list(body.parent.bodies).index(body) + 1
            body.name = _free(f"{_label(body.parent, what)} (body {number})", taken)
            taken.add(body.name)


def _label(body: mujoco.MjsBody, what: str) -> str:
    return what if body.name == "world" else body.name


def _free(name: str, taken: set[str]) -> str:
    while name in taken:
        name += "'"
    return name


def attach(world: mujoco.MjSpec, child: mujoco.MjSpec, prefix: str, at: mujoco.MjsFrame | mujoco.MjsSite) -> Names:
    """Attach a model whose elements are all named.

    Args:
        world: the cell so far.
        child: the model.
        prefix: its elements' own namespace, with the slash; materials, meshes and defaults keep it.
        at: the frame or site it is attached to.

    Returns:
        What its elements are called now.
    """
    if isinstance(at, mujoco.MjsSite):
        world.attach(child, site=at, prefix=prefix)
    else:
        world.attach(child, frame=at, prefix=prefix)
    names = {kind: _renamed(world, kind, prefix) for kind in KINDS}
    bodies, geoms = names["bodies"], names["geoms"]
    for exclude in world.excludes:
        exclude.bodyname1, exclude.bodyname2 = (
            _now(bodies, prefix, name) for name in (exclude.bodyname1, exclude.bodyname2)
        )
    for pair in world.pairs:
        pair.geomname1, pair.geomname2 = (_now(geoms, prefix, name) for name in (pair.geomname1, pair.geomname2))
    return Names(bodies, names["joints"], geoms, names["sites"])


def _renamed(world: mujoco.MjSpec, kind: str, prefix: str) -> dict[str, str]:
    elements = list(getattr(world, kind))
    taken = {e.name for e in elements}
    reserved = RESERVED.get(kind, ANY_KIND)
    names = {}
    for element in elements:
        if not element.name.startswith(prefix):
            continue
        own = element.name.removeprefix(prefix)
        names[own] = element.name
        if own and own not in taken and not reserved.fullmatch(own):
            element.name = names[own] = own
            taken.add(own)
    return names


def _now(names: dict[str, str], prefix: str, name: str) -> str:
    return names.get(name.removeprefix(prefix), name) if name.startswith(prefix) else name
