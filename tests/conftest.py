"""Small cases that check in about a second."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import mujoco  # noqa: F401  (pytester forgets modules that its tests import first, and these load once a process)
import pytest
import trimesh
import yaml
from browser import NAMES, Browser

if TYPE_CHECKING:
    from cell.check import Result

pytest_plugins = ["pytester"]


def boss_mesh(length: float = 12.0, width: float = 8.0, height: float = 5.0, radius: float = 20.0):
    """A box on a cylinder of ``radius`` about z, pointing along -x; its foot is inside the cylinder."""
    box = trimesh.creation.box((height + 4.0, length, width))
    box.apply_translation([-(radius - 4.0 + (height + 4.0) / 2), 0.0, 20.0])
    return box


@pytest.fixture
def make_case(tmp_path: Path) -> Callable[..., Path]:
    """Write a case of a boss on a hub; sections given are merged in."""

    def make(name: str = "boss", **sections: Any) -> Path:
        boss_mesh().export(tmp_path / "boss.stl")
        content: dict[str, Any] = {
            "part": {"sub_volumes": ["boss.stl"], "body": {"radius_mm": 20, "z_mm": [0, 40]}},
            "support": {"radius_mm": 15, "height_mm": 100},
            "positioner": {"position_mm": [1500, 0, 0], "rotation_deg": [0, 0, -90]},
            "table": {"E1_deg": 90, "E2_deg": 180},
        }
        for key, value in sections.items():
            content[key] = {**content[key], **value} if isinstance(content.get(key), dict) else value
        path = tmp_path / f"{name}.case.yaml"
        path.write_text(yaml.safe_dump(content), encoding="utf-8")
        return path

    return make


LITTLE = """
name: boss
part: {sub_volumes: [boss.stl], body: {radius_mm: 9, z_mm: [0, 40]}}
support: {radius_mm: 8, height_mm: 100}
positioner: {position_mm: [1500, 0, 0], rotation_deg: [0, 0, -90]}
table: {E1_deg: 90, E2_deg: 180}
"""


def little_case(folder: Path) -> Path:
    """A low box on a cylinder, on the side that is up at E1 = 90, E2 = 180 deg."""
    box = trimesh.creation.box((8.0, 8.0, 12.0))
    box.apply_translation((-9.0, 0.0, 20.0))
    box.export(folder / "boss.stl")
    path = folder / "boss.case.yaml"
    path.write_text(LITTLE, encoding="utf-8")
    return path


@pytest.fixture(scope="session")
def little(tmp_path_factory: pytest.TempPathFactory) -> Result:
    """A feasible result that is quickly had, to look at."""
    from cell.check import check
    from cell.config import load_case
    from cell.job import prepare

    found = check(prepare(load_case(little_case(tmp_path_factory.mktemp("boss")))), 90, 180)
    assert found.motion is not None
    return found


@pytest.fixture(scope="session")
def gl() -> None:
    """Skip where nothing can be rendered; on CI that is a failure."""
    from cell.errors import InputError
    from cell.picture import require_gl

    try:
        require_gl()
    except InputError as error:
        if os.environ.get("CI"):
            raise
        pytest.skip(str(error))


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    """Skips where there is no browser; on CI that is a failure."""
    program = next(filter(None, map(shutil.which, NAMES)), None)
    try:
        import websockets  # noqa: F401
    except ImportError:
        why = "the package websockets is not installed"
    else:
        why = "" if program else "there is no Chromium (apt-get install chromium)"
    if why:
        if os.environ.get("CI"):
            pytest.fail(why)
        pytest.skip(why)
    profile = tempfile.mkdtemp()
    started = Browser(str(program), profile)
    yield started
    started.close()
    shutil.rmtree(profile, ignore_errors=True)
