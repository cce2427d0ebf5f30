"""The page on this machine's own address: for whoever has the token, and nobody else; it opens no files."""

from __future__ import annotations

import http.server
import io
import json
import secrets
import tempfile
import threading
from http import HTTPStatus
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs, urlsplit

from etendue.errors import ArgumentError, EtendueError
from etendue.formats.maps import save_map
from etendue.lightfield.light_field import LightField
from etendue.luminance.estimate import luminance_map
from etendue.plot.map_picture import plot_map
from etendue.quantities.observer import Observer, Screen
from etendue.viewer.bundle import page_html
from etendue.viewer.opening import Exhibit
from etendue.viewer.refining import Refinement
from etendue.viewer.subjects import packed_map

ADDRESS = "127.0.0.1"

FORMATS = {"png": "image/png", "exr": "image/x-exr", "csv": "text/csv"}
"""What maps are handed out as."""

MOST_ASKED = 1 << 16
"""Bytes of a question."""

MOST_PIXELS = 1 << 23
"""Of a map that the page asks for."""

WAIT = 1.0
"""How long a question about the refinement waits for news [s]."""

HEADERS = {
    "Cache-Control": "no-store",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
}


class ViewerServer(http.server.ThreadingHTTPServer):
    """A server of one page.

    The address `url` holds a token that is good for one visit: it is changed for a cookie of this server alone, and then
    void. Without the cookie nothing is answered; nor is anything asked under another name than the address, or from
    another page.

    Parameters
    ----------
    exhibit : Exhibit
    port : int
        0: any that is free.
    threads : int, optional
        For maps; all cores if None.

    Raises
    ------
    OSError
        If the port is taken.
    """

    daemon_threads = True

    def __init__(self, exhibit: Exhibit, port: int = 0, threads: int | None = None) -> None:
        super().__init__((ADDRESS, port), _Handler)
        self.exhibit, self.threads = exhibit, threads
        self.place = f"{ADDRESS}:{self.server_port}"
        self.token: str | None = secrets.token_urlsafe(24)
        self.session = secrets.token_urlsafe(32)
        self.cookie = f"etendue-{self.server_port}"
        self.lock = threading.Lock()
        self.refinement: Refinement | None = None
        served = {"formats": list(FORMATS), "refines": exhibit.scene is not None}
        self.page = page_html({**exhibit.subject, "server": served}, served=True).encode()

    @property
    def url(self) -> str:
        """Where the page is, once."""
        return f"http://{self.place}/?token={self.token}"

    def spend(self, token: str) -> bool:
        """Whether this is the token; it is none any more."""
        with self.lock:
            good = self.token is not None and secrets.compare_digest(token, self.token)
            if good:
                self.token = None
            return good

    def refine(self, observer: Observer, screen: Screen) -> None:
        """Follow lines of sight for this view, and for no other any more."""
        scene = self.exhibit.scene
        if scene is None:
            raise ArgumentError("this page shows no scene, in which lines of sight could be followed.")
        with self.lock:
            if self.refinement is not None:
                self.refinement.stop()
            self.refinement = Refinement(scene, observer, screen, self.threads)

    def refined(self, number: int) -> dict[str, Any]:
        """How far that is, and the last pass if the page has not got it yet."""
        refinement = self.refinement
        if refinement is None:
            raise ArgumentError("no view is being refined.")
        progress = refinement.after(number, WAIT)
        fresh = progress.lmap is not None and progress.number > number
        return {
            "words": progress.words,
            "number": progress.number,
            "done": progress.done,
            "map": packed_map(progress.lmap) if fresh and progress.lmap is not None else None,
        }

    def map_file(self, asked: dict[str, Any]) -> bytes:
        """The map of a view, by the core, in a file format."""
        observer, screen = view_of(asked)
        form = asked.get("format")
        if form not in FORMATS:
            raise ArgumentError(f"format {form!r}; there are {', '.join(FORMATS)}.")
        source = self.exhibit.source
        if isinstance(source, LightField):
            lmap: Any = luminance_map(source, observer, screen, threads=self.threads)
        else:
            lmap = source
        if form == "png":
            picture = io.BytesIO()
            plot_map(lmap, scale="log" if asked.get("logarithmic") else "linear").savefig(picture, format="png")
            return picture.getvalue()
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / f"map.{form}"
            save_map(lmap, path)
            return path.read_bytes()


def view_of(asked: dict[str, Any]) -> tuple[Observer, Screen]:
    """Observer and screen of a question.

    Raises
    ------
    ArgumentError
        If they are none.

    Examples
    --------
    >>> observer = {"theta": 30, "phi": 0, "distance": 500, "target": [0, 0, 1]}
    >>> view_of({"observer": observer, "screen": {"width": 4, "height": 2, "columns": 8, "rows": 4}})[1].pixel_area
    0.25
    """
    try:
        observer, screen = asked["observer"], asked["screen"]
        up = observer.get("up")
        if int(screen["columns"]) * int(screen["rows"]) > MOST_PIXELS:
            raise ArgumentError(f"a page asks for {MOST_PIXELS:,} pixels at most.")
        return (
            Observer(
                float(observer["theta"]),
                float(observer["phi"]),
                float(observer["distance"]),
                tuple(float(x) for x in observer["target"]),  # type: ignore[arg-type]  # Observer checks how many
                tuple(float(x) for x in up) if up else None,  # type: ignore[arg-type]
                float(observer.get("roll", 0.0)),
            ),
            Screen(float(screen["width"]), float(screen["height"]), int(screen["columns"]), int(screen["rows"])),
        )
    except (KeyError, TypeError, ValueError, OverflowError) as error:
        raise ArgumentError(f"this is no view: {error}.") from None


class _Handler(http.server.BaseHTTPRequestHandler):
    server: ViewerServer
    server_version = "etendue"
    sys_version = ""
    protocol_version = "HTTP/1.1"
    timeout = 30

    def log_message(self, *_: Any) -> None:
        """Say nothing: the terminal is the user's."""

    def do_GET(self) -> None:
        if self.headers.get("Host") != self.server.place:
            self._refuse(HTTPStatus.FORBIDDEN, "This server is asked for under its address only.")
            return
        asked = urlsplit(self.path)
        tokens = parse_qs(asked.query).get("token", [])
        if asked.path == "/" and tokens and self.server.spend(tokens[0]):
            cookie = f"{self.server.cookie}={self.server.session}; HttpOnly; SameSite=Strict; Path=/"
            self._answer(HTTPStatus.SEE_OTHER, b"", "text/plain", {"Location": "/", "Set-Cookie": cookie})
        elif not self._known():
            self._refuse(HTTPStatus.FORBIDDEN, "The address was good for one visit. Start `etendue view` again.")
        elif asked.path == "/":
            self._answer(HTTPStatus.OK, self.server.page, "text/html; charset=utf-8")
        else:
            self._refuse(HTTPStatus.NOT_FOUND, "There is one page here.")

    def do_POST(self) -> None:
        length = self.headers.get("Content-Length", "")
        if not (length.isascii() and length.isdigit() and int(length) <= MOST_ASKED):
            self.close_connection = True
            self._refuse(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, "This is more than a question.")
            return
        body = self.rfile.read(int(length))
        origin = f"http://{self.server.place}"
        if self.headers.get("Host") != self.server.place or self.headers.get("Origin") != origin or not self._known():
            self._refuse(HTTPStatus.FORBIDDEN, "Only the page itself may ask.")
            return
        try:
            asked = json.loads(body)
            if not isinstance(asked, dict):
                raise ArgumentError("a question is a JSON object.")
            self._reply(asked)
        except (EtendueError, json.JSONDecodeError, UnicodeDecodeError, OSError) as error:
            self._refuse(HTTPStatus.BAD_REQUEST, str(error))

    def _reply(self, asked: dict[str, Any]) -> None:
        match self.path:
            case "/map":
                self._answer(HTTPStatus.OK, self.server.map_file(asked), FORMATS[asked["format"]])
            case "/refine":
                self.server.refine(*view_of(asked))
                self._answer(HTTPStatus.OK, b"{}", "application/json")
            case "/refined":
                number = asked.get("number")
                found = self.server.refined(number if isinstance(number, int) else 0)
                self._answer(HTTPStatus.OK, json.dumps(found).encode(), "application/json")
            case _:
                self._refuse(HTTPStatus.NOT_FOUND, "Nobody answers that here.")

    def _known(self) -> bool:
        wanted = f"{self.server.cookie}={self.server.session}"
        return any(
            secrets.compare_digest(one.strip().encode(), wanted.encode())
            for one in self.headers.get("Cookie", "").split(";")
        )

    def _refuse(self, status: HTTPStatus, words: str) -> None:
        self._answer(status, words.encode(), "text/plain; charset=utf-8")

    def _answer(self, status: HTTPStatus, body: bytes, kind: str, more: dict[str, str] | None = None) -> None:
        try:
            self.send_response(status)
            for name, value in {
                **HEADERS,
                **(more or {}),
                "Content-Type": kind,
                "Content-Length": str(len(body)),
            }.items():
                self.send_header(name, value)
            self.end_headers()
            self.wfile.write(body)
        except ConnectionError:  # the page has gone on to another view and no longer listens
            self.close_connection = True
