"""Pages in a headless Chromium, by its DevTools protocol: keys are pressed as a person would."""

import base64
import contextlib
import json
import os
import re
import shutil
import subprocess
import tempfile
from pathlib import Path

import pytest

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
CODES = {"ArrowLeft": 37, "ArrowRight": 39, "Home": 36, "End": 35, "Tab": 9}


def binary():
    """Return the path of Chromium, ``None`` if it is not installed."""
    return next((path for path in map(shutil.which, NAMES) if path), None)


def need_chromium():
    """Skip the test if there is no Chromium, or nothing to talk to it with."""
    pytest.importorskip("websocket", reason="websocket-client is not installed")
    if binary() is None:
        pytest.skip("no Chromium on this computer")


@contextlib.contextmanager
def browser():
    """Start a browser, and give the address at which it is told what to do."""
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        process = subprocess.Popen(
            [
                binary(), "--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage",
                "--no-first-run", "--remote-debugging-port=0", "--remote-allow-origins=*",
                f"--user-data-dir={profile}", "about:blank",
            ],
            stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, env={**os.environ, "LC_ALL": "C.UTF-8"},
        )  # fmt: skip
        try:
            listens = re.compile(r"DevTools listening on (ws://\S+)")
            yield next(found[1] for line in process.stderr if (found := listens.search(line)))
        finally:
            process.terminate()
            process.wait(20)
            process.stderr.close()


class Page:
    """A page in a window of its own, which shares nothing with others of the browser at this address."""

    def __init__(self, path, address, *, dark=False, size=(1280, 1000)):
        import websocket

        width, height = size
        self._socket = websocket.create_connection(address, timeout=60)
        self._number = 0
        self._session = None
        self.errors = []
        self.requests = []
        context = self._call("Target.createBrowserContext", disposeOnDetach=True)["browserContextId"]
        window = self._call("Target.createTarget", url="about:blank", newWindow=True, browserContextId=context)
        self._session = self._call("Target.attachToTarget", targetId=window["targetId"], flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self._call(f"{domain}.enable")
        scheme = [{"name": "prefers-color-scheme", "value": "dark" if dark else "light"}]
        self._call("Emulation.setEmulatedMedia", features=scheme)
        self._call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False)
        self._loaded = False
        self._call("Page.navigate", url=Path(path).resolve().as_uri())
        while not self._loaded:
            self._receive()

    def ask(self, expression):
        """Return the value of an expression in the page."""
        found = self._call("Runtime.evaluate", expression=expression, returnByValue=True)
        assert "exceptionDetails" not in found, found
        return found["result"].get("value")

    def press(self, key):
        """Press a key and let it go."""
        common = {"key": key, "code": key, "windowsVirtualKeyCode": CODES[key]}
        self._call("Input.dispatchKeyEvent", type="rawKeyDown", **common)
        self._call("Input.dispatchKeyEvent", type="keyUp", **common)

    def screenshot(self, path, *, full=True):
        """Save what the page looks like as PNG."""
        picture = self._call("Page.captureScreenshot", format="png", captureBeyondViewport=full)
        Path(path).write_bytes(base64.b64decode(picture["data"]))

    def close(self):
        """Close the page."""
        with contextlib.suppress(Exception):
            self._socket.close()

    def _call(self, method, **parameters):
        self._number += 1
        message = {"id": self._number, "method": method, "params": parameters}
        self._socket.send(json.dumps(message if self._session is None else {**message, "sessionId": self._session}))
        while True:
            answer = self._receive()
            if answer.get("id") == self._number:
                assert "error" not in answer, answer
                return answer["result"]

    def _receive(self):
        """Return the next message; keep what the page complains of, and what it asks for."""
        message = json.loads(self._socket.recv())
        method, parameters = message.get("method"), message.get("params", {})
        if method == "Runtime.exceptionThrown":
            self.errors.append(parameters["exceptionDetails"]["text"])
        elif method == "Runtime.consoleAPICalled" and parameters["type"] in ("error", "warning", "assert"):
            self.errors.append(str(parameters["args"]))
        elif method == "Log.entryAdded" and parameters["entry"]["level"] in ("error", "warning"):
            self.errors.append(parameters["entry"]["text"])
        elif method == "Network.requestWillBeSent":
            self.requests.append(parameters["request"]["url"])
        elif method == "Page.loadEventFired":
            self._loaded = True
        return message
