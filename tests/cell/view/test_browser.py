"""Replay in a browser: on loopback unless told otherwise, alive in a real one, and gone on Ctrl-C."""

from __future__ import annotations

import base64
import http.client
import io
import logging
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from urllib.parse import urlsplit

import mujoco
import numpy as np
import pytest
from support.browser import Browser, wait_for
from support.jobs.cases import little_case
from support.paths import ROOT

from cell.errors import InputError
from cell.failure import Contact, Failure, Kind
from cell.verdict.result import Result
from cell.view.browser import LOOPBACK, PIECES, _is_news, listen
from cell.view.browser_stage import ROOM, BrowserStage
from cell.view.player import KEYS, Player
from cell.view.stage_scene import StagedScene


def test_a_port_is_taken_on_this_machine_alone() -> None:
    with listen(LOOPBACK, 0) as place:
        assert place.private
        assert place.sock.getsockname() == ("127.0.0.1", place.port)
        assert place.address == f"http://127.0.0.1:{place.port}/"
        place.sock.listen()
        with listen(LOOPBACK, 0) as other:
            assert other.port != place.port
        with pytest.raises(InputError, match=f"port {place.port}"), listen(LOOPBACK, place.port):
            pass
    with listen("0.0.0.0", 0) as place:
        assert not place.private


@pytest.mark.parametrize(("host", "port"), [("no.such.host.invalid", 0), ("192.0.2.1", 0), (LOOPBACK, 70000)])
def test_a_place_that_is_none_is_refused_in_one_line(host: str, port: int) -> None:
    with pytest.raises(InputError) as caught, listen(host, port):
        pass
    assert "\n" not in str(caught.value)


def test_the_viewer_is_brought_to_the_players_frame(little: Result) -> None:
    player, staged = Player(little), StagedScene(little, PIECES)
    stage = BrowserStage(staged, player)
    viewer = SimpleNamespace(
        data=mujoco.MjData(staged.model), camera=mujoco.MjvCamera(), vis_options=mujoco.MjvOption(), extra_geoms=[]
    )
    player.playing = False
    counts = []
    for moment in (0.0, player.end / 2, player.end, player.end / 4):
        player.time = moment
        assert not stage.update(viewer)
        np.testing.assert_array_equal(viewer.data.qpos[little.job.scene.arm_qpos], player.frame().q)
        counts.append(len(viewer.extra_geoms))
    assert counts[0] < counts[1] < counts[2] <= ROOM
    assert counts[0] < counts[3] < counts[1]
    for key in ("t", "o", "c", "v"):
        player.key(KEYS[key])
    before = viewer.camera.distance
    stage.update(viewer)
    assert len(viewer.extra_geoms) > counts[3] + 2 * len(little.rows) - 2
    assert viewer.camera.distance < before


def test_what_collides_is_sent_to_the_browser_anew(little: Result) -> None:
    rows = list(little.rows)
    hit = Failure(Kind.COLLISION, -1.0, 5.0, contact=Contact(("torch_nozzle", "support")))
    rows[2] = replace(rows[2], failure=hit, q=None, attempt=rows[2].q)
    rows[3] = replace(rows[3], failure=Failure(Kind.UNREACHABLE, 1.0), q=None)
    bad = replace(little, rows=tuple(rows), motion=None)
    player, staged = Player(bad), StagedScene(bad, PIECES)
    stage = BrowserStage(staged, player)
    viewer = SimpleNamespace(
        data=mujoco.MjData(staged.model), camera=mujoco.MjvCamera(), vis_options=mujoco.MjvOption(), extra_geoms=[]
    )
    player.playing = False
    assert stage.update(viewer)
    assert not stage.update(viewer)
    player.key(KEYS["n"])
    assert stage.update(viewer)


@pytest.fixture
def served(tmp_path: Path) -> Iterator[tuple[subprocess.Popen[bytes], str, Path]]:
    """``rbam replay --web`` in a process of its own, and its address."""
    said = tmp_path / "said"
    command = [sys.executable, "-m", "cell", "replay", "--web", "--loop", str(little_case(tmp_path))]
    env = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "WAYLAND_DISPLAY")}
    with said.open("wb") as out:
        process = subprocess.Popen(command, cwd=ROOT, env=env, stdout=out, stderr=subprocess.STDOUT)
    try:
        wait_for(lambda: "Ctrl-C" in said.read_text() or process.poll() is not None, 60)
        assert process.poll() is None, said.read_text()
        yield process, said.read_text().split("replay at ")[1].split()[0], said
    finally:
        process.kill()
        process.wait(20)


def stopped(process: subprocess.Popen[bytes], said: Path) -> None:
    process.send_signal(signal.SIGINT)
    assert process.wait(30) == 0
    assert "Traceback" not in said.read_text(), said.read_text()


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="Ctrl-C is sent as a signal")
def test_it_plays_in_a_browser_and_stops_on_ctrl_c(
    served: tuple[subprocess.Popen[bytes], str, Path],
    browser: Browser,
) -> None:
    process, address, said = served
    assert address.startswith("http://127.0.0.1:")
    port = urlsplit(address).port or 0
    with socket.socket() as elsewhere:
        # every address of this machine but loopback's own is closed
        assert elsewhere.connect_ex(("127.0.0.2", port)) != 0
    browser.events.clear()
    browser("Emulation.setDeviceMetricsOverride", width=480, height=400, deviceScaleFactor=1, mobile=False)
    browser("Page.navigate", url=address)
    time.sleep(1.0)  # the page gets a process of its own, to which the browser has to be attached first
    wait_for(lambda: browser.js("document.readyState") == "complete", 30)

    def shot() -> np.ndarray:
        from PIL import Image

        png = base64.b64decode(browser("Page.captureScreenshot")["data"])
        return np.asarray(Image.open(io.BytesIO(png)).convert("RGB")).astype(int)

    def orange() -> bool:
        """Whether the arm is there: it is beside the panel."""
        image = shot()[:, 392:]
        return bool(((image[..., 0] > 120) & (image[..., 2] < 60)).sum() > 100)

    wait_for(orange, 90)
    assert shot().std() > 10
    first = shot()
    wait_for(lambda: np.abs(shot() - first).max() > 30, 30)  # it plays
    problems = [p for p in browser.problems() if not p.startswith(address.split("?")[0])]
    assert problems == []
    browser("Page.navigate", url="about:blank")
    stopped(process, said)


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="Ctrl-C is sent as a signal")
def test_nobody_from_elsewhere_is_let_in_and_ctrl_c_stops_it(
    served: tuple[subprocess.Popen[bytes], str, Path],
) -> None:
    process, address, said = served
    where = urlsplit(address)

    def asked(path: str, **headers: str) -> int:
        """The server's answer to a browser that would open a socket."""
        upgrade = {"Upgrade": "websocket", "Connection": "Upgrade", "Sec-WebSocket-Version": "13"}
        key = {"Sec-WebSocket-Key": base64.b64encode(bytes(16)).decode()}
        connection = http.client.HTTPConnection("127.0.0.1", where.port or 0, timeout=20)
        connection.request("GET", path, headers={**upgrade, **key, **headers})
        status = connection.getresponse().status
        connection.close()
        return status

    own = {"Cookie": f"rbam-{where.port}={where.query.removeprefix('token=')}"}
    for path in ("/state?sid=a", "/ui?sid=a"):
        assert asked(path, **own) == 101
        assert asked(path, **own, Origin=f"http://127.0.0.1:{where.port}") == 101
        assert asked(path) == 403
        for origin in ("http://evil.example", "null"):
            assert asked(path, **own, Origin=origin) == 403
        assert asked(path, **own, Host="evil.example") == 403
    assert asked("/drop?sid=a", **own) == 403  # 60 MB a time stayed in its memory
    stopped(process, said)


def test_a_browser_that_goes_while_it_is_sent_to_is_no_news() -> None:
    from websockets.exceptions import ConnectionClosedError

    def record(error: BaseException | None) -> logging.LogRecord:
        info = None if error is None else (type(error), error, None)
        return logging.LogRecord("asyncio", logging.ERROR, "", 0, "unhandled exception", (), info)

    assert not _is_news(record(ConnectionClosedError(None, None)))
    assert not _is_news(record(ConnectionResetError()))
    assert _is_news(record(KeyError("x")))
    assert _is_news(record(None))
