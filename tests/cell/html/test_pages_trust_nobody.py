"""Names from a user's files reach pages as texts, and the viewer answers its own page alone."""

from __future__ import annotations

import re
import tracemalloc
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import trimesh
from support.paths import ROOT

from cell.html.page import policy
from cell.html.shapes import CROWDED, _creased
from cell.view.web_guard import MOST_BYTES, Guard

WEB = ROOT / "cell" / "html" / "web"
datastructures = pytest.importorskip("websockets.datastructures")


@pytest.mark.parametrize("name", sorted(path.name for path in WEB.glob("*.js")))
def test_no_script_makes_markup_of_texts(name: str) -> None:
    found = re.findall(
        r"(?:inner|outer)HTML|insertAdjacentHTML|document\.write|srcdoc|eval\(|new Function", (WEB / name).read_text()
    )
    assert found == []


def test_a_page_sends_nothing_and_is_based_nowhere() -> None:
    assert {"default-src 'none'", "base-uri 'none'", "form-action 'none'"} <= set(policy("x").split("; "))


def test_the_middle_of_a_fan_takes_memory_in_proportion() -> None:
    tracemalloc.start()
    try:
        for make in (trimesh.creation.cylinder, trimesh.creation.cone):
            solid = make(1.0, 2.0, sections=4000)
            tracemalloc.reset_peak()
            shape = _creased(np.asarray(solid.vertices, dtype=float), np.asarray(solid.faces))
            assert len(shape.faces) == len(solid.faces)
            assert tracemalloc.get_traced_memory()[1] < 100e6
    finally:
        tracemalloc.stop()


def test_a_fans_normals_are_those_of_the_cylinder() -> None:
    solid = trimesh.creation.cylinder(1.0, 2.0, sections=4 * CROWDED)
    shape = _creased(np.asarray(solid.vertices, dtype=float), np.asarray(solid.faces))
    normals, corners = shape.normals[shape.faces], shape.vertices[shape.faces]
    cap = np.abs(solid.face_normals[:, 2]) > 0.5
    assert cap.sum() >= 2 * CROWDED
    np.testing.assert_allclose(np.abs(normals[cap][..., 2]), 1.0, atol=1e-9)
    wall = corners[~cap] * [1, 1, 0]
    wall /= np.linalg.norm(wall, axis=2, keepdims=True)
    assert (np.einsum("ijk,ijk->ij", normals[~cap], wall) > 0.999).all()


def headers(host: str = "127.0.0.1:8080", **others: str) -> Any:
    return datastructures.Headers({"Host": host, **others})


def test_only_who_has_the_address_may_talk_to_the_viewer() -> None:
    guard = Guard("127.0.0.1", 8080)
    other = Guard("127.0.0.1", 8080)
    query = guard.address.removeprefix("http://127.0.0.1:8080")
    cookie = {"Cookie": "a=b; " + guard.cookie.split(";")[0]}
    assert query != other.address.removeprefix("http://127.0.0.1:8080")
    assert guard.refusal(query, headers()) is None
    assert guard.enters(query)
    for path in ("/", "/model", "/ui?sid=a", "/state?sid=a", "/web_client.js"):
        assert not guard.enters(path)
        assert guard.refusal(path, headers(**cookie)) is None
        assert guard.refusal(path, headers("localhost:9000", Origin="http://localhost:9000", **cookie)) is None
        assert guard.refusal(path, headers()) is not None
        assert guard.refusal(path, headers(Cookie="rbam-8080=guess")) is not None
        assert guard.refusal(path, headers(Cookie=";=;;a")) is not None
        assert other.refusal(path, headers(**cookie)) is not None
        for origin in ("http://evil.example", "null", "http://127.0.0.1:8081", "http://localhost:8080"):
            assert guard.refusal(path, headers(Origin=origin, **cookie)) == "another origin"
        for host in ("evil.example:8080", "localhost.evil.example", "", "[", "127.0.0.1.evil.example"):
            assert guard.refusal(path, headers(host, **cookie)) == "another host"
    assert guard.refusal("/drop?sid=a", headers(**cookie)) == "nothing can be uploaded"
    assert guard.refusal("/?token=", headers()) is not None
    assert {"HttpOnly", "SameSite=Lax", "Path=/"} <= set(guard.cookie.split("; "))


def test_the_viewers_server_asks_the_guard() -> None:
    calls: list[dict[str, Any]] = []
    server = SimpleNamespace(serve=lambda *_, **kwargs: calls.append(kwargs))
    before, guard = server.serve, Guard("127.0.0.1", 8080)
    with guard.kept(server):
        server.serve("handler", process_request=lambda *_: "served", max_size=2**26, compression=None)
    assert server.serve is before
    assert (calls[0]["max_size"], calls[0]["compression"]) == (MOST_BYTES, None)
    ask = calls[0]["process_request"]
    enters = ask(None, SimpleNamespace(path="/?" + guard.address.split("?")[1], headers=headers()))
    assert (enters.status_code, enters.headers["Location"]) == (303, "/")
    kept = headers(Cookie=enters.headers["Set-Cookie"].split(";")[0])
    assert ask(None, SimpleNamespace(path="/", headers=kept)) == "served"
    assert ask(None, SimpleNamespace(path="/", headers=headers())).status_code == 403
