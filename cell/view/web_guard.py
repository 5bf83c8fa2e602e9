"""Access to the web viewer: only for those who were given its address, and from its own page.

    guard = Guard(place.host, place.port)
    guard.address                              # http://127.0.0.1:8080/?token=...
    with guard.kept(web_server): ...           # what its server answers from here on

A page of another origin that is open in the same browser reaches this machine as well; so does a name that somebody
else lets point to it. The token in the address becomes a cookie of the browser, and each request has to carry it, to
name this machine as its host, and, where it has an origin, to come from the viewer's own page. Nothing can be uploaded.
"""

from __future__ import annotations

import contextlib
import ipaddress
import secrets
import socket
from collections.abc import Callable, Iterator
from http.cookies import CookieError, SimpleCookie
from typing import Any
from urllib.parse import parse_qs, urlsplit

MOST_BYTES = 2**20  # of a message from a browser: keys and the mouse take a few hundred
UPLOAD = "/drop"  # the viewer's way to be given another model, which a replay has no use for


class Guard:
    """Lets requests pass that carry the token and come from the viewer's own page."""

    def __init__(self, host: str, port: int) -> None:
        """Make a token.

        Args:
            host: name or address that the viewer listens on.
            port: its port.
        """
        self._token = secrets.token_urlsafe(16)
        self._cookie = f"rbam-{port}"  # browsers share cookies between ports
        self._hosts = {"localhost", host.lower(), socket.gethostname().lower()}
        shown = f"[{host}]" if ":" in host else host
        self.address = f"http://{shown}:{port}/?token={self._token}"

    def refusal(self, path: str, headers: Any) -> str | None:
        """Why a request is refused; None where it may pass.

        Args:
            path: with its query.
            headers: of the request, as a mapping with ``get_all``.
        """
        hosts, origins = headers.get_all("Host"), headers.get_all("Origin")
        if len(hosts) != 1 or not self._mine(hosts[0]):
            return "another host"
        if any(origin not in (f"http://{hosts[0]}", f"https://{hosts[0]}") for origin in origins):
            return "another origin"
        if urlsplit(path).path == UPLOAD:
            return "nothing can be uploaded"
        mine = self._token.encode()
        if not any(
            secrets.compare_digest(given.encode("utf-8", "replace"), mine) for given in self._given(path, headers)
        ):
            return "use the whole address that rbam replay prints, with its token"
        return None

    def enters(self, path: str) -> bool:
        """Whether a request is the address as it was given, rather than from the page that it leads to."""
        return urlsplit(path).path == "/" and "token" in parse_qs(urlsplit(path).query)

    @property
    def cookie(self) -> str:
        """The header that has the browser keep the token."""
        return f"{self._cookie}={self._token}; Path=/; HttpOnly; SameSite=Lax"

    def _mine(self, host: str) -> bool:
        """Whether a Host names this machine: by an address, or by a name that nobody else can give it."""
        try:
            name = urlsplit(f"//{host}").hostname or ""
        except ValueError:
            return False
        if name in self._hosts:
            return True
        try:
            ipaddress.ip_address(name)
        except ValueError:
            return False
        return True

    def _given(self, path: str, headers: Any) -> list[str]:
        given = parse_qs(urlsplit(path).query).get("token", []) if self.enters(path) else []
        for header in headers.get_all("Cookie"):
            try:
                kept = SimpleCookie(header).get(self._cookie)
            except CookieError:
                continue
            if kept is not None:
                given.append(kept.value)
        return given

    @contextlib.contextmanager
    def kept(self, web_server: Any) -> Iterator[None]:
        """Have a server of MuJoCo's viewer that is started meanwhile ask first.

        Args:
            web_server: the module ``mujoco.studio.web.web_server``.
        """
        serve = web_server.serve

        def guarded(handler: Any, *args: Any, process_request: Callable[[Any, Any], Any], **kwargs: Any) -> Any:
            kwargs.update(process_request=self._asked(process_request), max_size=MOST_BYTES)
            return serve(handler, *args, **kwargs)

        web_server.serve = guarded
        try:
            yield
        finally:
            web_server.serve = serve

    def _asked(self, process_request: Callable[[Any, Any], Any]) -> Callable[[Any, Any], Any]:
        from websockets.datastructures import Headers
        from websockets.http11 import Response

        def answer(code: int, reason: str, body: str, **headers: str) -> Response:
            found = Headers({"Content-Type": "text/plain; charset=utf-8", "Cache-Control": "no-store", **headers})
            found["Content-Length"] = str(len(body.encode()))
            return Response(code, reason, found, body.encode())

        def ask(connection: Any, request: Any) -> Any:
            why = self.refusal(request.path, request.headers)
            if why is not None:
                return answer(403, "Forbidden", f"{why}\n")
            if self.enters(request.path):
                # out of the address bar, where it would be seen and kept
                return answer(303, "See Other", "", **{"Location": "/", "Set-Cookie": self.cookie})
            return process_request(connection, request)

        return ask
