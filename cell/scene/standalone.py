"""The composed cell as one MJCF that plain MuJoCo loads.

Use:

    Path("cell.xml").write_text(standalone_xml(scene))
"""

from __future__ import annotations

import numpy as np

from .compose import _without_images
from .scene import Scene


def standalone_xml(scene: Scene) -> str:
    """The scene as one MJCF without other files: meshes are written into it.

    Args:
        scene: the composed cell.

    Returns:
        XML that plain MuJoCo loads.
    """
    import trimesh

    spec = scene.spec.copy()
    for mesh in spec.meshes:
        if not mesh.file:
            continue
        solid = trimesh.load_mesh(mesh.file, process=False)
        mesh.uservert = np.asarray(solid.vertices, dtype=np.float64).ravel()
        mesh.userface = np.asarray(solid.faces, dtype=np.int32).ravel()
        mesh.file = ""
    _without_images(spec)
    return str(spec.to_xml())
