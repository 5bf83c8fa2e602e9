"""Files that a model reads are those that MuJoCo reads, wherever it is compiled."""

import mujoco
import numpy as np
import pytest
import trimesh

from cell.errors import InputError
from cell.mjcf.asset_files import settle_files

CHILD = """<mujoco><compiler meshdir="meshes"/><asset>
<mesh name="m" file="hull.stl" scale="2 1 1" refpos="0.1 0 0"/></asset>
<worldbody><body name="b"><geom name="theirs" type="mesh" mesh="m"/></body></worldbody></mujoco>"""
PARENT = """<mujoco><compiler meshdir="meshes"/><asset><mesh name="m" file="hull.stl"/>{more}</asset>
<worldbody><geom name="ours" type="mesh" mesh="m"/>{body}</worldbody></mujoco>"""


def write(folder, size):
    (folder / "meshes").mkdir(parents=True)
    box = trimesh.creation.box(size)
    box.apply_translation((0.3, 0.2, 0.1))
    box.export(folder / "meshes/hull.stl")


def corners(model):
    """Bounds of each shape's vertices in the world, by its name."""
    data, found = mujoco.MjData(model), {}
    mujoco.mj_kinematics(model, data)
    for g in range(model.ngeom):
        m = model.geom_dataid[g]
        points = model.mesh_vert[model.mesh_vertadr[m] :][: model.mesh_vertnum[m]]
        points = points @ data.geom_xmat[g].reshape(3, 3).T + data.geom_xpos[g]
        found[model.geom(g).name] = np.array([points.min(axis=0), points.max(axis=0)])
    return found


def test_an_attached_models_meshes_are_its_own_though_another_folder_has_files_of_that_name(tmp_path):
    write(tmp_path / "ours", (1.0, 2.0, 3.0))
    write(tmp_path / "theirs", (0.1, 0.2, 0.4))
    (tmp_path / "theirs/hand.xml").write_text(CHILD)
    more, body = '<model name="hand" file="../theirs/hand.xml"/>', '<attach model="hand" prefix="h_" body="b"/>'
    path = tmp_path / "ours/arm.xml"
    path.write_text(PARENT.format(more=more, body=body))
    right = corners(mujoco.MjModel.from_xml_path(str(path)))
    assert np.allclose(np.ptp(right["h_theirs"], axis=0), (0.2, 0.2, 0.4))
    spec = mujoco.MjSpec.from_file(str(path))
    settle_files(spec, path)
    world = mujoco.MjSpec()
    world.attach(spec, frame=world.worldbody.add_frame(), prefix="robot/")
    found = corners(world.compile())
    assert set(found) == {"robot/ours", "robot/h_theirs"}
    for name, bounds in right.items():
        assert np.allclose(found[f"robot/{name}"], bounds, atol=1e-6)


def test_a_mesh_that_is_not_there_is_named(tmp_path):
    path = tmp_path / "arm.xml"
    path.write_text(PARENT.format(more="", body=""))
    with pytest.raises(InputError, match=r"arm\.xml.*hull\.stl"):
        settle_files(mujoco.MjSpec.from_file(str(path)), path)
