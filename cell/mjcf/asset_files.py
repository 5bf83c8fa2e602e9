"""Files that a model reads, found wherever the cell is compiled.

    settle_files(spec, path)                  # spec as it was read from the MJCF at this path

A model may attach others, each with its own folder of meshes, which MuJoCo alone knows: the meshes of such a model are
written into it.
"""

from __future__ import annotations

import re
from pathlib import Path

import mujoco
import numpy as np

from ..case.files import asset_path
from ..errors import InputError

ATTACHES = re.compile(rb"<model\s[^>]*\bfile\s*=")


def settle_files(spec: mujoco.MjSpec, path: Path) -> None:
    """Give files by their whole paths; meshes of attached models and of unknown folders are written into the model.

    Args:
        spec: a model as it was read; changed in place.
        path: the file it was read from.

    Raises:
        InputError: MuJoCo does not find a mesh.
    """
    nested = _attaches(path)
    unknown = []
    for mesh in spec.meshes:
        if mesh.file:
            at = asset_path(mesh.file, spec, path.parent / spec.meshdir)
            if nested or not at.is_file():
                unknown.append(mesh)
            else:
                mesh.file = str(at)
    if unknown:
        _write_in(spec, unknown, path)
    for hfield in spec.hfields:
        if hfield.file:
            hfield.file = str(asset_path(hfield.file, spec, path.parent / spec.meshdir))
    for texture in spec.textures:
        if texture.file:
            texture.file = str(asset_path(texture.file, spec, path.parent / spec.texturedir))
    spec.strippath = False  # of the names as they are now


def _attaches(path: Path) -> bool:
    """Whether a model, or one that it includes, names other models."""
    files = [path, *map(Path, mujoco.mju_getXMLDependencies(str(path)))]
    texts = [file for file in files if file.suffix.lower() in (".xml", ".mjcf") and file.is_file()]
    return any(ATTACHES.search(file.read_bytes()) for file in texts)


def _write_in(spec: mujoco.MjSpec, meshes: list[mujoco.MjsMesh], path: Path) -> None:
    """Write meshes into a model as MuJoCo reads them."""
    try:
        model = spec.copy().compile()
    except ValueError as error:
        raise InputError(f"{path}: does not compile: {' '.join(str(error).split())}") from None
    ids = {model.mesh(m).name: m for m in range(model.nmesh)}
    for mesh in meshes:
        if mesh.name not in ids:
            continue
        m, turn = ids[mesh.name], np.zeros(9)
        mujoco.mju_quat2Mat(turn, model.mesh_quat[m])
        v, f = int(model.mesh_vertadr[m]), int(model.mesh_faceadr[m])
        vertices = model.mesh_vert[v : v + model.mesh_vertnum[m]].astype(np.float64)
        faces = model.mesh_face[f : f + model.mesh_facenum[m]]
        mesh.file, mesh.scale = "", (1.0, 1.0, 1.0)
        mesh.refpos, mesh.refquat = (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)
        mesh.uservert = (vertices @ turn.reshape(3, 3).T + model.mesh_pos[m]).ravel()
        mesh.userface = faces.astype(np.int32).ravel()
