"""Replay in a browser, through MuJoCo's web viewer: for machines without a display, or to look from another one.

    with listen("127.0.0.1", 0) as place:
        replay_in_browser(check(prepare(case), 90, 180), place, speed=5)     # returns on Ctrl-C

The viewer binds every interface and has no password. It is handed a socket of ours instead, which is bound to this
machine alone unless an interface is asked for by name. ``cell.view.web_guard`` decides on access. From another machine
use ``ssh -L 8080:localhost:8080``: browsers run the viewer at localhost (or over https) only.
"""

from __future__ import annotations

import contextlib
import ipaddress
import logging
import signal
import socket
import sys
import threading
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ..errors import InputError
from .browser_stage import BrowserStage
from .player import Player
from .stage_scene import StagedScene
from .web_guard import Guard

if TYPE_CHECKING:
    from ..verdict.result import Result
    from .colours import Colouring

LOOPBACK = "127.0.0.1"
PORTS = range(8080, 8180)  # of which the first free one is taken
PIECES = 600  # of beads; the rest is for marks and normals
RESTING = 0.02  # s between looks for a browser
WARNING = (
    "rbam: anyone who has this address can watch and control the replay, and the connection is not encrypted. "
    "A browser on another machine needs https or ssh -L {port}:localhost:{port}\n"
)


@dataclass(frozen=True, eq=False)
class Address:
    """Where the viewer listens.

    Attributes:
        sock: bound, not yet listening.
        host: its interface.
        port: its port.
    """

    sock: socket.socket
    host: str
    port: int

    @property
    def address(self) -> str:
        """For a browser."""
        return f"http://{f'[{self.host}]' if ':' in self.host else self.host}:{self.port}/"

    @property
    def private(self) -> bool:
        """Whether it can be reached from this machine alone."""
        return ipaddress.ip_address(self.sock.getsockname()[0]).is_loopback


@contextlib.contextmanager
def listen(host: str, port: int) -> Iterator[Address]:
    """Take a port, before the work rather than after it.

    Args:
        host: name or address of an interface of this machine.
        port: 0 for the first free one from 8080.

    Yields:
        The place.

    Raises:
        InputError: there is no such interface, or no such port is free; one line.
    """
    if not 0 <= port <= 65535:
        raise InputError(f"--port: {port} is not in 0 .. 65535")
    try:
        family, kind, _, _, where = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
    except OSError as error:
        raise InputError(f"--host: {host!r} is not an address ({error.strerror or error})") from None
    sock = socket.socket(family, kind)
    try:
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        _bind(sock, str(where[0]), [port] if port else PORTS)
        yield Address(sock, host, sock.getsockname()[1])
    finally:
        sock.close()


def _bind(sock: socket.socket, host: str, ports: Any) -> None:
    for port in ports:
        try:
            sock.bind((host, port))
        except OSError as error:
            why = error
        else:
            return
    raise InputError(f"cannot listen on {host} port {ports[0]}: {why.strerror or why}; choose another --host or --port")


def replay_in_browser(
    result: Result, place: Address, *, speed: float = 1.0, loop: bool = False, colour: Colouring = "layer"
) -> None:
    """Serve a result to browsers until Ctrl-C is pressed.

    Args:
        result: from ``cell.check``.
        place: from :func:`listen`.
        speed: times real time.
        loop: whether to start again at the end.
        colour: what the beads' colours mean at first.

    Raises:
        InputError: the speed is not above 0, or MuJoCo has no web viewer; one line.
    """
    player = Player(result, speed, loop, colour)
    staged = StagedScene(result, PIECES)
    staged.pose(player.frame())
    guard = Guard(place.host, place.port)
    with _stopped() as stop, contextlib.redirect_stdout(sys.stderr), _guarded(guard):
        viewer, update, gui = _opened(staged, player, place)
        try:
            sys.stderr.write(f"rbam: replay at {guard.address} (stop with Ctrl-C)\n")
            if not place.private:
                sys.stderr.write(WARNING.format(port=place.port))
            sys.stderr.flush()
            while not stop.is_set():
                if not viewer.prepare_next_frame():
                    stop.wait(RESTING)
                    continue
                viewer.dispatch(update)
                viewer.dispatch(gui)
                viewer.sync()
        finally:
            viewer.close()


@contextlib.contextmanager
def _stopped() -> Iterator[threading.Event]:
    """An event that Ctrl-C sets: an exception in the middle of a window's layout would abort the process."""
    stop = threading.Event()
    signals = (signal.SIGINT, signal.SIGTERM)
    before = {s: signal.signal(s, lambda *_: stop.set()) for s in signals}
    try:
        yield stop
    finally:
        for s, handler in before.items():
            signal.signal(s, handler)


@contextlib.contextmanager
def _guarded(guard: Guard) -> Iterator[None]:
    """Have the viewer's server ask the guard, where there is such a server; its thread may start late."""
    try:
        from mujoco.studio.web import web_server
    except ImportError:
        yield  # _opened says so
        return
    with guard.kept(web_server):
        yield


def _opened(staged: StagedScene, player: Player, place: Address) -> tuple[Any, Any, Any]:
    try:
        from mujoco.studio import launch_thread, messages, viewer_protocol, web_viewer
    except ImportError as error:
        raise InputError(
            f"MuJoCo's web viewer cannot be loaded ({error}); rbam check --html F.html needs none"
        ) from None
    from .browser_panel import Panel

    sockets: list[socket.socket] = []

    def bind(_host: str, _port: int = 0) -> socket.socket:
        sockets.append(place.sock)
        return place.sock

    # browsers that come and go in the middle of a handshake are no news, least of all with a traceback
    logging.getLogger("websockets").setLevel(logging.CRITICAL)
    logging.getLogger("websockets.server").setLevel(logging.CRITICAL)
    # nor is one that has gone while something was still being sent to it
    logging.getLogger("asyncio").addFilter(_is_news)
    endpoint, _ = launch_thread.make_thread_endpoints()
    config = viewer_protocol.ViewerConfig(title=f"rbam: {staged.result.job.case.title}", gfx="web")
    with (
        _instead(web_viewer.web_server, "bind_public_socket", bind),
        _instead(web_viewer, "_print_url_banner", lambda *_: None),  # it always says localhost
    ):
        viewer = web_viewer.WebViewer(
            config, endpoint, model=staged.model, plugins=[Panel(player, BrowserStage(staged, player))]
        )
    # that a browser has connected, or gone, is no news either
    logging.getLogger("WebServer").setLevel(logging.WARNING)
    if not sockets:
        viewer.close()
        raise InputError("this version of MuJoCo's web viewer cannot choose an interface; use 4.0")
    return viewer, messages.UpdateEvent(), messages.BuildGuiEvent()


def _is_news(record: logging.LogRecord) -> bool:
    """Whether a record tells of something else than a browser that has gone."""
    from websockets.exceptions import ConnectionClosed

    error = record.exc_info[1] if record.exc_info else None
    return not isinstance(error, (ConnectionClosed, ConnectionError))


@contextlib.contextmanager
def _instead(module: Any, name: str, function: Any) -> Iterator[None]:
    """Have a module call another function for a while."""
    before = getattr(module, name)
    setattr(module, name, function)
    try:
        yield
    finally:
        setattr(module, name, before)
