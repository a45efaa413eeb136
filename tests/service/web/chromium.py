"""Debian's Chromium without a window, driven by the protocol of its developer tools."""

import base64
import itertools
import json
import shutil
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import httpx
from websockets.sync.client import ClientConnection, connect

from tests.waiting import wait_until

PROGRAM = shutil.which("chromium")
SECONDS = 30.0
KEY_CODES = {"Tab": 9}
"""Of keys that the browser itself acts upon."""

AXE = Path(__file__).parent / "axe" / "axe.min.js"
"""axe-core 4.14.1 as its authors published it, under the MPL 2.0 (the licence is beside it)."""

OPTIONS = (
    "--headless=new",
    "--no-sandbox",  # tests run as root, too
    "--disable-gpu",
    "--no-first-run",
    "--disable-background-networking",
    "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1",  # nothing but this machine can be reached
    "--remote-debugging-port=0",
)


class Tab:
    """A page of the browser, and what went wrong on it: ``errors`` of scripts and policies, ``requests`` by address."""

    def __init__(self, socket: ClientConnection) -> None:
        self.errors: list[str] = []
        self.requests: list[str] = []
        self.width = 0
        self._socket = socket
        self._numbers = itertools.count(1)
        for domain in ("Page", "Runtime", "Log", "Network", "DOM"):
            self.call(f"{domain}.enable")

    def call(self, method: str, **params: Any) -> Any:
        """Ask the browser for something, and note what it tells meanwhile."""
        number = next(self._numbers)
        self._socket.send(json.dumps({"id": number, "method": method, "params": params}))
        while True:
            told = json.loads(self._socket.recv(timeout=SECONDS))
            if told.get("id") == number:
                assert "error" not in told, told
                return told["result"]
            self._note(told["method"], told["params"])

    def run(self, script: str) -> Any:
        """The value of an expression, or of what it promises."""
        told = self.call("Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True)
        assert "exceptionDetails" not in told, told
        return told["result"].get("value")

    def until(self, script: str) -> Any:
        """Wait until an expression is true, and return it."""
        deadline = time.monotonic() + SECONDS
        while time.monotonic() < deadline:
            with suppress(AssertionError):  # a page is being left
                if value := self.run(script):
                    return value
            time.sleep(0.01)
        page = self.run("location.href + ' ' + document.body.innerText")
        raise AssertionError(f"{script} does not become true on {page}; errors: {self.errors}")

    def go(self, url: str) -> None:
        """Load a page."""
        self.call("Page.navigate", url=url)
        self.until(f"location.href === {json.dumps(url)} && document.readyState === 'complete'")

    def resize(self, width: int) -> None:
        """Be so wide, in CSS pixels."""
        self.width = width
        self.call(
            "Emulation.setDeviceMetricsOverride", width=width, height=900, deviceScaleFactor=1, mobile=width < 500
        )

    def prefer(self, scheme: str) -> None:
        """Ask pages for "light" or "dark"."""
        self.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])

    def picture(self) -> bytes:
        """A PNG of the part of the page that is seen."""
        return base64.b64decode(self.call("Page.captureScreenshot", format="png")["data"])

    def barriers(self) -> list[str]:
        """What axe-core finds on the page that may keep people from using it: rule, impact and the elements."""
        if not self.run("'axe' in window"):
            self.call("Runtime.evaluate", expression=AXE.read_text(encoding="utf-8"))
        found = self.run("axe.run(document, {resultTypes: ['violations']}).then(found => found.violations)")
        return [
            f"{each['id']} ({each['impact']}): {'; '.join(node['html'][:120] for node in each['nodes'])}"
            for each in found
        ]

    def choose(self, selector: str, path: Path) -> None:
        """Choose a file, as in the browser's own dialogue."""
        root = self.call("DOM.getDocument")["root"]["nodeId"]
        node = self.call("DOM.querySelector", nodeId=root, selector=selector)["nodeId"]
        self.call("DOM.setFileInputFiles", files=[str(path)], nodeId=node)

    def press(self, key: str) -> None:
        """Press a key and let it go."""
        for kind in ("keyDown", "keyUp"):
            self.call("Input.dispatchKeyEvent", type=kind, key=key, windowsVirtualKeyCode=KEY_CODES.get(key, 0))

    def _note(self, method: str, params: Any) -> None:
        if method == "Runtime.exceptionThrown":
            self.errors.append(str(params["exceptionDetails"]))
        elif method == "Log.entryAdded" and params["entry"]["level"] == "error":
            self.errors.append(f"{params['entry']['text']} {params['entry'].get('url', '')}")
        elif method == "Network.requestWillBeSent":
            self.requests.append(params["request"]["url"])


@contextmanager
def running(folder: Path) -> Iterator[Tab]:
    """A browser of its own, with its files in ``folder``, and one page of it."""
    assert PROGRAM is not None
    command = [PROGRAM, *OPTIONS, f"--user-data-dir={folder}", "about:blank"]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        try:
            with httpx.Client(trust_env=False) as client:
                (target,) = [each for each in client.get(_address(folder)).json() if each["type"] == "page"]
            with connect(target["webSocketDebuggerUrl"], max_size=None, proxy=None) as socket:
                yield Tab(socket)
        finally:
            process.terminate()


def _address(folder: Path) -> str:
    """Where the browser lists its pages, once it has said so."""
    file = folder / "DevToolsActivePort"
    wait_until(lambda: file.exists() and "\n" in file.read_text(), "the browser to start", SECONDS)
    return f"http://127.0.0.1:{file.read_text().splitlines()[0]}/json"
