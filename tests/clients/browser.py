"""Chromium without a screen, driven by its remote debugging protocol."""

import asyncio
import base64
import json
import subprocess
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

FLAGS = (
    *("--headless", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"),
    *("--disable-quic", "--no-first-run", "--disable-background-networking"),
    *("--disable-component-update", "--disable-sync", "--remote-debugging-port=0"),
)
STARTED_S, READY_S = 60.0, 60.0
FAULTS = ("Runtime.exceptionThrown", "Log.entryAdded", "Runtime.consoleAPICalled")
READY = "document.documentElement?.dataset.ready === 'true'"


class Browser:
    """One page of a Chromium that runs."""

    def __init__(self, port: str) -> None:
        """Connect to the page that is open."""
        from tornado.httpclient import AsyncHTTPClient
        from tornado.websocket import websocket_connect

        self._loop = asyncio.new_event_loop()
        self._number = 0
        self.events: list[dict[str, Any]] = []

        async def connected() -> Any:
            answer = await AsyncHTTPClient().fetch(f"http://127.0.0.1:{port}/json")
            pages = [one for one in json.loads(answer.body) if one["type"] == "page"]
            return await websocket_connect(
                pages[0]["webSocketDebuggerUrl"], max_message_size=1 << 28
            )

        self._socket = self._loop.run_until_complete(connected())
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(f"{domain}.enable")

    def close(self) -> None:
        self._socket.close()
        self._loop.run_until_complete(asyncio.sleep(0))
        self._loop.close()

    def call(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Call a method of the protocol and return its result."""
        return self._loop.run_until_complete(self._call(method, parameters))

    async def _call(self, method: str, parameters: dict[str, Any]) -> dict[str, Any]:
        self._number += 1
        message = {"id": self._number, "method": method, "params": parameters}
        await self._socket.write_message(json.dumps(message))
        while True:
            answer = json.loads(await self._socket.read_message())
            if answer.get("id") != self._number:
                self.events.append(answer)
                continue
            assert "error" not in answer, answer
            result: dict[str, Any] = answer["result"]
            return result

    def value(self, expression: str) -> Any:
        """The value of an expression in the page."""
        result = self.call(
            "Runtime.evaluate", expression=expression, awaitPromise=True, returnByValue=True
        )
        assert "exceptionDetails" not in result, result
        return result["result"].get("value")

    def open(
        self, page: Path | str, width: int = 1400, height: int = 1100, ready: str = READY
    ) -> float:
        """Open a file or address and wait until the page says that it is ready; return seconds."""
        self.call(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=height,
            deviceScaleFactor=1,
            mobile=False,
        )
        started = time.monotonic()
        self.call("Page.navigate", url=page if isinstance(page, str) else page.resolve().as_uri())
        while not self.value(ready):
            assert time.monotonic() - started < READY_S, self.faults
            time.sleep(0.05)
        return time.monotonic() - started

    def click(self, x: float, y: float) -> None:
        """Click at a place of the window, in pixels."""
        for kind in ("mousePressed", "mouseReleased"):
            self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1)

    def drag(self, x: float, y: float, right: float, down: float) -> None:
        """Press at a place of the window, move in ten steps, and release."""
        move = {"button": "left", "buttons": 1, "clickCount": 1}
        self.call("Input.dispatchMouseEvent", type="mousePressed", x=x, y=y, **move)
        for k in range(1, 11):
            at = {"x": x + right * k / 10, "y": y + down * k / 10}
            self.call("Input.dispatchMouseEvent", type="mouseMoved", **at, **move)
        end = {"x": x + right, "y": y + down, "button": "left", "clickCount": 1}
        self.call("Input.dispatchMouseEvent", type="mouseReleased", **end)

    def press(self, key: str) -> None:
        """Press a key."""
        for kind in ("keyDown", "keyUp"):
            self.call("Input.dispatchKeyEvent", type=kind, key=key)

    def screenshot(self, file: Path) -> None:
        """Save what the window shows as a PNG file."""
        drawn = "new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))"
        self.value(drawn)
        data = self.call("Page.captureScreenshot", format="png")["data"]
        file.write_bytes(base64.b64decode(data))

    @property
    def faults(self) -> list[dict[str, Any]]:
        """Errors, warnings and other messages of the console."""
        return [one for one in self.events if one["method"] in FAULTS]

    @property
    def requests(self) -> list[str]:
        """Addresses that were asked for, but for data that the page holds itself."""
        asked = [
            one["params"]["request"]["url"]
            for one in self.events
            if one["method"] == "Network.requestWillBeSent"
        ]
        return [url for url in asked if not url.startswith(("data:", "blob:"))]


@contextmanager
def chromium(program: str, profile: Path) -> Iterator[Browser]:
    """Chromium with an empty profile, ended with the block."""
    words = [program, *FLAGS, f"--user-data-dir={profile}", "about:blank"]
    process = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        with closing(Browser(_port(profile / "DevToolsActivePort"))) as browser:
            yield browser
    finally:
        process.terminate()
        process.wait()


def _port(file: Path) -> str:
    started = time.monotonic()
    while not (file.is_file() and file.read_text(encoding="utf-8").count("\n")):
        assert time.monotonic() - started < STARTED_S, "Chromium does not start"
        time.sleep(0.05)
    return file.read_text(encoding="utf-8").split()[0]
