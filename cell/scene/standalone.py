"""The composed cell as one MJCF that plain MuJoCo loads.

Use:

    Path("cell.xml").write_text(standalone_xml(scene))
"""

from __future__ import annotations

import mujoco
import numpy as np

from .compose import put_together
from .scene import Scene


def standalone_xml(scene: Scene) -> str:
    """The scene as one MJCF without other files: meshes are written into it.

    Args:
        scene: the composed cell.

    Returns:
        XML that plain MuJoCo loads.
    """
    import trimesh

    spec = put_together(scene.case, scene.part).pieces.world
    for mesh in spec.meshes:
        if not mesh.file:
            continue
        solid = trimesh.load_mesh(mesh.file, process=False)
        mesh.uservert = np.asarray(solid.vertices, dtype=np.float64).ravel()
        mesh.userface = np.asarray(solid.faces, dtype=np.int32).ravel()
        mesh.file = ""
    _without_images(spec)
    spec.compile()
    return str(spec.to_xml())


def _without_images(spec: mujoco.MjSpec) -> None:
    """Leave out textures that are files; materials keep their colours."""
    images = {texture.name for texture in spec.textures if texture.file or any(texture.cubefiles)}
    for material in spec.materials:
        material.textures = ["" if name in images else name for name in material.textures]
    for texture in [t for t in spec.textures if t.name in images]:
        spec.delete(texture)
