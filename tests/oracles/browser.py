"""Chromium without a window, driven through its pipe: what a page shows, and what it asks the network for."""

from __future__ import annotations

import base64
import contextlib
import json
import os
import select
import subprocess
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

FLAGS = (
    "--headless=new",
    "--no-sandbox",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--remote-debugging-pipe",
)


class Browser:
    """A page in Chromium. What it asks the network for is kept in `requests`, what it complains of in `complaints`."""

    def __init__(self, program: str, *, width: int, height: int, patience: float = 120.0) -> None:
        self.patience = patience
        self.requests: list[str] = []
        self.complaints: list[str] = []
        self._number, self._answers, self._rest = 0, {}, b""
        self._loaded = False
        self._profile = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
        to_browser, self._to = os.pipe()
        self._from, from_browser = os.pipe()

        # Chromium reads from descriptor 3 and writes to 4, whatever these pipes are called here.
        def pipes() -> None:
            high = [os.dup2(fd, 1000 + i) for i, fd in enumerate((to_browser, from_browser))]
            os.dup2(high[0], 3)
            os.dup2(high[1], 4)

        arguments = [
            program,
            *FLAGS,
            f"--window-size={width},{height}",
            f"--user-data-dir={self._profile.name}",
            "about:blank",
        ]
        self._process = subprocess.Popen(
            arguments,
            preexec_fn=pipes,  # noqa: PLW1509 - it only names pipes anew
            close_fds=False,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        os.close(to_browser)
        os.close(from_browser)
        targets = self.call("Target.getTargets")["targetInfos"]
        page = next(target for target in targets if target["type"] == "page")
        self._session: str | None = None
        self._session = self.call("Target.attachToTarget", targetId=page["targetId"], flatten=True)["sessionId"]
        for domain in ("Page", "Network", "Runtime", "Log"):
            self.call(f"{domain}.enable")
        # The window's size is that of the page: a window has a frame of its own.
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False)

    _session: str | None = None

    def call(self, method: str, **parameters: Any) -> Any:
        """One command of the DevTools protocol."""
        self._number += 1
        message = {"id": self._number, "method": method, "params": parameters}
        if self._session:
            message["sessionId"] = self._session
        os.write(self._to, json.dumps(message).encode() + b"\0")
        end = time.monotonic() + self.patience
        while self._number not in self._answers:
            self._read(end)
        answer = self._answers.pop(self._number)
        if "error" in answer:
            raise RuntimeError(f"{method}: {answer['error']}")
        return answer["result"]

    def _read(self, end: float) -> None:
        ready, _, _ = select.select([self._from], [], [], max(end - time.monotonic(), 0.0))
        if not ready:
            raise TimeoutError("Chromium does not answer")
        chunk = os.read(self._from, 1 << 20)
        if not chunk:
            raise RuntimeError("Chromium has ended")
        *messages, self._rest = (self._rest + chunk).split(b"\0")
        for message in map(json.loads, messages):
            if "id" in message:
                self._answers[message["id"]] = message
            else:
                self._note(message["method"], message.get("params", {}))

    def _note(self, event: str, told: Any) -> None:
        match event:
            case "Network.requestWillBeSent":
                self.requests.append(told["request"]["url"])
            case "Page.loadEventFired":
                self._loaded = True
            case "Runtime.exceptionThrown":
                details = told["exceptionDetails"]
                self.complaints.append(details.get("exception", {}).get("description", details["text"]))
            case "Log.entryAdded" if told["entry"]["level"] == "error":
                self.complaints.append(told["entry"]["text"])

    def open(self, url: str) -> None:
        """Go to an address and wait until it is loaded."""
        self._loaded = False
        self.call("Page.navigate", url=url)
        self.wait("document.readyState === 'complete' && !!window.etendue")

    def evaluate(self, expression: str) -> Any:
        """The value of an expression of JavaScript; of a promise, what it comes to."""
        found = self.call("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in found:
            raise RuntimeError(found["exceptionDetails"].get("exception", {}).get("description", "an exception"))
        return found["result"].get("value")

    def wait(self, condition: str) -> None:
        """Until an expression is true."""
        end = time.monotonic() + self.patience
        while not self.evaluate(condition):
            if time.monotonic() > end:
                raise TimeoutError(f"{condition} does not come true; {self.complaints}")
            time.sleep(0.02)

    def mouse(self, kind: str, *, x: float, y: float, **more: Any) -> None:
        """mousePressed, mouseMoved, mouseReleased or mouseWheel at a place of the page."""
        self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, **more)

    def drag(self, *places: tuple[float, float]) -> None:
        """The left button, pressed at the first place and let go at the last."""
        self.mouse("mousePressed", x=places[0][0], y=places[0][1], button="left", buttons=1, clickCount=1)
        for place in places[1:]:
            self.mouse("mouseMoved", x=place[0], y=place[1], button="left", buttons=1)
        self.mouse("mouseReleased", x=places[-1][0], y=places[-1][1], button="left", buttons=0, clickCount=1)

    def key(self, key: str) -> None:
        """One key, pressed and let go."""
        for kind in ("keyDown", "keyUp"):
            self.call(
                "Input.dispatchKeyEvent", type=kind, key=key, text=key if len(key) == 1 and kind == "keyDown" else ""
            )

    def screenshot(self, path: Path) -> None:
        """A picture of the page, .png."""
        path.write_bytes(base64.b64decode(self.call("Page.captureScreenshot", format="png")["data"]))

    def close(self) -> None:
        """End it."""
        with contextlib.suppress(OSError, RuntimeError, TimeoutError):
            self._session = None
            self.patience = 10.0
            self.call("Browser.close")
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(10)
        if self._process.poll() is None:
            self._process.kill()
            self._process.wait()
        os.close(self._to)
        os.close(self._from)
        self._profile.cleanup()


@contextlib.contextmanager
def browsing(program: str, *, width: int = 1200, height: int = 800) -> Iterator[Browser]:
    """A browser for as long as the block runs."""
    browser = Browser(program, width=width, height=height)
    try:
        yield browser
    finally:
        browser.close()
