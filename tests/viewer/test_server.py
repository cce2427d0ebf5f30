"""The page on the loopback address: for one visitor with the token, nothing but the page, and maps of the core."""

from __future__ import annotations

import base64
import functools
import http.client
import json
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import etendue as et
import numpy as np
import pytest
from etendue.viewer.opening import Exhibit, exhibit_of
from etendue.viewer.refining import PASSES
from etendue.viewer.server import ADDRESS, FORMATS, MOST_ASKED, ViewerServer

from viewer.conftest import FIELDS

VIEW = {
    "observer": {"theta": 33.0, "phi": 20.0, "distance": 400.0, "target": [0.1, 0.0, 0.3]},
    "screen": {"width": 3.0, "height": 2.0, "columns": 12, "rows": 8},
}
OBSERVER, SCREEN = et.Observer(33, 20, 400, (0.1, 0, 0.3)), et.Screen(3, 2, 12, 8)


class Answer(NamedTuple):
    """What the server said."""

    status: int
    headers: dict[str, str]
    body: bytes


class Visitor:
    """Asks one server, with or without the cookie."""

    def __init__(self, server: ViewerServer) -> None:
        self.server = server
        self.cookie = ""

    def ask(self, method: str, path: str, body: Any = None, **headers: str) -> Answer:
        connection = http.client.HTTPConnection(ADDRESS, self.server.server_port, timeout=60)
        own = {"Origin": f"http://{self.server.place}"} if method == "POST" else {}
        cookie = {"Cookie": self.cookie} if self.cookie else {}
        text = body if isinstance(body, bytes | None) else json.dumps(body).encode()
        connection.request(method, path, text, {**own, **cookie, **headers})
        answer = connection.getresponse()
        found = Answer(answer.status, dict(answer.getheaders()), answer.read())
        connection.close()
        return found

    def enter(self) -> None:
        answer = self.ask("GET", self.server.url.removeprefix(f"http://{self.server.place}"))
        assert answer.status == 303
        assert answer.headers["Location"] == "/"
        self.cookie = answer.headers["Set-Cookie"].split(";")[0]


def serving(exhibit: Exhibit) -> Iterator[Visitor]:
    with ViewerServer(exhibit) as server:
        # A server looks now and then whether it should stop: tests do not wait for half a second.
        thread = threading.Thread(target=server.serve_forever, args=(0.01,), daemon=True)
        thread.start()
        yield Visitor(server)
        server.shutdown()
        thread.join()


@functools.cache
def lamp() -> Exhibit:
    return exhibit_of(FIELDS["lamp"], name="lamp.h5")


@pytest.fixture
def visitor() -> Iterator[Visitor]:
    yield from serving(lamp())


def test_the_token_is_good_once_and_the_cookie_afterwards(visitor: Visitor) -> None:
    url = visitor.server.url
    assert url.startswith("http://127.0.0.1:")
    assert visitor.ask("GET", "/").status == 403
    assert visitor.ask("GET", "/?token=" + "x" * 32).status == 403
    visitor.enter()
    page = visitor.ask("GET", "/")
    assert page.status == 200
    assert b"lamp.h5" in page.body
    assert page.headers["X-Frame-Options"] == "DENY"
    stranger = Visitor(visitor.server)
    assert stranger.ask("GET", url.removeprefix(f"http://{visitor.server.place}")).status == 403
    stranger.cookie = visitor.cookie[:-1] + "x"
    assert stranger.ask("GET", "/").status == 403


def test_cookies_are_kept_from_scripts_and_other_sites(visitor: Visitor) -> None:
    answer = visitor.ask("GET", visitor.server.url.removeprefix(f"http://{visitor.server.place}"))
    parts = {part.strip() for part in answer.headers["Set-Cookie"].split(";")}
    assert {"HttpOnly", "SameSite=Strict", "Path=/"} <= parts


def test_no_other_name_no_other_page_and_no_file(visitor: Visitor, tmp_path: Path) -> None:
    """A foreign host name (DNS rebinding), a foreign origin, a missing one, and any path are refused."""
    visitor.enter()
    assert visitor.ask("GET", "/", Host="evil.example").status == 403
    assert visitor.ask("POST", "/map", {**VIEW, "format": "csv"}, Origin="https://evil.example").status == 403
    assert visitor.ask("POST", "/map", {**VIEW, "format": "csv"}, Host="evil.example").status == 403
    assert Visitor(visitor.server).ask("POST", "/map", {**VIEW, "format": "csv"}).status == 403
    secret = tmp_path / "secret"
    secret.write_text("here")
    for path in (str(secret), "/../../etc/passwd", "/%2e%2e/etc/passwd", "/main.js", "//etc/passwd"):
        assert visitor.ask("GET", path).status == 404
        assert visitor.ask("POST", path, {}).status == 404
    assert visitor.ask("PUT", "/map", b"").status == 501


@pytest.mark.parametrize(
    ("body", "words"),
    [
        (b"{", "Expecting"),
        (b"[]", "object"),
        (b"\xff", "decode"),
        ({}, "no view"),
        ({**VIEW, "format": "toml"}, "toml"),
        ({**VIEW, "observer": {**VIEW["observer"], "theta": 999}, "format": "csv"}, "theta"),
        ({**VIEW, "screen": {**VIEW["screen"], "columns": 1e9}, "format": "csv"}, "pixels"),
    ],
)
def test_nonsense_is_refused_with_words(visitor: Visitor, body: Any, words: str) -> None:
    visitor.enter()
    answer = visitor.ask("POST", "/map", body)
    assert answer.status == 400
    assert words in answer.body.decode()


def test_long_questions_are_not_read(visitor: Visitor) -> None:
    visitor.enter()
    assert visitor.ask("POST", "/map", b" " * 10, **{"Content-Length": str(MOST_ASKED + 1)}).status == 413
    assert visitor.ask("POST", "/map", b"", **{"Content-Length": "-1"}).status == 413
    assert visitor.ask("GET", "/").status == 200


def test_maps_are_those_of_the_core_bit_by_bit(visitor: Visitor, tmp_path: Path) -> None:
    visitor.enter()
    truth = et.luminance_map(FIELDS["lamp"], OBSERVER, SCREEN)
    for form in FORMATS:
        answer = visitor.ask("POST", "/map", {**VIEW, "format": form})
        assert answer.status == 200
        assert answer.headers["Content-Type"] == FORMATS[form]
        path = tmp_path / f"map.{form}"
        path.write_bytes(answer.body)
        if form == "png":
            assert answer.body.startswith(b"\x89PNG")
            continue
        found = et.read_map(path)
        exact = truth.values if form == "csv" else truth.values.astype(np.float32)
        np.testing.assert_array_equal(found.values, exact)
        assert (found.observer, found.screen) == (truth.observer, truth.screen)


def test_a_page_without_a_scene_refines_nothing(visitor: Visitor) -> None:
    visitor.enter()
    for path in ("/refine", "/refined"):
        answer = visitor.ask("POST", path, VIEW)
        assert answer.status == 400
        assert answer.body


@pytest.fixture(scope="module")
def scene() -> et.Scene:
    """A small lamp off its axis under a lens."""
    return et.Scene(
        name="lens",
        sources=[
            {
                "kind": "surface",
                "shape": {"kind": "rectangle", "width": 1, "height": 0.6},
                "at": [0.2, -0.1, 0],
                "flux": 9,
            }
        ],
        solids=[{"shape": {"kind": "ball", "radius": 2}, "medium": "PMMA", "at": [0, 0, 3]}],
    )


@pytest.mark.slow
def test_a_scene_is_refined_by_lines_of_sight_until_another_view_comes(scene: et.Scene) -> None:
    """The last pass is the map that `luminance_map` makes of the scene; a new view gives up the old one."""
    field = FIELDS["lamp"]
    exhibit = Exhibit(lamp().subject, field, scene)
    asked = {
        "observer": {"theta": 10.0, "phi": 0.0, "distance": 100.0, "target": [0, 0, 2]},
        "screen": {"width": 5.0, "height": 4.0, "columns": 40, "rows": 32},
    }
    for visitor in serving(exhibit):
        visitor.enter()
        assert json.loads(visitor.ask("POST", "/refine", asked).body) == {}
        first = visitor.server.refinement
        assert (
            json.loads(visitor.ask("POST", "/refine", {**asked, "observer": {**asked["observer"], "theta": 20.0}}).body)
            == {}
        )
        assert first is not None
        assert first.after(10**9, 60).done
        number, maps = 0, []
        for _ in range(300):
            found = json.loads(visitor.ask("POST", "/refined", {"number": number}).body)
            number = found["number"]
            if found["map"]:
                maps.append(found["map"])
            if found["done"]:
                break
        assert number == len(PASSES)
        assert found["words"].startswith("by lines of sight")
        coarseness, lines = PASSES[-1]
        truth = et.luminance_map(
            scene,
            et.Observer(20, 0, 100, (0, 0, 2)),
            et.Screen(5, 4, 40 // coarseness, 32 // coarseness),
            rays_per_pixel=lines,
        )
        values = np.frombuffer(base64.b64decode(maps[-1]["values"]), "<f4").reshape(truth.values.shape)
        np.testing.assert_array_equal(values, truth.values.astype(np.float32))
        assert truth.values.max() > 0
