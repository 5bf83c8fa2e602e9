"""One page of a headless Chromium, driven over its DevTools protocol (package ``websockets``)."""

from __future__ import annotations

import base64
import io
import json
import subprocess
import time
import urllib.request
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np

FLAGS = (
    *("--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--hide-scrollbars"),
    *("--disable-background-networking", "--disable-component-update", "--disable-sync"),
    *("--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--remote-debugging-port=0"),
)
NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")


class Browser:
    """One page of a headless Chromium."""

    def __init__(self, program: str, profile: str) -> None:
        from websockets.sync.client import connect

        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        self.process = subprocess.Popen([program, *FLAGS, f"--user-data-dir={profile}", "about:blank"], **quiet)
        port = wait_for(lambda: _first_line(Path(profile) / "DevToolsActivePort"), 30)
        with urllib.request.urlopen(f"http://127.0.0.1:{port}/json") as answer:
            page = next(t for t in json.load(answer) if t["type"] == "page")
        self.stack = ExitStack()
        self.socket = self.stack.enter_context(connect(page["webSocketDebuggerUrl"], max_size=None))
        self.count, self.events = 0, []
        for domain in ("Page", "Runtime", "Log", "Network"):
            self(f"{domain}.enable")

    def __call__(self, method: str, **params: Any) -> dict[str, Any]:
        self.count += 1
        self.socket.send(json.dumps({"id": self.count, "method": method, "params": params}))
        while True:
            message = json.loads(self.socket.recv(timeout=60))
            if message.get("id") == self.count:
                assert "error" not in message, message
                return message["result"]
            self.events.append(message)

    def js(self, code: str) -> Any:
        found = self("Runtime.evaluate", expression=code, awaitPromise=True, returnByValue=True)
        assert "exceptionDetails" not in found, found
        return found["result"].get("value")

    def open(self, path: Path, width: int = 1000, height: int = 640, theme: str = "light") -> float:
        """Open a page; gives the milliseconds until it was ready."""
        self.events.clear()
        self("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=width < 500)
        self("Emulation.setEmulatedMedia", media="", features=[{"name": "prefers-color-scheme", "value": theme}])
        self("Page.navigate", url="about:blank")
        self("Page.navigate", url=path.as_uri())
        return float(wait_for(lambda: self.js("document.documentElement?.dataset.ready"), 20))

    def settle(self) -> None:
        """Wait until the view has been drawn as it is drawn at rest."""
        # the frame after the one in which it is drawn: only then is that one on the screen
        frame = "requestAnimationFrame(() => requestAnimationFrame(done))"
        self.js(f"new Promise((done) => setTimeout(() => {frame}, 350))")

    def pixels(self, of: str = "#view") -> np.ndarray:
        from PIL import Image

        self.settle()
        box = self.js(f"(({{x, y, width, height}}) => [x + scrollX, y + scrollY, width, height])"
                      f"(document.querySelector('{of}').getBoundingClientRect())")  # fmt: skip
        clip = dict(zip(("x", "y", "width", "height"), box, strict=True), scale=1)
        png = base64.b64decode(self("Page.captureScreenshot", clip=clip, captureBeyondViewport=True)["data"])
        return np.asarray(Image.open(io.BytesIO(png)).convert("RGB")).astype(int)

    def middle(self, of: str) -> tuple[float, float]:
        """Where an element is in the window."""
        self.js(f"document.querySelector('{of}').scrollIntoView({{block: 'center'}})")
        return tuple(self.js(f"(({{x, y, width, height}}) => [x + width / 2, y + height / 2])"
                             f"(document.querySelector('{of}').getBoundingClientRect())"))  # fmt: skip

    def mouse(self, kind: str, x: float, y: float, held: bool = False) -> None:
        button = "left" if held or kind != "mouseMoved" else "none"
        self("Input.dispatchMouseEvent", type=kind, x=x, y=y, button=button, buttons=int(held), clickCount=1)

    def click(self, of: str) -> None:
        x, y = self.middle(of)
        self.mouse("mousePressed", x, y, held=True)
        self.mouse("mouseReleased", x, y)

    def problems(self) -> list[str]:
        """Errors on the console, and everything that was asked of a network."""
        self.js("1")
        out = []
        for event in self.events:
            p = event.get("params", {})
            if event["method"] == "Runtime.exceptionThrown":
                out.append(str(p["exceptionDetails"]))
            elif event["method"] == "Runtime.consoleAPICalled" and p["type"] in ("error", "warning", "assert"):
                out.append(str(p["args"]))
            elif event["method"] == "Log.entryAdded" and p["entry"]["level"] == "error":
                out.append(p["entry"]["text"])
            elif event["method"] == "Network.requestWillBeSent":
                url = p["request"]["url"]
                out += [] if url.startswith(("file:", "data:", "about:")) else [url]
            elif event["method"] == "Page.javascriptDialogOpening":
                out.append(p["message"])
        return out

    def close(self) -> None:
        self.stack.close()
        self.process.terminate()
        self.process.wait(20)


def _first_line(path: Path) -> str | None:
    lines = path.read_text().split() if path.exists() else []
    return lines[0] if lines else None


def wait_for(found: Callable[[], Any], seconds: float) -> Any:
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        value = found()
        if value:
            return value
        time.sleep(0.02)
    raise AssertionError(f"nothing within {seconds} s")
