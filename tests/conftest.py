"""Small cases that check in about a second."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import mujoco  # noqa: F401  (pytester forgets modules that its tests import first, and these load once a process)
import pytest
import trimesh
import yaml
from browser import NAMES, Browser

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
