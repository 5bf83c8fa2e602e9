"""Random cells of all shape kinds stay what they are however their models are written, and wherever they stand."""

from xml.etree import ElementTree as Tree

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.cells.cell_models import driven, fused, mirrored, renamed, unnamed, with_bodies_between, with_visuals
from support.cells.random_cells import arm_xml, random_cell, table_xml, torch_xml, write_meshes

from cell.case.read import parse_case
from cell.collision.checker import Checker
from cell.job.job import prepare
from cell.scene.compose import compose

REACH, CONFIGURATIONS = 0.05, 60
SAME = 1e-6  # m
SEEDS = (11, 12, 13)
LINKS = ("base_link", *(f"link_{k}" for k in range(1, 7)))
MODELS = {"robot": arm_xml, "tool": torch_xml, "positioner": table_xml}


@pytest.fixture(scope="module")
def part(tmp_path_factory):
    folder = tmp_path_factory.mktemp("part")
    write_meshes(folder)
    return prepare(random_cell(np.random.default_rng(0), folder)).shape


def written(folder, seed):
    """A random cell of models of its own, as the content of a case and the models' texts."""
    rng = np.random.default_rng(seed)
    write_meshes(folder)
    content = random_cell(rng, folder).model_dump(mode="json", exclude_unset=True)
    return content, {key: make(rng) for key, make in MODELS.items()}


def distances(folder, part, content, texts, deposits_laid=None):
    """Least distances in random configurations at a random pose of the table, m."""
    content = {**content}
    for key, text in texts.items():
        (folder / f"{key}.xml").write_text(text, encoding="utf-8")
        content[key] = {**content.get(key, {}), "model": f"{key}.xml"}
    content["tool"]["wire"] = ["wire"]
    scene = compose(parse_case(content, folder / "cell.case.yaml"), part)
    rng = np.random.default_rng(5)
    table = tuple(rng.uniform(*scene.table_range.T).tolist())
    q = rng.uniform(scene.chain.lower, scene.chain.upper, (CONFIGURATIONS, scene.chain.n))
    laid = (
        rng.integers(0, scene.n_deposits + 1, CONFIGURATIONS)
        if deposits_laid is None
        else np.full(CONFIGURATIONS, deposits_laid)
    )
    found = Checker(scene, table, REACH).clearances(q, laid)
    return np.minimum(found.distance, REACH)


def every(change, **keep):
    return lambda texts: {key: change(text, **keep) if keep else change(text) for key, text in texts.items()}


REWRITTEN = {
    "renamed": every(renamed, keep=("wire", *LINKS)),
    "unnamed": every(unnamed, keep=("wire", *LINKS)),
    "visuals": every(with_visuals),
    "driven": lambda t: {**t, "robot": driven(t["robot"]), "positioner": driven(t["positioner"])},
    "bodies between": lambda t: {**t, "robot": with_bodies_between(t["robot"]), "tool": with_bodies_between(t["tool"])},
    "fused": lambda t: {**t, "tool": fused(t["tool"]), "positioner": fused(t["positioner"])},
}


@pytest.mark.parametrize("seed", SEEDS)
def test_however_the_models_of_a_random_cell_are_written_it_is_as_clear(seed, part, tmp_path):
    content, texts = written(tmp_path, seed)
    usual = distances(tmp_path, part, content, texts)
    assert len(np.unique(usual)) > 10  # near enough to something to tell cells apart
    for name, change in REWRITTEN.items():
        other = distances(tmp_path, part, content, change(texts))
        assert np.allclose(usual, other, atol=SAME), name


def turned(place, turn, shift):
    """A position and rotation of a case, moved with its whole cell."""
    position = turn.apply(place.get("position_mm", [0, 0, 0])) + shift
    rotation = turn * Rotation.from_euler("xyz", place.get("rotation_deg", [0, 0, 0]), degrees=True)
    return {
        **place,
        "position_mm": position.tolist(),
        "rotation_deg": rotation.as_euler("xyz", degrees=True).tolist(),
    }


@pytest.mark.parametrize("seed", SEEDS)
def test_a_random_cell_that_is_moved_and_turned_is_as_clear(seed, part, tmp_path):
    content, texts = written(tmp_path, seed)
    usual = distances(tmp_path, part, content, texts)
    turn, shift = Rotation.from_euler("z", 37.0, degrees=True), np.array([400.0, -900.0, 0.0])
    moved = {**content, "fixtures": [turned(f, turn, shift) for f in content["fixtures"]]}
    for key in ("robot", "positioner"):
        moved[key] = turned(content.get(key, {}), turn, shift)
    assert np.allclose(usual, distances(tmp_path, part, moved, texts), atol=SAME)


def in_the_mirror(text):
    """:func:`mirrored`, the corners of meshes too."""
    tree = Tree.fromstring(mirrored(text))
    for mesh in tree.iter("mesh"):
        corners = np.array(mesh.get("vertex").split(), dtype=float).reshape(-1, 3) * (1, -1, 1)
        mesh.set("vertex", " ".join(f"{v:.9f}" for v in corners.ravel()))
    return Tree.tostring(tree, encoding="unicode")


@pytest.mark.parametrize("seed", SEEDS)
def test_a_random_cell_in_the_mirror_is_as_clear(seed, part, tmp_path):
    content, texts = written(tmp_path, seed)
    usual = distances(tmp_path, part, content, texts, deposits_laid=0)
    fixtures = []
    for fixture in content["fixtures"]:  # each is its own mirror image, where it stands
        x, y, z = fixture["position_mm"]
        R = Rotation.from_euler("xyz", fixture["rotation_deg"], degrees=True).as_matrix()
        flip = np.diag([1.0, -1.0, 1.0])
        rotation = Rotation.from_matrix(flip @ R @ flip).as_euler("xyz", degrees=True)
        fixtures.append({**fixture, "position_mm": [x, -y, z], "rotation_deg": rotation.tolist()})
    positioner = {**content["positioner"], "rotation_deg": [0, 0, 90]}
    mirror = {**content, "fixtures": fixtures, "positioner": positioner}
    other = distances(
        tmp_path, part, mirror, {key: in_the_mirror(text) for key, text in texts.items()}, deposits_laid=0
    )
    assert np.allclose(usual, other, atol=1e-4)  # the body is a polygon, and a wire's corners are rounded
