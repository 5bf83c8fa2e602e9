"""Small cases that check in about a second."""

from __future__ import annotations

import gc
import os
import shutil
import tempfile
from collections.abc import Callable, Generator, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import mujoco  # noqa: F401  (pytester forgets modules that its tests import first, and these load once a process)
import pytest
import yaml
from hypothesis import HealthCheck, settings
from support.browser import NAMES, Browser
from support.jobs.cases import boss_mesh, little_case

if TYPE_CHECKING:
    from cell.verdict.result import Result

pytest_plugins = ["pytester"]

# how long an example takes says nothing on a machine that does other things as well
settings.register_profile("rbam-cell", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("rbam-cell")


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, Any, Any]:
    """What is imported and collected stays to the end: looking through it for garbage again and again takes time."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.collect()
        gc.freeze()
        gc.set_threshold(10_000, 20, 20)
        gc.enable()


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
def little(tmp_path_factory: pytest.TempPathFactory) -> Result:
    """A feasible result that is quickly had, to look at."""
    from cell.case.read import load_case
    from cell.job.job import prepare
    from cell.verdict.check import check_fixed

    found = check_fixed(prepare(load_case(little_case(tmp_path_factory.mktemp("boss")))), 90, 180)
    assert found.motion is not None
    return found


@pytest.fixture(scope="session")
def gl() -> None:
    """Skip where nothing can be rendered; on CI that is a failure."""
    from cell.errors import InputError
    from cell.view.picture import require_gl

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
